"""Bins of motion and drive, and the filter and the rate's noise that windows of them share."""

from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.signals.sensors import resolution_of

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

BIN_S = 0.005


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


def low_pass(values: Array, cutoff_Hz: float, rate_Hz: float) -> Array:
    """Low-pass by what a 4th-order Butterworth filter does forwards and backwards: nothing is late.

    Its gain, 1 / (1 + (tan(pi f / rate) / tan(pi cutoff / rate))^8), is applied to the spectrum of
    the values less the line through the first and the last of them, continued as an odd function,
    so that neither end has a step. (Importing scipy.signal takes 0.7 s, most of what a fit may.)
    """
    if len(values) < 3:
        return np.array(values, dtype=np.float64)
    line = np.linspace(values[0], values[-1], len(values))
    away = values - line
    spectrum = np.fft.rfft(np.concatenate([away, -away[-2:0:-1]]))
    edge = np.tan(np.pi * min(cutoff_Hz / rate_Hz, 0.4))
    bins = np.arange(len(spectrum)) / (2 * (len(values) - 1))
    # tan is huge at half the rate, where the gain is 0; a cap keeps its eighth power finite.
    ratio = np.minimum(np.tan(np.pi * bins) / edge, 1e30)
    kept = np.fft.irfft(spectrum / (1.0 + ratio**8), n=2 * (len(values) - 1))
    return np.asarray(line + kept[: len(values)])


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
