"""Where the plate stands, as its estimator tells the outer loop."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array


@dataclass(frozen=True, eq=False)
class PlatePose:
    """A pose T_rig_plate at ``time``, in seconds of the clock that the source is asked with.

    ``rotation`` (3, 3) and ``translation`` (3,) in m map the plate's frame into the rig's;
    ``covariance`` (6, 6) is that of a rotation vector in the rig's axes (rad), applied after the
    rotation, and of the translation (m). ``velocity`` (3,) in m/s is that of the plate's origin,
    ``turn_rate`` (3,) in rad/s that of its axes, both in the rig's axes. ``tracked`` says whether
    the pose counts, ``why`` what is wrong where it does not.
    """

    time: float
    rotation: Array
    translation: Array
    covariance: Array
    velocity: Array = field(default_factory=lambda: np.zeros(3))
    turn_rate: Array = field(default_factory=lambda: np.zeros(3))
    tracked: bool = True
    why: str = ""

    def at(self, time: float) -> "PlatePose":
        """The pose a little later or earlier, if the plate goes on as it moves."""
        if not (np.any(self.velocity) or np.any(self.turn_rate)):
            return self
        from scipy.spatial.transform import Rotation

        passed = time - self.time
        turned = Rotation.from_rotvec(passed * self.turn_rate).as_matrix()
        return PlatePose(
            time,
            turned @ self.rotation,
            self.translation + passed * self.velocity,
            self.covariance,
            self.velocity,
            self.turn_rate,
            self.tracked,
            self.why,
        )


PoseSource = Callable[[float, NDArray[np.void]], PlatePose | None]
"""Asked with the time (s; the host's monotonic clock on a port, virtual time in lockstep) and the
rig's samples since the last time; its newest estimate, None while it has none."""


def fixed_pose(rotation: Array, translation: Array, covariance: Array | None = None) -> PoseSource:
    """A source that always gives one pose: a fitted or a stated one.

    >>> source = fixed_pose(np.eye(3), np.zeros(3))
    >>> source(2.5, np.zeros(0, dtype=np.void)).time
    2.5
    """
    known = np.zeros((6, 6)) if covariance is None else covariance

    def source(now_s: float, samples: NDArray[np.void]) -> PlatePose:
        return PlatePose(now_s, rotation, translation, known)

    return source


def level_plate(
    place_mm: tuple[float, float, float], pitch_deg: float = 0.0
) -> tuple[Array, Array]:
    """Rotation and translation of a plate whose x lies along the rig's, and whose face looks up.

    ``place_mm`` is its origin in the rig's frame; ``pitch_deg`` turns it about the pivot's axis.

    >>> rotation, _ = level_plate((0.0, 10.0, 0.0))
    >>> (rotation @ [0.0, 0.0, 1.0]).tolist()
    [0.0, 1.0, 0.0]
    """
    angle = np.radians(pitch_deg)
    sine, cosine = float(np.sin(angle)), float(np.cos(angle))
    turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
    level = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    return turn @ level, 1e-3 * np.asarray(place_mm, dtype=np.float64)
