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


def pieces_of(recording: Recording) -> list[tuple[int, int]]:
    """Stretches without a gap that are long enough for a rate, as (first, one past the last).

    Long enough is longer than four times ``EDGE_S``, and more than ``FEWEST_SAMPLES`` samples,
    whatever the sampling rate. Raises InputError where the device's clock stands still.
    """
    time = recording.device_time_s
    if len(time) < 2:
        return []
    step = np.diff(time)
    usual = float(np.median(step))
    if usual <= 0:
        raise still_clock(recording)
    breaks = np.flatnonzero((step > GAP_FACTOR * usual) | (step <= 0)) + 1
    bounds = [0, *breaks.tolist(), len(time)]
    least = max(EDGES * edge_samples(1.0 / usual), FEWEST_SAMPLES)
    return [(low, high) for low, high in pairwise(bounds) if high - low > least]


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
        f"{FEWEST_SAMPLES} samples, so no rate can be computed; record again without interruptions."
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
