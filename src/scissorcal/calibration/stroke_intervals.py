"""Intervals of a mean, a difference and a trend over strokes, each stroke one value."""

from dataclasses import dataclass

import numpy as np
from scipy import stats

from scissorcal.aliases import Array

LEVEL = 0.90
FEWEST = 3
"""Strokes without which no interval is given."""


@dataclass(frozen=True)
class Interval:
    """A mean over strokes with its interval, of 90 % (None: fewer than three strokes)."""

    value: float
    low: float | None
    high: float | None
    strokes: int

    @property
    def sign(self) -> int:
        """1 or -1 where the whole interval has that sign, else 0."""
        if self.low is None or self.high is None:
            return 0
        return int(self.low > 0.0) - int(self.high < 0.0)


def mean_interval(values: Array, level: float = LEVEL) -> Interval:
    """Mean of values (n,), one a stroke, with Student's interval."""
    count, mean = len(values), float(np.mean(values))
    if count < FEWEST:
        return Interval(mean, None, None, count)
    reach = _t(count - 1, level) * float(np.std(values, ddof=1)) / np.sqrt(count)
    return Interval(mean, mean - reach, mean + reach, count)


def difference_interval(one: Array, other: Array, level: float = LEVEL) -> Interval:
    """Difference of two means with Welch's interval (doi:10.1093/biomet/34.1-2.28)."""
    value, count = float(np.mean(one) - np.mean(other)), min(len(one), len(other))
    if count < FEWEST:
        return Interval(value, None, None, count)
    a, b = np.var(one, ddof=1) / len(one), np.var(other, ddof=1) / len(other)
    if a + b == 0.0:
        return Interval(value, value, value, count)
    freedom = (a + b) ** 2 / (a**2 / (len(one) - 1) + b**2 / (len(other) - 1))
    reach = _t(float(freedom), level) * float(np.sqrt(a + b))
    return Interval(value, value - reach, value + reach, count)


def trend_interval(values: Array) -> Interval | None:
    """Slope of values (n,) over their number, with the 90 % interval of least squares."""
    count = len(values)
    if count < FEWEST:
        return None
    fitted = stats.linregress(np.arange(count), values)
    reach = _t(count - 2) * float(fitted.stderr)
    slope = float(fitted.slope)
    return Interval(slope, slope - reach, slope + reach, count)


def _t(freedom: float, level: float = LEVEL) -> float:
    return float(stats.t.ppf(0.5 + 0.5 * level, freedom))
