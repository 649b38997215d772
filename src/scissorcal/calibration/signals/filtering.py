"""Bins of motion and drive, the low-pass filter, and the noise of the rate."""

import math
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array, Integers
from scissorcal.recording.strokes import noise_of, resolution_of

BIN_S = 0.005
HIGHEST = 0.4
"""A filter passes half at no more than this share of the sampling rate."""
PASSING = 0.01
"""Share of the motion below whose rate a joint only passes through."""
REMEMBERED = 10.0
"""Periods of the cutoff over which the filter's memory falls by e^-24: its slowest poles decay by
2 pi sin(pi / 8) a period."""


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

    @property
    def slowest_rate(self) -> float:
        """The slowest rate (rad/s or m/s) that was swept, not only passed through."""
        return float(np.quantile(np.abs(self.rate), PASSING))

    def where(self, keep: NDArray[np.bool_]) -> "Bins":
        """Return the bins that ``keep`` selects."""
        chosen = {
            f.name: getattr(self, f.name)[keep]
            for f in fields(self)
            if isinstance(getattr(self, f.name), np.ndarray)
        }
        return Bins(**chosen, bin_s=self.bin_s, rate_floor=self.rate_floor)


def low_pass(values: Array, cutoff_Hz: float, rate_Hz: float) -> Array:
    """Low-pass with the gain of a 4th-order Butterworth filter forwards and backwards: no delay.

    Worked out in the frequency domain: importing scipy.signal takes as long as fitting a law. Both
    ends are continued by their point reflection, as far as the filter remembers.
    """
    corner = np.tan(np.pi * min(cutoff_Hz, HIGHEST * rate_Hz) / rate_Hz)
    beyond = min(len(values) - 1, math.ceil(REMEMBERED * rate_Hz / cutoff_Hz))
    before = 2 * values[0] - values[beyond:0:-1]
    after = 2 * values[-1] - values[-2 : -beyond - 2 : -1]
    whole = np.concatenate([before, values, after])
    base = np.linspace(whole[0], whole[-1], len(whole))
    size = 1 << len(whole).bit_length()  # quick; what is transformed is zero at both ends
    gain = 1 / (1 + (np.tan(np.pi * np.fft.rfftfreq(size)) / corner) ** 8)
    smooth = base + np.fft.irfft(np.fft.rfft(whole - base, size) * gain, size)[: len(whole)]
    return np.asarray(smooth[beyond : beyond + len(values)])


@dataclass(frozen=True)
class PositionError:
    """What hides a motion: the sensor's ``step`` (NaN: none to be seen), its error's ``sd``."""

    step: float
    sd: float


def position_error(position: Array) -> PositionError:
    """The error of a position sensor, from a whole recording (m,).

    Its standard deviation is that of the steps, step / sqrt(12), or of the noise where that exceeds
    a step: a table has steps of its last digit, however noisy the sensor. Of a part of a recording
    it must not be taken: a steady motion has even steps, and would hide itself.
    """
    step, noise = resolution_of(position), noise_of(position)
    noise = noise if np.isfinite(noise) else 0.0
    if not np.isfinite(step) or noise > step:
        return PositionError(step, noise)
    return PositionError(step, float(step / np.sqrt(12.0)))


def rate_floor(sd: float, cutoff_Hz: float, rate_Hz: float) -> float:
    """Three standard deviations of the rate that white noise ``sd`` of the position gives.

    The position is low-passed as :func:`low_pass` does, at no more than 0.4 of the sampling rate.
    """
    passed_Hz = min(cutoff_Hz, HIGHEST * rate_Hz)
    noise = 2 * np.pi * passed_Hz / np.sqrt(3) * sd * np.sqrt(2 * passed_Hz / rate_Hz)
    return float(3 * noise)


def rate_floor_of_step(step: float, cutoff_Hz: float, rate_Hz: float) -> float:
    """The same of an encoder whose step is known, as before a capture."""
    return rate_floor(step / np.sqrt(12.0), cutoff_Hz, rate_Hz)
