"""Rendered photographs: exact geometry through a lens, with the defects of real pictures.

Nothing here is used by a fit, and nothing of a fit is used here except the printed targets' layout.
"""

from scissorcal.vision.sim.optics import Lens, Looks, Pose, as_jpeg, random_looks
from scissorcal.vision.sim.photograph import CastShadow, Glare, Lamp, Layer, render
from scissorcal.vision.sim.scenes import (
    BladeShape,
    Nick,
    PlateScene,
    blade_layer,
    chained,
    plate_scene,
    scissors_layers,
    target_layers,
)

__all__ = [
    "BladeShape",
    "CastShadow",
    "Glare",
    "Lamp",
    "Layer",
    "Lens",
    "Looks",
    "Nick",
    "PlateScene",
    "Pose",
    "as_jpeg",
    "blade_layer",
    "chained",
    "plate_scene",
    "random_looks",
    "render",
    "scissors_layers",
    "target_layers",
]
