"""Find strokes in a motion, between turning points: for imports and captures by hand."""

import itertools
import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scissorcal.aliases import Array
from scissorcal.recording.header import Joint, Stroke, StrokeKind

STEADY_STEP, NEAR_WHOLE, SAME = 0.9, 0.05, 1e-9

TRAVEL_SHARE = 0.05
LEAST_TRAVEL = {"rotary": 5e-3, "linear": 5e-4}
"""Least travel of a stroke: 5 % of the range, and 5 mrad or 0.5 mm."""
STEPS_OF_STROKE = 3.0
"""A resting encoder moves between two neighbouring values; with noise of a step, between three."""
NOISE_OF_STROKE = 10.0
"""Of 10^6 samples of white normal noise, the largest and the smallest lie 9.8 sd apart (mean)."""
MOST_NOISE_SHARE = 0.25
"""Of the range: what is taken for noise never makes a stroke of a larger share no stroke."""
ORDERS = range(2, 9)
"""Differences from which noise is told: a motion of x rad a sample leaves (2 sin(x/2))^k of it."""

GAP_FACTOR = 1.5
"""A step longer than this many usual ones is a gap: a sample is missing."""
EDGE_S = 0.05
"""Time left out at both ends of a piece, where a zero-phase filter sees no neighbours; gaps up to
this length are bridged."""
EDGES = 4
"""Least length of a piece in edges, so that at least half of it can be used."""
FEWEST_SAMPLES = 20
"""Samples that a piece must exceed for a 4th-order filter and a window of one knot to fit in."""


class StrokeThreshold(NamedTuple):
    """Least travel of a stroke [rad, or m], and in words what decided it."""

    travel: float
    reason: str


def stroke_threshold(position: Array, joint: Joint) -> StrokeThreshold:
    """Choose the least travel that noise and steps of the sensor ``position`` (m,) cannot make.

    >>> angle = np.round(np.cos(np.arange(0.0, 30.0, 0.01)) / 0.1) * 0.1
    >>> stroke_threshold(angle, Joint())
    StrokeThreshold(travel=0.3, reason='3 steps of the sensor')
    """
    step, noise = resolution_of(position), noise_of(position)
    choices = {
        f"{TRAVEL_SHARE:.0%} of the range": TRAVEL_SHARE * float(np.ptp(position)),
        f"the least for a {joint.kind} joint": LEAST_TRAVEL[joint.kind],
        f"{STEPS_OF_STROKE:.0f} steps of the sensor": STEPS_OF_STROKE * step,
        f"{NOISE_OF_STROKE:.0f} standard deviations of its noise": min(
            NOISE_OF_STROKE * noise, MOST_NOISE_SHARE * float(np.ptp(position))
        ),
    }
    known = {reason: travel for reason, travel in choices.items() if np.isfinite(travel)}
    reason = max(known, key=lambda name: known[name])
    return StrokeThreshold(float(f"{known[reason]:.6g}"), reason)


def resolution_of(values: Array) -> float:
    """Step of a quantised channel (m,), NaN where its values are not multiples of one.

    >>> f"{resolution_of(np.round(np.sin(np.arange(1000.0)) / 0.01) * 0.01):.6f}"
    '0.010000'
    """
    levels = np.unique(values)
    apart = np.diff(levels)
    apart = apart[apart > SAME * np.ptp(values)]
    if len(apart) < 2:
        return float("nan")
    least = float(apart.min())
    step = float(apart.sum() / np.round(apart / least).sum())
    away = np.abs(apart / step - np.round(apart / step))
    return step if np.mean(away < NEAR_WHOLE) > STEADY_STEP else float("nan")


def noise_of(values: Array) -> float:
    """Standard deviation of white noise on a smooth signal (m,), from its differences.

    Those of order k of white noise have (2k)! / k!^2 times its variance, those of a smooth motion
    vanish, the sooner the higher k is: the least of several orders counts, which a log of few
    samples a stroke needs. The median is not moved by turns. NaN for less than three values.

    >>> rng = np.random.default_rng(0)
    >>> round(noise_of(np.sin(np.arange(0, 9, 1e-3)) + rng.normal(0, 0.02, 9000)), 3)
    0.02
    """
    if len(values) < 3:
        return float("nan")
    orders = [order for order in ORDERS if order < len(values)]
    return min(_noise_from(values, order) for order in orders)


def _noise_from(values: Array, order: int) -> float:
    # 0.6745: the median of |x| for a standard normal x.
    spread = float(np.median(np.abs(np.diff(values, order)))) / 0.6745
    return spread / math.sqrt(math.comb(2 * order, order))


def edge_samples(rate_Hz: float) -> int:
    """Samples that ``EDGE_S`` lasts at a sampling rate, one at least.

    >>> edge_samples(1000.0), edge_samples(200.0)
    (50, 10)
    """
    return max(1, round(EDGE_S * rate_Hz))


def is_short(step: Array, usual: float) -> NDArray[np.bool_]:
    """Which steps (n,) of a clock miss no more samples than an edge has: such gaps are bridged."""
    return np.asarray(np.rint(step / usual) - 1 <= edge_samples(1.0 / usual))


def long_enough(samples: int, usual: float) -> bool:
    """Whether a stretch of so many samples is long enough for a rate."""
    return samples > max(EDGES * edge_samples(1.0 / usual), FEWEST_SAMPLES)


REST_SHARE = 0.02
"""Share of ``min_travel`` within which the joint counts as still resting at a turning point."""

REST_KEPT_S = 0.05
"""Rest that stays with a stroke at either end, so that no acceleration phase is cut off."""


class StrokeLabels(NamedTuple):
    """Strokes of a motion and, for each sample, the stroke it belongs to (-1: none), shape (N,)."""

    strokes: tuple[Stroke, ...]
    stroke_of_sample: NDArray[np.int32]


def label_strokes(
    opening: ArrayLike, time: ArrayLike, min_travel: float, *, sheet: ArrayLike = -1
) -> StrokeLabels:
    """Divide a motion into strokes at its turning points.

    A turning point is an extreme from which the opening returns by at least ``min_travel``, so
    noise and encoder steps smaller than that never split a stroke. Each leg between two turning
    points is a stroke: ``closing`` where the opening falls, ``opening`` where it grows. Rest at a
    turning point belongs to no stroke, except for the 0.05 s next to the motion. ``speed`` is
    that over the middle 80 % of the travel.

    ``opening`` [rad or m] and ``time`` [s], shape (N,), finite, time not falling; ``min_travel``
    in the unit of ``opening``; ``sheet``: a number, or one for each sample (the stroke takes
    that of its first sample). ValueError if shapes disagree or ``min_travel`` is not positive.

    >>> time = np.arange(0.0, 4.0, 0.01)
    >>> labels = label_strokes(np.cos(np.pi * time / 2), time, min_travel=0.1)
    >>> [(stroke.kind, round(stroke.speed, 2)) for stroke in labels.strokes]
    [('closing', 1.35), ('opening', 1.35)]
    """
    position = np.asarray(opening, dtype=np.float64)
    seconds = np.asarray(time, dtype=np.float64)
    if position.ndim != 1 or position.shape != seconds.shape:
        raise ValueError(f"opening has shape {position.shape} and time {seconds.shape}")
    if not min_travel > 0 or not math.isfinite(min_travel):
        raise ValueError(f"min_travel must be positive, not {min_travel}")
    sheets = np.broadcast_to(np.asarray(sheet, dtype=np.int64), position.shape)

    stroke_of_sample = np.full(position.shape, -1, dtype=np.int32)
    strokes: list[Stroke] = []
    finder = TurningPoints(min_travel)
    finder.feed(position)
    turns = finder.so_far
    for start, end in itertools.pairwise(turns):
        first, last = _without_rest(position, seconds, start, end, REST_SHARE * min_travel)
        stroke_of_sample[first : last + 1] = len(strokes)
        kind: StrokeKind = "closing" if position[end] < position[start] else "opening"
        speed = _speed(position, seconds, start, end)
        strokes.append(Stroke(len(strokes), kind, speed, int(sheets[first])))
    return StrokeLabels(tuple(strokes), stroke_of_sample)


class TurningPoints:
    """Finds the turning points of a motion that arrives in pieces.

    A turning point is an extreme from which the motion returns by at least ``min_travel``. The
    pieces' sizes make no difference, the time for a piece does not depend on what came before,
    and memory grows by a number for each turning point, not for each sample.

    >>> points = TurningPoints(0.1)
    >>> points.feed([1.0, 0.5, 0.2, 0.21])
    >>> points.feed([0.9, 1.0])
    >>> points.so_far, points.closings, points.openings
    ([0, 2, 5], 1, 1)
    """

    def __init__(self, min_travel: float) -> None:
        self._min_travel = min_travel
        self._count = 0
        self._turns: list[int] = []
        self._direction = 0
        self._low = self._high = self._extreme = (0, 0.0)

    @property
    def so_far(self) -> list[int]:
        """Indices of the first extreme, every turning point, and the last extreme so far."""
        return [*self._turns, self._extreme[0]] if self._direction else []

    @property
    def closings(self) -> int:
        """Legs of a falling opening so far: as many closing strokes has `label_strokes`."""
        return (len(self._turns) + (self._direction < 0)) // 2

    @property
    def openings(self) -> int:
        """Legs of a growing opening so far."""
        return (len(self._turns) + (self._direction > 0)) // 2

    def feed(self, values: ArrayLike) -> None:
        """Take the next values (n,), in order; all finite."""
        numbers = np.asarray(values, dtype=np.float64).tolist()
        if not self._count and numbers:
            self._low = self._high = (0, numbers[0])
        first = self._count
        self._count += len(numbers)
        if not self._direction:
            first = self._find_direction(numbers, first)
        self._follow(numbers[first - self._count + len(numbers) :], first)

    def _find_direction(self, values: list[float], first: int) -> int:
        """Take values until they span ``min_travel``; return the index of the next one."""
        low, high = self._low, self._high
        for index, value in enumerate(values, first):
            low = (index, value) if value < low[1] else low
            high = (index, value) if value > high[1] else high
            if high[1] - low[1] >= self._min_travel:
                self._direction = 1 if high[0] > low[0] else -1
                self._turns.append(min(low[0], high[0]))
                self._extreme = (index, value)
                first = index + 1
                break
        else:
            first += len(values)
        self._low, self._high = low, high
        return first

    def _follow(self, values: list[float], first: int) -> None:
        direction, (extreme, reached) = self._direction, self._extreme
        for index, value in enumerate(values, first):
            if (value - reached) * direction > 0:
                extreme, reached = index, value
            elif (reached - value) * direction >= self._min_travel:
                self._turns.append(extreme)
                direction, extreme, reached = -direction, index, value
        self._direction, self._extreme = direction, (extreme, reached)


def _without_rest(
    position: NDArray[np.float64], time: NDArray[np.float64], start: int, end: int, rest: float
) -> tuple[int, int]:
    """Narrow a leg to where it moves, plus REST_KEPT_S of the rest at either end."""
    leg = position[start : end + 1]
    leaves = start + int(np.flatnonzero(np.abs(leg - leg[0]) <= rest)[-1])
    arrives = start + int(np.flatnonzero(np.abs(leg - leg[-1]) <= rest)[0])
    first = int(np.searchsorted(time, time[leaves] - REST_KEPT_S, side="left"))
    last = int(np.searchsorted(time, time[arrives] + REST_KEPT_S, side="right")) - 1
    return max(start, first), min(end, last)


def _speed(position: NDArray[np.float64], time: NDArray[np.float64], start: int, end: int) -> float:
    share = (position[start : end + 1] - position[start]) / (position[end] - position[start])
    first = start + int(np.argmax(share >= 0.1))
    last = start + int(np.argmax(share >= 0.9))
    duration = float(time[last] - time[first])
    if duration <= 0:
        return math.nan
    return abs(float(position[last] - position[first])) / duration
