"""Rendered photographs: exact geometry through a lens, with the defects of real pictures.

Nothing here is used by a fit, and nothing of a fit is used here except the printed targets' layout.
"""

from scissorcal.vision.sim.optics import Lens, Looks, SimPose, as_jpeg
from scissorcal.vision.sim.photograph import PaintLayer, render
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
    "Lens",
    "Looks",
    "Nick",
    "PaintLayer",
    "PlateScene",
    "SimPose",
    "as_jpeg",
    "blade_layer",
    "chained",
    "plate_scene",
    "render",
    "scissors_layers",
    "target_layers",
]
