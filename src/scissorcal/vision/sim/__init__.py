"""Rendered photographs: exact geometry through a lens, with the defects of real pictures.

Nothing here is used by a fit, and nothing of a fit is used here except the printed targets' layout.
"""

from scissorcal.vision.sim.optics import Lens, Looks, Pose, as_jpeg
from scissorcal.vision.sim.photograph import Layer, render
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
    "render",
    "scissors_layers",
    "target_layers",
]
