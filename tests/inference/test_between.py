"""Intervals of a population's value hold it as often as they say, with as few as two groups."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import norm

from scissorcal.inference.between import between_groups, one_normal

P, OWN_SD, SCALE = 4, 0.005, 0.02


def coverage(groups: int, scatter: float, studies: int) -> tuple[float, float]:
    """Share of 90 % intervals that hold a parameter that scatters, and those that do not."""
    rng = np.random.default_rng([groups, round(1e4 * scatter)])
    held = []
    precision = np.eye(P) / OWN_SD**2
    for _ in range(studies):
        truth = np.array([scatter, 0, 0, 0]) * rng.standard_normal((groups, P))
        means = truth + OWN_SD * rng.standard_normal((groups, P))
        found = between_groups(
            means, np.stack([precision] * groups), np.full(P, SCALE), np.eye(P) / 8, rng
        )
        low, high = np.quantile(found.population, [0.05, 0.95], axis=0)
        held.append((low < 0) & (high > 0))
    shares = np.mean(held, axis=0)
    return float(shares[0]), float(shares[1:].mean())


@pytest.mark.slow
@pytest.mark.parametrize("groups", [2, 3, 5])
@pytest.mark.parametrize("scatter", [0.0, 0.03, 0.1])
def test_intervals_of_the_population_hold_it(groups: int, scatter: float) -> None:
    """60 studies: 90 % in truth gives less than 73 % once in 50,000 (binomial)."""
    differing, alike = coverage(groups, scatter, 60)
    assert differing > 0.73
    assert alike > 0.85


def test_one_parameter_that_differs_is_let_go_alone() -> None:
    rng = np.random.default_rng(3)
    means = np.zeros((2, P))
    means[1, 0] = 0.2
    precision = np.stack([np.eye(P) / OWN_SD**2] * 2)
    found = between_groups(means, precision, np.full(P, SCALE), np.eye(P) / 8, rng)
    median = np.median(found.sd, axis=0)
    assert median[0] > 0.05
    assert np.all(median[1:] < 0.02)
    low, high = np.quantile(found.population[:, 0], [0.05, 0.95])
    assert low < 0.02
    assert high > 0.18


def test_equal_seeds_give_equal_draws_and_many_alike_groups_shrink_the_scatter() -> None:
    precision = np.stack([np.eye(P) / OWN_SD**2] * 8)
    means = OWN_SD * np.random.default_rng(4).standard_normal((8, P))
    runs = [
        between_groups(means, precision, np.full(P, SCALE), np.eye(P) / 8, np.random.default_rng(5))
        for _ in range(2)
    ]
    assert np.array_equal(runs[0].sd, runs[1].sd)
    assert np.all(np.median(runs[0].sd, axis=0) < OWN_SD)


def test_equal_variances_are_their_own_normal() -> None:
    assert one_normal(np.array([[4.0, 9.0]] * 3)) == pytest.approx([2.0, 3.0])


@given(
    sds=st.lists(st.floats(1e-4, 1e3), min_size=1, max_size=20),
    scale=st.floats(1e-6, 1e6),
)
def test_one_normal_has_the_interval_of_the_mixture(sds: list[float], scale: float) -> None:
    """90 % of the mixture lies within 1.645 of its standard deviations, in any unit."""
    sd = np.array(sds)
    (found,) = one_normal((sd**2)[:, None])
    inside = np.mean(2.0 * norm.cdf(norm.ppf(0.95) * found / sd) - 1.0)
    assert inside == pytest.approx(0.9, abs=1e-6)
    assert one_normal(((scale * sd) ** 2)[:, None])[0] == pytest.approx(scale * found, rel=1e-6)


def test_groups_that_differ_by_nothing_have_a_finite_scatter() -> None:
    """Exact and equal estimates: no draw of tau beyond what a half-normal of the slab reaches."""
    means = np.zeros((2, P))
    precision = np.stack([np.eye(P) / 1e-6**2] * 2)
    rng = np.random.default_rng(6)
    found = between_groups(means, precision, np.full(P, SCALE), np.eye(P) / 8, rng)
    assert found.sd.max() < 5.0 * 10.0 * SCALE
    assert np.all(np.median(found.sd, axis=0) < 0.2 * SCALE)
