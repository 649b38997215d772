"""Jitter of an encoder is told from vibration, and from a place between two steps."""

import numpy as np
import pytest

from scissorcal.device.probe.idle import largest_correlation

TIME_S = np.arange(1000) * 1e-3


@pytest.mark.parametrize("seed", range(5))
def test_white_noise_is_uncorrelated(seed: int) -> None:
    assert largest_correlation(np.random.default_rng(seed).normal(size=1000)) < 0.2


@pytest.mark.parametrize("rate_Hz", [20.0, 50.0, 180.0, 250.0, 410.0])
def test_a_vibration_is_correlated_at_any_rate(rate_Hz: float) -> None:
    noise = np.random.default_rng(1).normal(size=1000)
    shaken = 2.0 * np.sin(2 * np.pi * rate_Hz * TIME_S) + noise
    assert largest_correlation(shaken) > 0.5


def test_a_constant_and_a_short_series_are_no_noise() -> None:
    assert largest_correlation(np.zeros(1000)) == 1.0
    assert largest_correlation(np.random.default_rng(1).normal(size=20)) == 1.0
