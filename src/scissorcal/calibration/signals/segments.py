"""Divisions of a recording: pieces without gaps, sheets, runs of equal samples."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from scissorcal.errors import InputError
from scissorcal.recording.recording import Recording

Integers = NDArray[np.int64]
Mask = NDArray[np.bool_]

EDGE_S = 0.05
"""Time left out at both ends of a piece, where a zero-phase filter sees no neighbours."""
EDGES = 4
"""Least length of a piece in edges, so that at least half of it can be used."""
FEWEST_SAMPLES = 20
"""Samples that a piece must exceed for a 4th-order filter and a window of one knot to fit in."""
GAP_FACTOR = 1.5


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
    least = max(EDGES * edge_samples(1.0 / usual), FEWEST_SAMPLES)
    return [(low, high) for low, high in pairwise(bounds) if high - low > least]


def usual_tick(recording: Recording) -> float:
    """Median step of the clock in s; raises InputError where it stands still."""
    usual = float(np.median(np.diff(recording.device_time_s)))
    if usual <= 0:
        raise still_clock(recording)
    return usual


def edge_samples(rate_Hz: float) -> int:
    """Samples that ``EDGE_S`` lasts at a sampling rate, one at least.

    >>> edge_samples(1000.0), edge_samples(200.0)
    (50, 10)
    """
    return max(1, round(EDGE_S * rate_Hz))


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
    steps = [np.diff(one.device_time_s) for one in recordings]
    wide = [step > GAP_FACTOR * np.median(step) if len(step) else step > 0 for step in steps]
    count = sum(int(np.count_nonzero(one)) for one in wide)
    if not count:
        seconds = max((one.duration_s for one in recordings), default=0.0)
        return f"There are no gaps, and the longest recording lasts {seconds:.3g} s."
    index = max(range(len(steps)), key=lambda i: float(steps[i].max(initial=0.0)))
    at = int(np.argmax(steps[index]))
    longest = 0.0
    for one, gaps in zip(recordings, wide, strict=True):
        ends = np.concatenate([[0], np.flatnonzero(gaps) + 1, [len(one.samples)]])
        time = one.device_time_s
        longest = max([longest, *(float(time[b - 1] - time[a]) for a, b in pairwise(ends))])
    worst = recordings[index]
    where = f"{worst.source or 'the recording'} at {worst.device_time_s[at]:.4g} s"
    return (
        f"There are {count} gaps, the longest of {steps[index][at]:.3g} s ({where}); the longest "
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


def sheets_of(recording: Recording) -> Integers:
    """Sheet in place at each sample: a stroke's own, held until the next stroke names another."""
    stroke = np.asarray(recording.samples["stroke"], dtype=np.int64)
    of_stroke = np.array([s.sheet for s in recording.strokes] + [-1], dtype=np.int64)
    known = np.where(stroke >= 0, stroke, len(recording.strokes))
    sheet = of_stroke[known]
    last = np.maximum.accumulate(np.where(stroke >= 0, np.arange(len(stroke)), -1))
    return np.where(last >= 0, sheet[np.maximum(last, 0)], -1)
