"""Compile a law, given as a function and its derivative, to a small cubic table."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from scissorcal.aliases import Array
from scissorcal.kernel import Row16, Table
from scissorcal.model.curvature import Bounds

Function = Callable[[Array], Array]
NumberFormat = Literal["float32", "int16", "float64"]
Rows = tuple[Row16, Row16, Row16]

LARGEST_TABLE = 256
FLOOR = 0.01
"""Below this share of a law's scale the tolerance no longer shrinks with the value."""

_PROBES = 0.5 - 0.5 * np.cos(np.pi * (np.arange(23) + 0.5) / 23)
"""Places inside an interval, as shares of it, at which its error is measured."""

_SPARE = 0.95
"""Share of the tolerance that a probe may find used: between two probes it may be a little more."""

_STEEPEST = 3.0
"""A cubic between slopes of at most three times the chord's is monotone (Fritsch and Carlson
1980, doi:10.1137/0717021)."""


@dataclass(frozen=True)
class Fitted:
    """A table with the error that it was found to have.

    ``error`` is the largest deviation from the law that was probed, as a share of what a probe may
    find: 1 or less where the tolerance was met. ``array`` (3, knots) holds knots, values and slopes
    as the number format has them, in float64; ``rows`` say how int16 stores them, else None.
    """

    table: Table
    error: float
    array: Array
    rows: Rows | None = None

    @property
    def met(self) -> bool:
        """Whether the table keeps its tolerance everywhere it was probed."""
        return self.error <= 1.0


@dataclass(frozen=True)
class TableLaw:
    """One law that becomes a table: what `fit_table` takes of it.

    ``curvature`` bounds its second derivative over intervals, none of which contains one of
    ``breaks``; None where no bound is known.
    """

    law: Function
    derivative: Function
    low: float
    high: float
    monotone: bool = False
    scale: float | None = None
    curvature: Callable[[Array, Array], Bounds] | None = None
    breaks: Array = field(default_factory=lambda: np.zeros(0))


def fit_table(
    law: TableLaw,
    *,
    tolerance: float,
    largest: int = LARGEST_TABLE,
    number_format: NumberFormat = "float32",
) -> Fitted:
    """Place knots where the law needs them, until a cubic Hermite table follows it.

    The deviation allowed at x is ``tolerance`` times |law(x)|, or times 1 % of ``scale`` where that
    is more; the scale is the law's largest value, unless given. Every interval that deviates
    further is halved, the worst first once ``largest`` knots are near. Knots are numbers of the
    format and the law is evaluated exactly there, so rounding them costs nothing; values and slopes
    are rounded, and no interval is halved for what 16 bits cannot hold. With ``monotone`` the law
    must not fall, its slopes are limited so that neither does the table, and an infinite slope
    (a power below one, at 0) is replaced by the steepest one that stays monotone.

    Raises ValueError where the law is not finite, falls although ``monotone``, or the range is
    empty.

    >>> root = TableLaw(np.sqrt, lambda x: 0.5 / np.sqrt(x), 0.01, 1.0)
    >>> fitted = fit_table(root, tolerance=1e-3)
    >>> fitted.met, len(fitted.table.x)
    (True, 9)
    """
    low, high, scale = law.low, law.high, law.scale
    ends = np.array([low, high], dtype=np.float32).astype(np.float64)
    if not (np.isfinite(ends).all() and ends[0] < ends[1]):
        raise ValueError(f"a table needs low < high, both finite; got {low:g} and {high:g}")
    if scale is None:
        scale = float(np.max(np.abs(law.law(np.linspace(ends[0], ends[1], 257)))))
    rounding = _Rounding(number_format, ends)
    knots = rounding.knots(ends)
    while True:
        at = _at_knots(law, knots, rounding)
        ratios = _errors(law.law, knots, at, _SPARE * tolerance, scale, at.resolution)
        middles = rounding.knots(0.5 * (knots[:-1] + knots[1:]))
        splittable = (middles > knots[:-1]) & (middles < knots[1:])
        worst = np.argsort(-np.where(splittable, ratios, 0.0), kind="stable")
        worst = worst[(ratios[worst] > 1.0) & splittable[worst]][: largest - len(knots)]
        if len(worst) == 0:
            break
        knots = np.sort(np.concatenate([knots, middles[worst]]))
    if at.resolution:
        ratios = _errors(law.law, knots, at, _SPARE * tolerance, scale, 0.0)
    array = np.stack([knots, at.values, at.slopes])
    return Fitted(Table(*array), float(ratios.max()), array, at.rows)


def hermite(knots: Array, values: Array, slopes: Array, x: Array) -> Array:
    """Evaluate a cubic Hermite table in float64 for x within its range; shape of ``x``."""
    index = np.clip(np.searchsorted(knots, x, side="right") - 1, 0, len(knots) - 2)
    width = knots[index + 1] - knots[index]
    t = (x - knots[index]) / width
    rise = values[index + 1] - values[index]
    first, last = slopes[index] * width, slopes[index + 1] * width
    bend = t * (1.0 - t) * ((first - rise) * (1.0 - t) - (last - rise) * t)
    return np.asarray(values[index] + rise * t + bend)


class _Rounding:
    """How a number format rounds a table between two ends."""

    def __init__(self, number_format: NumberFormat, ends: Array) -> None:
        self.fixed = number_format == "int16"
        self._dtype = np.float64 if number_format == "float64" else np.float32
        self._row = Row16.spanning(*ends)

    def knots(self, x: Array) -> Array:
        """The format's numbers next to ``x``."""
        return self._row.rounded(x) if self.fixed else x.astype(self._dtype).astype(np.float64)

    def values(self, y: Array, *, down: bool = False) -> Array:
        """A row as the format has it; ``down``: none of it above what it was, to a rounding."""
        if self.fixed:
            return self.row_of(y).rounded(y, down=down)
        return y.astype(self._dtype).astype(np.float64)

    def row_of(self, y: Array) -> Row16:
        """How a row is stored in 16 bits."""
        return Row16.spanning(float(y.min()), float(y.max()))

    def rows(self, values: Row16, slopes: Row16) -> Rows | None:
        """How the rows of a table are stored, None where they are stored as they are."""
        return (self._row, values, slopes) if self.fixed else None


@dataclass(frozen=True)
class _AtKnots:
    """Values and slopes at the knots, as their format holds them, and the rows of 16 bits."""

    values: Array
    slopes: Array
    rows: Rows | None
    resolution: float


def _at_knots(law: TableLaw, knots: Array, rounding: _Rounding) -> _AtKnots:
    """Values and slopes at the knots, rounded; ``resolution`` is what more knots do not reduce."""
    with np.errstate(divide="ignore", over="ignore"):
        exact = np.asarray(law.law(knots), dtype=np.float64)
        finite = np.isfinite(exact.astype(np.float32))
        slopes = np.asarray(law.derivative(knots), dtype=np.float64)
    if not finite.all():
        place = knots[~finite][0]
        raise ValueError(f"the law is not finite in single precision at {place:g}")
    values = rounding.values(exact)
    if law.monotone:
        chords = np.diff(values) / np.diff(knots)
        if np.any(chords < 0):
            place = knots[:-1][chords < 0][0]
            raise ValueError(f"the law falls beyond {place:g}, but has to rise")
        steepest = _STEEPEST * np.minimum(
            np.concatenate([chords[:1], chords]), np.concatenate([chords, chords[-1:]])
        )
        slopes = np.clip(slopes, 0.0, steepest)
    if not np.isfinite(slopes.astype(np.float32)).all():
        place = knots[~np.isfinite(slopes)][0]
        raise ValueError(f"the law's derivative is not finite at {place:g}")
    value_row, slope_row = rounding.row_of(exact), rounding.row_of(slopes)
    resolution = 2.0 * value_row.scale if rounding.fixed else 0.0
    rows = rounding.rows(value_row, slope_row)
    return _AtKnots(values, rounding.values(slopes, down=law.monotone), rows, resolution)


def _errors(
    law: Function, knots: Array, at: _AtKnots, tolerance: float, scale: float, resolution: float
) -> Array:
    """Largest deviation in each interval as a share of what is allowed there."""
    x = knots[:-1, None] + np.diff(knots)[:, None] * _PROBES
    exact = np.asarray(law(x.ravel()))
    if not np.isfinite(exact).all():
        raise ValueError(f"the law is not finite at {x.ravel()[~np.isfinite(exact)][0]:g}")
    allowed = np.maximum(tolerance * np.maximum(np.abs(exact), FLOOR * scale), resolution)
    deviation = np.abs(hermite(knots, at.values, at.slopes, x.ravel()) - exact)
    ratios = np.where(deviation > 0, deviation / np.where(allowed > 0, allowed, 1e-300), 0.0)
    return np.asarray(ratios.reshape(x.shape).max(axis=1))
