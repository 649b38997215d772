"""Pareto smoothing against ArviZ's, which is not imported by fits because that takes seconds."""

import numpy as np
import pytest

from scissorcal.inference.importance import smooth_weights
from tests.with_arviz import arviz


@pytest.mark.parametrize("count", [60, 256, 4000])
@pytest.mark.parametrize("spread", [1e-8, 0.1, 1.0, 3.0, 40.0])
def test_weights_and_k_hat_are_those_of_arviz(count: int, spread: float) -> None:
    ratios = spread * np.random.default_rng(count).standard_t(5, (3, count)) - 700.0
    weights, k_hats = smooth_weights(ratios)
    expected, expected_k = arviz.psislw(ratios.copy())
    assert k_hats == pytest.approx(np.asarray(expected_k), abs=1e-9)
    assert weights == pytest.approx(np.asarray(expected), abs=1e-9)


def test_equal_ratios_have_no_tail() -> None:
    weights, k_hat = smooth_weights(np.zeros(100))
    assert np.isinf(k_hat)
    assert weights == pytest.approx(np.full(100, -np.log(100)))
