"""A proved bound of how far a table is from its law, in exact arithmetic and in float32.

Between the ends of a cell, where the deviation d = table - law is evaluated, |d| is at most the
larger of both ends plus max |d''| width^2 / 8, the error of a chord. The table is a cubic, so its
second derivative is linear; the law's is enclosed by `scissorcal.model.curvature`. Cells are a
small part of an interval between knots, so that little is added to what is found at their ends.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.kernel import Table
from scissorcal.model.curvature import Span
from scissorcal.package.tables import TableLaw, hermite

CELLS = 32
PROFILE_CELLS = 1024
"""Cells of each interval between knots."""

OCTAVES = 60
"""Halvings of the first interval towards 0, where a power law bends without bound."""

FLOAT64 = 1e-14
"""Rounding of law and cubic in float64, as a share of the values that are subtracted."""

UNIT = 2.0**-24
"""Rounding of float32. The kernel's cubic sums y and three coefficients of at most 3 Q, with
Q = |slope| width at both ends and twice the rise; their own roundings add up to 16 Q, that of the
place within the interval to 32 Q and Horner's sums to 12 Q and 4 |y|, in units of it (the running
error of Higham 2002, doi:10.1137/1.9780898718027, section 5.1)."""


@dataclass(frozen=True)
class ProvedTable:
    """Bounds of one table against its law, cell by cell: all arrays have shape (cells,).

    The cells run from ``low`` to ``high``. ``value`` bounds |table - law| in exact arithmetic,
    ``rounding`` what float32 adds in the kernel, ``slope`` both for the derivatives.
    """

    low: Array
    high: Array
    value: Array
    slope: Array
    rounding: Array

    @property
    def proved(self) -> float:
        """The bound of the kernel's table over its whole range, in the table's unit."""
        return float(np.max(self.value + self.rounding))

    def over(self, part: Array, low: Array, high: Array) -> Array:
        """The largest entry of ``part`` among the cells that touch each [low, high].

        Beyond the table's ends that of its end.
        """
        first = np.clip(np.searchsorted(self.high, low, side="left"), 0, len(part) - 1)
        last = np.clip(np.searchsorted(self.low, high, side="right"), 1, len(part))
        stacked = _running_maxima(part)
        length = np.maximum(last - first, 1)
        level = np.log2(length).astype(np.int64)
        both = stacked[level, first], stacked[level, first + length - 2**level]
        return np.asarray(np.maximum(*both))


def proved_table(law: TableLaw, array: NDArray[np.float32]) -> ProvedTable | None:
    """Bound the deviation of a table (3, knots) from its law; None where f'' has no bound."""
    if law.curvature is None:
        return None
    knots, values, slopes = array.astype(np.float64)
    ends = _cell_ends(law, knots)
    low, high = ends[:-1], ends[1:]
    exact = np.asarray(law.law(ends), dtype=np.float64)
    table = hermite(knots, values, slopes, ends)
    away = np.abs(table - exact) + FLOAT64 * (np.abs(table) + np.abs(exact))
    with np.errstate(divide="ignore", over="ignore", invalid="ignore"):
        least, most = law.curvature(low, high)
        steep = np.asarray(law.derivative(ends), dtype=np.float64)
    index, first, last = _second_derivative(knots, values, slopes, low, high)
    bend = np.maximum(most - np.minimum(first, last), np.maximum(first, last) - least)
    width = high - low
    value = np.maximum(away[:-1], away[1:]) + bend * width**2 / 8.0
    tilt = np.abs(_first_derivative(knots, values, slopes, ends) - steep)
    slope = 0.5 * (tilt[:-1] + tilt[1:] + bend * width)
    # at 0 a power law may bend without bound; there both it and the table rise from 0
    monotone = np.maximum(np.abs(table), np.abs(exact))[1:]
    value = np.where(np.isfinite(value), value, monotone if law.monotone else np.inf)
    slope = np.where(np.isfinite(slope), slope, np.inf)
    rise = np.diff(values)
    size = (np.abs(slopes[:-1]) + np.abs(slopes[1:])) * np.diff(knots) + 2.0 * np.abs(rise)
    most_value = np.maximum(np.abs(values[:-1]), np.abs(values[1:]))
    rounding = UNIT * (4.0 * most_value + 64.0 * size)
    # the derivative's coefficients are up to three times the cubic's, over the width
    tilted = 3.0 * 64.0 * UNIT * size / np.diff(knots)
    return ProvedTable(low, high, value, slope + tilted[index], rounding[index])


def seen_deviation(law: TableLaw, array: NDArray[np.float32]) -> float:
    """Largest deviation of the kernel's table that is found at the cells' ends and middles."""
    ends = _cell_ends(law, array[0].astype(np.float64))
    places = np.concatenate([ends, 0.5 * (ends[:-1] + ends[1:])]).astype(np.float32)
    places = np.clip(places, array[0, 0], array[0, -1])
    away = Table(*array).evaluate(places).astype(np.float64) - law.law(places.astype(np.float64))
    return float(np.max(np.abs(away)))


def _cell_ends(law: TableLaw, knots: Array) -> Array:
    shares = np.arange(CELLS) / CELLS
    ends = [(knots[:-1, None] + np.diff(knots)[:, None] * shares).ravel(), knots[-1:]]
    inside = law.breaks[(law.breaks > knots[0]) & (law.breaks < knots[-1])]
    ends.append(inside)
    if law.monotone and knots[0] == 0.0:
        halves = knots[1] / CELLS * 2.0 ** -np.arange(1.0, OCTAVES)
        ends.append((halves[:, None] * (1.0 + np.arange(8) / 8.0)).ravel())
    return np.unique(np.concatenate(ends))


def _pieces(knots: Array, x: Array) -> NDArray[np.int64]:
    return np.clip(np.searchsorted(knots, x, side="right") - 1, 0, len(knots) - 2)


def _coefficients(
    knots: Array, values: Array, slopes: Array, index: NDArray[np.int64]
) -> tuple[Array, Array, Array, Array]:
    """Width, and the coefficients of t, t^2 and t^3 in each interval."""
    width = knots[index + 1] - knots[index]
    rise = values[index + 1] - values[index]
    first, last = slopes[index] * width, slopes[index + 1] * width
    third = first + last - 2.0 * rise
    return width, first, rise - first - third, third


def _first_derivative(knots: Array, values: Array, slopes: Array, x: Array) -> Array:
    index = _pieces(knots, x)
    width, first, second, third = _coefficients(knots, values, slopes, index)
    t = (x - knots[index]) / width
    return np.asarray((first + t * (2.0 * second + 3.0 * t * third)) / width)


def _second_derivative(
    knots: Array, values: Array, slopes: Array, low: Array, high: Array
) -> tuple[NDArray[np.int64], Array, Array]:
    """The interval of each cell, and the table's second derivative at both of its ends."""
    index = _pieces(knots, 0.5 * (low + high))
    width, _, second, third = _coefficients(knots, values, slopes, index)
    ends = [
        (2.0 * second + 6.0 * (x - knots[index]) / width * third) / width**2 for x in (low, high)
    ]
    return index, ends[0], ends[1]


def _running_maxima(part: Array) -> Array:
    """Maxima over 1, 2, 4, ... entries from each on: (levels, n), for maxima of any range."""
    rows = [part]
    while 2 ** len(rows) <= len(part):
        step = 2 ** (len(rows) - 1)
        row = rows[-1].copy()
        row[:-step] = np.maximum(row[:-step], rows[-1][step:])
        rows.append(row)
    return np.stack(rows)


def profiles(law: TableLaw, array: NDArray[np.float32]) -> "tuple[Profile, Profile]":
    """Profiles of a law's first and second derivative over its table (3, knots).

    ValueError where the law has no bound of its second derivative.
    """
    if law.curvature is None:
        raise ValueError("the law has no bound of its second derivative")
    low, high = float(array[0, 0]), float(array[0, -1])
    ends = np.linspace(low, high, PROFILE_CELLS + 1)
    if law.monotone and low == 0.0:
        ends = np.concatenate([ends, ends[1] * 2.0 ** -np.arange(1.0, 40.0)])
    inside = law.breaks[(law.breaks > low) & (law.breaks < high)]
    return Profile.of(law.derivative, law.curvature, np.unique(np.concatenate([ends, inside])))


@dataclass(frozen=True)
class Profile:
    """Bounds of a function of one variable over cells, and so over any interval."""

    ends: Array
    lows: Array
    highs: Array

    @classmethod
    def of(
        cls,
        slope: Callable[[Array], Array],
        curvature: Callable[[Array, Array], tuple[Array, Array]],
        ends: Array,
    ) -> "tuple[Profile, Profile]":
        """Profiles of a law's first and second derivative."""
        low, high = ends[:-1], ends[1:]
        with np.errstate(all="ignore"):
            least, most = curvature(low, high)
            first, last = slope(low), slope(high)
        size, width = np.maximum(np.abs(least), np.abs(most)), high - low
        spare = 0.5 * np.where(np.isfinite(size), size, 0.0) * width
        # where f'' has one sign f' is monotone; else it strays from its ends by half a cell's bend
        spare = np.where((least >= 0.0) | (most <= 0.0), 0.0, spare)
        highest = np.where(np.isneginf(least), np.inf, np.maximum(first, last) + spare)
        firsts = cls(ends, np.minimum(first, last) - spare, highest)
        return firsts, cls(ends, least, most)

    def over(self, span: Span) -> Span:
        """Bounds over each interval; those of the ends beyond them."""
        count = len(self.lows)
        first = np.clip(np.searchsorted(self.ends, span.low, side="left") - 1, 0, count - 1)
        last = np.clip(np.searchsorted(self.ends, span.high, side="right"), 1, count)
        length = np.maximum(last - first, 1)
        level = np.log2(length).astype(np.int64)
        start, end = first, first + length - 2**level
        lows, highs = _running_maxima(-self.lows), _running_maxima(self.highs)
        return Span(
            -np.maximum(lows[level, start], lows[level, end]),
            np.maximum(highs[level, start], highs[level, end]),
        )
