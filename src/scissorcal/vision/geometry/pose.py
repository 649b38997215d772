"""Poses: rotation as a unit quaternion, translation in metres, and their covariance."""

import math
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from scissorcal.aliases import Array
from scissorcal.errors import InputError
from scissorcal.recipe.euler_angles import EulerAngles

NEARLY_UNIT = 1e-6
"""How far a quaternion's length or a matrix's product with its transpose may be from one: rounding
of files with six digits, and no more."""


class PoseError(InputError, ValueError):
    """Numbers that are no pose."""


@dataclass(frozen=True)
class Pose:
    """T_a_b: maps points of frame b into frame a.

    ``quaternion`` is (w, x, y, z), of length one, w >= 0; ``translation_m`` is b's origin in a.
    ``covariance`` (6, 6) is that of a rotation vector in a's axes (rad), applied after the
    rotation, and of the translation (m): R = exp(d_phi) R_mean, t = t_mean + d_t. None if
    unknown.

    >>> turned = Pose.from_rotation_vector([0.0, 0.0, np.pi / 2], [0.1, 0.0, 0.0])
    >>> turned.apply([[1.0, 0.0, 0.0]]).round(6)
    array([[0.1, 1. , 0. ]])
    """

    also_written: ClassVar[tuple[str, ...]] = ("euler_angles",)
    """Properties that stand in JSON beside the fields."""

    quaternion: tuple[float, float, float, float]
    translation_m: tuple[float, float, float]
    covariance: Array | None = None

    def __post_init__(self) -> None:
        """Refuse what is no pose: PoseError."""
        length = math.hypot(*self.quaternion)
        if not (abs(length - 1.0) < NEARLY_UNIT and all(map(math.isfinite, self.translation_m))):
            raise PoseError(
                f"Quaternion {self.quaternion} with translation {self.translation_m} is no pose: "
                "it takes a quaternion of length one and finite numbers. Check what it was "
                "computed from."
            )

    @staticmethod
    def from_rotation_vector(
        vector: ArrayLike, translation_m: ArrayLike, covariance: Array | None = None
    ) -> "Pose":
        """Pose of a rotation vector (rad) and a translation (m), three numbers each."""
        from scipy.spatial.transform import Rotation

        return Pose.from_matrix(
            Rotation.from_rotvec(np.asarray(vector, dtype=np.float64)).as_matrix(),
            translation_m,
            covariance,
        )

    @staticmethod
    def from_matrix(
        matrix: ArrayLike, translation_m: ArrayLike, covariance: Array | None = None
    ) -> "Pose":
        """Pose of a rotation matrix (3, 3) and a translation (m). PoseError where it is none."""
        from scipy.spatial.transform import Rotation

        given = np.asarray(matrix, dtype=np.float64)
        with np.errstate(invalid="ignore"):
            off = float(np.abs(given @ given.T - np.eye(3)).max())
        if not off < NEARLY_UNIT or np.linalg.det(given) < 0.0:
            raise PoseError(
                f"The matrix {given.round(6).tolist()} is no rotation: its columns must be "
                "orthogonal, of length one and right-handed. Check what it was computed from."
            )
        x, y, z, w = Rotation.from_matrix(given).as_quat(canonical=True)
        t = np.asarray(translation_m, dtype=np.float64)
        return Pose(
            (float(w), float(x), float(y), float(z)),
            (float(t[0]), float(t[1]), float(t[2])),
            covariance,
        )

    @property
    def matrix(self) -> Array:
        """The rotation matrix (3, 3)."""
        from scipy.spatial.transform import Rotation

        w, x, y, z = self.quaternion
        return np.asarray(Rotation.from_quat([x, y, z, w]).as_matrix(), dtype=np.float64)

    @property
    def rotation_vector(self) -> Array:
        """The rotation vector (3,) in rad, of length pi at most."""
        w, *axis = self.quaternion
        return _turn(w, np.array(axis))

    @property
    def euler_angles(self) -> EulerAngles:
        """The rotation as yaw, pitch and roll in degrees; the quaternion counts."""
        return EulerAngles.of(self.quaternion, self.covariance)

    def apply(self, points: ArrayLike) -> Array:
        """Points (n, 3) of frame b, in frame a."""
        given = np.asarray(points, dtype=np.float64)
        return np.asarray(given @ self.matrix.T + np.asarray(self.translation_m))

    def inverse(self) -> "Pose":
        """T_b_a, with the covariance that goes with it."""
        turned = self.matrix.T
        t = np.asarray(self.translation_m)
        covariance = None
        if self.covariance is not None:
            slope = _inverse_slope(self)
            covariance = slope @ self.covariance @ slope.T
        return Pose.from_matrix(turned, -turned @ t, covariance)

    def after(self, other: "Pose") -> "Pose":
        """T_a_c = T_a_b T_b_c, with ``other`` = T_b_c; the covariances add."""
        matrix, moved = self.matrix, self.apply([other.translation_m])[0]
        covariance = None
        if self.covariance is not None or other.covariance is not None:
            mine = np.zeros((6, 6)) if self.covariance is None else self.covariance
            its = np.zeros((6, 6)) if other.covariance is None else other.covariance
            by_mine, by_its = _product_slopes(self, other)
            covariance = by_mine @ mine @ by_mine.T + by_its @ its @ by_its.T
        return Pose.from_matrix(matrix @ other.matrix, moved, covariance)


UNMOVED = Pose((1.0, 0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
"""Of a frame in itself."""


def between(a: Pose, b: Pose, shared: Array) -> Pose:
    """T_a_b of T_c_a and T_c_b with the cross-covariance ``shared`` (6, 6)."""
    back = a.inverse()
    pose = back.after(b)
    if pose.covariance is None:
        return pose
    by_back, by_b = _product_slopes(back, b)
    both = by_back @ _inverse_slope(a) @ shared @ by_b.T
    return Pose(pose.quaternion, pose.translation_m, pose.covariance + both + both.T)


def difference(a: Pose, b: Pose) -> Array:
    """What takes ``b`` to ``a``: rotation vector (rad) in the outer frame, then translation (m)."""
    (w_a, *axis), (w_b, *other) = a.quaternion, b.quaternion
    of_a, of_b = np.array(axis), np.array(other)
    turn = _turn(w_a * w_b + of_a @ of_b, w_b * of_a - w_a * of_b - np.cross(of_a, of_b))
    return np.concatenate([turn, np.subtract(a.translation_m, b.translation_m)])


def left_jacobian(vector: Array) -> Array:
    """Left Jacobian (3, 3) of SO(3) at a rotation vector (3,)."""
    angle = float(np.linalg.norm(vector))
    cross = _cross(vector)
    if angle < 1e-6:
        return np.asarray(np.eye(3) + 0.5 * cross)
    first = (1.0 - np.cos(angle)) / angle**2
    second = (angle - np.sin(angle)) / angle**3
    return np.asarray(np.eye(3) + first * cross + second * cross @ cross)


def _turn(w: float, axis: Array) -> Array:
    """The rotation vector (3,) of a unit quaternion of either sign, of length pi at most."""
    sine = float(np.linalg.norm(axis))
    if sine == 0.0:
        return np.zeros(3)
    return np.asarray(axis * np.copysign(2.0 * np.arctan2(sine, abs(w)) / sine, w))


def _inverse_slope(pose: Pose) -> Array:
    """How errors of a pose become those of its inverse, (6, 6)."""
    turned = pose.matrix.T
    slope = np.zeros((6, 6))
    slope[:3, :3] = -turned
    slope[3:, :3] = -turned @ _cross(np.asarray(pose.translation_m))
    slope[3:, 3:] = -turned
    return slope


def _product_slopes(first: Pose, second: Pose) -> tuple[Array, Array]:
    """How errors of either pose become those of the first after the second, (6, 6) each."""
    by_first = np.eye(6)
    by_first[3:, :3] = -_cross(first.matrix @ np.asarray(second.translation_m))
    return by_first, np.asarray(np.kron(np.eye(2), first.matrix), dtype=np.float64)


def _cross(vector: Array) -> Array:
    x, y, z = vector
    return np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
