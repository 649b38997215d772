"""Optima, derivatives, long-run covariance and importance sampling against known answers."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from scissorcal.inference import (
    Problem,
    find_optimum,
    gradient,
    hessian,
    infer,
    ljung_box,
    robust_covariance_of_scores,
)
from scissorcal.inference.importance import pooled, sample_by_importance, sample_by_mixture
from scissorcal.inference.mixture import Mixture


def problem_of(terms, starts, names=("a", "b"), sd=10.0, normal=None, count=1):
    size = len(names)
    return Problem(
        names=names,
        log_prior=lambda u: -0.5 * float(np.sum((u / sd) ** 2)),
        log_likelihood_terms=terms,
        series=np.zeros(count, dtype=np.int64),
        prior_sd=np.full(size, sd),
        starts=np.atleast_2d(starts),
        lower=np.full(size, -50.0),
        upper=np.full(size, 50.0),
        standardised=normal,
    )


def test_optimum_of_a_bent_valley_is_found_from_afar():
    def terms(u):
        return np.array([-50.0 * (u[1] - u[0] ** 2) ** 2, -0.5 * (1 - u[0]) ** 2])

    found = find_optimum(problem_of(terms, [[-3.0, 5.0], [4.0, 4.0]], sd=1e3, count=2))
    assert found.success
    assert found.point == pytest.approx([1.0, 1.0], abs=2e-2)
    assert found.value == pytest.approx(0.0, abs=1e-4)


def test_a_posterior_without_a_finite_start_is_refused():
    with pytest.raises(ValueError, match="finite at no start"):
        find_optimum(problem_of(lambda u: np.array([np.nan]), [[0.0, 0.0]]))


def test_a_start_in_a_lower_basin_is_counted_as_lower():
    def terms(u):
        near, far = -5 * np.sum((u - 3) ** 2), -5 * np.sum((u + 30) ** 2) - 200.0
        return np.array([np.logaddexp(near, far)])

    found = find_optimum(problem_of(terms, [[2.0, 2.0], [-30.0, -30.0]], sd=1e3))
    assert found.agreeing == 1
    assert "1 of 2 starts" in found.sentence
    assert found.point == pytest.approx([3.0, 3.0], abs=1e-2)


def test_derivatives_are_exact_for_quartics():
    def function(u):
        return u[0] ** 4 + 3 * u[0] * u[1] - 2 * u[1] ** 2

    point, step = np.array([0.7, -1.2]), np.array([0.05, 0.05])
    assert gradient(lambda u: np.array([function(u)]), point, step)[0] == pytest.approx(
        [4 * 0.7**3 - 3.6, 2.1 + 4.8], rel=1e-9
    )
    assert hessian(function, point, step) == pytest.approx(
        np.array([[12 * 0.49, 3.0], [3.0, -4.0]]), rel=1e-6
    )


@pytest.mark.parametrize("rho", [0.0, 0.5, 0.9])
def test_long_run_covariance_of_an_autoregression(rho):
    """Variance of a sum of AR(1) is n s^2 / (1 - rho)^2; 40 series, so 3 se are about 20 %."""
    rng = np.random.default_rng(1)
    n = 4000
    estimates = []
    for _ in range(40):
        noise = lfilter([1.0], [1.0, -rho], rng.standard_normal(n))
        found = robust_covariance_of_scores(noise[:, None], np.zeros(n, dtype=np.int64))
        estimates.append(found[0, 0])
    assert np.mean(estimates) == pytest.approx(n / (1 - rho) ** 2, rel=0.15)


def test_scores_that_never_vary_carry_no_covariance():
    assert np.all(robust_covariance_of_scores(np.zeros((50, 2)), np.zeros(50, dtype=int)) == 0)


def test_products_are_not_taken_across_a_gap():
    rng = np.random.default_rng(2)
    white = rng.standard_normal(4000)
    pairs = np.repeat(white, 2)
    within = ljung_box(pairs, np.zeros(8000, dtype=int))
    across = ljung_box(white, np.arange(4000))
    assert within.first_lag == pytest.approx(0.5, abs=0.05)
    assert across.first_lag == pytest.approx(0.0, abs=1e-12)


def test_ljung_box_passes_white_noise_and_catches_colour():
    rng = np.random.default_rng(4)
    series = np.zeros(3000, dtype=int)
    assert ljung_box(rng.standard_normal(3000), series).p_value > 1e-3
    coloured = lfilter([1], [1, -0.8], rng.standard_normal(3000))
    found = ljung_box(coloured, series)
    assert found.p_value < 1e-12
    assert found.share == pytest.approx(0.2 / 1.8, rel=0.3)


def test_importance_sampling_of_a_correlated_normal_keeps_its_dependence():
    covariance = np.array([[1.0, 0.9], [0.9, 1.0]])
    precision = np.linalg.inv(covariance)
    rng = np.random.default_rng(5)
    proposal = Mixture.of(np.ones(1), np.array([[0.5, 0.0]]), 2 * np.eye(2)[None])
    sampled = sample_by_importance(
        lambda u: -0.5 * np.sum((u @ precision) * u, axis=1), proposal, 4000, rng
    )
    draws = sampled.resample(4000, rng)
    assert sampled.k_hat < 0.7
    assert np.cov(draws, rowvar=False) == pytest.approx(covariance, abs=0.12)


def test_draws_of_several_proposals_are_weighed_as_those_of_their_mixture():
    """Two proposals that each miss half of a normal; it ends at 2.5, where 1 % of it is lost."""
    rng = np.random.default_rng(8)
    parts = [Mixture.of(np.ones(1), np.array([[c, 0.0]]), 0.5 * np.eye(2)[None]) for c in (-1, 1)]

    def height(u):
        return np.where(u[:, 0] < 2.5, -0.5 * np.sum(u**2, axis=1), -np.inf)

    seen = [sample_by_importance(height, part, 8000, rng, rounds=1) for part in parts]
    both = pooled(seen)
    assert both.k_hat < 0.5
    mean = both.weights @ both.draws
    assert mean == pytest.approx(np.zeros(2), abs=0.06)
    assert both.weights @ (both.draws - mean) ** 2 == pytest.approx(np.ones(2), abs=0.08)
    assert both.effective > 2.0 * seen[0].effective
    with pytest.raises(ValueError, match="some have none"):
        pooled([replace(seen[0], proposal=None)])


def test_a_mixture_is_drawn_from_until_as_many_draws_are_effective_as_were_asked_for():
    """A bent ridge in 6 dimensions; with a budget for no further batch it is not trusted."""

    def many(u):
        return -0.5 * np.sum(u[:, 1:] ** 2, axis=1) - 2.0 * (u[:, 0] - u[:, 1] ** 2) ** 2

    first = Mixture.of(np.ones(1), np.zeros((1, 6)), np.eye(6)[None])
    found = []
    for budget in (200_000, 14_000):
        rng = np.random.default_rng(3)
        begun = sample_by_importance(many, first, 2000, rng)
        given = (many, begun, first, 2000, rng, budget)
        found.append(sample_by_mixture(*given))
        assert found[-1].evaluations <= begun.evaluations + budget
    enough, short = found
    assert (enough.trusted, short.trusted) == (True, False)
    assert enough.effective >= enough.wanted == 2000
    assert short.k_hat <= short.limit, "it lacks draws alone"
    assert sample_by_mixture(*given[:5], 4_000) is None


def test_a_hopeless_proposal_is_said_to_be_one():
    rng = np.random.default_rng(6)
    sampled = sample_by_importance(
        lambda u: -0.5 * np.sum((u - 60.0) ** 2, axis=1),
        Mixture.of(np.ones(1), np.zeros((1, 2)), 1e-2 * np.eye(2)[None]),
        500,
        rng,
        rounds=1,
    )
    assert sampled.k_hat > 0.7


def regression(rng, rho, count=2000):
    time = np.arange(count) / 200
    columns = np.stack([np.ones(count), np.sin(2 * np.pi * 0.7 * time)], axis=1)
    truth = np.array([1.0, 0.5])
    noise = 0.1 * lfilter([1.0], [1.0, -rho], rng.standard_normal(count))
    return columns, truth, columns @ truth + noise


def posterior_of(columns, measured, rng, effort):
    def normal(u):
        return (measured - columns @ u[:2]) / np.exp(u[2]), np.full(len(measured), u[2])

    def terms(u):
        z, log_sd = normal(u)
        return -0.5 * z**2 - log_sd

    problem = problem_of(
        terms, [[0.0, 0.0, -1.0]], ("a", "b", "log_sd"), normal=normal, count=len(measured)
    )
    return infer(problem, effort, rng)


def test_white_noise_gives_the_textbook_posterior():
    rng = np.random.default_rng(7)
    columns, _, measured = regression(rng, 0.0)
    found = posterior_of(columns, measured, rng, "standard")
    estimate, *_ = np.linalg.lstsq(columns, measured, rcond=None)
    sd = np.sqrt(np.diag(0.01 * np.linalg.inv(columns.T @ columns)))
    assert found.draws[:, :2].mean(axis=0) == pytest.approx(estimate, abs=0.15 * sd.max())
    assert found.draws[:, :2].std(axis=0) == pytest.approx(sd, rel=0.15)
    assert found.null == ()


@pytest.mark.slow
@pytest.mark.parametrize("rho", [0.0, 0.9])
def test_intervals_cover_although_noise_is_coloured(rho):
    """90 % intervals, 2 parameters x 100 fits: 90 +- 2.1 % (1 sd), so 82 % is 4 sd low."""
    inside = []
    for seed in range(100):
        rng = np.random.default_rng(seed)
        columns, truth, measured = regression(rng, rho)
        draws = posterior_of(columns, measured, rng, "draft").draws[:, :2]
        low, high = np.quantile(draws, [0.05, 0.95], axis=0)
        inside.append((low <= truth) & (truth <= high))
    assert 0.82 <= np.mean(inside) <= 0.98


def test_a_direction_without_data_is_named_and_keeps_its_prior():
    rng = np.random.default_rng(8)
    measured = 3.0 + 0.1 * rng.standard_normal(500)

    def terms(u):
        return -0.5 * ((measured - u[0] - u[1]) / 0.1) ** 2

    found = infer(problem_of(terms, [[0.0, 0.0]], count=500), "standard", rng)
    assert len(found.null) == 1
    assert "a (50%) + b (50%)" in found.null[0] or "b (50%) + a (50%)" in found.null[0]
    assert found.draws[:, 0].std() == pytest.approx(10 / np.sqrt(2), rel=0.1)
