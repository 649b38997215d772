"""What the scores are really worth: their covariance under noise with memory."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.inference.ar_noise import ArNoise, fit_ar, runs
from scissorcal.inference.autocorrelation import robust_covariance_of_scores
from scissorcal.inference.information import Slopes
from scissorcal.inference.problem import Problem

Array = NDArray[np.float64]
Labels = NDArray[np.int64]

WELL_ABOVE_ROUNDING = 1e-6
CHANCE = 0.1


@dataclass(frozen=True)
class LongRun:
    """Covariance (p, p) of the sum of scores, and what it rests on.

    ``orders`` are those of the autoregressions that the data chose, one for each population of
    terms (none where the terms are not normal). ``dispersion`` >= 1 is the factor by which the
    scores of whole blocks vary more than noise with that memory would have them.
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

    What whole blocks (strokes) have in common beyond that, because the law is not quite true, is
    judged by the chi-square of their score sums; its mean per degree of freedom widens all alike
    (overdispersion, McCullagh and Nelder 1989, doi:10.1007/978-1-4899-3242-6, section 4.5). It
    never narrows. Without ``slopes`` the kernel estimate is taken from the ``scores`` (n, p).
    """
    if slopes is None:
        return LongRun(robust_covariance_of_scores(scores, problem.series), (), 1.0)
    pull, size_pull = slopes.pull, slopes.z * slopes.pull - 1.0
    populations = np.zeros(len(pull), int) if problem.populations is None else problem.populations
    blocks = problem.series if problem.blocks is None else problem.blocks
    total = np.zeros((scores.shape[1],) * 2)
    orders: list[int] = []
    square = freedom = 0.0
    for label in np.unique(populations):
        here = populations == label
        series, by_mean = problem.series[here], slopes.by_mean[here]
        noise = fit_ar(pull[here], series)
        orders.append(noise.order)
        total += covariance_of_sum(by_mean, series, noise)
        total += covariance_of_sum(slopes.by_size[here], series, fit_ar(size_pull[here], series))
        found = _excess(by_mean, pull[here], blocks[here], noise)
        square, freedom = square + found[0], freedom + found[1]
    dispersion = _dispersion(square, freedom - scores.shape[1])
    return LongRun(total * dispersion, tuple(orders), dispersion)


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
    """Slopes' times the Toeplitz matrix of ``memory`` times slopes, by Fourier transforms."""
    length = len(slopes)
    size = 1 << int(2 * length - 1).bit_length()
    kernel = np.zeros(size)
    kernel[:length] = memory[:length]
    kernel[size - length + 1 :] = memory[1:length][::-1]
    spectrum = np.fft.rfft(kernel).real
    waves = np.fft.rfft(slopes, size, axis=0)
    smoothed = np.fft.irfft(waves * spectrum[:, None], size, axis=0)[:length]
    product = slopes.T @ smoothed
    return np.asarray(0.5 * (product + product.T))


def _dispersion(square: float, spare: float) -> float:
    """Chi-square over its degrees of freedom where it is larger than chance would have it, else 1.

    Taken whenever above 1 it would widen honest intervals by 4 to 8 % on average.
    """
    from scipy.stats import chi2

    if spare <= 0 or float(chi2.sf(square, spare)) > CHANCE:
        return 1.0
    return square / spare


def _excess(slopes: Array, pull: Array, blocks: Labels, noise: ArNoise) -> tuple[float, float]:
    """Chi-square of the blocks' score sums under noise with memory, and its degrees of freedom.

    Slopes are taken in units of their own size: in mixed units rounding would decide which
    directions of a block count. A parameter that hardly moves the mean has no say.
    """
    size = np.sqrt(np.mean(slopes**2, axis=0))
    telling = size > WELL_ABOVE_ROUNDING * size.max(initial=0.0)
    slopes = slopes[:, telling] / size[telling]
    bounds = runs(blocks)
    memory = noise.autocovariance(max((high - low for low, high in bounds), default=0))
    square = freedom = 0.0
    for low, high in bounds:
        values, vectors = np.linalg.eigh(_quadratic(slopes[low:high], memory))
        told = values > WELL_ABOVE_ROUNDING * max(values[-1], 1e-300)
        along = vectors[:, told].T @ (slopes[low:high].T @ pull[low:high])
        square += float(np.sum(along**2 / values[told]))
        freedom += float(np.sum(told))
    return square, freedom
