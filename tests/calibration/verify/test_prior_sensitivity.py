"""Power-scaling sensitivity against quadrature of conjugate normals."""

import numpy as np
import pytest
from scipy.stats import norm

from scissorcal.calibration.verify.statistics import (
    SENSITIVE,
    cumulative_distance,
    diagnose,
    power_sensitivity,
)


def posterior(prior: tuple[float, float], data: tuple[float, float], a: float, b: float):
    precision = a / prior[1] ** 2 + b / data[1] ** 2
    return (a * prior[0] / prior[1] ** 2 + b * data[0] / data[1] ** 2) / precision, precision**-0.5


def by_quadrature(prior, data, component: str, low: float, high: float) -> float:
    """The sensitivity from exact distribution functions, over the range that the draws span."""
    x = np.linspace(low, high, 200001)
    total = 0.0
    for power in (1.01, 1 / 1.01):
        a, b = (power, 1.0) if component == "prior" else (1.0, power)
        P, Q = (
            norm.cdf(x, *posterior(prior, data, 1, 1)),
            norm.cdf(x, *posterior(prior, data, a, b)),
        )
        distances = []
        for p, q in ((P, Q), (1 - P, 1 - Q)):
            p, q = np.maximum(p, 1e-300), np.maximum(q, 1e-300)
            middle = (p + q) / 2
            integral = np.sum(p * np.log2(p / middle) + q * np.log2(q / middle))
            distances.append(np.sqrt(integral / np.sum(p + q)))
        total += max(distances)
    return total / (2 * np.log2(1.01))


@pytest.mark.parametrize(
    ("prior", "data", "diagnosis"),
    [
        ((0.0, 2.8), (1.0, 0.01), "fine"),
        ((0.0, 1.0), (3.0, 0.5), "prior-data conflict"),
        ((0.0, 1.0), (0.5, 5.0), "weak likelihood"),
        ((0.0, 1.0), (0.0, 1.0), "fine"),
    ],
)
def test_normal_sensitivities_and_their_diagnosis(prior, data, diagnosis):
    mean, sd = posterior(prior, data, 1, 1)
    draws = mean + sd * np.random.default_rng(1).standard_normal((4000, 1))
    found = []
    for component, (centre, size) in (("prior", prior), ("likelihood", data)):
        (one,) = power_sensitivity(draws, -0.5 * ((draws[:, 0] - centre) / size) ** 2)
        exact = by_quadrature(prior, data, component, draws.min(), draws.max())
        assert one == pytest.approx(exact, rel=0.1)
        found.append(one)
    assert diagnose(*found) == diagnosis


def test_sensitivity_does_not_depend_on_units_or_sign():
    rng = np.random.default_rng(2)
    draws = rng.gamma(3.0, size=(2000, 1))
    log_prior = -draws[:, 0] / 2
    one = power_sensitivity(draws, log_prior)
    assert power_sensitivity(1e-4 * draws, log_prior) == pytest.approx(one)
    assert power_sensitivity(-draws, log_prior) == pytest.approx(one)
    assert power_sensitivity(draws, log_prior + 1e6) == pytest.approx(one, rel=1e-3)


def test_draws_without_spread_and_equal_weights_have_no_distance():
    assert cumulative_distance(np.ones(50), np.linspace(1, 2, 50)) == 0.0
    assert cumulative_distance(np.arange(50.0), np.ones(50)) == pytest.approx(0.0, abs=1e-6)


def test_a_flat_component_has_no_sensitivity():
    draws = np.random.default_rng(3).standard_normal((500, 2))
    assert power_sensitivity(draws, np.zeros(500)) == pytest.approx([0, 0], abs=1e-6)
    assert SENSITIVE == 0.05
