"""A plate that somebody moves, a made-up tracker that sees it, and the torque that it should give.

The true torque shares no code with the rendering: the section is solved for from three points of
the plate, and the torque comes from `tests.kernel.reference_plate`.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.kernel import ModelTables
from scissorcal.tracking import PlatePose
from tests.kernel.reference_plate import Placed, ReferencePlate

Samples = NDArray[np.void]

FLAT = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""Rotation of a plate that lies along the advance, its face up."""


def turned(vector: Array) -> Array:
    """Rotation matrix of a rotation vector (Rodrigues 1840)."""
    angle = float(np.linalg.norm(vector))
    if angle == 0.0:
        return np.eye(3)
    x, y, z = np.asarray(vector) / angle
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross)


@dataclass(frozen=True)
class Move:
    """A plate at rest that goes by ``by_m``, and by ``turn_rad`` (rotation vector) about a point of
    the rig, between two times."""

    start_m: tuple[float, float, float]
    by_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    turn_rad: tuple[float, float, float] = (0.0, 0.0, 0.0)
    about_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    begins_s: float = 0.0
    takes_s: float = 1.0

    def pose(self, time_s: float) -> tuple[Array, Array]:
        """Rotation (3, 3) and translation (3,) at a time."""
        way = min(max((time_s - self.begins_s) / self.takes_s, 0.0), 1.0)
        share = way**3 * (10.0 + way * (6.0 * way - 15.0))
        turn, about = turned(share * np.array(self.turn_rad)), np.array(self.about_m)
        place = about + turn @ (np.array(self.start_m) - about)
        return turn @ FLAT, place + share * np.array(self.by_m)


def section_by_points(
    rotation: Array, translation: Array, upper_face: float, moving_blades: int
) -> tuple[float, float, float, float, float]:
    """The section's five numbers from points of the plate, each found by solving for z = 0."""
    thickness = upper_face * (2.0 if moving_blades == 2 else 1.0)

    def meets(along: float, down: float) -> Array:
        """The point of the plate at z = 0, ``along`` the cut and ``down`` from its face."""
        start = translation + rotation @ np.array([along, 0.0, -down])
        across = rotation @ np.array([0.0, 1.0, 0.0])
        return np.asarray(start - across * start[2] / across[2])[:2]

    near, far = meets(0.0, 0.0), meets(1.0, 0.0)
    run = far - near
    pitch = float(np.arctan2(run[1], run[0]))
    below = meets(0.0, thickness)
    normal = np.array([-run[1], run[0]]) / np.hypot(*run)
    through = float((near - below) @ normal)
    if moving_blades == 1:
        return near[0], near[1], pitch, float(np.hypot(*run)), through / thickness

    def centred(along: float) -> float:
        """Where a point of the plate's middle comes to stand that gives way along the normal."""
        middle = meets(along, 0.0) - 0.5 * through * normal
        return float((middle - normal * middle[1] / normal[1])[0])

    upright = through / np.cos(pitch)
    stretch = centred(1.0) - centred(0.0)
    return centred(0.0), 0.5 * upright, 0.0, stretch, through * np.cos(pitch) / thickness


@dataclass
class Tracker:
    """Estimates of a moving plate: every 10 ms, late, noisy, off by a constant, and lost at times.

    ``sd`` (6,) is white noise of each estimate, ``bias`` (6,) constant: rotation vector (rad), then
    translation (m); ``claimed`` (6,) are the standard deviations that it states.
    """

    move: Move
    rng: np.random.Generator
    sd: Array = field(default_factory=lambda: np.zeros(6))
    bias: Array = field(default_factory=lambda: np.zeros(6))
    claimed: Array = field(default_factory=lambda: np.full(6, 1e-6))
    late_s: float = 0.0
    lost: Callable[[float], bool] = lambda now_s: False
    silent: Callable[[float], bool] = lambda now_s: False
    _next_s: float = -np.inf
    asked: int = 0
    asked_s: float = 0.0
    samples: int = 0

    def __call__(self, now_s: float, samples: Samples) -> PlatePose | None:
        self.asked, self.asked_s = self.asked + 1, now_s
        self.samples += len(samples)
        if now_s < self._next_s or self.silent(now_s):
            return None
        self._next_s = now_s + 0.00999
        rotation, translation = self.move.pose(now_s - self.late_s)
        error = self.bias + self.sd * self.rng.standard_normal(6)
        return PlatePose(
            now_s - self.late_s,
            turned(error[:3]) @ rotation,
            translation + error[3:],
            np.diag(self.claimed**2),
            tracked=not self.lost(now_s),
            why="the target is hidden" if self.lost(now_s) else "",
        )


def true_torque(tables: ModelTables, move: Move, samples: Samples, every: int = 4) -> Array:
    """Torque that samples should have had, at every so many of them; NaN between."""
    plate = ReferencePlate(tables)
    found = np.full(len(samples), np.nan)
    time = samples["host_time_ns"] * 1e-9
    for k in range(0, len(samples), every):
        pose = move.pose(float(time[k]))
        numbers = section_by_points(*pose, tables.upper_face, tables.moving_blades)
        at = Placed(float(samples["opening"][k]), float(samples["advance"][k]), *numbers)
        found[k] = plate.step(at, 0.0)["torque"]
    return found
