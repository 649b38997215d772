"""What the scores are really worth: their covariance under noise with memory."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.inference.ar_noise import ArNoise, fit_ar, runs
from scissorcal.inference.autocorrelation import robust_covariance_of_scores
from scissorcal.inference.information import Slopes
from scissorcal.inference.problem import Problem

Labels = NDArray[np.int64]

WELL_ABOVE_ROUNDING = 1e-6
CHANCE = 0.01
BLOCK = 8192
"""Rows that are transformed together at least, which the processor's cache holds."""


@dataclass(frozen=True)
class LongRun:
    """Covariance (p, p) of the sum of scores, and what it rests on.

    ``orders`` are those of the autoregressions that the data chose, one for each population of
    terms (none where the terms are not normal). ``dispersion`` >= 1 is the factor by which the
    scores of whole blocks vary more than noise with that memory would have them, in the direction
    where they do so most.
    """

    covariance: Array
    orders: tuple[int, ...]
    dispersion: float


def long_run_covariance(problem: Problem, scores: Array, slopes: Slopes | None) -> LongRun:
    """Covariance of the sum of scores at an optimum, with memory as the data show it.

    Where terms are normal (or Student-t), a score is an influence, which has memory, times a slope,
    which is known. An autoregression of the order that BIC chooses is fitted to the influences,
    and the sum's covariance G' R G follows exactly from its autocorrelations R. That is far less
    noisy than to estimate the long-run covariance of every score by itself: with memory of rho =
    0.9, 90 % intervals by the latter held the truth 97 % of the time, by this 89 to 90 %.

    What whole blocks (strokes) have in common beyond that, because the law is not quite true, shows
    in the spread of their score sums (Liang and Zeger 1986, doi:10.1093/biomet/73.1.13). Where that
    exceeds, in some direction, what noise with memory explains, and chance too, the covariance
    grows in that direction. It never shrinks. Without ``slopes`` the kernel estimate is taken from
    the ``scores`` (n, p).
    """
    if slopes is None:
        return LongRun(robust_covariance_of_scores(scores, problem.series), (), 1.0)
    pull, size_pull = slopes.pull, slopes.z * slopes.pull - 1.0
    populations = np.zeros(len(pull), int) if problem.populations is None else problem.populations
    blocks = problem.series if problem.blocks is None else problem.blocks
    total = np.zeros((scores.shape[1],) * 2)
    orders: list[int] = []
    dispersion = 1.0
    for label in np.unique(populations):
        here = populations == label
        series, by_mean = problem.series[here], slopes.by_mean[here]
        noise = fit_ar(pull[here], series)
        orders.append(noise.order)
        total += covariance_of_sum(by_mean, series, noise)
        total += covariance_of_sum(slopes.by_size[here], series, fit_ar(size_pull[here], series))
        excess, largest = _excess(by_mean, pull[here], blocks[here], noise)
        total += excess
        dispersion = max(dispersion, largest)
    return LongRun(slopes.share**2 * total, tuple(orders), dispersion)


def covariance_of_sum(slopes: Array, series: Labels, noise: ArNoise) -> Array:
    """Covariance (p, p) of the sum of slopes (n, p) times noise, each ``series`` (n,) by itself.

    >>> ones = np.ones((10000, 1))
    >>> white = covariance_of_sum(ones, np.zeros(10000, dtype=int), ArNoise(0, (), 2.0))
    >>> float(np.round(white[0, 0]))
    40000.0
    """
    total = np.zeros((slopes.shape[1],) * 2)
    bounds = runs(series)
    longest = max((high - low for low, high in bounds), default=0)
    memory = noise.autocovariance(longest)
    for low, high in bounds:
        total += _quadratic(slopes[low:high], memory)
    return total


def _quadratic(slopes: Array, memory: Array) -> Array:
    """Slopes' times the Toeplitz matrix of ``memory`` times slopes, by Fourier transforms.

    A block of rows at a time, each with as many rows on either side as there is memory.
    """
    length = len(slopes)
    reach = int(np.max(np.flatnonzero(memory[:length]), initial=0))
    size = 1 << int(min(2 * length - 1, max(BLOCK, 8 * reach))).bit_length()
    block = length if 2 * length - 1 <= size else size - 2 * reach
    kernel = np.zeros(size)
    kernel[: reach + 1] = memory[: reach + 1]
    kernel[size - reach :] = memory[1 : reach + 1][::-1]
    spectrum = np.fft.rfft(kernel).real
    product = np.zeros((slopes.shape[1],) * 2)
    for low in range(0, length, block):
        first, high = max(low - reach, 0), min(low + block, length)
        near = np.ascontiguousarray(slopes[first : min(high + reach, length)].T)
        smoothed = np.fft.irfft(np.fft.rfft(near, size) * spectrum, size)
        inside = slice(low - first, high - first)
        product += near[:, inside] @ smoothed[:, inside].T
    return np.asarray(0.5 * (product + product.T))


def _excess(slopes: Array, pull: Array, blocks: Labels, noise: ArNoise) -> tuple[Array, float]:
    """What blocks' score sums vary beyond noise with memory (p, p), and the largest factor of it.

    Directions are those in which the sums' outer product stands out most from what is expected of
    it. A direction counts where its chi-square is beyond chance, with as many degrees of freedom as
    blocks share its information, less one for the fit. Slopes are taken in units of their size:
    in mixed units rounding would decide. A parameter that hardly moves the mean has no say.
    """
    from scipy.special import chdtrc

    size = np.sqrt(np.mean(slopes**2, axis=0))
    telling = np.flatnonzero(size > WELL_ABOVE_ROUNDING * size.max(initial=0.0))
    grown, largest = np.zeros((slopes.shape[1],) * 2), 1.0
    unit = size[telling]
    own = slopes[:, telling] / unit
    bounds = runs(blocks)
    memory = noise.autocovariance(max((high - low for low, high in bounds), default=0))
    expected = np.stack([_quadratic(own[low:high], memory) for low, high in bounds])
    sums = np.stack([own[low:high].T @ pull[low:high] for low, high in bounds])
    values, vectors = np.linalg.eigh(expected.sum(axis=0))
    told = values > WELL_ABOVE_ROUNDING * values[-1]
    root = vectors[:, told] * np.sqrt(values[told])
    white = vectors[:, told] / np.sqrt(values[told])
    factors, directions = np.linalg.eigh(white.T @ (sums.T @ sums) @ white)
    for factor, direction in zip(factors, directions.T, strict=True):
        along = white @ direction
        shares = np.einsum("i,bij,j->b", along, expected, along)
        spare = 1.0 / float(np.sum(shares**2)) - 1.0
        if spare <= 1.0:
            continue
        factor = factor * (spare + 1.0) / spare
        if factor > 1.0 and float(chdtrc(spare, factor * spare)) < CHANCE / len(unit):
            away = root @ direction
            grown[np.ix_(telling, telling)] += (factor - 1.0) * np.outer(away * unit, away * unit)
            largest = max(largest, float(factor))
    return grown, largest
