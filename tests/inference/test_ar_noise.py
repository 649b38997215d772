"""Autoregressive noise: recovered orders and moments, and fresh starts at every series."""

import pickle

import numpy as np
import pytest

from scissorcal.inference import ArNoise, fit_ar


@pytest.mark.parametrize("coefficients", [(), (0.9,), (1.2, -0.5), (0.5, 0.0, 0.0, 0.3)])
def test_order_and_coefficients_are_recovered(coefficients):
    """Each coefficient within 0.03; sd of an estimate is at most 1 / sqrt(20000) = 0.007."""
    noise = ArNoise(len(coefficients), coefficients, 0.3)
    series = np.repeat(np.arange(10), 2000)
    found = fit_ar(noise.draw(series, np.random.default_rng(3)), series)
    assert found.order == len(coefficients)
    assert found.coefficients == pytest.approx(coefficients, abs=0.03)
    assert found.sd == pytest.approx(0.3, rel=0.03)


def test_the_variance_of_an_autoregression_is_its_closed_form():
    assert ArNoise(1, (0.9,), 2.0).marginal_sd == pytest.approx(2 / np.sqrt(1 - 0.81))
    assert ArNoise(0, (), 2.0).marginal_sd == 2.0


def test_a_series_begins_at_full_size_and_knows_nothing_of_the_one_before():
    """20000 starts of two samples: covariance within 5 sd of its closed form."""
    noise = ArNoise(2, (1.2, -0.5), 1.0)
    series = np.repeat(np.arange(20000), 2)
    drawn = noise.draw(series, np.random.default_rng(4)).reshape(-1, 2)
    variance = noise.marginal_sd**2
    assert np.var(drawn, axis=0) == pytest.approx([variance, variance], rel=0.05)
    assert np.mean(drawn[:, 0] * drawn[:, 1]) == pytest.approx(variance * 1.2 / 1.5, rel=0.05)
    across = np.mean(drawn[:-1, 1] * drawn[1:, 0]) / variance
    assert abs(across) < 5 / np.sqrt(20000)


def test_fits_stay_stationary_on_a_walk_and_silent_on_silence():
    walk = np.cumsum(np.random.default_rng(5).standard_normal(3000))
    series = np.zeros(3000, dtype=np.int64)
    found = fit_ar(walk, series)
    assert np.isfinite(found.marginal_sd)
    roots = np.roots([1.0, *(-np.array(found.coefficients))])
    assert np.all(np.abs(roots) < 1)
    assert fit_ar(np.zeros(50), np.zeros(50, dtype=np.int64)) == ArNoise(0, (), 0.0)
    assert fit_ar(np.zeros(0), np.zeros(0, dtype=np.int64)).order == 0


def test_equal_generators_draw_equal_noise_after_pickling():
    noise = ArNoise(1, (0.9,), 1.0)
    series = np.zeros(100, dtype=np.int64)
    again = pickle.loads(pickle.dumps(noise))
    assert np.array_equal(
        noise.draw(series, np.random.default_rng(1)), again.draw(series, np.random.default_rng(1))
    )
