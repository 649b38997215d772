"""Length of the windows: by the cutoff, or longer for a coarse encoder."""

from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from scissorcal.aliases import Array, Integers, Mask
from scissorcal.calibration.signals.filtering import BIN_S
from scissorcal.calibration.signals.segments import stretches
from scissorcal.recording.strokes import edge_samples

HALF_AT = 0.365
"""Frequency times knot distance at which a quadratic B-spline passes half: sinc^3 = 1 / 2."""
ENCODER_SHARE = 2.5e-3
"""Largest share of the encoder's steps in the acceleration's mean square; a fitted inertia is too
low by the same share."""
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

    def not_resting(self, first: Integers, length: int) -> Mask:
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
        first = first[piece.not_resting(first, len(twice))]
        if len(first) == 0:
            continue
        square += float(
            np.sum((sliding_window_view(piece.position, len(twice))[first] @ twice) ** 2)
        )
        error += len(first) * float(np.sum(twice**2)) * step**2 / 12.0
    return max(square - error, 0.0), error, count


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
