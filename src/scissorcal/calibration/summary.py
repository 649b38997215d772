"""What force or torque over an angle tells by itself: curves by direction, work, plateau, slope.

Nothing here is a model of a cut. A stroke is the unit of every interval: samples within one share
its friction, its sheet and its hand.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.calibration.signals.sensors import channels_of
from scissorcal.calibration.stroke_intervals import (
    BINS,
    EDGE,
    FEWEST,
    LEAST_PLATEAU,
    Curves,
    Interval,
    Plateau,
    SpeedClass,
    difference_interval,
    drawn_strokes,
    find_plateau,
    mean_interval,
    negated,
    speed_classes,
    stroke_curves,
    trend_interval,
)
from scissorcal.errors import InputError
from scissorcal.recording.recording import Recording

Effort = Literal["motor_torque", "handle_force"]

FULL_TURN_RAD = 2.0 * np.pi
SIGN_LEVEL = 0.998
"""Of the interval that decides a sign: chance changes a right one in 1 of 1,000 logs."""


@dataclass(frozen=True)
class LogSummary:
    """One log on the grid ``places`` (BINS,). Resistance is positive while closing is resisted.

    ``left_out`` strokes do not reach over the range, ``holed`` ones reach and have a hole as wide
    as the least plateau. ``turned`` says that the sign was changed: ``sign`` is closing minus
    opening (closing, where nothing opens) as recorded, with an interval of ``SIGN_LEVEL``, and
    ``signed`` whether some log of the channel determines it. ``share`` is that of the range
    in the median travel of the closing strokes. ``drift`` is the change of a closing stroke's mean
    from one to the next, None with fewer than three.
    """

    source: str
    places: Array
    closing: Curves
    opening: Curves | None
    speeds: tuple[SpeedClass, ...]
    mean: Interval
    work: Interval
    drift: Interval | None
    share: float
    left_out: int
    holed: int
    turned: bool
    sign: Interval
    signed: bool


@dataclass(frozen=True)
class Difference:
    """One log minus another: the mean curves with a pointwise interval (BINS,), and their means.

    ``work`` is that of a closing stroke over the range, ``slope`` the change of the difference
    along the range, ``excludes_zero`` whether the interval of ``mean`` leaves out 0.
    """

    curve: Array
    low: Array | None
    high: Array | None
    mean: Interval
    work: Interval
    slope: Interval
    plateau: Plateau | None

    @property
    def excludes_zero(self) -> bool | None:
        if self.mean.low is None or self.mean.high is None:
            return None
        return not self.mean.low <= 0.0 <= self.mean.high


def common_places(recordings: Sequence[Recording]) -> Array:
    """The grid that most strokes of all recordings reach over: centres of BINS bins.

    Raises InputError where a recording has no closing stroke, or the ranges have no common part.
    """
    ends = [_range_of(recording) for recording in recordings]
    low, high = max(a for a, _ in ends), min(b for _, b in ends)
    if high - low < 0.1 * min(b - a for a, b in ends):
        listed = "; ".join(
            f"{recording.source}: {a:.3g} to {b:.3g} {recording.joint.position_unit}"
            for recording, (a, b) in zip(recordings, ends, strict=True)
        )
        raise InputError(
            f"The logs have no common range of opening ({listed}): compare strokes over the same "
            "range, and check units and zero of the angle."
        )
    edges = np.linspace(low, high, BINS + 1)
    return np.asarray(0.5 * (edges[1:] + edges[:-1]))


def summarise(logs: Sequence[tuple[Recording, Effort]], places: Array) -> tuple[LogSummary, ...]:
    """Sum up recordings on the grid ``places``, of :func:`common_places`.

    Each comes with its channel: ``motor_torque``, or ``handle_force`` as a force, or as a torque
    where the recording has a handle radius. One sign holds for all logs of a channel. It is taken
    from closing minus opening, which friction and cutting make positive whatever the sensor's zero;
    from the closing strokes where nothing opens. It is changed only where an interval of
    ``SIGN_LEVEL`` lies below 0 in some log and above 0 in none; else it stays as recorded. Marks of
    overflow are left out. Raises InputError where a channel is constant or too few strokes reach
    over the range.
    """
    measured = [_Strokes.of(recording, effort, places) for recording, effort in logs]
    signs = {
        effort: {
            part.sign.sign for part, log in zip(measured, logs, strict=True) if log[1] == effort
        }
        for _, effort in logs
    }
    return tuple(
        _summary(recording, strokes, places, signs[effort] - {0})
        for strokes, (recording, effort) in zip(measured, logs, strict=True)
    )


def difference(one: LogSummary, other: LogSummary, rng: np.random.Generator) -> Difference:
    """Closing strokes of ``one`` minus those of ``other``, on one grid (Welch's t-intervals).

    ``rng`` draws strokes, for the ends of the plateau.
    """
    places, (a, b) = one.places, (one.closing.values, other.closing.values)
    low = high = None
    if min(len(a), len(b)) >= FEWEST:
        each = [difference_interval(x, y) for x, y in zip(a.T, b.T, strict=True)]
        low = np.array([entry.low for entry in each], dtype=np.float64)
        high = np.array([entry.high for entry in each], dtype=np.float64)
    curve = a.mean(axis=0) - b.mean(axis=0)

    def level(chosen: slice) -> Interval:
        return difference_interval(a[:, chosen].mean(axis=1), b[:, chosen].mean(axis=1))

    def drawn() -> Array:
        return np.asarray(drawn_strokes(a, rng).mean(axis=0) - drawn_strokes(b, rng).mean(axis=0))

    few = min(len(a), len(b)) < FEWEST
    plateau = find_plateau(curve, places, level, None if few else drawn)
    return Difference(
        curve,
        low,
        high,
        mean=difference_interval(a.mean(axis=1), b.mean(axis=1)),
        work=difference_interval(one.closing.work, other.closing.work),
        slope=difference_interval(_slopes(a, places), _slopes(b, places)),
        plateau=plateau,
    )


def plateau_in(found: LogSummary, rng: np.random.Generator) -> Plateau | None:
    """The plateau of the closing strokes of one log; None where their mean has none.

    ``rng`` draws strokes, for the ends of the plateau.
    """
    values = found.closing.values

    def level(chosen: slice) -> Interval:
        return mean_interval(values[:, chosen].mean(axis=1))

    def drawn() -> Array:
        return np.asarray(drawn_strokes(values, rng).mean(axis=0))

    few = len(values) < FEWEST
    return find_plateau(found.closing.mean, found.places, level, None if few else drawn)


def slope_in(found: LogSummary) -> Interval:
    """Change of the closing resistance along the range, per rad (or m): local sharpness."""
    return mean_interval(_slopes(found.closing.values, found.places))


def friction_of(blank: LogSummary) -> Interval | None:
    """Half the difference of closing and opening without material; None without openings.

    Weight, springs and the sensor's zero are alike in both directions and drop out.
    """
    if blank.opening is None:
        return None
    closing, opening = blank.closing.values.mean(axis=1), blank.opening.values.mean(axis=1)
    return difference_interval(0.5 * closing, 0.5 * opening)


def _effort_of(recording: Recording, effort: Effort) -> Array:
    """The channel (N,): of a rotary joint, a force becomes a torque where its lever is known."""
    values = np.asarray(recording.samples[effort], dtype=np.float64)
    return values * recording.handle_radius_m if _has_lever(recording, effort) else values


def effort_unit(recording: Recording, effort: Effort) -> str:
    """Unit of :func:`_effort_of`."""
    if effort == "handle_force" and not _has_lever(recording, effort):
        return "N"
    return recording.joint.effort_unit


def _has_lever(recording: Recording, effort: Effort) -> bool:
    turns = recording.joint.kind == "rotary"
    return effort == "handle_force" and turns and bool(np.isfinite(recording.handle_radius_m))


@dataclass(frozen=True)
class _Strokes:
    """The strokes of a log that reach over the grid, as they were measured."""

    closing: Curves
    opening: Curves | None
    left_out: int
    holed: int
    travel: float

    @property
    def sign(self) -> Interval:
        """Closing minus opening as recorded, or closing alone, with an interval of SIGN_LEVEL."""
        closing = self.closing.values.mean(axis=1)
        if self.opening is None:
            return mean_interval(closing, SIGN_LEVEL)
        return difference_interval(closing, self.opening.values.mean(axis=1), SIGN_LEVEL)

    @classmethod
    def of(cls, recording: Recording, effort: Effort, places: Array) -> "_Strokes":
        values = _effort_of(recording, effort)
        if float(np.ptp(values)) == 0.0:
            raise InputError(
                f"{recording.source}: {effort} is constant at {values[0]:.4g}: name its column, or "
                "check the sensor."
            )
        (channel,) = channels_of(recording, (effort,))
        usable = ~np.isin(recording.samples[effort], channel.marks)
        closing, left_out, holed = stroke_curves(recording, values, usable, places, "closing")
        opening, *others = stroke_curves(recording, values, usable, places, "opening")
        if closing is None and holed:
            raise InputError(
                f"{recording.source}: every closing stroke has a hole of {LEAST_PLATEAU:.0%} of "
                "the range or more, in which nothing was measured: log at a higher rate, or "
                f"without losing samples. {_counted(recording, usable, left_out, holed)}"
            )
        if closing is None:
            raise InputError(
                f"{recording.source}: no closing stroke reaches over the range from "
                f"{places[0]:.3g} to {places[-1]:.3g} {recording.joint.position_unit}: give a "
                "smaller --min-travel, or another log. "
                f"{_counted(recording, usable, left_out, holed)}"
            )
        low, high = _ends_of(recording)
        left_out, holed = left_out + others[0], holed + others[1]
        return cls(closing, opening, left_out, holed, high - low)


def _counted(recording: Recording, usable: NDArray[np.bool_], left_out: int, holed: int) -> str:
    """What each filter left of a log of which no closing stroke remains."""
    closing = sum(stroke.kind == "closing" for stroke in recording.strokes)
    return (
        f"Of {len(usable)} samples recorded, {np.count_nonzero(usable)} are sound; of "
        f"{len(recording.strokes)} strokes, {closing} are closing; of these, {left_out} do not "
        f"reach over the range, {holed} have a hole, and none is used."
    )


def _summary(recording: Recording, strokes: _Strokes, places: Array, signs: set[int]) -> LogSummary:
    """One log; ``signs`` are those that logs of its channel determine."""
    closing, opening, turned = strokes.closing, strokes.opening, signs == {-1}
    if turned:
        closing = negated(closing)
        opening = None if opening is None else negated(opening)
    ways = (closing, *((opening,) if opening else ()))
    width = float(places[-1] - places[0]) * len(places) / (len(places) - 1)
    return LogSummary(
        source=recording.source,
        places=places,
        closing=closing,
        opening=opening,
        speeds=tuple(speed_class for curves in ways for speed_class in speed_classes(curves)),
        mean=mean_interval(closing.values.mean(axis=1)),
        work=mean_interval(closing.work),
        drift=trend_interval(closing.values.mean(axis=1)),
        share=width / strokes.travel,
        left_out=strokes.left_out,
        holed=strokes.holed,
        turned=turned,
        sign=strokes.sign,
        signed=len(signs) == 1,
    )


def _range_of(recording: Recording) -> tuple[float, float]:
    """The range of opening over which closing strokes are compared, without their ends."""
    low, high = _ends_of(recording)
    margin = EDGE * (high - low)
    return low + margin, high - margin


def _ends_of(recording: Recording) -> tuple[float, float]:
    """Where the median closing stroke ends, and where it begins."""
    opening = np.asarray(recording.samples["opening"], dtype=np.float64)
    unit = recording.joint.position_unit
    if unit == "rad" and np.ptp(opening) > FULL_TURN_RAD:
        raise InputError(
            f"{recording.source}: the opening covers {np.ptp(opening):.3g} rad, more than a full "
            "turn: if its column is in degrees, state it with -u opening=deg."
        )
    kinds = [stroke.index for stroke in recording.strokes if stroke.kind == "closing"]
    parts = [opening[recording.samples["stroke"] == index] for index in kinds]
    parts = [part for part in parts if len(part) > 2]
    if not parts:
        raise InputError(
            f"{recording.source} has no closing stroke: the angle falls while the tool closes; if "
            "it grows, give the scale -1 (-s opening=-1)."
        )
    low = float(np.median([part.min() for part in parts]))
    high = float(np.median([part.max() for part in parts]))
    return low, high


def _slopes(values: Array, places: Array) -> Array:
    """Least-squares slope of each row of values (n, BINS) over the places."""
    away = places - places.mean()
    return np.asarray(values @ away / (away @ away))
