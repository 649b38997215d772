"""Rotations, and the plate's pose as a source gives it at a time: fixed, level, with play."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array

_SMALL = 1e-6
_THRICE = 3.0 * np.eye(3)


def rotation_of(vector: Array) -> Array:
    """The rotation matrix (3, 3) of a rotation vector (3,) in rad (Rodrigues' formula).

    >>> rotation_of(np.array([0.0, 0.0, np.pi / 2])).round(6) + 0.0
    array([[ 0., -1.,  0.],
           [ 1.,  0.,  0.],
           [ 0.,  0.,  1.]])
    """
    x, y, z = float(vector[0]), float(vector[1]), float(vector[2])
    square = x * x + y * y + z * z
    angle = math.sqrt(square)
    if angle < _SMALL:
        first, second = 1.0 - square / 6.0, 0.5 - square / 24.0
    else:
        first, second = math.sin(angle) / angle, (1.0 - math.cos(angle)) / square
    a, b, c = first * x, first * y, first * z
    xy, xz, yz = second * x * y, second * x * z, second * y * z
    xx, yy, zz = second * x * x, second * y * y, second * z * z
    return np.array(
        [
            [1.0 - yy - zz, xy - c, xz + b],
            [xy + c, 1.0 - xx - zz, yz - a],
            [xz - b, yz + a, 1.0 - xx - yy],
        ]
    )


def rotation_vector(matrix: Array) -> Array:
    """The rotation vector (3,) in rad of a rotation matrix (3, 3), of length pi at most.

    By the quaternion whose largest component is computed first (Shepperd 1978,
    doi:10.2514/3.55767b), so it is accurate up to and at half a turn.
    """
    (r00, r01, r02), (r10, r11, r12), (r20, r21, r22) = matrix.tolist()
    trace = r00 + r11 + r22
    if trace >= max(r00, r11, r22):
        w, x, y, z = 1.0 + trace, r21 - r12, r02 - r20, r10 - r01
    elif r00 >= max(r11, r22):
        w, x, y, z = r21 - r12, 1.0 + r00 - r11 - r22, r01 + r10, r02 + r20
    elif r11 >= r22:
        w, x, y, z = r02 - r20, r01 + r10, 1.0 + r11 - r00 - r22, r12 + r21
    else:
        w, x, y, z = r10 - r01, r02 + r20, r12 + r21, 1.0 + r22 - r00 - r11
    sine = math.sqrt(x * x + y * y + z * z)
    if sine == 0.0:
        return np.zeros(3)
    share = math.copysign(2.0 * math.atan2(sine, abs(w)) / sine, w)
    return np.array([share * x, share * y, share * z])


def pose_error(rotation: Array, place_m: Array, true_rotation: Array, true_place_m: Array) -> Array:
    """Error (6,) of an estimated pose: rotation vector (rad) and way (m) that lead to the truth.

    True rotation = Exp(error[:3]) estimated rotation, the error that the filter's covariance is of.
    """
    turn = rotation_vector(true_rotation @ rotation.T)
    return np.concatenate([turn, np.subtract(true_place_m, place_m)])


def cross(a: Array, b: Array) -> Array:
    """Cross product of two vectors (3,); ten times as fast as NumPy's on single vectors."""
    ax, ay, az = float(a[0]), float(a[1]), float(a[2])
    bx, by, bz = float(b[0]), float(b[1]), float(b[2])
    return np.array([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx])


def cross_matrix(vector: Array) -> Array:
    """The matrix (3, 3) whose product with a vector is the cross product."""
    x, y, z = float(vector[0]), float(vector[1]), float(vector[2])
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])


def nearest_rotation(matrix: Array) -> Array:
    """The rotation nearest to a matrix that rounding has moved off: one Newton step.

    A step of X <- X (3 - X^T X) / 2 squares the deviation from orthogonality (Higham 1986,
    doi:10.1137/0907079); after each product of the filter it stands near 1e-16.
    """
    return np.asarray(0.5 * matrix @ (_THRICE - matrix.T @ matrix))


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
