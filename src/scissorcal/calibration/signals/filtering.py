"""Bins of motion and drive, the low-pass filter, the noise of the rate, the length of windows."""

import math
from dataclasses import dataclass, fields

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from scissorcal.aliases import Array, Integers, Mask
from scissorcal.calibration.signals.segments import stretches
from scissorcal.recording.strokes import edge_samples, noise_of, resolution_of

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


def position_error(position: Array) -> tuple[float, float]:
    """The step of a position sensor (NaN: none to be seen) and its error, from a recording (m,).

    The error's standard deviation is that of the steps, step / sqrt(12), or of the noise where that
    exceeds a step: a table has steps of its last digit, however noisy the sensor. Of a part of a
    recording it must not be taken: a steady motion has even steps, and would hide itself.
    """
    step, noise = resolution_of(position), noise_of(position)
    noise = noise if np.isfinite(noise) else 0.0
    if not np.isfinite(step) or noise > step:
        return step, noise
    return step, float(step / np.sqrt(12.0))


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


HALF_AT = 0.365
"""Frequency times knot distance at which a quadratic B-spline passes half: sinc^3 = 1 / 2."""
ENCODER_SHARE = 2.5e-3
"""Largest share of the encoder's steps in the acceleration's mean square; a fitted inertia is too
low by the same share, which its draws contain."""
LONGEST_S = 0.1
"""Windows are not lengthened beyond this."""
TURN_S = 5e-3
LEAST_LEFT = 0.5
"""Lengthened windows leave at least this share of those that hold no rest and no turn."""
SMOOTH = 1 / 12
"""Weight of a neighbouring sample in a mean over two ticks of a smooth signal
(Numerov 1924, doi:10.1093/mnras/84.8.592)."""


@dataclass(frozen=True)
class Motion:
    """One piece of a recording without a gap, before it is weighed; arrays (m,) by sample.

    ``position`` is as measured, in steps of ``step`` (NaN: none to be seen), ``opening`` and
    ``rate`` are low-passed, ``floor`` is the speed below which the rate's sign is noise.
    ``turning`` marks samples of rest and of turns, ``faulty`` those that a sensor invalidated, and
    those that bridge a gap.
    """

    position: Array
    step: float
    opening: Array
    rate: Array
    floor: float
    turning: Mask
    faulty: Mask
    rate_Hz: float

    def places(self, length: int) -> Integers:
        """First samples of windows of ``length`` samples, one per bin."""
        edge, width = edge_samples(self.rate_Hz), max(1, round(BIN_S * self.rate_Hz))
        return np.arange(edge, len(self.position) - edge - length, width)

    def moving(self, first: Integers, length: int) -> Mask:
        """Which windows from ``first`` (n,) on hold no turn, no rest and no faulty sample."""
        return np.asarray(_held(self.turning | self.faulty, first, length) == 0)

    def _not_resting(self, first: Integers, length: int) -> Mask:
        """Which windows hold no rest and no faulty sample; a quick turn is no rest."""
        low, high = stretches(self.turning)
        rests = np.zeros(len(self.turning), dtype=bool)
        for a, b in zip(low, high, strict=True):
            rests[a:b] = b - a > TURN_S * self.rate_Hz
        return np.asarray(_held(rests | self.faulty, first, length) == 0)


def _held(marks: Mask, first: Integers, length: int) -> Integers:
    """How many marked samples each window holds."""
    total = np.concatenate([[0], np.cumsum(marks)])
    return np.asarray(total[first + length] - total[first])


def knot_samples(cutoff_Hz: float, rate_Hz: float) -> int:
    """Samples from knot to knot of windows that pass half at ``cutoff_Hz``.

    >>> knot_samples(75.0, 1000.0), knot_samples(75.0, 100.0)
    (5, 1)
    """
    return max(1, round(HALF_AT * rate_Hz / cutoff_Hz))


def longer_knot(pieces: list[Motion], shortest: int) -> int:
    """Samples from knot to knot, at least ``shortest``, at which the encoder's steps do not matter.

    The steps, of size q, give the second derivative weighed over windows the variance
    6 q^2 / (12 k^5 tick^4) at a knot distance of k ticks, while that of the motion hardly depends
    on k. What is regressed on has errors then, and its coefficient, the inertia, is too low by
    their share (Fuller 1987, Measurement Error Models, section 1.1). The least k is taken at
    which the share is at most ``ENCODER_SHARE`` over all motion, turns among it; where none is, or
    too few windows without a turn would be left, the longest that is allowed.
    """
    steps = [piece.step for piece in pieces]
    if not pieces or not np.all(np.isfinite(steps)):
        return shortest
    rate_Hz = pieces[0].rate_Hz
    chosen, knot, at_first = shortest, shortest, 0
    while knot == shortest or 3 * knot <= LONGEST_S * rate_Hz:
        square, error, count = _acceleration(pieces, steps, knot)
        at_first = at_first or count
        if count < max(1.0, LEAST_LEFT * at_first):
            break
        chosen = knot
        if error <= ENCODER_SHARE * square:
            break
        knot += max(1, knot // 8)
    return chosen


def _acceleration(pieces: list[Motion], steps: list[float], knot: int) -> tuple[float, float, int]:
    """Sums of squares over motion: acceleration, its error; and windows without a turn."""
    square = error = 0.0
    count = 0
    for piece, step in zip(pieces, steps, strict=True):
        twice = second_derivative(knot, piece.rate_Hz)
        first = piece.places(len(twice))
        count += int(piece.moving(first, len(twice)).sum())
        first = first[piece._not_resting(first, len(twice))]
        if len(first) == 0:
            continue
        square += float(
            np.sum((sliding_window_view(piece.position, len(twice))[first] @ twice) ** 2)
        )
        error += len(first) * steps_variance(twice, step)
    return max(square - error, 0.0), error, count


def steps_variance(twice: Array, step: float) -> float:
    """Variance that white steps of an encoder give the second derivative weighed by ``twice``."""
    return float(np.sum(twice**2)) * step**2 / 12.0


def spline(knot: int) -> Array:
    """Quadratic B-spline over three knot distances, (3 knot - 2,), of sum one."""
    box = np.full(knot, 1.0 / knot)
    return np.convolve(np.convolve(box, box), box)


def widened(weights: Array, neighbour: float) -> Array:
    """Weights of means over two ticks, in which a neighbouring sample counts ``neighbour``."""
    return np.convolve(weights, np.array([neighbour, 1.0 - 2.0 * neighbour, neighbour]))


def second_derivative(knot: int, rate_Hz: float) -> Array:
    """Weights of the position that give the second derivative weighed by a widened B-spline.

    A second difference of samples is the acceleration's mean over two ticks, exactly, so all else
    must be averaged over two ticks too: hence the widening of the B-spline.
    """
    second = np.zeros(2 * knot + 1)
    second[[0, knot, -1]] = np.array([1.0, -2.0, 1.0]) * (rate_Hz / knot) ** 2
    return np.convolve(np.full(knot, 1.0 / knot), second)
