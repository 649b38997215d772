"""Divisions of a recording: pieces without gaps, short gaps bridged, sheets, runs of samples."""

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from scissorcal.aliases import Array, Integers, Mask
from scissorcal.errors import InputError
from scissorcal.recording.recording import Recording
from scissorcal.recording.strokes import (
    EDGE_S,
    EDGES,
    FEWEST_SAMPLES,
    GAP_FACTOR,
    edge_samples,
    is_short,
    long_enough,
)

_STRAIGHT = ("motor_torque", "handle_force", "advance", "torque_command", "force_command")


@dataclass(frozen=True)
class Bridged:
    """A recording whose short gaps hold made-up samples; arrays (m,) over its samples.

    ``usable`` is false for those and for samples that a sensor invalidated. ``source`` is the
    place of each sample in the recording as it was, for a made-up one that of the sample before.
    ``pieces`` are those of :func:`~.segments.pieces_of`, between the gaps that stay.
    """

    recording: Recording
    usable: Mask
    source: Integers
    pieces: list[tuple[int, int]]

    @property
    def recorded(self) -> Mask:
        """Which samples were recorded, (m,)."""
        return np.diff(self.source, prepend=-1) > 0


def pieces_of(recording: Recording, tick_s: float | None = None) -> list[tuple[int, int]]:
    """Stretches without a gap that are long enough for a rate, as (first, one past the last).

    Long enough is longer than four times ``EDGE_S``, and more than ``FEWEST_SAMPLES`` samples,
    whatever the sampling rate. ``tick_s`` is the usual step of the clock, the median if not given.
    Raises InputError where the device's clock stands still.
    """
    time = recording.device_time_s
    if len(time) < 2:
        return []
    step = np.diff(time)
    usual = usual_tick(recording) if tick_s is None else tick_s
    breaks = np.flatnonzero((step > GAP_FACTOR * usual) | (step <= 0)) + 1
    bounds = [0, *breaks.tolist(), len(time)]
    return [(low, high) for low, high in pairwise(bounds) if long_enough(high - low, usual)]


def bridge(recording: Recording, usable: Mask) -> Bridged:
    """Fill gaps of at most 0.05 s (``EDGE_S``), or of one sample where samples are farther apart.

    The zero-phase filter looks about so far, which is what an end of a piece costs. With a gap
    filled, the filter sees its neighbours on either side, and only windows that touch the gap are
    lost. The opening follows the cubic that has the places and the rates of both ends, so that the
    filtered rate beside the gap stays right; the other channels follow the line. ``usable`` (m,)
    comes back with made-up samples as False. Longer gaps stay, and part the recording. Raises
    InputError where the clock stands still.
    """
    time = recording.device_time_s
    count = np.arange(len(time))
    if len(time) < 3:
        return Bridged(recording, usable, count, [])
    step, usual = np.diff(time), usual_tick(recording)
    missing = np.rint(step / usual).astype(np.int64) - 1
    short = (step > GAP_FACTOR * usual) & is_short(step, usual)
    if not np.any(short):
        return Bridged(recording, usable, count, pieces_of(recording, usual))
    added = np.where(short, np.maximum(missing, 1), 0)
    before = np.repeat(np.arange(len(added)), added)
    place = np.arange(len(before)) - np.repeat(np.cumsum(added) - added, added) + 1
    share = place / (added[before] + 1.0)
    source = np.insert(count, before + 1, before)
    made = np.diff(source, prepend=-1) == 0
    samples = np.insert(recording.samples, before + 1, recording.samples[before])
    for name in _STRAIGHT:
        values = np.asarray(recording.samples[name], dtype=np.float64)
        samples[name][made] = values[before] + share * np.diff(values)[before]
    clock = np.asarray(recording.samples["device_time_us"], dtype=np.int64)
    later = np.rint(share * np.diff(clock)[before]).astype(np.int64)
    samples["device_time_us"][made] = clock[before] + later
    samples["opening"][made] = _cubic(recording, step, short, before, share)
    filled = replace(recording, samples=samples)
    return Bridged(filled, usable[source] & ~made, source, pieces_of(filled, usual))


def usual_tick(recording: Recording) -> float:
    """Median step of the clock in s; raises InputError where it stands still."""
    usual = float(np.median(np.diff(recording.device_time_s)))
    if usual <= 0:
        raise still_clock(recording)
    return usual


def still_clock(recording: Recording) -> InputError:
    """The error of a recording whose clock stands still."""
    return InputError(
        f"{recording.source or 'The recording'}: its clock does not advance; "
        "check the time column or the device's clock."
    )


def no_piece(recordings: tuple[Recording, ...]) -> InputError:
    """The error of recordings without a piece that is long enough for a rate."""
    names = ", ".join(recording.source or "recording" for recording in recordings)
    return InputError(
        f"{names}: no stretch without gaps is longer than {EDGES * EDGE_S:g} s and "
        f"{FEWEST_SAMPLES} samples, so no rate can be computed. {gaps_in_words(recordings)} "
        "Record for longer, and without losing samples."
    )


def gaps_in_words(recordings: tuple[Recording, ...]) -> str:
    """How many gaps there are, the longest with its place, and the longest stretch between them."""
    recordings = tuple(recording for recording in recordings if len(recording.samples) > 1)
    steps = [np.diff(recording.device_time_s) for recording in recordings]
    wide = [np.asarray(step > GAP_FACTOR * np.median(step)) for step in steps]
    count = sum(int(np.count_nonzero(one)) for one in wide)
    if not count:
        seconds = max((recording.duration_s for recording in recordings), default=0.0)
        return f"There are no gaps, and the longest recording lasts {seconds:.3g} s."
    index = int(np.argmax([step.max(initial=0.0) for step in steps]))
    at = int(np.argmax(steps[index]))
    longest = 0.0
    for one, gaps in zip(recordings, wide, strict=True):
        ends = np.concatenate([[0], np.flatnonzero(gaps) + 1, [len(one.samples)]])
        time = one.device_time_s
        longest = max([longest, *(float(time[b - 1] - time[a]) for a, b in pairwise(ends))])
    worst = recordings[index]
    where = f"{worst.source or 'the recording'} at {worst.device_time_s[at]:.4g} s"
    counted = "There is 1 gap" if count == 1 else f"There are {count} gaps"
    return (
        f"{counted}, the longest of {steps[index][at]:.3g} s ({where}); the longest "
        f"stretch between gaps lasts {longest:.3g} s."
    )


def stretches(held: Mask) -> tuple[Integers, Integers]:
    """First samples, and ones past the last, of the runs in which ``held`` (m,) is true.

    >>> low, high = stretches(np.array([True, False, True, True]))
    >>> low.tolist(), high.tolist()
    ([0, 2], [1, 4])
    """
    edges = np.flatnonzero(np.diff(np.concatenate([[False], held, [False]]).astype(int)))
    return edges[::2], edges[1::2]


def by_label(labels: Integers) -> dict[int, Integers]:
    """Places (k,) of each label in ``labels`` (m,), ascending, by one sort for all of them.

    >>> {label: at.tolist() for label, at in by_label(np.array([7, 3, 7])).items()}
    {3: [1], 7: [0, 2]}
    """
    order = np.argsort(labels, kind="stable")
    ordered = labels[order]
    first = np.flatnonzero(np.diff(ordered)) + 1
    found = ordered[np.concatenate([[0], first])] if len(ordered) else ordered
    return dict(zip(found.tolist(), np.split(order, first), strict=True)) if len(found) else {}


def sheets_of(recording: Recording) -> Integers:
    """Sheet in place at each sample: a stroke's own, held until the next stroke names another."""
    stroke = np.asarray(recording.samples["stroke"], dtype=np.int64)
    of_stroke = np.array([s.sheet for s in recording.strokes] + [-1], dtype=np.int64)
    known = np.where(stroke >= 0, stroke, len(recording.strokes))
    sheet = of_stroke[known]
    last = np.maximum.accumulate(np.where(stroke >= 0, np.arange(len(stroke)), -1))
    return np.where(last >= 0, sheet[np.maximum(last, 0)], -1)


def _cubic(recording: Recording, step: Array, short: Mask, before: Integers, share: Array) -> Array:
    """The opening at made-up samples: Hermite's cubic between the ends of each gap.

    With the line, the inertia of a swing at 0.7 Hz, logged at 100 Hz without two samples in 30, was
    off by 0.8 %; with the cubic by 3e-6.
    """
    opening = np.asarray(recording.samples["opening"], dtype=np.float64)
    time = recording.device_time_s
    usual = usual_tick(recording)
    broken, reach = np.flatnonzero(step > GAP_FACTOR * usual), 2 + 2 * edge_samples(1.0 / usual)
    rates = np.zeros((2, len(step)))
    for gap in np.flatnonzero(short).tolist():
        place = int(np.searchsorted(broken, gap))
        first = int(broken[place - 1]) + 1 if place else 0
        last = int(broken[place + 1]) if place + 1 < len(broken) else len(time) - 1
        first, last = max(first, gap - reach), min(last, gap + 1 + reach)
        rates[0, gap] = _end_rate(time, opening, np.arange(gap, first - 1, -1), step[gap])
        rates[1, gap] = _end_rate(time, opening, np.arange(gap + 1, last + 1), step[gap])
    rise, lasting = np.diff(opening)[before], step[before]
    known = (np.isfinite(rates[0]) & np.isfinite(rates[1]))[before]
    left, right = (np.where(known, lasting * rate[before], rise) for rate in rates)
    s = share
    bend = s * (1.0 - s) * ((1.0 - s) * (left - rise) - s * (right - rise))
    return np.asarray(opening[before] + s * rise + bend)


def _end_rate(time: Array, opening: Array, inward: Integers, lasting: float) -> float:
    """Rate at one end of a gap: the parabola through as long a stretch as the gap; NaN for none."""
    reach = int(np.searchsorted(np.abs(time[inward] - time[inward[0]]), lasting, side="right")) - 1
    if reach < 2:
        return float("nan")
    near, far = inward[reach // 2], inward[reach]
    a, b = time[near] - time[inward[0]], time[far] - time[inward[0]]
    ya, yb = opening[near] - opening[inward[0]], opening[far] - opening[inward[0]]
    return float((ya * b / a - yb * a / b) / (b - a))
