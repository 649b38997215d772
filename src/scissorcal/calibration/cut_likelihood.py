"""The likelihood of a cut: blocks of bins, and resting cracks whose places are integrated out."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.cut_expected import BLOCK_BINS, Expected

Array = NDArray[np.float64]

TRIED = np.linspace(-2.5, 2.5, 6)
"""Places of rest that are tried first, in standard deviations from the one expected."""
STEPS = 3
LONGEST_STEP = 0.8
DIFFERENCE = np.array([0.0, 1e-5])


@dataclass(frozen=True)
class Blocks:
    """Short runs of neighbouring bins: ``place`` (n,) is a bin's number in its block, ``first``
    (n,) the index at which its block begins, ``length`` (n,) the block's length."""

    place: NDArray[np.int64]
    first: NDArray[np.int64]
    length: NDArray[np.int64]


def make_blocks(run: NDArray[np.int64]) -> Blocks:
    """Cut runs of equal labels (n,) into blocks of ``BLOCK_BINS``, the last of each shorter."""
    index = np.arange(len(run))
    begins = np.maximum.accumulate(np.where(np.diff(run, prepend=run[0] - 1) != 0, index, 0))
    place = (index - begins) % BLOCK_BINS
    first = index - place
    return Blocks(place, first, np.bincount(first, minlength=len(run))[first])


def contrasts(values: Array, blocks: Blocks) -> Array:
    """Block means and contrasts of values (n,), by Helmert's orthonormal transform.

    The first of a block becomes its mean times the root of its length, the k-th the difference
    between itself and the mean of those before. An uneven material varies slowly and shows in the
    means, a ripple is fast and shows in the contrasts, so that neither is taken for the other.
    """
    k, first, length = blocks.place, blocks.first, blocks.length
    total = np.cumsum(values)
    start = (total - values)[first]
    contrast = (total - values - start - k * values) / np.sqrt(np.maximum(k * (k + 1), 1))
    means = (total[first + length - 1] - start) / np.sqrt(length)
    return np.asarray(np.where(k == 0, means, contrast))


def variance_of_contrasts(slow: Array, fast: Array, blocks: Blocks) -> Array:
    """Variance of what :func:`contrasts` gives (n,), from what bins share and have alone."""
    alone = _block_mean(fast, blocks.first, blocks.length)
    shared = _block_mean(slow, blocks.first, blocks.length)
    return np.asarray(np.where(blocks.place == 0, alone + blocks.length * shared, alone))


def normal_terms(torque: Array, expected: Expected, blocks: Blocks) -> tuple[Array, Array]:
    """Whitened residuals of the material's torque (n,), and log standard deviations (n,).

    Where a crack rests, its place x is normal about what is expected, and integrated out: about
    the place that fits best, torque is straight in x, so that residuals r = J (x - expected) +
    noise have the covariance V + s^2 J J', whose root and determinant are known in closed form
    (Sherman and Morrison 1950, doi:10.1214/aoms/1177729893). The sum of the squares is the
    smallest over x of misfit plus prior (Laplace's method in x).
    """
    slow, fast = expected.variances
    sd = np.sqrt(variance_of_contrasts(slow, fast, blocks))
    residual = torque - expected.mean
    if len(expected.resting.place) == 0:
        return contrasts(residual, blocks) / sd, np.log(sd)
    z, change, slope = _best(residual, expected)
    borne, rest = expected.borne, expected.motion.bin_rest
    lift = np.zeros_like(residual)
    along = np.zeros_like(residual)
    lift[borne.bins] = slope * z[borne.rest] - change
    along[borne.bins] = slope
    white = contrasts(residual + lift, blocks) / sd
    return _integrated(white, contrasts(along, blocks) / sd, np.log(sd), rest, len(z))


def _integrated(
    white: Array, along: Array, log_sd: Array, rest: NDArray[np.int64], rests: int
) -> tuple[Array, Array]:
    group = np.where(rest < 0, rests, rest)
    length2 = np.bincount(group, weights=along**2, minlength=rests + 1)
    safe = np.maximum(length2, 1e-300)
    projected = np.bincount(group, weights=along * white, minlength=rests + 1)
    shrink = (1.0 - 1.0 / np.sqrt(1.0 + length2)) * projected / safe
    share = along**2 / safe[group]
    z = white - along * shrink[group]
    return z, log_sd + 0.5 * np.log1p(length2)[group] * share


def best_rests(torque: Array, expected: Expected) -> Array:
    """Where the cracks rested (rests,), by the torque (n,) that re-closing onto them took."""
    z, _, _ = _best(torque - expected.mean, expected)
    return np.asarray(expected.resting.place + z * expected.resting.sd)


def _best(residual: Array, expected: Expected) -> tuple[Array, Array, Array]:
    """Best places in standard deviations (rests,), and the mean's change and slope there (b,).

    The best of a few places, then Gauss-Newton steps of misfit plus prior.
    """
    resting, borne = expected.resting, expected.borne
    slow, fast = expected.variances
    rests = len(resting.place)
    weight = 1.0 / (slow + fast)[borne.bins]
    left = residual[borne.bins]

    def summed(values: Array) -> Array:
        counted = np.bincount(borne.rest, weights=values, minlength=rests)
        return np.asarray(counted, dtype=np.float64)

    def change(z: Array) -> Array:
        return borne.change(resting.place + z * resting.sd)

    tried = change(np.repeat(TRIED[:, None], rests, axis=1))
    heights = np.stack([summed(weight * (left - one) ** 2) for one in tried])
    z = TRIED[np.argmin(heights + TRIED[:, None] ** 2, axis=0)]
    for step in range(STEPS + 1):
        middle, beyond = change(z + DIFFERENCE[:, None])
        slope = (beyond - middle) / DIFFERENCE[1]
        if step == STEPS:
            break
        pull = summed(weight * slope * (left - middle)) - z
        bend = summed(weight * slope**2) + 1.0
        z = z + np.clip(pull / bend, -LONGEST_STEP, LONGEST_STEP)
    return z, middle, slope


def _block_mean(values: Array, first: NDArray[np.int64], length: NDArray[np.int64]) -> Array:
    total = np.concatenate([[0.0], np.cumsum(values)])
    return np.asarray((total[first + length] - total[first]) / length)
