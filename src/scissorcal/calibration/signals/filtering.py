"""From raw samples to band-limited bins: derivatives without phase, gaps respected."""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.signals.segments import (
    edge_samples,
    no_piece,
    pieces_of,
    sheets_of,
    stretches,
)
from scissorcal.calibration.signals.sensors import resolution_of
from scissorcal.errors import InputError
from scissorcal.recording.recording import Recording

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

BIN_S = 0.005
REST_MARGIN_S = 0.02
JITTER = 0.1
"""Motion slower than this share of the recording's rms rate is jitter, not sliding."""
STICKS_PER_S = 5.0


@dataclass(frozen=True)
class Bins:
    """Band-limited motion and drive in bins of a few milliseconds; all arrays (n,).

    ``opening``, ``rate``, ``acceleration``, ``drive``, ``advance`` are means over a bin, in the
    joint's SI units. ``moving`` is false where the rate's sign is not certain throughout the
    bin, and next to rests where the joint sticks and slips. ``series`` numbers pieces without a
    gap, ``recording`` and ``stroke`` say what a bin came from (stroke -1 between strokes,
    numbered across recordings), ``sheet`` which piece of material.
    ``bin_s`` is the width of a bin, ``rate_floor`` the speed below which the sign is noise.
    """

    time_s: Array
    opening: Array
    rate: Array
    acceleration: Array
    drive: Array
    advance: Array
    moving: NDArray[np.bool_]
    series: Integers
    recording: Integers
    stroke: Integers
    sheet: Integers
    bin_s: float
    rate_floor: float

    def where(self, keep: NDArray[np.bool_]) -> "Bins":
        """Return the bins that ``keep`` selects."""
        chosen = {
            f.name: getattr(self, f.name)[keep]
            for f in fields(self)
            if isinstance(getattr(self, f.name), np.ndarray)
        }
        return Bins(**chosen, bin_s=self.bin_s, rate_floor=self.rate_floor)


def condition(
    recordings: tuple[Recording, ...], cutoff_Hz: float, acceleration_cutoff_Hz: float | None = None
) -> Bins:
    """Band-limit and bin recordings for a fit.

    Position is low-passed forwards and backwards (4th-order Butterworth at ``cutoff_Hz``), rate and
    acceleration are its central differences, the drive passes the same filter, and all are
    averaged over bins of 5 ms (Janot, Gautier and Brunot 2019, the recipe of the EMPS benchmark,
    with bins for its decimation). The acceleration may be low-passed further, at
    ``acceleration_cutoff_Hz``: an encoder's steps are loudest in it. A jump of the device clock
    splits a recording; nothing is interpolated across. Raises InputError where no piece is long
    enough.
    """
    if not recordings:
        raise InputError("There is no recording to fit: capture or import one first.")
    pieces: list[Bins] = []
    stroke_offset = 0
    for index, recording in enumerate(recordings):
        for low, high in pieces_of(recording):
            pieces.append(
                _bin_piece(
                    recording,
                    (low, high),
                    (cutoff_Hz, acceleration_cutoff_Hz or cutoff_Hz),
                    (index, stroke_offset, len(pieces)),
                )
            )
        stroke_offset += len(recording.strokes)
    if not pieces:
        raise no_piece(recordings)
    joined = {
        f.name: np.concatenate([getattr(piece, f.name) for piece in pieces])
        for f in fields(Bins)
        if f.name not in ("bin_s", "rate_floor")
    }
    return Bins(
        **joined,
        bin_s=pieces[0].bin_s,
        rate_floor=max(piece.rate_floor for piece in pieces),
    )


def _bin_piece(
    recording: Recording,
    piece: tuple[int, int],
    cutoffs_Hz: tuple[float, float],
    numbers: tuple[int, int, int],
) -> Bins:
    (low, high), (cutoff_Hz, gentle_Hz), (index, stroke_offset, number) = piece, cutoffs_Hz, numbers
    samples = recording.samples[low:high]
    time = recording.device_time_s[low:high]
    rate_Hz = (len(time) - 1) / (time[-1] - time[0])
    position = np.asarray(samples["opening"], dtype=np.float64)
    smooth = low_pass(position, cutoff_Hz, rate_Hz)
    drive = low_pass(recording.drive_effort[low:high], cutoff_Hz, rate_Hz)
    rate = _central(smooth, rate_Hz)
    gentle = smooth if gentle_Hz == cutoff_Hz else low_pass(position, gentle_Hz, rate_Hz)
    acceleration = _central(_central(gentle, rate_Hz), rate_Hz)
    floor = rate_floor(position, cutoff_Hz, rate_Hz)
    width = max(1, round(BIN_S * rate_Hz))
    edge = edge_samples(rate_Hz)
    count = (len(time) - 2 * edge) // width
    kept = slice(edge, edge + count * width)

    def binned(values: Array) -> Array:
        return np.asarray(values[kept].reshape(count, width).mean(axis=1))

    windows = rate[kept].reshape(count, width)
    certain = (windows.min(axis=1) > floor) | (windows.max(axis=1) < -floor)
    moving = _away_from_rests(certain, windows.mean(axis=1), width / rate_Hz)
    middle = np.arange(count) * width + edge + width // 2
    stroke = np.asarray(samples["stroke"], dtype=np.int64)
    return Bins(
        time_s=binned(time),
        opening=binned(smooth),
        rate=binned(rate),
        acceleration=binned(acceleration),
        drive=binned(drive),
        advance=binned(np.asarray(samples["advance"], dtype=np.float64)),
        moving=moving,
        series=np.full(count, number),
        recording=np.full(count, index),
        stroke=np.where(stroke[middle] >= 0, stroke[middle] + stroke_offset, -1),
        sheet=sheets_of(recording)[low:high][middle],
        bin_s=width / rate_Hz,
        rate_floor=floor,
    )


def _away_from_rests(certain: NDArray[np.bool_], rate: Array, bin_s: float) -> NDArray[np.bool_]:
    """Where the joint sticks and slips, leave out the neighbours of every rest and reversal.

    A stick is an interruption between motion in one direction that is no mere jitter on either
    side. A low-pass filter smears the rest into the slip, and then inertia comes out too large and
    Stribeck friction too small; bins within ``REST_MARGIN_S`` of an interruption are therefore left
    out. Motion without sticks keeps all its bins: it passes zero once a reversal, and those
    bins tell Coulomb friction from the rest.
    """
    low_ends, high_ends = stretches(~certain)
    rests = list(zip(low_ends.tolist(), high_ends.tolist(), strict=True))
    if not np.any(certain):
        return certain
    margin = max(1, round(REST_MARGIN_S / bin_s))
    fast = JITTER * float(np.sqrt(np.mean(rate[certain] ** 2)))

    def sticks(low: int, high: int) -> bool:
        before, after = rate[max(low - margin, 0) : low], rate[high : high + margin]
        if len(before) == 0 or len(after) == 0 or before[-1] * after[0] <= 0:
            return False
        return bool(min(np.abs(before).max(), np.abs(after).max()) > fast)

    kept = certain.copy()
    found = sum(sticks(low, high) for low, high in rests)
    if found >= STICKS_PER_S * np.count_nonzero(certain) * bin_s:
        for low, high in rests:
            kept[max(low - margin, 0) : high + margin] = False
    return kept


def low_pass(values: Array, cutoff_Hz: float, rate_Hz: float) -> Array:
    """Low-pass forwards and backwards (4th-order Butterworth), so that nothing is late."""
    from scipy.signal import butter, sosfiltfilt

    sections = butter(4, min(cutoff_Hz, 0.4 * rate_Hz) / (rate_Hz / 2), output="sos")
    return np.asarray(sosfiltfilt(sections, values))


def _central(values: Array, rate_Hz: float) -> Array:
    return np.asarray(np.gradient(values) * rate_Hz)


def rate_floor(position: Array, cutoff_Hz: float, rate_Hz: float) -> float:
    """Three standard deviations of the rate that the encoder's steps alone would give."""
    steps = np.abs(np.diff(position))
    moved = steps[steps > 0]
    if len(moved) == 0:
        return 0.0
    seen = resolution_of(position)
    step = seen if np.isfinite(seen) else float(np.quantile(moved, 0.01))
    share = min(2 * cutoff_Hz / rate_Hz, 1.0)
    noise = 2 * np.pi * cutoff_Hz / np.sqrt(3) * step / np.sqrt(12) * np.sqrt(share)
    return float(3 * noise)
