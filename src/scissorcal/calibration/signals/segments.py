"""What splits a recording: gaps of its clock, the sheets in place, runs of samples alike."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from scissorcal.errors import InputError
from scissorcal.recording.recording import Recording

Integers = NDArray[np.int64]
Mask = NDArray[np.bool_]

EDGE_SAMPLES = 50
"""Samples left out at both ends of a piece, where a zero-phase filter sees no neighbours."""
GAP_FACTOR = 1.5


def pieces_of(recording: Recording) -> list[tuple[int, int]]:
    """Stretches without a gap that are long enough for a rate, as (first, one past the last)."""
    time = recording.device_time_s
    if len(time) < 2:
        return []
    step = np.diff(time)
    usual = float(np.median(step))
    if usual <= 0:
        raise InputError(
            f"{recording.source or 'The recording'}: its clock does not advance; "
            "check the time column or the device's clock."
        )
    breaks = np.flatnonzero((step > GAP_FACTOR * usual) | (step <= 0)) + 1
    bounds = [0, *breaks.tolist(), len(time)]
    return [(low, high) for low, high in pairwise(bounds) if high - low > 4 * EDGE_SAMPLES]


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
