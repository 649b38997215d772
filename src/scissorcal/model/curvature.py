"""Bounds of the second derivative of each law over intervals: what a proof about tables rests on.

Each function encloses f'' on the intervals [low, high] (arrays of one shape) and returns the lower
and the upper bounds. They hold in exact arithmetic; float64 rounds them by some 1e-15 of
themselves. Intervals must not contain one of the law's breaks inside, where f'' may jump.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from scissorcal.aliases import Array
from scissorcal.model.bspline import FEWEST
from scissorcal.model.edge import Edge
from scissorcal.model.friction import FrictionLaw, friction_level
from scissorcal.model.response import LARGEST_ARGUMENT, Response

Bounds = tuple[Array, Array]


@dataclass(frozen=True)
class Span:
    """Intervals [low, high], elementwise; sums and products enclose those of any members."""

    low: Array
    high: Array

    @classmethod
    def between(cls, one: Array, other: Array) -> "Span":
        """From values at both ends, in any order: of a monotone function, its range."""
        return cls(np.minimum(one, other), np.maximum(one, other))

    def __add__(self, other: "Span | Array | float") -> "Span":
        part = _span(other)
        return Span(self.low + part.low, self.high + part.high)

    def __sub__(self, other: "Span | Array | float") -> "Span":
        part = _span(other)
        return Span(self.low - part.high, self.high - part.low)

    def __mul__(self, other: "Span | Array | float") -> "Span":
        part = _span(other)
        ends = [a * b for a in (self.low, self.high) for b in (part.low, part.high)]
        return Span(np.minimum.reduce(ends), np.maximum.reduce(ends))

    def inverse(self) -> "Span":
        """1 over the interval, which must be positive; infinite where it is not."""
        with np.errstate(divide="ignore"):
            return Span(1.0 / self.high, np.where(self.low > 0.0, 1.0 / self.low, np.inf))

    @property
    def largest(self) -> Array:
        """Largest magnitude."""
        return np.maximum(np.abs(self.low), np.abs(self.high))


def _span(value: Span | Array | float) -> Span:
    if isinstance(value, Span):
        return value
    array = np.asarray(value, dtype=np.float64)
    return Span(array, array)


def edge_breaks(edge: Edge) -> Array:
    """Stations at which the second derivative of an edge may jump or bend."""
    if edge.family != "spline":
        return np.zeros(0)
    pieces = np.shape(edge.spline_m)[-1] - FEWEST + 1
    return np.linspace(edge.spline_start_m, edge.length_m, pieces + 1)


def edge_curvature(edge: Edge, low: Array, high: Array) -> Bounds:
    """e'' over stations: every family is a cubic between its breaks."""
    return cubic_curvature(edge.slope_at, low, high)


def cubic_curvature(slope: Callable[[Array], Array], low: Array, high: Array) -> Bounds:
    """f'' of a law that is a cubic on each interval: linear, so its ends enclose it.

    Its slope is a parabola there, whose derivative at both ends three values of it give exactly.
    """
    width = high - low
    inside = low + 0.125 * width, low + 0.5 * width, low + 0.875 * width
    first, middle, last = (slope(place) for place in inside)
    tilt, bend = (last - first) / 0.75, (last - 2.0 * middle + first) / 0.28125
    with np.errstate(divide="ignore", invalid="ignore"):
        span = Span.between((tilt - bend) / width, (tilt + bend) / width)
    return span.low, span.high


def response_breaks(response: Response) -> Array:
    """Indentations at which the second derivative of a response may jump."""
    return np.asarray(response.knots_m, dtype=np.float64)


def response_curvature(response: Response, low: Array, high: Array) -> Bounds:
    """g'' over indentations > 0; infinite at 0 for powers below two."""
    force, reference = np.asarray(response.force), response.reference_m
    if response.family == "spline":
        return _log_spline_curvature(response, low, high)
    exponent = np.asarray(response.exponent, dtype=np.float64)
    if response.family == "power":
        with np.errstate(divide="ignore", invalid="ignore"):
            ends = [(u / reference) ** (exponent - 2.0) for u in (low, high)]
        scale = force * exponent * (exponent - 1.0) / reference**2
        ends = [np.where(scale == 0.0, 0.0, scale * end) for end in ends]
    else:
        argument = [np.minimum(exponent * u / reference, LARGEST_ARGUMENT) for u in (low, high)]
        scale = force * (exponent / reference) ** 2 / np.expm1(exponent)
        ends = [scale * np.exp(end) for end in argument]
    span = Span.between(ends[0], ends[1])
    return span.low, span.high


def _log_spline_curvature(response: Response, low: Array, high: Array) -> Bounds:
    """g = F exp(y(v)) with v = ln(delta / reference): g'' = g (y'' + y'^2 - y') / delta^2."""
    with np.errstate(divide="ignore"):
        ends = [np.log(place / response.reference_m) for place in (low, high)]
        slope, bend = response.log_bounds(*ends)
    force = Span(response.force_at(low), response.force_at(high))
    first, second = Span(*slope), Span(*bend)
    span = force * (second + first * (first - 1.0)) * Span(low**2, high**2).inverse()
    return span.low, span.high


def level_curvature(law: FrictionLaw, sign: float, low: Array, high: Array) -> Bounds:
    """Second derivative of :func:`friction_level` by the speed.

    The Stribeck part S exp(-(w / w_s)^2) has S (4 (w / w_s)^2 - 2) / w_s^2 exp(-(w / w_s)^2); all
    else is a polynomial of third degree at most.
    """
    rate = np.asarray(law["stribeck_rate"], dtype=np.float64)
    level = np.asarray(law["stribeck"], dtype=np.float64)
    has = bool(np.any(level))

    def slope(speed: Array) -> Array:
        whole = friction_level(law, sign, speed)[1]
        if not has:
            return whole
        return whole + level * 2.0 * speed / rate**2 * np.exp(-((speed / rate) ** 2))

    rest = Span(*cubic_curvature(slope, low, high))
    if not has:
        return rest.low, rest.high
    near, far = low / rate, high / rate
    factor = Span(4.0 * near**2 - 2.0, 4.0 * far**2 - 2.0)
    bump = Span(np.exp(-(far**2)), np.exp(-(near**2)))
    span = rest + factor * bump * (level / rate**2)
    return span.low, span.high
