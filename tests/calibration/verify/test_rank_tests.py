"""Ranks, bands and p-values against enumeration, simulation and known faults."""

import itertools

import numpy as np
import pytest
from scipy.stats import binom, norm

from scissorcal.calibration.verify.statistics import (
    POINTS,
    acceptance,
    chi_square_p_value,
    ecdf_band,
    ecdf_p_value,
    rank_among,
)

LEVELS = 200


def ranks_of(width: float, shift: float, count: int, rng: np.random.Generator) -> np.ndarray:
    """Ranks of truths whose normal posteriors are too narrow by ``width`` and off by ``shift``."""
    return np.floor(LEVELS * norm.cdf(width * rng.standard_normal(count) + shift)).astype(np.int64)


def least_pointwise(ranks: np.ndarray, levels: int) -> np.ndarray:
    """The test's statistic of samples (m, n), written out: the least two-sided p-value."""
    n = ranks.shape[1]
    least = np.ones(len(ranks))
    for k in range(1, POINTS):
        below = np.sum((ranks + 1) * POINTS <= k * levels, axis=1)
        tails = np.minimum(binom.cdf(below, n, k / POINTS), binom.sf(below - 1, n, k / POINTS))
        least = np.minimum(least, 2 * tails)
    return least


def test_p_values_of_two_ranks_are_those_of_enumeration():
    """All 100^2 outcomes: exact to rounding."""
    every = np.array(list(itertools.product(range(100), repeat=2)))
    statistics = least_pointwise(every, 100)
    for ranks in ((0, 0), (3, 97), (50, 50), (10, 20), (99, 99), (0, 50)):
        exact = np.mean(statistics <= least_pointwise(np.array([ranks]), 100) + 1e-11)
        assert ecdf_p_value(np.array(ranks), 100) == pytest.approx(exact, abs=1e-9), ranks


@pytest.mark.slow
def test_the_false_alarm_rate_is_as_stated():
    """800 uniform samples: the shares lie within 4 binomial standard deviations (1 in 15000)."""
    rng = np.random.default_rng(1)
    p = np.array([ecdf_p_value(rng.integers(0, LEVELS, 150), LEVELS) for _ in range(800)])
    for alpha in (0.5, 0.1, 0.01):
        assert abs(np.mean(p <= alpha) - alpha) < 4 * np.sqrt(alpha * (1 - alpha) / 800) + 0.002


def test_the_band_is_left_exactly_where_the_p_value_is_small():
    rng = np.random.default_rng(2)
    band = ecdf_band(100, 0.05)
    z, low, high = (np.array(values) for values in (band.z, band.low, band.high))
    left = 0
    for width in np.repeat([1.0, 1.3], 50):
        ranks = ranks_of(width, 0.0, 100, rng)
        curve = np.mean(ranks < np.round(z * LEVELS)[:, None], axis=1)
        outside = bool(np.any((curve < low - 1e-9) | (curve > high + 1e-9)))
        p = ecdf_p_value(ranks, LEVELS)
        assert not (outside and p > 0.05)
        assert not (not outside and p < 0.045), "the band is exact up to the discreteness"
        left += outside
    assert 12 < left < 50


@pytest.mark.parametrize(
    ("count", "least"),
    [(200, 0.95), (100, 0.5)],
)
def test_intervals_too_narrow_by_one_and_a_half_are_found(count, least):
    """At 1 in 1000: measured 0.997 with 200 fits, 0.71 with 100.

    Of 50 such samples fewer than allowed are found with a chance of 5e-4 and 1.4e-3 (binomial).
    """
    rng = np.random.default_rng(3)
    found = [ecdf_p_value(ranks_of(1.5, 0.0, count, rng), LEVELS) < 1e-3 for _ in range(50)]
    assert np.mean(found) > least


@pytest.mark.parametrize(("width", "shift", "least"), [(1 / 1.5, 0.0, 0.75), (1.0, 0.6, 0.85)])
def test_too_wide_and_shifted_intervals_are_found(width, shift, least):
    """At 1 in 1000: measured of 600 samples 0.92 if too wide by one and a half, all if shifted.

    Of 40 such samples no more than allowed are found with a chance of 7e-4, and of 2e-7 even if one
    in 160 shifted ones is not found (binomial).
    """
    rng = np.random.default_rng(4)
    found = [ecdf_p_value(ranks_of(width, shift, 200, rng), LEVELS) < 1e-3 for _ in range(40)]
    assert np.mean(found) > least


def test_ranks_of_a_calibrated_posterior_are_uniform_and_of_an_overconfident_one_are_not():
    """Normal mean, known variance, conjugate: the posterior is exact. 800 fits, 1e-4 each."""
    rng = np.random.default_rng(5)
    truth = rng.standard_normal(800)
    data = truth + 0.5 * rng.standard_normal(800)
    mean, sd = data / 1.25, np.sqrt(0.2)
    for factor, right in ((1.0, True), (1 / 1.5, False)):
        ranks = np.array(
            [
                rank_among(m + factor * sd * rng.standard_normal((199, 1)), t[None], rng)[0]
                for m, t in zip(mean, truth, strict=True)
            ]
        )
        assert ranks.min() >= 0
        assert ranks.max() < LEVELS
        assert (ecdf_p_value(ranks, LEVELS) > 1e-4) is right
        assert (chi_square_p_value(ranks, LEVELS) > 1e-4) is right


def test_ties_are_broken_evenly():
    rng = np.random.default_rng(6)
    ranks = [rank_among(np.zeros((199, 1)), np.zeros(1), rng)[0] for _ in range(500)]
    assert ecdf_p_value(np.array(ranks), LEVELS) > 1e-4


def test_coverage_limits_hold_nearly_all_binomials():
    rng = np.random.default_rng(7)
    low, high = acceptance(400, 0.9, 0.01)
    share = rng.binomial(400, 0.9, 20000) / 400
    outside = np.mean((share < low) | (share > high))
    assert outside < 0.01
    assert acceptance(400, 0.9, 0.01)[0] < 0.9 < acceptance(400, 0.9, 0.01)[1]


def test_few_ranks_have_no_chi_square_and_wrong_levels_are_refused():
    assert np.isnan(chi_square_p_value(np.arange(5), LEVELS))
    with pytest.raises(ValueError, match="multiple"):
        ecdf_p_value(np.arange(5), 150)
