"""A second world for judging the filter of a plate's pose, of other construction than the first.

The first is benchmarks.control.world. This one shares no code with it, with
scissorcal.tracking or with scissorcal.model: rotations are SciPy's, a plate moves as a body on
springs or as a hand moves it, a picture's pose is solved from noisy projected corners, and a
contact is a ball on a half-linear, half-Hertzian plate with creep, stick-slip and a drifting
sensor.

    world = draw_world(Scene("springs"), SHAPES["plane"], np.random.default_rng(1))
    world.pictures[0].covariance, world.touches.point_m
"""

from .shapes import SHAPES, Shape
from .world import Scene, World, draw_world

__all__ = ["SHAPES", "Scene", "Shape", "World", "draw_world"]
