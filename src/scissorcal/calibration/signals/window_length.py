"""Length of the windows: by the cutoff, or longer for a coarse encoder."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from scissorcal.calibration.signals.filtering import BIN_S
from scissorcal.calibration.signals.segments import edge_samples
from scissorcal.recording.resolution import resolution_of

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Mask = NDArray[np.bool_]

HALF_AT = 0.365
"""Frequency times knot distance at which a quadratic B-spline passes half: sinc^3 = 1 / 2."""
ENCODER_SHARE = 2.5e-3
"""Largest share of the encoder's steps in the acceleration's mean square; a fitted inertia is too
low by the same share."""
LONGEST_S = 0.1
"""Windows are not lengthened beyond this."""
LEAST_LEFT = 0.5
"""Lengthened windows leave at least this share of those that hold no rest."""
MUCH_LONGER = 2.0
SMOOTH = 1 / 12
"""Weight of a neighbouring sample in a mean over two ticks of a smooth signal
(Numerov 1924, doi:10.1093/mnras/84.8.592)."""


@dataclass(frozen=True)
class Motion:
    """One piece of a recording without a gap, before it is weighed; arrays (m,) by sample.

    ``position`` is as measured, ``opening`` and ``rate`` are low-passed, ``floor`` is the speed
    below which the rate's sign is noise, ``invalid`` marks samples of rest, of any turn, and those
    that a sensor invalidated; ``resting`` the same without quick turns.
    """

    position: Array
    opening: Array
    rate: Array
    floor: float
    invalid: Mask
    resting: Mask
    rate_Hz: float

    def places(self, length: int) -> Integers:
        """First samples of windows of ``length`` samples, one per bin."""
        edge, width = edge_samples(self.rate_Hz), max(1, round(BIN_S * self.rate_Hz))
        return np.arange(edge, len(self.position) - edge - length, width)

    def moving(self, first: Integers, length: int) -> Mask:
        """Which windows from ``first`` (n,) on hold no invalid sample."""
        invalid = np.concatenate([[0], np.cumsum(self.invalid)])
        return np.asarray(invalid[first + length] == invalid[first])


def with_turns(pieces: list[Motion], shortest: int) -> list[Motion]:
    """Pieces whose quick turns count, where windows of ``MUCH_LONGER`` knots need them.

    A window with a turn is invalid, as friction jumps there at an uncertain time. But long windows,
    for a coarse encoder, would leave hardly any data near a turn, and only those identify how
    friction builds up.
    """
    turning = [replace(piece, invalid=piece.resting) for piece in pieces]
    return turning if longer_knot(turning, shortest) >= MUCH_LONGER * shortest else pieces


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
    which the share is at most ``ENCODER_SHARE``; where none is, or too few windows without a rest
    would be left, the longest that is allowed.
    """
    steps = [resolution_of(piece.position) for piece in pieces]
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
    """Sums of squares over windows without a rest: acceleration, its error; and their number."""
    square = error = 0.0
    count = 0
    for piece, step in zip(pieces, steps, strict=True):
        twice = second_derivative(knot, piece.rate_Hz)
        first = piece.places(len(twice))
        first = first[piece.moving(first, len(twice))]
        if len(first) == 0:
            continue
        count += len(first)
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
