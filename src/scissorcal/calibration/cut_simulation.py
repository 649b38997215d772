"""Torque of a cut drawn from what its law says of ripple, unevenness and resting cracks."""

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.cut_expected import UNEVEN_LENGTH_M, Expected
from scissorcal.calibration.cut_motion import CutMotion

Array = NDArray[np.float64]


def draw_torque(expected: Expected, rng: np.random.Generator) -> Array:
    """Draw the material's torque at each bin (n,), without sensor noise.

    Each crack rests at a place of its own. A running one adds a saw-tooth, exactly averaged over
    each bin, whose phase goes on from bin to bin and starts anywhere in every stretch; and the
    material's unevenness, which belongs to the place in the sheet.
    """
    resting = expected.resting
    rests = resting.place + resting.sd * rng.standard_normal(len(resting.place))
    torque = expected.mean_with(rests)
    if expected.settled is None:
        return torque
    motion, spread = expected.motion, expected.spread
    tooth = np.sqrt(12.0) * spread.visibility * expected.saw_tooth
    ripple = tooth * _saw_tooth(expected.periods, motion.runs, rng)
    uneven = spread.variation * expected.mean * _uneven(motion, rng)
    return np.asarray(torque + expected.running * (ripple + uneven))


def _saw_tooth(periods: Array, runs: NDArray[np.int64], rng: np.random.Generator) -> Array:
    """Averages over bins (n,) of a saw-tooth from -1/2 to 1/2 that passes ``periods`` in each."""
    begins = np.diff(runs, prepend=runs[0] - 1) != 0
    phase = rng.random(int(begins.sum()))[np.cumsum(begins) - 1]
    total = np.cumsum(periods)
    end = (
        total - (total - periods)[np.maximum.accumulate(np.where(begins, np.arange(len(runs)), 0))]
    )
    end = end + phase
    start = end - periods

    def integral(place: Array) -> Array:
        whole = np.floor(place)
        rest = place - whole
        return 0.5 * rest * (rest - 1.0)

    still = periods < 1e-9
    mean = (integral(end) - integral(start)) / np.where(still, 1.0, periods)
    return np.where(still, start - np.floor(start) - 0.5, mean)


def _uneven(motion: CutMotion, rng: np.random.Generator) -> Array:
    """A field of unit variance along each sheet, seen at the bins (n,).

    Independent over ``UNEVEN_LENGTH_M`` and straight between, so that it divides between block
    means and contrasts as the likelihood takes it.
    """
    gone = np.cumsum(motion.travel_m) / UNEVEN_LENGTH_M
    knots = rng.standard_normal(int(gone[-1]) + 2) if len(gone) else np.zeros(2)
    index = gone.astype(np.int64)
    part = gone - index
    field = (1.0 - part) * knots[index] + part * knots[index + 1]
    return np.asarray(field / np.sqrt(part**2 + (1.0 - part) ** 2))
