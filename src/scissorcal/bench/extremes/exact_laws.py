"""Edges and responses in 50 digits, written from their definitions; shares no code with the model.

Numbers are either all of :data:`mp`, or all floats: a law of floats (:func:`scouted`) only finds
out between which places a root lies, which is then found in 50 digits.
"""

import bisect
import itertools
import math
from collections.abc import Callable
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any, Protocol, TypeVar

from scissorcal.errors import needs_extra

try:
    import mpmath
except ImportError:
    raise needs_extra("bench extremes", "mpmath", "bench") from None

mp = mpmath.MPContext()
mp.dps = 50
Number = Any
"""A number of :data:`mp`, or a float."""

HOLDS = TypeVar("HOLDS")
CLOSE = mp.mpf(10) ** -44
"""Share of its place to which a root is found."""


class OverflowedError(Exception):
    """A force beyond what a float can hold."""


class Curve(Protocol):
    """An edge e(s): a polynomial of at most third degree between ``breaks``."""

    @property
    def breaks(self) -> tuple[Number, ...]:
        """Stations between which the edge is one polynomial."""
        ...

    def at(self, s: Number) -> tuple[Number, Number]:
        """Offset and slope at a station."""
        ...


class Force(Protocol):
    """A response."""

    def at(self, delta: Number) -> tuple[Number, Number]:
        """Force (N) and stored energy (J) of one blade at an indentation > 0."""
        ...

    def inverse(self, force: Number) -> Number:
        """Indentation at which a force > 0 is reached."""
        ...


@dataclass(frozen=True)
class Bow:
    """offset + s tan(taper) + curvature s^2 / 2."""

    offset: Number
    tangent: Number
    curvature: Number
    breaks: tuple[Number, ...] = ()

    def at(self, s: Number) -> tuple[Number, Number]:
        """Offset and slope at a station."""
        bent = self.curvature * s
        return self.offset + s * (self.tangent + bent / 2), self.tangent + bent


@dataclass(frozen=True)
class Nicked:
    """A bow, and one cubic B-spline of the height ``weight``, of which it reaches 2/3.

    The B-spline is a sum of truncated powers over five knots ``step`` apart from ``first`` on.
    """

    bow: Bow
    weight: Number
    first: Number
    step: Number

    @property
    def breaks(self) -> tuple[Number, ...]:
        """Knots of the B-spline."""
        return tuple(self.first + k * self.step for k in range(5))

    def at(self, s: Number) -> tuple[Number, Number]:
        """Offset and slope at a station."""
        offset, slope = self.bow.at(s)
        u = (s - self.first) / self.step
        if 0 < u < 4:
            for factor, k in ((1, 0), (-4, 1), (6, 2), (-4, 3)):
                over = u - k
                if over > 0:
                    offset += self.weight * factor * over**3 / 6
                    slope += self.weight * factor * over**2 / 2 / self.step
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

    def magnitude(self, at: Number) -> Number:
        """Sum of the magnitudes of what adds up to the value: its rounding is a share of it."""
        i, w, (y, p, _, d) = self.piece(at)
        t = (at - self.x[i]) / w
        rise = abs(self.y[min(i + 1, len(self.y) - 1)] - y) if d else 0 * t
        return abs(y) + abs(t) * (abs(p) + abs(t) * (rise + 3 * abs(p) + 2 * abs(d)))


@dataclass(frozen=True)
class Power:
    """force (delta / reference)^exponent."""

    force: Number
    exponent: Number
    reference: Number

    def at(self, delta: Number) -> tuple[Number, Number]:
        """Force and its integral."""
        try:
            force = self.force * (delta / self.reference) ** self.exponent
        except OverflowError:
            raise OverflowedError from None
        return force, force * delta / (self.exponent + 1)

    def inverse(self, force: Number) -> Number:
        """Indentation at which a force is reached."""
        return self.reference * (force / self.force) ** (1 / self.exponent)


@dataclass(frozen=True)
class Exponential:
    """force (exp(b delta) - 1) / (exp(b reference) - 1) with b = exponent / reference."""

    force: Number
    exponent: Number
    reference: Number

    def at(self, delta: Number) -> tuple[Number, Number]:
        """Force and its integral."""
        a = self.exponent * delta / self.reference
        if a > 700:
            raise OverflowedError
        own = math if isinstance(a, float) else mp
        scale = self.force / own.expm1(self.exponent)
        grown = own.expm1(a)
        return scale * grown, scale * (grown - a) * self.reference / self.exponent

    def inverse(self, force: Number) -> Number:
        """Indentation at which a force is reached."""
        own = math if isinstance(force, float) else mp
        grown = own.log1p(force / self.force * own.expm1(self.exponent))
        return self.reference * grown / self.exponent


@dataclass(frozen=True)
class TableForce:
    """A response's table, with a cap on the force (N) beyond which it is constant."""

    table: TableCurve
    areas: tuple[Number, ...]
    cap: Number

    @classmethod
    def of(cls, table: Any, cap: float) -> "TableForce":
        """The table of a kernel, exactly."""
        curve = TableCurve.of(table)
        areas = [mp.mpf(0)]
        for i, (low, high) in enumerate(itertools.pairwise(curve.x)):
            mean = (curve.y[i] + curve.y[i + 1]) / 2
            mean += (high - low) * (curve.slope[i] - curve.slope[i + 1]) / 12
            areas.append(areas[-1] + (high - low) * mean)
        return cls(curve, tuple(areas), mp.mpf(cap))

    def at(self, delta: Number) -> tuple[Number, Number]:
        """Force and its integral."""
        i, w, (y, p, c, d) = self.table.piece(delta)
        t = (delta - self.table.x[i]) / w
        force = y + t * (p + t * (c + t * d))
        area = self.areas[i] + w * t * (y + t * (p / 2 + t * (c / 3 + t * d / 4)))
        if force > self.cap and i == len(self.areas) - 1 and p > 0:
            area -= (force - self.cap) ** 2 / p / 2
        return max(min(force, self.cap), 0 * force), area

    def inverse(self, force: Number) -> Number:
        """Indentation at which a force is reached, by bisection between knots."""
        curve = self.table
        if force >= curve.y[-1]:
            return curve.x[-1] + (force - curve.y[-1]) / curve.slope[-1]
        i = bisect.bisect_right(curve.y, force) - 1
        return root(lambda x: curve.at(x)[0] - force, curve.x[i], curve.x[i + 1])


def scouted(law: HOLDS) -> HOLDS:
    """The same law of floats."""
    changes = {f.name: _floats(getattr(law, f.name)) for f in fields(law)}  # type: ignore[arg-type]
    return replace(law, **changes)  # type: ignore[type-var]


def _floats(value: Any) -> Any:
    if isinstance(value, tuple):
        return tuple(_floats(one) for one in value)
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
