"""Rendered photographs: exact geometry through a lens, with the defects of real pictures.

Nothing here is used by a fit, and nothing of a fit is used here except the printed targets' layout.
"""

from scissorcal.vision.sim.blades import BladeShape, Nick, blade_layer, scissors_layers
from scissorcal.vision.sim.lens import Lens, SimPose
from scissorcal.vision.sim.looks import Looks, as_jpeg, random_looks
from scissorcal.vision.sim.photograph import Glare, PaintLayer, render
from scissorcal.vision.sim.plate_scene import PlateScene, chained, plate_scene
from scissorcal.vision.sim.shadows import CastShadow, Lamp
from scissorcal.vision.sim.targets import target_layers

__all__ = [
    "BladeShape",
    "CastShadow",
    "Glare",
    "Lamp",
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
    "random_looks",
    "render",
    "scissors_layers",
    "target_layers",
]
