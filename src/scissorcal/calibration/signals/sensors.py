"""Sensor faults in a recording: quantisation, saturation, dead bands, constant channels."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from scissorcal.aliases import Array, Integers, Mask
from scissorcal.calibration.signals.segments import still_clock, stretches
from scissorcal.recording.faulty_values import marks_in
from scissorcal.recording.recording import Recording
from scissorcal.recording.strokes import resolution_of
from scissorcal.verdicts import Check, Verdict

Scope = Literal["fit.friction", "fit.cut"]

LONG_RUN_S = 0.005
FEWEST_IN_RUN = 4
"""Least duration and least samples of a run of equal values."""
FALSE_RUNS = 1e-3
"""Runs of equal values by chance that are expected in a recording, of the length that counts."""
EQUAL_HALF_STEPS = 0.55
"""Half a step, and a tenth more for what the noise's own estimate may be off."""
BLOCK = 50
"""Second differences whose mean square is one estimate of the noise: known to 20 %."""
FEWEST_INVALID_S = 0.02
NEAR_S = 0.05
"""The joint moves where its position changes more than twice within this time before and after."""
NOISY = 0.2
"""A channel has noise where neighbouring samples are equal less often; then values do not repeat by
chance."""
WIGGLES = 0.2
"""Least share of values at which noise turns (two of three for white noise)."""
REGULAR = 0.9
"""An oversampled sensor holds at least this share of its values equally long."""
UNUSUAL = 3.0
"""Without noise, a run at an end counts from this multiple of the usual length."""
BAND_STEPS = 4.0
FLAT = 3.0
"""Such a run is flat if it lasts longer than entering and leaving it, through the last few levels,
by this factor. A parabola's turn lasts 0.81 times as long, a fourth power's twice."""
LONGEST = 1.5
STANDS_OUT = 2.0
"""A flat run must last longer by these factors than any within the range, or all flat runs at an
end than the longer runs at any level within."""
WITHIN = 0.5
"""Least share of moving samples within the range, without which its ends are not judged."""
HANDLE_FORCE_SATURATED, ENCODER_FAULT = 32, 64
"""Flags of a device's state frame (docs/protocol.md)."""
SENSORS = Check(
    "fit sensors", "what was measured: share of samples that a sensor spoilt", at_most=0.05
)
"""Share of invalid samples above which a fit fails."""


@dataclass(frozen=True)
class Channel:
    """One sensor over one recording.

    ``step`` is its resolution (NaN: none to be seen), ``saturated`` and ``dead`` (m,) mark
    samples at an end of its range and within a dead band; ``low`` and ``high`` are those ends.
    ``marks`` are values in the place of a measurement (see
    :func:`~scissorcal.recording.faulty_values.marks_in`); their samples count as saturated.
    ``at_ends`` is the share of samples at ``low`` or ``high``, whether or not the sensor is cut off
    there.
    ``held`` are the first sample, and the one past the last, of the longest run of one value within
    the range that noise does not repeat so often, while the joint moves; None where there is none.
    """

    name: str
    constant: bool
    step: float
    saturated: Mask
    dead: Mask
    low: float
    high: float
    marks: tuple[float, ...] = ()
    at_ends: float = 0.0
    held: tuple[int, int] | None = None

    @property
    def mostly_at_ends(self) -> bool:
        """Whether the sensor tells more of its range than of what it measures."""
        return not self.constant and self.at_ends > WITHIN


@dataclass(frozen=True)
class Sensors:
    """All sensors of all recordings: usable samples, sentences, and a verdict."""

    usable: tuple[Mask, ...]
    notes: tuple[str, ...]
    verdict: Verdict


def inspect_sensors(recordings: tuple[Recording, ...], scope: Scope = "fit.friction") -> Sensors:
    """Find saturation and dead bands, and mark the invalid samples.

    Saturation is a stretch of equal values at a channel's largest or smallest one, a dead band
    such a stretch at zero while the joint moves. In a channel with noise, values do not
    repeat by chance. A channel without noise (quantised, or slow) repeats values: there a stretch
    at an end is saturation if it is flat, unlike a turn, and if no level within the range is held
    as long, unlike a plateau. Invalid samples are left out of the likelihood; where their share
    exceeds that of ``SENSORS`` the verdict, on the fit that ``scope`` names, fails.
    """
    usable, notes = [], []
    worst, named = 0.0, ""
    for recording in recordings:
        channels = channels_of(recording)
        invalid = _flagged(recording)
        source = recording.source or "the recording"
        for channel in channels:
            invalid |= channel.saturated | channel.dead
            notes += [f"{source}: {said}" for said in _sentences(channel, recording)]
            for share, what in (
                (float(channel.saturated.mean()), "is at the end of its range"),
                (float(channel.dead.mean()), "does not respond around zero"),
            ):
                if share > worst:
                    worst, named = share, f"{channel.name} of {source} {what}"
        usable.append(~invalid)
    return Sensors(tuple(usable), tuple(notes), _verdict(scope, worst, named))


def channels_of(recording: Recording, names: Sequence[str] | None = None) -> tuple[Channel, ...]:
    """Inspect channels by name; if none are given, those that a fit uses, the position first."""
    samples = recording.samples
    if names is None:
        force = ["handle_force"] if np.isfinite(recording.handle_radius_m) else []
        names = ["opening", "motor_torque", *force]
    opening = np.asarray(samples["opening"], dtype=np.float64)
    time = recording.device_time_s
    tick_s = float(np.median(np.diff(time))) if len(time) > 1 else 0.0
    if tick_s <= 0.0:
        raise still_clock(recording)
    moves = _moves(opening, max(1, round(NEAR_S / tick_s)))
    return tuple(
        _inspect(name, np.asarray(samples[name], dtype=np.float64), moves, tick_s) for name in names
    )


def _inspect(name: str, values: Array, moves: Mask, tick_s: float) -> Channel:
    low, high = float(values.min()), float(values.max())
    none = np.zeros(len(values), dtype=bool)
    constant, step = low == high, resolution_of(values)
    at_ends = float(np.mean((values == low) | (values == high)))
    if constant or name == "opening":
        return Channel(name, constant, step, none, none, low, high, at_ends=at_ends)
    marks = marks_in(values)
    if marks:
        marked = np.isin(values, marks)
        rest = _inspect(name, np.where(marked, values[~marked][0], values), moves, tick_s)
        return replace(rest, saturated=rest.saturated | marked, marks=marks, held=None)
    long_run = max(FEWEST_IN_RUN, round(LONG_RUN_S / tick_s))
    fewest = max(2 * FEWEST_IN_RUN, round(FEWEST_INVALID_S / tick_s))
    hold, alike = _repetition(values)
    dead, ends = none, tuple[float, ...]()
    held = _held_within(values, moves, step, fewest)
    if alike < NOISY:
        by_chance = _longest_by_chance(values[::hold], step)
        long_run = max(long_run, hold * max(FEWEST_IN_RUN, by_chance))
        ends = tuple(end for end in (low, high) if _long_runs(values == end, long_run) >= fewest)
        silent = (values == 0.0) & moves
        if low < 0.0 < high and _long_runs(silent, long_run) >= fewest:
            dead = silent
    else:
        ends = _held_ends(values, moves, step, long_run, fewest)
    cut = np.isin(values, ends)
    return Channel(name, constant, step, cut, dead, low, high, at_ends=at_ends, held=held)


def _held_within(values: Array, moves: Mask, step: float, fewest: int) -> tuple[int, int] | None:
    """The longest run of a value (m,) that is no end and not 0, where noise cannot have made it.

    It has ``fewest`` samples while the joint moves, and what lies outside it has noise that repeats
    a value ``UNUSUAL`` times less often.
    """
    first, after = _runs(values)
    moving = np.concatenate([[0], np.cumsum(moves)])
    count = moving[after] - moving[first]
    count[np.isin(values[first], (0.0, values.min(), values.max()))] = 0
    longest = int(np.argmax(count))
    run = int(first[longest]), int(after[longest])
    rest = np.delete(values, slice(*run))
    if count[longest] < fewest or len(rest) < BLOCK:
        return None
    hold, alike = _repetition(rest)
    by_chance = max(FEWEST_IN_RUN, _longest_by_chance(rest[::hold], step))
    return run if alike < NOISY and count[longest] >= UNUSUAL * hold * by_chance else None


def _longest_by_chance(values: Array, step: float) -> int:
    """Equal values in a row that noise alone does not give once in 1 / FALSE_RUNS recordings.

    A value of white noise (standard deviation sd) lies in the same step as the one before with at
    most p = 2 Phi(step / (2 sd)) - 1, so that n (1 - p) p^m runs of m are expected among n values
    (m,). The noise is that of the second differences, less the steps' own step^2 / 12.
    """
    change = np.diff(values, 2)
    if not math.isfinite(step) or len(change) < BLOCK:
        return 0
    whole = change[: len(change) // BLOCK * BLOCK].reshape(-1, BLOCK)
    spread = float(np.median(np.mean(whole**2, axis=1))) / 6.0
    sd = math.sqrt(max(spread - step**2 / 12.0, (EQUAL_HALF_STEPS * step / 5.0) ** 2))
    equal = math.erf(EQUAL_HALF_STEPS * step / (sd * math.sqrt(2.0)))
    if equal >= 1.0:
        return len(values)
    expected = len(values) * (1.0 - equal)
    return max(0, math.ceil(math.log(FALSE_RUNS / expected) / math.log(equal)))


def _repetition(values: Array) -> tuple[int, float]:
    """Samples that a channel (m,) holds each value for, and the share of values that repeat.

    A sensor that is read faster than it measures holds every value equally long; whether it has
    noise shows in the values that it measures, not in the samples. A channel that hardly ever turns
    has no noise, however fast it moves, and repeats all. The range's ends and zero do not count.
    """
    first, after = _runs(values)
    level, length = values[first], after - first
    inside = (level > values.min()) & (level < values.max()) & (level != 0.0)
    if not np.any(inside):
        return 1, 1.0
    ways = np.sign(np.diff(level))
    if np.mean(ways[1:] != ways[:-1]) < WIGGLES:
        return 1, 1.0
    hold = max(1, int(np.median(length[inside])))
    if np.mean(length[inside] % hold == 0) < REGULAR:
        hold = 1
    measured = np.round(length[inside] / hold)
    return hold, 1.0 - float(np.count_nonzero(inside) / measured.sum())


def _held_ends(
    values: Array, moves: Mask, step: float, long_run: int, fewest: int
) -> tuple[float, ...]:
    """Ends of the range at which a channel (m,) without noise looks cut off."""
    first, after = _runs(values)
    length, level = after - first, values[first]
    ends = (float(values.min()), float(values.max()))
    alive = np.concatenate([[0], np.cumsum(moves)])
    moving = alive[after] - alive[first]
    within = (level > ends[0]) & (level < ends[1]) & (moving > 0)
    if moving[within].sum() < max(WITHIN * moving.sum(), 1):
        return ()
    usual = float(np.quantile(length[within], 0.95))
    long = length >= max(long_run, UNUSUAL * usual)
    inner = within & (level != 0.0)
    longest = LONGEST * float(length[inner].max(initial=0))
    _, place = np.unique(level, return_inverse=True)
    most = STANDS_OUT * float(np.bincount(place, np.where(long & inner, moving, 0)).max())
    change = float(np.median(np.abs(np.diff(level[moving > 0]))))
    band = BAND_STEPS * max(change, step if np.isfinite(step) else 0.0)
    found = []
    for end in ends:
        near = _runs_around(np.abs(values - end) <= band, first)
        flat = length[long & (level == end) & (length > FLAT * (near - length))]
        if flat.sum() >= fewest and (flat.sum() > most or flat.max() > longest):
            found.append(end)
    return tuple(found)


def _runs(values: Array) -> tuple[Integers, Integers]:
    """First samples, and ones past the last, of the runs of equal values (m,)."""
    edges = np.flatnonzero(np.diff(values) != 0.0) + 1
    return np.concatenate([[0], edges]), np.concatenate([edges, [len(values)]])


def _runs_around(near: Mask, first: Integers) -> Integers:
    """Length of the stretch of ``near`` (m,) that each sample of ``first`` (k,) lies in, or 0."""
    low, high = stretches(near)
    if len(low) == 0:
        return np.zeros(len(first), dtype=np.int64)
    index = np.maximum(np.searchsorted(low, first, side="right") - 1, 0)
    return np.where((first >= low[index]) & (first < high[index]), high[index] - low[index], 0)


def _long_runs(held: Mask, long_run: int) -> int:
    """Samples in the runs of ``held`` (m,) that are too long for chance."""
    low, high = stretches(held)
    lengths = high - low
    return int(lengths[lengths >= long_run].sum())


def _moves(opening: Array, reach: int) -> Mask:
    """Samples (m,) near which the position changes."""
    changed = np.concatenate([[0], np.cumsum(np.diff(opening, prepend=opening[:1]) != 0)])
    index = np.arange(len(opening))
    ahead = changed[np.minimum(index + reach, len(opening))]
    return np.asarray(ahead - changed[np.maximum(index - reach, 0)] > 2)


def _flagged(recording: Recording) -> Mask:
    """Samples that the device flags as not measured."""
    flags = np.asarray(recording.samples["flags"], dtype=np.int64)
    wrong = ENCODER_FAULT
    if np.isfinite(recording.handle_radius_m):
        wrong |= HANDLE_FORCE_SATURATED
    return np.asarray((flags & wrong) != 0)


def mark_sentence(channel: Channel, count: int, unit: str) -> str:
    """That samples hold a mark in the place of a measurement."""
    listed = " or ".join(f"{value:.9g}" for value in channel.marks)
    samples = "1 sample" if count == 1 else f"{count} samples"
    return (
        f"{channel.name} is exactly {listed} {unit} in {samples}, where nothing leads from or to "
        "the other values: a mark of overflow or loss, which is left out."
    )


def held_sentence(channel: Channel, recording: Recording, unit: str) -> str:
    """That a noisy channel stands still; empty where it does not."""
    if channel.held is None:
        return ""
    first, after = channel.held
    time = recording.device_time_s
    return (
        f"{channel.name} is exactly {recording.samples[channel.name][first]:.6g} {unit} from "
        f"{time[first]:.6g} to {time[after - 1]:.6g} s ({after - first} samples) while the joint "
        "moves; its noise does not repeat a value so often. If the sensor or its link stood still, "
        "what happened then was not measured: remove those rows."
    )


def ends_sentence(channel: Channel, unit: str) -> str:
    """That most samples stand at an end of the range."""
    return (
        f"{channel.name} is {channel.low:.6g} or {channel.high:.6g} {unit}, its least and its "
        f"largest value, in {channel.at_ends:.1%} of the samples. If it is cut off there, what "
        "lies beyond was not measured: check the sensor's range."
    )


def _sentences(channel: Channel, recording: Recording) -> list[str]:
    joint = recording.joint
    unit = {"opening": joint.position_unit, "motor_torque": joint.effort_unit}.get(
        channel.name, "N"
    )
    said = []
    if channel.constant:
        said.append(f"{channel.name} is constant at {channel.low:.6g} {unit}.")
    elif np.isfinite(channel.step):
        said.append(f"{channel.name} has a resolution of {channel.step:.3g} {unit}.")
    if channel.marks:
        count = int(np.isin(recording.samples[channel.name], channel.marks).sum())
        said.append(mark_sentence(channel, count, unit))
    if channel.saturated.any() and not channel.marks:
        said.append(
            f"{channel.name} is at an end of its range ({channel.low:.3g} to {channel.high:.3g} "
            f"{unit}) in {channel.saturated.mean():.2%} of the samples, which are left out."
        )
    if channel.dead.any():
        said.append(
            f"{channel.name} is exactly 0 in {channel.dead.mean():.2%} of the samples although "
            "the joint moves: a dead band. They are left out."
        )
    return said


def _verdict(scope: Scope, worst: float, named: str) -> Verdict:
    if worst == 0.0:
        why = "No sensor saturated, and none has a dead band around zero."
        return SENSORS.judge(0.0, why).of(scope)
    limit = SENSORS.threshold
    why = f"{named} in {worst:.1%} of the samples (limit {limit:.0%}); they are left out."
    remedy = " Record again with a sensor of larger range, or slower and with gentler turns."
    return SENSORS.judge(worst, why, why + remedy).of(scope)
