"""A monotone spline between logarithms: a power law whose exponent changes from knot to knot."""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from scissorcal.aliases import Array, Integers

Bounds = tuple[Array, Array]

_NODES, _WEIGHTS = np.polynomial.legendre.leggauss(8)
_PLACES, _SHARES = 0.5 * (1.0 + _NODES), 0.5 * _WEIGHTS


@dataclass(frozen=True)
class LogSpline:
    """y(v), rising everywhere, with y(0) = 0; straight on beyond its knots.

    ``knots`` (k,) ascend, ``exponents`` (..., k - 1) > 0 are the mean slopes between them; their
    leading axes broadcast with places, such as (draws, 1) with (points,). At a knot the slope is
    the geometric mean of both neighbours'. Between knots y is the rational quadratic of Gregory and
    Delbourgo (1982, doi:10.1093/imanum/2.2.123): once continuously differentiable, rising for
    any positive slopes, and inverted in closed form, which a cubic is not. Equal exponents give
    exactly a straight line.

    >>> line = LogSpline(np.array([-1.0, 0.0, 1.0]), np.array([2.0, 2.0]))
    >>> line.value(np.array([-3.0, 0.5, 4.0])).tolist()
    [-6.0, 1.0, 8.0]
    """

    knots: Array
    exponents: Array

    def value(self, v: Array) -> Array:
        """y at ``v``; -inf at -inf."""
        return self._raised(v) - self._at_zero

    def slope(self, v: Array) -> Array:
        """dy/dv at ``v``."""
        index, t = self._place(v)
        n, first, last = self._around(index)
        mix = t * (1.0 - t)
        below = n + (first + last - 2.0 * n) * mix
        above = last * t * t + 2.0 * n * mix + first * (1.0 - t) ** 2
        return np.asarray(n * n * above / (below * below))

    def derivative_bounds(self, low: Array, high: Array) -> tuple[Bounds, Bounds]:
        """Bounds of dy/dv and of d2y/dv2 over [low, high], which have no knot inside.

        Between knots dy/dv = n^2 u / b^2 and d2y/dv2 = n^2 (u' b - 2 u b') / (b^3 width), where u
        and b are parabolas in the share t of the interval. Each is enclosed by itself.
        """
        index, middle = self._place(0.5 * (low + high))
        n, first, last = self._around(index)
        width = np.diff(self.knots)[index]
        ends = [np.clip((v - self.knots[index]) / width, 0.0, 1.0) for v in (low, high)]
        twist = first + last - 2.0 * n
        bend = 0.25 * np.abs(twist) * (ends[1] - ends[0]) ** 2
        above = _range(
            [last * t * t + 2 * n * t * (1 - t) + first * (1 - t) ** 2 for t in ends], bend
        )
        below = _range([n + twist * t * (1 - t) for t in ends], bend)
        rise = _range([2.0 * (last * t + n * (1 - 2 * t) - first * (1 - t)) for t in ends])
        fall = _range([twist * (1 - 2 * t) for t in ends])
        slope = n * n * above[0] / below[1] ** 2, n * n * above[1] / below[0] ** 2
        gains = _products(rise, below)
        losses = _products(above, fall)
        top = gains[0] - 2.0 * losses[1], gains[1] - 2.0 * losses[0]
        shrink = n * n / (below[1] ** 3 * width), n * n / (below[0] ** 3 * width)
        straight = (middle == 0.0) | (middle == 1.0)  # beyond the knots
        tail = np.where(middle == 0.0, self.exponents[..., 0], self.exponents[..., -1])
        low_bend, high_bend = _products(top, shrink)
        return (
            (np.where(straight, tail, slope[0]), np.where(straight, tail, slope[1])),
            (np.where(straight, 0.0, low_bend), np.where(straight, 0.0, high_bend)),
        )

    def inverse(self, y: Array) -> Array:
        """The v at which y is reached: the root of a quadratic between two knots."""
        raised = y + self._at_zero
        heights = self._heights
        index = np.zeros(raised.shape, dtype=np.int64)
        for knot in range(1, heights.shape[-1] - 1):
            index = index + (raised >= heights[..., knot])
        n, first, last = self._around(index)
        width = np.diff(self.knots)[index]
        rise = n * width
        part = np.clip(raised - _pick(heights, index), 0.0, rise)
        twist = part * (first + last - 2.0 * n)
        a, b, c = rise * (n - first) + twist, rise * first - twist, -n * part
        root = np.sqrt(np.maximum(b * b - 4.0 * a * c, 0.0))
        v = self.knots[index] + width * (2.0 * c / (-b - root))
        below = np.minimum(raised - heights[..., 0], 0.0) / self.exponents[..., 0]
        beyond = np.maximum(raised - heights[..., -1], 0.0) / self.exponents[..., -1]
        return np.asarray(v + below + beyond)

    def area(self, v: Array) -> Array:
        """Integral of exp(y) over exp(v) from 0 on.

        In closed form outside the knots; between them by Gauss and Legendre's eight points to an
        interval: to 1e-6 of it where slope times width stays below 6, to 1e-4 below 12.
        """
        low, high = self.knots[0], self.knots[-1]
        inside = np.clip(v, low, high)
        index, _ = self._place(inside)
        between = _pick(self._areas, index) + self._quadrature(self.knots[index], inside)
        first = self.exponents[..., 0] + 1.0
        last = self.exponents[..., -1] + 1.0
        head = np.exp(self.value(np.minimum(v, low)) + np.minimum(v, low)) / first
        over = np.maximum(v, high)
        tail = np.exp(self.value(over) + over) - np.exp(self.value(high) + high)
        return np.asarray(np.where(v < low, head, between + tail / last))

    @cached_property
    def _slopes(self) -> Array:
        n = self.exponents
        middle = np.sqrt(n[..., 1:] * n[..., :-1])
        return np.concatenate([n[..., :1], middle, n[..., -1:]], axis=-1)

    @cached_property
    def _heights(self) -> Array:
        """Heights of the knots (..., k) above the first."""
        rises = np.cumsum(self.exponents * np.diff(self.knots), axis=-1)
        return np.concatenate([np.zeros((*rises.shape[:-1], 1)), rises], axis=-1)

    @cached_property
    def _at_zero(self) -> Array:
        return self._raised(np.zeros(()))

    @cached_property
    def _areas(self) -> Array:
        """Area up to each knot (..., k)."""
        start = self.knots[0]
        parts = [np.exp(self.value(start) + start) / (self.exponents[..., 0] + 1.0)]
        parts += [self._quadrature(low, high) for low, high in pairwise(self.knots)]
        return np.cumsum(np.stack(parts, axis=-1), axis=-1)

    def _raised(self, v: Array) -> Array:
        """Height above the first knot."""
        index, t = self._place(v)
        n, first, last = self._around(index)
        mix = t * (1.0 - t)
        below = n + (first + last - 2.0 * n) * mix
        rise = n * np.diff(self.knots)[index]
        inner = _pick(self._heights, index) + rise * (n * t * t + first * mix) / below
        under = self.exponents[..., 0] * np.minimum(v - self.knots[0], 0.0)
        beyond = self.exponents[..., -1] * np.maximum(v - self.knots[-1], 0.0)
        return np.asarray(inner + under + beyond)

    def _place(self, v: Array) -> tuple[Integers, Array]:
        """Interval of each place, and where in it, from 0 to 1."""
        last = len(self.knots) - 2
        index = np.clip(np.searchsorted(self.knots, v, side="right") - 1, 0, last)
        t = (v - self.knots[index]) / np.diff(self.knots)[index]
        return index, np.clip(t, 0.0, 1.0)

    def _around(self, index: Integers) -> tuple[Array, Array, Array]:
        """Mean slope of an interval, and those at its ends."""
        slopes = self._slopes
        return _pick(self.exponents, index), _pick(slopes, index), _pick(slopes, index + 1)

    def _quadrature(self, low: Array, high: Array) -> Array:
        """Integral of exp(y + v) from ``low`` to ``high`` within one interval each."""
        width = high - low
        total = np.zeros(())
        for place, share in zip(_PLACES, _SHARES, strict=True):
            v = low + place * width
            total = total + share * np.exp(self.value(v) + v)
        return np.asarray(width * total)


def _pick(values: Array, index: Integers) -> Array:
    """Entries of the last axis of ``values`` (..., k) at ``index``, leading axes broadcast."""
    if values.ndim == 1:
        return np.asarray(values[index])
    shape = np.broadcast_shapes(values.shape[:-1], index.shape)
    wide = np.broadcast_to(values, (*shape, values.shape[-1]))
    return np.take_along_axis(wide, np.broadcast_to(index, shape)[..., None], axis=-1)[..., 0]


def _range(ends: list[Array], spare: Array | float = 0.0) -> Bounds:
    """Bounds from values at both ends, and how far a parabola may leave them in between."""
    return np.minimum(*ends) - spare, np.maximum(*ends) + spare


def _products(one: Bounds, other: Bounds) -> Bounds:
    """Bounds of a product."""
    ends = [a * b for a in one for b in other]
    return np.minimum.reduce(ends), np.maximum.reduce(ends)
