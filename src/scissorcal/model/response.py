"""The material's response g(delta): force at the edge against indentation.

A power law, or a monotone spline between logarithms: a power law whose exponent changes from knot
to knot.
"""

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from scissorcal.aliases import Array, Integers
from scissorcal.errors import ModelError
from scissorcal.model.checks import SMALLEST, check_name, check_numbers

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

    def _derivative_bounds(self, low: Array, high: Array) -> tuple[Bounds, Bounds]:
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


Family = Literal["power", "exponential", "spline"]
_FAMILIES = get_args(Family)

LARGEST_ARGUMENT = 700.0
"""exp() overflows a float64 just above this; beyond it the exponential response is held."""

SERIES_UP_TO = 0.5
SERIES_TERMS = 15
"""0.5^15 / 15! is 2e-17 of the sum's first term, 0.5^2 / 2."""


@dataclass(frozen=True)
class Response:
    """A response family with its parameters, which may be arrays that broadcast.

    All families are written through ``force``, the force in newtons at the indentation
    ``reference_m``, so that their parameters are nearly uncorrelated and mean the same:

    * ``power``: g = force (delta / reference)^exponent
    * ``exponential``: g = force (exp(b delta) - 1) / (exp(b reference) - 1), with
      b = exponent / reference
    * ``spline``: a power whose exponent changes over the indentations ``knots_m`` (k,), one value
      between each two of them: their logarithms change by ``shape`` (..., k - 2) from one to the
      next, and ``exponent`` is their geometric mean. Beyond the knots the outermost powers go on.

    For delta <= 0 there is no contact and no force. ModelError for an unknown family, for a number
    that is not finite and above 0 (``shape``: finite), and for knots that do not rise or are not
    two more than the changes of shape.

    >>> float(Response("power", force=2.0, exponent=1.5, reference_m=3e-4).force_at(3e-4))
    2.0
    """

    family: Family
    force: float | Array
    exponent: float | Array
    reference_m: float
    shape: tuple[float, ...] | Array = ()
    knots_m: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        check_name("family of a response", self.family, _FAMILIES)
        check_numbers("the force of a response (N)", self.force, SMALLEST)
        check_numbers("the exponent of a response", self.exponent, SMALLEST)
        check_numbers("the reference indentation of a response (m)", self.reference_m, SMALLEST)
        if self.family == "spline":
            self._check_knots()

    def _check_knots(self) -> None:
        check_numbers("the changes of shape of a response", self.shape)
        check_numbers("the knots of a response (m)", self.knots_m, SMALLEST)
        changes, knots = np.shape(self.shape)[-1], len(self.knots_m)
        if knots < 2 or changes != knots - 2 or np.any(np.diff(self.knots_m) <= 0.0):
            raise ModelError(
                "A response that is a spline needs knots that rise, 2 or more, and one change of "
                f"shape for each inner knot: it has {knots} knots, {self.knots_m}, and {changes} "
                "changes."
            )

    def force_at(self, indentation: ArrayLike) -> Array:
        """Force g in newtons, shape of the broadcast of ``indentation`` (m) and parameters."""
        u = self._relative(indentation)
        if self.family == "spline":
            grown = np.minimum(self._spline.value(_logarithm(u)), LARGEST_ARGUMENT)
            return np.asarray(self.force * np.exp(grown))
        if self.family == "power":
            with np.errstate(divide="ignore"):
                return np.asarray(self.force * np.where(u > 0, u, 0.0) ** self.exponent)
        return np.asarray(self.force * np.expm1(self._argument(u)) / np.expm1(self.exponent))

    def energy_at(self, indentation: ArrayLike) -> Array:
        """Stored energy, the integral of g from 0 to delta, in joules."""
        u = self._relative(indentation)
        if self.family == "spline":
            return np.asarray(self.force * self.reference_m * self._spline.area(_logarithm(u)))
        if self.family == "power":
            power = np.asarray(self.exponent) + 1.0
            return np.asarray(self.force * self.reference_m * u**power / power)
        argument = self._argument(u)
        shape = _beyond_line(argument) / np.expm1(self.exponent)
        return np.asarray(self.force * self.reference_m * shape / self.exponent)

    def stiffness_at(self, indentation: ArrayLike) -> Array:
        """Stiffness dg/d(delta) in N/m; infinite at 0+ for a power below one."""
        u = self._relative(indentation)
        inside = np.asarray(indentation) > 0
        if self.family == "spline":
            v = _logarithm(np.where(inside, u, 1.0))
            grown = np.minimum(self._spline.value(v) - v, LARGEST_ARGUMENT)
            grade = self._spline.slope(v) * np.exp(grown)
        elif self.family == "power":
            with np.errstate(divide="ignore"):
                grade = self.exponent * np.where(u > 0, u, 0.0) ** (np.asarray(self.exponent) - 1.0)
        else:
            grade = self.exponent * np.exp(self._argument(u)) / np.expm1(self.exponent)
        return np.where(inside, self.force * grade / self.reference_m, 0.0)

    def indentation_at(self, force: ArrayLike) -> Array:
        """Indentation in metres at which the response reaches ``force`` >= 0 (the inverse of g)."""
        ratio = np.maximum(np.asarray(force, dtype=np.float64), 0.0) / self.force
        if self.family == "spline":
            return np.asarray(self.reference_m * np.exp(self._spline.inverse(_logarithm(ratio))))
        if self.family == "power":
            return np.asarray(self.reference_m * ratio ** (1.0 / np.asarray(self.exponent)))
        grown = np.log1p(ratio * np.expm1(self.exponent))
        return np.asarray(self.reference_m * grown / self.exponent)

    def log_bounds(self, low: Array, high: Array) -> tuple[Bounds, Bounds]:
        """Bounds of y' and y'' of a spline between logarithms, see :class:`LogSpline`."""
        return self._spline._derivative_bounds(low, high)

    @cached_property
    def _spline(self) -> LogSpline:
        steps = np.cumsum(np.asarray(self.shape, dtype=np.float64), axis=-1)
        logs = np.concatenate([np.zeros((*steps.shape[:-1], 1)), steps], axis=-1)
        logs = logs - logs.mean(axis=-1, keepdims=True)
        exponents = np.asarray(self.exponent)[..., None] * np.exp(logs)
        return LogSpline(np.log(np.asarray(self.knots_m) / self.reference_m), exponents)

    def _relative(self, indentation: ArrayLike) -> Array:
        return np.maximum(np.asarray(indentation, dtype=np.float64), 0.0) / self.reference_m

    def _argument(self, relative: Array) -> Array:
        return np.minimum(self.exponent * relative, LARGEST_ARGUMENT)


def _beyond_line(a: Array) -> Array:
    """exp(a) - 1 - a for a >= 0; where that would cancel, its series, to 1e-16 of it."""
    small = np.minimum(a, SERIES_UP_TO)
    term = total = 0.5 * small**2
    for power in range(3, SERIES_TERMS):
        term = term * small / power
        total = total + term
    return np.where(a <= SERIES_UP_TO, total, np.expm1(a) - a)


def _logarithm(x: Array) -> Array:
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(x))


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


def _products(first: Bounds, second: Bounds) -> Bounds:
    """Bounds of a product."""
    ends = [a * b for a in first for b in second]
    return np.minimum.reduce(ends), np.maximum.reduce(ends)
