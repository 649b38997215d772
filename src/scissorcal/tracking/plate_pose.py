"""Where the plate stands, as its estimator tells the outer loop."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.tracking.rotation import pose_error, rotation_of

PLAY_SDS = 6.0
"""Of the noise of a picture's pose, as its six numbers have it together. With 4, 8 and 12 a plate
at rest is rendered alike (docs/decisions/145-a-rendered-pose-has-play.md)."""


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


class SteadyPose:
    """Follows a pose with play, as a slack linkage does.

    It rests while the estimate e stays within sqrt(e^T N^-1 e) <= `PLAY_SDS`, with N (6, 6) the
    noise of one picture, and is drawn along by what goes beyond. A crack that runs out at each step
    of the edge into it does not run back, so a small noise from estimate to estimate would cut; an
    offset as small changes the torque by about as much as it is itself. The covariance grows by
    that of an offset which is uniform within the play, `PLAY_SDS`^2 / 8 of N.

    >>> pose = PlatePose(0.0, np.eye(3), np.zeros(3), 1e-8 * np.eye(6))
    >>> steady, noise = SteadyPose(), 1e-10 * np.eye(6)
    >>> first = steady.held(pose, noise)
    >>> steady.held(replace(pose, translation=np.array([5e-5, 0.0, 0.0])), noise).translation
    array([0., 0., 0.])
    >>> moved = steady.held(replace(pose, translation=np.array([1e-3, 0.0, 0.0])), noise)
    >>> moved.translation.round(6)
    array([0.00094, 0.     , 0.     ])
    """

    def __init__(self) -> None:
        self._at: tuple[Array, Array] | None = None

    def held(self, pose: PlatePose, noise: Array) -> PlatePose:
        """The pose with its play; ``noise`` (6, 6) is of a rotation vector (rad) and place (m)."""
        if self._at is None:
            self._at = pose.rotation, pose.translation
        rotation, place = self._at
        error = pose_error(rotation, place, pose.rotation, pose.translation)
        away = float(np.sqrt(error @ np.linalg.solve(noise, error)))
        if away > PLAY_SDS:
            step = (1.0 - PLAY_SDS / away) * error
            rotation, place = rotation_of(step[:3]) @ rotation, place + step[3:]
            self._at = rotation, place
        wider = pose.covariance + PLAY_SDS**2 / 8.0 * noise
        return replace(pose, rotation=rotation, translation=place, covariance=wider)
