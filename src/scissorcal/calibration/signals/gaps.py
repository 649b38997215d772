"""Short gaps in a recording, bridged so that what lies on either side of one is kept."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.signals.segments import GAP_FACTOR, edge_samples, pieces_of, usual_tick
from scissorcal.recording.recording import Recording

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Mask = NDArray[np.bool_]

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


def bridge(recording: Recording, usable: Mask) -> Bridged:
    """Fill gaps of at most 0.05 s (``EDGE_S``), or of one sample where samples are farther apart.

    The zero-phase filter looks about so far, which is what an end of a piece costs. With a gap
    filled, the filter sees its neighbours on either side, and only windows that touch the gap are
    lost. The opening follows the cubic that has the places and the rates of both ends, so that the
    filtered rate beside the gap stays right; the other channels follow the line. No made-up sample
    is ever compared with a model: ``usable`` (m,) comes back with them as False. Longer gaps stay,
    and part the recording. Raises InputError where the clock stands still.
    """
    time = recording.device_time_s
    count = np.arange(len(time))
    if len(time) < 3:
        return Bridged(recording, usable, count, [])
    step, usual = np.diff(time), usual_tick(recording)
    missing = np.rint(step / usual).astype(np.int64) - 1
    short = (step > GAP_FACTOR * usual) & (missing <= edge_samples(1.0 / usual))
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


def _cubic(recording: Recording, step: Array, short: Mask, before: Integers, share: Array) -> Array:
    """The opening at made-up samples: Hermite's cubic between the ends of each gap."""
    opening = np.asarray(recording.samples["opening"], dtype=np.float64)
    time = recording.device_time_s
    usual = usual_tick(recording)
    broken, reach = np.flatnonzero(step > GAP_FACTOR * usual), 2 + 2 * edge_samples(1.0 / usual)
    rates = np.zeros((2, len(step)))
    for gap in np.flatnonzero(short):
        place = int(np.searchsorted(broken, gap))
        first = int(broken[place - 1]) + 1 if place else 0
        last = int(broken[place + 1]) if place + 1 < len(broken) else len(time) - 1
        first, last = max(first, gap - reach), min(last, gap + 1 + reach)
        rates[0, gap] = _end_rate(time, opening, np.arange(gap, first - 1, -1), step[gap])
        rates[1, gap] = _end_rate(time, opening, np.arange(gap + 1, last + 1), step[gap])
    rise, lasting = np.diff(opening)[before], step[before]
    known = np.isfinite(rates).all(axis=0)[before]
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
