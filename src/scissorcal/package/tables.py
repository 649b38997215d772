"""Compile a law, given as a function and its derivative, to a small cubic table in float32."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.kernel import Table

Array = NDArray[np.float64]
Function = Callable[[Array], Array]

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
    find: 1 or less where the tolerance was met.
    """

    table: Table
    error: float

    @property
    def met(self) -> bool:
        """Whether the table keeps its tolerance everywhere it was probed."""
        return self.error <= 1.0


def fit_table(
    law: Function,
    derivative: Function,
    low: float,
    high: float,
    *,
    tolerance: float,
    monotone: bool = False,
    scale: float | None = None,
    largest: int = LARGEST_TABLE,
) -> Fitted:
    """Place knots where the law needs them, until a cubic Hermite table follows it.

    The deviation allowed at x is ``tolerance`` times |law(x)|, or times 1 % of ``scale`` where that
    is more; the scale is the law's largest value, unless given. Every interval that deviates
    further is halved, the worst first once ``largest`` knots are near. Knots are float32 numbers
    and the law is evaluated exactly there, so rounding them costs nothing. With ``monotone`` the
    law must not fall, its slopes are limited so that neither does the table, and an infinite slope
    (a power below one, at 0) is replaced by the steepest one that stays monotone.

    Raises ValueError where the law is not finite, falls although ``monotone``, or the range is
    empty.

    >>> fitted = fit_table(np.sqrt, lambda x: 0.5 / np.sqrt(x), 0.01, 1.0, tolerance=1e-3)
    >>> fitted.met, len(fitted.table.x)
    (True, 9)
    """
    ends = np.array([low, high], dtype=np.float32).astype(np.float64)
    if not (np.isfinite(ends).all() and ends[0] < ends[1]):
        raise ValueError(f"a table needs low < high, both finite; got {low:g} and {high:g}")
    if scale is None:
        scale = float(np.max(np.abs(law(np.linspace(ends[0], ends[1], 257)))))
    knots = ends
    while True:
        values, slopes = _at_knots(law, derivative, knots, monotone)
        ratios = _error_ratios(law, knots, values, slopes, _SPARE * tolerance, scale)
        middles = (0.5 * (knots[:-1] + knots[1:])).astype(np.float32).astype(np.float64)
        splittable = (middles > knots[:-1]) & (middles < knots[1:])
        worst = np.argsort(-np.where(splittable, ratios, 0.0), kind="stable")
        worst = worst[(ratios[worst] > 1.0) & splittable[worst]][: largest - len(knots)]
        if len(worst) == 0:
            break
        knots = np.sort(np.concatenate([knots, middles[worst]]))
    x, y, slope = (array.astype(np.float32) for array in (knots, values, slopes))
    return Fitted(Table(x, y, slope), float(ratios.max()))


def hermite(knots: Array, values: Array, slopes: Array, x: Array) -> Array:
    """Evaluate a cubic Hermite table in float64 for x within its range; shape of ``x``."""
    index = np.clip(np.searchsorted(knots, x, side="right") - 1, 0, len(knots) - 2)
    width = knots[index + 1] - knots[index]
    t = (x - knots[index]) / width
    rise = values[index + 1] - values[index]
    first, last = slopes[index] * width, slopes[index + 1] * width
    bend = t * (1.0 - t) * ((first - rise) * (1.0 - t) - (last - rise) * t)
    return np.asarray(values[index] + rise * t + bend)


def _at_knots(
    law: Function, derivative: Function, knots: Array, monotone: bool
) -> tuple[Array, Array]:
    """Values and slopes at the knots, as float32 will hold them."""
    with np.errstate(divide="ignore", over="ignore"):
        values = np.asarray(law(knots), dtype=np.float32).astype(np.float64)
        slopes = np.asarray(derivative(knots), dtype=np.float64)
    if not np.isfinite(values).all():
        place = knots[~np.isfinite(values)][0]
        raise ValueError(f"the law is not finite in single precision at {place:g}")
    if monotone:
        chords = np.diff(values) / np.diff(knots)
        if np.any(chords < 0):
            place = knots[:-1][chords < 0][0]
            raise ValueError(f"the law falls beyond {place:g}, but has to rise")
        steepest = _STEEPEST * np.minimum(
            np.concatenate([chords[:1], chords]), np.concatenate([chords, chords[-1:]])
        )
        slopes = np.clip(slopes, 0.0, steepest)
    slopes = slopes.astype(np.float32).astype(np.float64)
    if not np.isfinite(slopes).all():
        place = knots[~np.isfinite(slopes)][0]
        raise ValueError(f"the law's derivative is not finite at {place:g}")
    return values, slopes


def _error_ratios(
    law: Function, knots: Array, values: Array, slopes: Array, tolerance: float, scale: float
) -> Array:
    """Largest deviation in each interval as a share of what is allowed there."""
    x = knots[:-1, None] + np.diff(knots)[:, None] * _PROBES
    exact = np.asarray(law(x.ravel()))
    if not np.isfinite(exact).all():
        raise ValueError(f"the law is not finite at {x.ravel()[~np.isfinite(exact)][0]:g}")
    allowed = tolerance * np.maximum(np.abs(exact), FLOOR * scale)
    deviation = np.abs(hermite(knots, values, slopes, x.ravel()) - exact)
    ratios = np.where(deviation > 0, deviation / np.where(allowed > 0, allowed, 1e-300), 0.0)
    return np.asarray(ratios.reshape(x.shape).max(axis=1))
