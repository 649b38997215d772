"""Plane, cylinder and sphere: phi0 = z + |C p|^2 / 2 R.

C projects onto the directions that are curved: none of a plane, all of a sphere, those across the
axis of a cylinder. The level is a polynomial, so that nothing is singular on an axis or at a
centre, and a plane is the limit of large radii without cancellation.
"""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from scissorcal.aliases import Array
from scissorcal.errors import ModelError
from scissorcal.model.checks import check_numbers
from scissorcal.model.surface.protocol import NearestPoints, SurfacePoint, as_points

_ROUNDING = 1e-13
"""Gradients of phi0, which has no unit, shorter than this have no direction."""


class _Quadric(ABC):
    """What plane, cylinder and sphere share."""

    @property
    @abstractmethod
    def _bend(self) -> float:
        """1 / R [1/m]."""

    @property
    @abstractmethod
    def _across(self) -> Array:
        """Two vectors (2, 3) across z that are curved; zeros where there are fewer."""

    @cached_property
    def _entries(self) -> tuple[float, ...]:
        return (self._bend, *self._across[:, :2].ravel().tolist())

    @cached_property
    def _rows(self) -> Array:
        return np.concatenate((self._across, np.array(((0.0, 0.0, 1.0),))))

    @cached_property
    def _hessian(self) -> Array:
        hessian: Array = self._bend * self._rows.T @ self._rows
        hessian.flags.writeable = False
        return hessian

    def at(self, point: Array) -> SurfacePoint:
        """Level, gradient and Hessian at one point (3,)."""
        x, y, z = point.tolist()
        bend, ax, ay, bx, by = self._entries
        a, b = ax * x + ay * y, bx * x + by * y
        level = z + 0.5 * bend * (a * a + b * b + z * z)
        gradient = np.array((bend * (a * ax + b * bx), bend * (a * ay + b * by), 1.0 + bend * z))
        return SurfacePoint(level, gradient, self._hessian)

    def level(self, points: ArrayLike) -> Array:
        """phi0 [m] at points (..., 3): (...), positive outside the material."""
        p = as_points(points)
        away = p @ self._rows.T
        return np.asarray(p[..., 2] + 0.5 * self._bend * (away * away).sum(axis=-1))

    def gradient(self, points: ArrayLike) -> Array:
        """Gradient of the level at points (..., 3): (..., 3)."""
        away = as_points(points) @ self._rows.T
        return np.asarray(self._bend * (away @ self._rows) + np.array((0.0, 0.0, 1.0)))

    def hessian(self, points: ArrayLike) -> Array:
        """Hessian of the level [1/m] at points (..., 3): (..., 3, 3)."""
        p = as_points(points)
        return np.broadcast_to(self._hessian, (*p.shape, 3)).astype(p.dtype)

    def nearest_points(self, points: ArrayLike) -> NearestPoints:
        """Nearest points, in closed form: the distance is 2 phi0 / (1 + abs(grad phi0)).

        It follows from |grad phi0|^2 = 1 + 2 phi0 / R, and has no cancellation at large radii.
        On the axis of a cylinder and at the centre of a sphere the nearest point is not unique.
        """
        p = as_points(points)
        gradient = self.gradient(p)
        length = np.linalg.norm(gradient, axis=-1)
        unique = length > _ROUNDING * (1.0 + abs(self._bend) * np.linalg.norm(p, axis=-1))
        distance = np.asarray(2.0 * self.level(p) / (1.0 + length))
        safe = np.where(unique, length, 1.0)[..., None]
        direction = np.where(unique[..., None], gradient / safe, np.array((0.0, 0.0, 1.0)))
        found = p - distance[..., None] * direction
        return NearestPoints(found, distance, unique, np.isfinite(distance))


@dataclass(frozen=True)
class Plane(_Quadric):
    """The plane z = 0."""

    @property
    def _bend(self) -> float:
        return 0.0

    @property
    def _across(self) -> Array:
        return np.zeros((2, 3))


@dataclass(frozen=True)
class Cylinder(_Quadric):
    """A circular cylinder whose apex line passes through the origin.

    ``radius_m`` > 0 bulges out of the material (convex), < 0 is a trough (concave). ``axis_rad`` is
    the angle of the axis from x towards y; 0 lays it along the cut.
    """

    radius_m: float
    axis_rad: float = 0.0

    def __post_init__(self) -> None:
        _check_radius("cylinder", self.radius_m)
        check_numbers("the angle of a cylinder's axis (rad)", self.axis_rad)

    @property
    def _bend(self) -> float:
        return 1.0 / self.radius_m

    @property
    def _across(self) -> Array:
        c, s = math.cos(self.axis_rad), math.sin(self.axis_rad)
        return np.array(((-s, c, 0.0), (0.0, 0.0, 0.0)))


@dataclass(frozen=True)
class Sphere(_Quadric):
    """A sphere whose apex is the origin: ``radius_m`` > 0 convex, < 0 a bowl (concave)."""

    radius_m: float

    def __post_init__(self) -> None:
        _check_radius("sphere", self.radius_m)

    @property
    def _bend(self) -> float:
        return 1.0 / self.radius_m

    @property
    def _across(self) -> Array:
        return np.eye(2, 3)


def _check_radius(kind: str, radius_m: float) -> None:
    check_numbers(f"the radius of a {kind} (m)", radius_m)
    if radius_m == 0.0:
        raise ModelError(
            f"The radius of a {kind} must not be 0: it is positive where the surface bulges out of "
            "the material, negative where it is hollow."
        )
