"""Intervals over strokes, and the plateau of a log."""

from collections.abc import Callable
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


FLAT = 0.2
"""On a plateau the mean curve stays within this share of its mean, all in all."""
LEAST_PLATEAU = 0.15
"""A plateau is at least this share of the range."""
STEEP, WHOLE = 0.5, 0.8
"""It rises at most half as steeply as the whole range, or is nearly the whole itself."""
RESAMPLES = 100
"""Draws of the strokes over which a plateau's ends are stated: their 5 % and 95 % quantiles lie
within 0.2 sds of those of many more (sqrt(0.05 x 0.95 / 100) over the normal density there,
0.103)."""


@dataclass(frozen=True)
class Plateau:
    """Where the mean curve is level: from ``low`` to ``high`` [rad, or m], and how high.

    ``low_ends`` and ``high_ends`` are the 5 % and 95 % quantiles of the two ends over draws of the
    strokes with replacement (Efron 1979, doi:10.1214/aos/1176344552), ``share`` is that of the
    draws that have a plateau at all; None with fewer than three strokes.
    """

    low: float
    high: float
    level: Interval
    low_ends: tuple[float, float] | None = None
    high_ends: tuple[float, float] | None = None
    share: float | None = None

    @property
    def determined(self) -> bool:
        """Whether the strokes show that there is a plateau: 90 % of the draws have one."""
        return self.share is None or self.share >= LEVEL


def find_plateau(
    curve: Array,
    places: Array,
    level: Callable[[slice], Interval],
    drawn: Callable[[], Array] | None,
) -> Plateau | None:
    """The plateau of ``curve`` (BINS,), how high, and how its ends scatter over ``drawn`` ones."""
    place = plateau_of(curve, places)
    if place is None:
        return None
    first, last = float(places[place[0]]), float(places[place[1] - 1])
    height = level(slice(*place))
    if drawn is None:
        return Plateau(first, last, height)
    found = [plateau_of(drawn(), places) for _ in range(RESAMPLES)]
    ends = np.array([(places[one[0]], places[one[1] - 1]) for one in found if one is not None])
    if not len(ends):
        return Plateau(first, last, height, share=0.0)
    (low, high), (low_, high_) = np.quantile(ends, [0.05, 0.95], axis=0).T
    share = len(ends) / RESAMPLES
    spread = ((float(low), float(high)), (float(low_), float(high_)))
    return Plateau(first, last, height, *spread, share)


def drawn_strokes(values: Array, rng: np.random.Generator) -> Array:
    """As many strokes (n, BINS) as there are, drawn with replacement."""
    return np.asarray(values[rng.integers(len(values), size=len(values))])


def plateau_of(curve: Array, places: Array) -> tuple[int, int] | None:
    """First bin and the one past the last of the longest level part of ``curve`` (n,)."""
    best: tuple[int, int] | None = None
    least = max(2, round(LEAST_PLATEAU * len(places)))
    steepness = float(np.ptp(curve)) / len(curve)
    for first in range(len(curve)):
        low = high = total = curve[first]
        for after in range(first + 2, len(curve) + 1):
            value = curve[after - 1]
            low, high, total = min(low, value), max(high, value), total + value
            if high - low > FLAT * abs(total / (after - first)):
                break
            size = after - first
            # A steady rise is no plateau, however high it stands: it is as steep as the whole.
            level = size >= WHOLE * len(curve) or (high - low) / size < STEEP * steepness
            if size >= least and level and (best is None or size > best[1] - best[0]):
                best = (first, after)
    return best
