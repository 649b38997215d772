"""Edges and responses in 50 digits, written from their definitions; shares no code with the model.

Numbers are either all of :data:`mp`, or all floats: a law of floats (:func:`scouted`) only finds
out between which places a root lies, which is then found in 50 digits.
"""

import bisect
import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any, TypeVar

from scissorcal.errors import needs_extra

try:
    import mpmath
except ImportError:
    raise needs_extra("bench extremes", "mpmath", "bench") from None

mp = mpmath.MPContext()
mp.dps = 50
Number = Any
"""A number of :data:`mp`, or a float."""

Law = TypeVar("Law")
CLOSE = mp.mpf(10) ** -44
"""Share of its place to which a root is found."""


class NotComparedError(Exception):
    """There is nothing to compare with; the sentence says why."""


TOO_LARGE = "above 1e30 N"


@dataclass(frozen=True)
class FormulaEdge:
    """offset + s tangent + curvature s^2 / 2 + bend s^3 / 6, and a cubic B-spline.

    ``polynomial`` holds offset, tangent, curvature and bend. The spline has its first knot at
    ``start``, pieces of the length ``step``, and goes on straight beyond both ends.
    """

    polynomial: tuple[Number, Number, Number, Number]
    weights: tuple[Number, ...] = ()
    start: Number = 0
    step: Number = 1

    @property
    def breaks(self) -> tuple[Number, ...]:
        """Stations between which the edge is a polynomial of at most third degree."""
        return tuple(
            self.start + k * self.step
            for k in range(len(self.weights) - 2)
            if any(self.weights[max(k - 1, 0) : k + 4])
        )

    def at(self, s: Number) -> tuple[Number, Number]:
        """Offset and slope at a station."""
        first, tangent, curvature, bend = self.polynomial
        offset = first + s * (tangent + s * (curvature / 2 + s * bend / 6))
        slope = tangent + s * (curvature + s * bend / 2)
        if self.weights:
            pieces = len(self.weights) - 3
            u = (s - self.start) / self.step
            within = min(max(u, 0 * u), pieces)
            k = min(int(within), pieces - 1)
            t, (a, b, c, d) = within - k, self.weights[k : k + 4]
            tilt = d * t**2 + c * (1 + 2 * t - 3 * t**2) - b * (4 * t - 3 * t**2) - a * (1 - t) ** 2
            offset += (a * (1 - t) ** 3 + b * (3 * t**3 - 6 * t**2 + 4) + d * t**3) / 6
            offset += c * (1 + 3 * t + 3 * t**2 - 3 * t**3) / 6 + tilt / 2 * (u - within)
            slope += tilt / 2 / self.step
        return offset, slope


@dataclass(frozen=True)
class TableCurve:
    """A cubic Hermite table of float32 numbers, straight on beyond its ends."""

    x: tuple[Number, ...]
    y: tuple[Number, ...]
    slope: tuple[Number, ...]

    @classmethod
    def of(cls, table: Any) -> "TableCurve":
        """The table's numbers, exactly."""
        rows = (table.x, table.y, table.slope)
        return cls(*(tuple(mp.mpf(float(v)) for v in row) for row in rows))

    @property
    def breaks(self) -> tuple[Number, ...]:
        """The knots."""
        return self.x

    def piece(self, at: Number) -> tuple[int, Number, tuple[Number, ...]]:
        """Knot from which an interval starts, its width, and its cubic's coefficients.

        Beyond the ends the width is 1 and the cubic a line.
        """
        last = len(self.x) - 1
        if at <= self.x[0] or at >= self.x[last]:
            end = 0 if at <= self.x[0] else last
            zero = 0 * at
            return end, 1 + zero, (self.y[end], self.slope[end], zero, zero)
        i = bisect.bisect_right(self.x, at) - 1
        w = self.x[i + 1] - self.x[i]
        rise, p, q = self.y[i + 1] - self.y[i], self.slope[i] * w, self.slope[i + 1] * w
        return i, w, (self.y[i], p, 3 * rise - 2 * p - q, p + q - 2 * rise)

    def at(self, at: Number) -> tuple[Number, Number]:
        """Value and derivative."""
        i, w, (y, p, c, d) = self.piece(at)
        t = (at - self.x[i]) / w
        return y + t * (p + t * (c + t * d)), (p + t * (2 * c + t * 3 * d)) / w

    def held(self, at: Number) -> Number:
        """Value, beyond the ends that of the end."""
        return self.at(min(max(at, self.x[0]), self.x[-1]))[0]


@dataclass(frozen=True)
class Power:
    """force (delta / reference)^exponent."""

    force: Number
    exponent: Number
    reference: Number

    def at(self, delta: Number) -> Number:
        """Force at an indentation > 0."""
        try:
            return self.force * (delta / self.reference) ** self.exponent
        except OverflowError:
            raise NotComparedError(TOO_LARGE) from None

    def energy(self, delta: Number) -> Number:
        """Integral of the force up to an indentation."""
        return self.at(delta) * delta / (self.exponent + 1)

    def inverse(self, force: Number) -> Number:
        """Indentation at which a force is reached."""
        return self.reference * (force / self.force) ** (1 / self.exponent)


class Exponential(Power):
    """force (exp(b delta) - 1) / (exp(b reference) - 1) with b = exponent / reference."""

    def at(self, delta: Number) -> Number:
        a = self.exponent * delta / self.reference
        if a > 700:
            raise NotComparedError(TOO_LARGE)
        numbers = math if isinstance(a, float) else mp
        return self.force * numbers.expm1(a) / numbers.expm1(self.exponent)

    def energy(self, delta: Number) -> Number:
        """Integral of the force up to an indentation."""
        numbers = math if isinstance(delta, float) else mp
        line = self.force * (self.exponent * delta / self.reference) / numbers.expm1(self.exponent)
        return (self.at(delta) - line) * self.reference / self.exponent

    def inverse(self, force: Number) -> Number:
        """Indentation at which a force is reached."""
        numbers = math if isinstance(force, float) else mp
        grown = numbers.log1p(force / self.force * numbers.expm1(self.exponent))
        return self.reference * grown / self.exponent


@dataclass(frozen=True)
class TableForce:
    """A response's table, with a cap on the force (N) beyond which it is constant."""

    table: TableCurve
    cap: Number

    def at(self, delta: Number) -> Number:
        """Force at an indentation > 0."""
        return max(min(self.table.at(delta)[0], self.cap), 0 * delta)


Curve = FormulaEdge | TableCurve
Force = Power | TableForce


def scouted(law: Law) -> Law:
    """The same law of floats."""
    changes = {f.name: _floats(getattr(law, f.name)) for f in fields(law)}  # type: ignore[arg-type]
    return replace(law, **changes)  # type: ignore[type-var]


def _floats(value: Any) -> Any:
    if isinstance(value, tuple):
        return tuple(_floats(entry) for entry in value)
    if is_dataclass(value):
        return scouted(value)
    return float(value) if isinstance(value, mp.mpf) else value


def root(function: Callable[[Number], Number], low: Number, high: Number) -> Number:
    """A root between two places of different sign, by the method of Ridders (1979).

    doi:10.1109/TCS.1979.1084580. ValueError where both places have the same sign.
    """
    at_low, at_high = function(low), function(high)
    if at_low == 0 or at_high == 0:
        return low if at_low == 0 else high
    if (at_low > 0) == (at_high > 0):
        raise ValueError("no change of sign between the two places")
    for _ in range(400):
        middle = (low + high) / 2
        at_middle = function(middle)
        width = mp.sqrt(at_middle**2 - at_low * at_high)
        sign = 1 if at_low > at_high else -1
        place = middle + (middle - low) * sign * at_middle / width
        known = sorted(
            [(low, at_low), (middle, at_middle), (place, function(place)), (high, at_high)]
        )
        for (a, fa), (b, fb) in itertools.pairwise(known):
            if fa == 0 or fb == 0:
                return a if fa == 0 else b
            if (fa > 0) != (fb > 0):
                low, at_low, high, at_high = a, fa, b, fb
                break
        if high - low <= CLOSE * max(abs(low), abs(high)):
            return low
    return (low + high) / 2
