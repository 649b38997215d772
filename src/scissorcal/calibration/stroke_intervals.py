"""Strokes of a log on one grid, intervals over them, and the plateau of their mean."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from scissorcal.aliases import Array
from scissorcal.recording.recording import Recording, StrokeKind

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
    plateaus = [plateau_of(drawn(), places) for _ in range(RESAMPLES)]
    ends = np.array(
        [(places[span[0]], places[span[1] - 1]) for span in plateaus if span is not None]
    )
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


BINS = 60
ENVELOPE = (0.1, 0.9)
EDGE = 0.05
"""Share of a stroke's travel at either end that is left out: there the joint speeds up or stops."""
SPEED_CLASS = 1.4
"""Speeds further apart than this factor are different classes."""


@dataclass(frozen=True)
class Curves:
    """The strokes of one direction: ``values`` (n, BINS) at the places of the grid.

    ``speeds`` (n,) [rad/s, or m/s], ``work`` (n,) is the integral over the grid's range.
    """

    kind: StrokeKind
    values: Array
    speeds: Array
    work: Array

    @property
    def mean(self) -> Array:
        return np.asarray(self.values.mean(axis=0))

    @property
    def envelope(self) -> tuple[Array, Array]:
        """The 10 % and 90 % quantiles over strokes, (BINS,) each."""
        low, high = np.quantile(self.values, ENVELOPE, axis=0)
        return low, high


@dataclass(frozen=True)
class SpeedClass:
    """Strokes of one direction and of about one speed, and their mean over the range."""

    kind: StrokeKind
    speed: float
    level: Interval


def stroke_curves(
    recording: Recording,
    values: Array,
    usable: NDArray[np.bool_],
    places: Array,
    kind: StrokeKind,
) -> tuple[Curves | None, int, int]:
    """The strokes of one direction over the grid; how many do not reach, how many have holes."""
    opening = np.asarray(recording.samples["opening"], dtype=np.float64)
    half = 0.5 * (places[1] - places[0])
    edges = np.append(places - half, places[-1] + half)
    rows, speeds, left_out, holed = [], [], 0, 0
    for stroke in recording.strokes:
        if stroke.kind != kind:
            continue
        own = usable & (recording.samples["stroke"] == stroke.index)
        curve = _binned(opening[own], values[own], edges)
        if isinstance(curve, str):
            left_out, holed = left_out + (curve == "short"), holed + (curve == "holed")
            continue
        rows.append(curve)
        speeds.append(stroke.speed)
    if not rows:
        return None, left_out, holed
    table = np.array(rows)
    work = table.mean(axis=1) * (edges[-1] - edges[0])
    return Curves(kind, table, np.array(speeds), work), left_out, holed


def _binned(opening: Array, values: Array, edges: Array) -> Array | Literal["short", "holed"]:
    """Mean in each bin, between neighbours where a bin is empty.

    "short" where the ends are empty, "holed" where so many bins in a row are that a plateau would
    fit in: a line drawn across would be taken for a measurement.
    """
    inside = (opening >= edges[0]) & (opening < edges[-1])
    index = np.clip(np.searchsorted(edges, opening[inside], side="right") - 1, 0, len(edges) - 2)
    counts = np.bincount(index, minlength=len(edges) - 1)
    seen = np.flatnonzero(counts)
    reach = max(1, round(EDGE * len(counts)))
    if len(seen) < 2 or seen[0] > reach or seen[-1] < len(counts) - 1 - reach:
        return "short"
    if np.diff(seen).max() > LEAST_PLATEAU * len(counts):
        return "holed"
    sums = np.bincount(index, values[inside], minlength=len(edges) - 1)
    return np.asarray(np.interp(np.arange(len(counts)), seen, sums[seen] / counts[seen]))


def speed_classes(curves: Curves) -> list[SpeedClass]:
    """Strokes grouped by speed, slow ones first."""
    order = np.argsort(curves.speeds)
    speeds, means = curves.speeds[order], curves.values.mean(axis=1)[order]
    first = [0]
    for index, speed in enumerate(speeds):
        if speed > SPEED_CLASS * speeds[first[-1]]:
            first.append(index)
    return [
        SpeedClass(curves.kind, float(np.median(own)), mean_interval(level))
        for own, level in zip(np.split(speeds, first[1:]), np.split(means, first[1:]), strict=True)
    ]


def negated(curves: Curves) -> Curves:
    return Curves(curves.kind, -curves.values, curves.speeds, -curves.work)
