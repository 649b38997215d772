"""One draw of the second world: a plate that moves, a camera that sees it, a tip on it."""

from dataclasses import dataclass

import numpy as np

from .camera import Picture, pictures
from .motion import Motion, moved
from .shapes import Shape
from .touch import Touches, touches


@dataclass(frozen=True)
class Scene:
    """How the plate moves ("clamped", "springs", "hand"), and what befalls pictures and tip.

    ``blind_s`` is the time without pictures at the end; ``flat`` a view in which the mirrored pose
    is about as likely; ``tip_radius_m`` that of the ball.
    """

    motion: str = "clamped"
    blind_s: float = 0.0
    flat: bool = False
    seconds: float = 8.0
    tip_radius_m: float = 1e-3


@dataclass(frozen=True)
class World:
    """What sensors said, and the truth by ``motion`` and ``touches``."""

    scene: Scene
    shape: Shape
    motion: Motion
    pictures: tuple[Picture, ...]
    touches: Touches


def draw_world(scene: Scene, shape: Shape, rng: np.random.Generator) -> World:
    """Draw a world; the camera's and the tip's draws are independent of each other."""
    moving, seeing, touching = rng.spawn(3)
    motion = moved(scene.motion, scene.seconds, moving)
    seen = pictures(motion, scene.seconds, scene.blind_s, scene.flat, seeing)
    rows = touches(motion, shape, scene.seconds, scene.tip_radius_m, touching)
    return World(scene, shape, motion, seen, rows)
