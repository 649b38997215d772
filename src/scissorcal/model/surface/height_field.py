"""A surface z = f(x, y), where f is a bicubic B-spline on even knots."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scissorcal.aliases import Array
from scissorcal.errors import ModelError
from scissorcal.model.bspline import FEWEST, spline_powers
from scissorcal.model.checks import check_numbers
from scissorcal.model.surface.height_search import nearest_on_height_field
from scissorcal.model.surface.protocol import NearestPoints, SurfacePoint, as_points

_BEYOND = 3
"""Pieces added at each end: over one the curvature falls to 0, over two that along the border; the
last is straight."""


@dataclass(frozen=True, eq=False)
class HeightField:
    """The surface z = f(x, y): level phi0 = z - f(x, y), in the plate's frame.

    ``weights_m`` (n + 3, m + 3) are those of a bicubic B-spline with n even intervals over ``x_m``
    (start, end) and m over ``y_m``. Beyond these it continues straight outwards, after an interval
    over which the curvature falls to 0, and as a plane beyond the corners: f is twice
    differentiable everywhere. Nothing was probed out there, which :meth:`inside` tells.
    ``outline`` (k, 3), rows (a, b, c) with a x + b y + c <= 0 inside, bounds the probed points
    within the rectangle. ModelError for numbers that are not finite, ends that do not rise, and
    fewer than one interval.
    """

    x_m: tuple[float, float]
    y_m: tuple[float, float]
    weights_m: Array
    outline: Array | None = None

    def __post_init__(self) -> None:
        for axis, ends in (("x", self.x_m), ("y", self.y_m)):
            check_numbers(f"the ends of a height field along {axis} (m)", ends)
            if not ends[0] < ends[1]:
                raise ModelError(f"A height field's end along {axis} must lie beyond its start.")
        check_numbers("the weights of a height field (m)", self.weights_m)
        if self.outline is not None:
            check_numbers("the outline of a height field", self.outline)
        if self.weights_m.ndim != 2 or min(self.weights_m.shape) < FEWEST:
            raise ModelError(
                f"A height field needs {FEWEST} weights or more along both axes; the shape of its "
                f"weights is {self.weights_m.shape}."
            )

    def at(self, point: Array) -> SurfacePoint:
        """Level, gradient and Hessian at one point (3,)."""
        x, y, z = point.tolist()
        i, t = _place(x, *self._grid[0])
        j, s = _place(y, *self._grid[1])
        wide, high = self._grid[0][1], self._grid[1][1]
        values, slopes, bends = [], [], []
        for a, b, c, d in self._pieces[i][j]:
            values.append(((d * s + c) * s + b) * s + a)
            slopes.append((3.0 * d * s + 2.0 * c) * s + b)
            bends.append(6.0 * d * s + 2.0 * c)
        a, b, c, d = values
        f, fx, fxx = (
            ((d * t + c) * t + b) * t + a,
            (3.0 * d * t + 2.0 * c) * t + b,
            6 * d * t + 2 * c,
        )
        fx, fxx = fx / wide, fxx / wide**2
        a, b, c, d = slopes
        fy = (((d * t + c) * t + b) * t + a) / high
        fxy = ((3.0 * d * t + 2.0 * c) * t + b) / (wide * high)
        a, b, c, d = bends
        fyy = (((d * t + c) * t + b) * t + a) / high**2
        hessian = np.array(((-fxx, -fxy, 0.0), (-fxy, -fyy, 0.0), (0.0, 0.0, 0.0)))
        return SurfacePoint(z - f, np.array((-fx, -fy, 1.0)), hessian)

    def level(self, points: ArrayLike) -> Array:
        """phi0 [m] at points (..., 3): (...), positive outside the material."""
        p = as_points(points)
        return np.asarray(p[..., 2] - self._derivative(p, 0, 0))

    def gradient(self, points: ArrayLike) -> Array:
        """Gradient of the level at points (..., 3): (..., 3)."""
        p = as_points(points)
        fx, fy = self._derivative(p, 1, 0), self._derivative(p, 0, 1)
        return np.stack((-fx, -fy, np.ones_like(fx)), axis=-1)

    def hessian(self, points: ArrayLike) -> Array:
        """Hessian of the level [1/m] at points (..., 3): (..., 3, 3)."""
        p = as_points(points)
        bend = np.zeros((*p.shape, 3), dtype=p.dtype)
        bend[..., 0, 0] = -self._derivative(p, 2, 0)
        bend[..., 1, 1] = -self._derivative(p, 0, 2)
        bend[..., 0, 1] = bend[..., 1, 0] = -self._derivative(p, 1, 1)
        return bend

    def nearest_points(self, points: ArrayLike) -> NearestPoints:
        """Nearest points of the field and its continuation, by Newton's method.

        See :mod:`scissorcal.model.surface.height_search` for what is searched.
        """
        return nearest_on_height_field(self, as_points(points))

    def inside(self, points: ArrayLike) -> NDArray[np.bool_]:
        """Whether points (..., 3) lie above or below what was probed."""
        p = as_points(points)
        x, y = p[..., 0], p[..., 1]
        within = (self.x_m[0] <= x) & (x <= self.x_m[1]) & (self.y_m[0] <= y) & (y <= self.y_m[1])
        if self.outline is not None:
            far = p[..., :2] @ self.outline[:, :2].T + self.outline[:, 2]
            within &= (far <= 0.0).all(axis=-1)
        return np.asarray(within)

    @property
    def intervals(self) -> tuple[int, int]:
        """Number of intervals of the spline along x and y."""
        n, m = self.weights_m.shape
        return n - FEWEST + 1, m - FEWEST + 1

    @property
    def interval_m(self) -> tuple[float, float]:
        """Width of the spline's intervals along x and y."""
        (a, b), (c, d), (n, m) = self.x_m, self.y_m, self.intervals
        return (b - a) / n, (d - c) / m

    @cached_property
    def _grid(self) -> tuple[tuple[float, float, int], tuple[float, float, int]]:
        """Start of the first piece, width and number of pieces along x and y."""
        (wide, high), (n, m) = self.interval_m, self.intervals
        return (
            (self.x_m[0] - _BEYOND * wide, wide, n + 2 * _BEYOND),
            (self.y_m[0] - _BEYOND * high, high, m + 2 * _BEYOND),
        )

    @cached_property
    def _patches(self) -> Array:
        """Coefficients (pieces, pieces, 4, 4) of the powers of the places in each patch."""
        along_y = spline_powers(_continued(self.weights_m))
        patches = np.moveaxis(spline_powers(np.moveaxis(along_y, 0, -1)), (2, 3), (0, 2))
        return _without_rounding(np.ascontiguousarray(patches))

    @cached_property
    def _pieces(self) -> list[list[list[list[float]]]]:
        pieces: list[list[list[list[float]]]] = self._patches.tolist()
        return pieces

    def _derivative(self, p: Array, by_x: int, by_y: int) -> Array:
        """Derivative of f of the given orders at points (..., 3)."""
        (start_x, wide, n), (start_y, high, m) = self._grid
        i, t = _places(p[..., 0], start_x, wide, n)
        j, s = _places(p[..., 1], start_y, high, m)
        terms = np.einsum(
            "...a,...ab,...b->...", _powers(t, by_x), self._patches[i, j], _powers(s, by_y)
        )
        return np.asarray(terms / (wide**by_x * high**by_y))


def _place(x: float, start: float, width: float, count: int) -> tuple[int, float]:
    u = (x - start) / width
    piece = int(min(max(0.0, u), count - 1.0))  # NaN goes to piece 0 and stays NaN in the place
    return piece, u - piece


def _places(x: Array, start: float, width: float, count: int) -> tuple[NDArray[np.int64], Array]:
    u = (x - start) / width
    real = np.nan_to_num(u.real, nan=0.0)
    piece = np.clip(real, 0.0, count - 1.0).astype(np.int64)
    return piece, u - piece


def _powers(t: Array, order: int) -> Array:
    """1, t, t^2, t^3 (..., 4), differentiated ``order`` times."""
    one, none = np.ones_like(t), np.zeros_like(t)
    rows = (
        (one, t, t * t, t**3),
        (none, one, 2.0 * t, 3.0 * t * t),
        (none, none, 2.0 * one, 6.0 * t),
    )
    return np.stack(rows[order], axis=-1)


def _continued(weights: Array) -> Array:
    """Weights with three more at each end of both axes, in line with the outermost two.

    In the corners they lie in a plane: the twist that both lines would give them is taken off.
    """
    steps = np.arange(1.0, _BEYOND + 1.0)
    out = weights
    for _ in range(2):
        first, last = out[0] - out[1], out[-1] - out[-2]
        before = out[0] + steps[::-1, None] * first
        out = np.concatenate((before, out, out[-1] + steps[:, None] * last)).T
    for one in (slice(None, None, -1), slice(None)):
        for other in (slice(None, None, -1), slice(None)):
            corner = out[one, other]  # a view whose last rows and columns are the corner
            (a, b), (c, d) = weights[one, other][-2:, -2:]
            corner[-_BEYOND:, -_BEYOND:] -= (a - b - c + d) * np.outer(steps, steps)
    return out


def _without_rounding(patches: Array) -> Array:
    """Straight pieces without the rounding of their higher powers, which far away would count."""
    for end in (0, -1):
        patches[end, :, 2:, :] = 0.0
        patches[:, end, :, 2:] = 0.0
        patches[end, (0, -1), 1, 1] = 0.0
    return patches
