"""What every surface gives (level, derivatives, nearest points), and plane, cylinder and sphere.

Of these the level is phi0 = z + |C p|^2 / 2 R. C projects onto the directions that are curved: none
of a plane, all of a sphere, those across the axis of a cylinder. The level is a polynomial, so that
nothing is singular on an axis or at a centre, and a plane is the limit of large radii without
cancellation.
"""

import math
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scissorcal.aliases import Array
from scissorcal.errors import ModelError
from scissorcal.model.checks import check_numbers


class SurfacePoint(NamedTuple):
    """Level phi0 [m] at one point, its gradient (3,) and its Hessian (3, 3) [1/m].

    The arrays may be shared between calls: do not write into them.
    """

    level: float
    gradient: Array
    hessian: Array


class NearestPoints(NamedTuple):
    """Nearest points of a surface.

    ``points`` (..., 3); NaN where the search did not converge. ``distance`` (...) [m] is signed as
    the level, positive outside the material. ``unique`` (...) is false where another point of the
    surface is as near, as at the centre of a sphere; ``points`` then holds one of them.
    ``converged`` (...).
    """

    points: Array
    distance: Array
    unique: NDArray[np.bool_]
    converged: NDArray[np.bool_]


class Surface(Protocol):
    """A surface as the zero of a twice differentiable level phi0(p), in the plate's frame.

    The level is positive outside the material. At the origin it is 0 with the gradient (0, 0, 1),
    of a probed surface nearly so. It is no distance: phi0 / abs(grad phi0) is one to first order.
    ``level``, ``gradient`` and ``hessian`` take points (..., 3) in metres, real or complex; ``at``
    gives all three at one point (3,) in microseconds.
    """

    def at(self, point: Array) -> SurfacePoint: ...

    def level(self, points: ArrayLike) -> Array: ...

    def gradient(self, points: ArrayLike) -> Array: ...

    def hessian(self, points: ArrayLike) -> Array: ...

    def nearest_points(self, points: ArrayLike) -> NearestPoints: ...


def as_points(points: ArrayLike) -> Array:
    """Points (..., 3) as an array; complex ones stay complex, for derivatives by complex steps."""
    array = np.asarray(points)
    if array.ndim == 0 or array.shape[-1] != 3:
        raise ValueError(f"points need the shape (..., 3), not {array.shape}")
    return array if np.iscomplexobj(array) else array.astype(np.float64, copy=False)


def nearest(surface: Surface, points: ArrayLike) -> Array:
    """Nearest points (..., 3) of the surface; NaN where the search did not converge.

    ``surface.nearest_points`` also gives signed distances, and where the point is not unique.

    >>> from scissorcal.model.surface import Sphere
    >>> nearest(Sphere(radius_m=0.02), [0.0, 0.0, 0.005]).tolist()
    [0.0, 0.0, 0.0]
    """
    return surface.nearest_points(points).points


def normal(surface: Surface, points: ArrayLike) -> Array:
    """Unit normal (..., 3) out of the material at points (..., 3).

    Away from the surface it is that of the level set through the point; NaN where the gradient
    vanishes (the axis of a cylinder, the centre of a sphere).
    """
    gradient = surface.gradient(points)
    length = np.linalg.norm(gradient, axis=-1, keepdims=True)
    return np.asarray(gradient / np.where(length > 0.0, length, np.nan))


def curvatures(surface: Surface, points: ArrayLike) -> Array:
    """Principal curvatures (..., 2) [1/m] in ascending order, positive where convex.

    >>> from scissorcal.model.surface import Cylinder
    >>> curvatures(Cylinder(radius_m=0.05), [0.01, 0.0, 0.0]).tolist()
    [0.0, 20.0]
    """
    unit = normal(surface, points)
    length = np.linalg.norm(surface.gradient(points), axis=-1)
    first, second = tangents(unit)
    bend = surface.hessian(points)
    a, b, c = (
        np.einsum("...i,...ij,...j->...", left, bend, right) / length
        for left, right in ((first, first), (first, second), (second, second))
    )
    mean, half = 0.5 * (a + c), np.hypot(0.5 * (a - c), b)
    return np.stack((mean - half, mean + half), axis=-1)


def tangents(unit: Array) -> tuple[Array, Array]:
    """Two unit vectors that make a right-handed frame with ``unit`` (..., 3).

    Without a branch that loses digits: Duff et al. 2017 (http://jcgt.org/published/0006/01/01/).
    """
    x, y, z = unit[..., 0], unit[..., 1], unit[..., 2]
    sign = np.copysign(1.0, z)
    a = -1.0 / (sign + z)
    b = x * y * a
    first = np.stack((1.0 + sign * x * x * a, sign * b, -sign * x), axis=-1)
    second = np.stack((b, sign + y * y * a, -y), axis=-1)
    return first, second


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
