"""Integration in closed form against the exact answer, and against sampling everything."""

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy import stats

from scissorcal.inference import Problem, infer
from scissorcal.inference.linear import LinearProblem, infer_linear, marginalised, with_linear

Array = NDArray[np.float64]


def decay(rng: np.random.Generator, count: int = 60) -> tuple[LinearProblem, Problem]:
    """y = b0 + b1 exp(-exp(r) x) + noise: by marginalisation, and with all four parameters."""
    x = np.linspace(0, 3, count)
    y = 0.5 + 2.0 * np.exp(-np.exp(0.3) * x) + 0.1 * rng.standard_normal(count)
    mean, covariance = np.array([0.2, 1.0]), np.array([[1.0, 0.3], [0.3, 4.0]])
    precision = np.linalg.inv(covariance)

    def design(theta: Array) -> tuple[Array, Array]:
        return np.zeros(count), np.column_stack([np.ones(count), np.exp(-np.exp(theta[0]) * x)])

    def log_prior(theta: Array) -> float:
        return -0.5 * float(theta[0] ** 2 + (theta[1] + 2) ** 2)

    linear = LinearProblem(
        names=("log_rate", "log_sd"),
        linear_names=("floor", "height"),
        measured=y,
        design_at=design,
        log_sd_at=lambda theta: theta[1],
        linear_mean=mean,
        linear_covariance=covariance,
        log_prior=log_prior,
        prior_sd=np.ones(2),
        starts=np.array([[0.0, -1.0]]),
        lower=np.full(2, -8.0),
        upper=np.full(2, 8.0),
    )

    def standardised(u: Array) -> tuple[Array, Array]:
        return (y - design(u)[1] @ u[2:]) / np.exp(u[1]), np.full(count, u[1])

    def terms(u: Array) -> Array:
        z, log_sd = standardised(u)
        return -0.5 * z**2 - log_sd

    def prior_of_all(u: Array) -> float:
        away = u[2:] - mean
        return log_prior(u[:2]) - 0.5 * float(away @ precision @ away)

    full = Problem(
        names=("log_rate", "log_sd", "floor", "height"),
        log_prior=prior_of_all,
        log_likelihood_terms=terms,
        series=np.zeros(count, dtype=np.int64),
        prior_sd=np.array([1.0, 1.0, 1.0, 2.0]),
        starts=np.array([[0.0, -1.0, 0.2, 1.0]]),
        lower=np.full(4, -20.0),
        upper=np.full(4, 20.0),
        standardised=standardised,
        independent=True,
    )
    return linear, full


def test_the_marginal_density_is_that_of_a_multivariate_normal() -> None:
    linear, _ = decay(np.random.default_rng(0))
    problem = marginalised(linear)
    gaps = []
    for theta in np.random.default_rng(1).normal([0, -1.5], 0.7, (10, 2)):
        offset, design = linear.design_at(theta)
        covariance = design @ linear.linear_covariance @ design.T
        covariance = covariance + np.exp(2 * theta[1]) * np.eye(len(offset))
        exact = stats.multivariate_normal(offset + design @ linear.linear_mean, covariance)
        wanted = exact.logpdf(linear.measured) + linear.log_prior(theta)
        gaps.append(problem.log_posterior(theta) - wanted)
    assert np.ptp(gaps) < 1e-7


def test_linear_draws_have_the_conditional_mean_and_covariance() -> None:
    linear, _ = decay(np.random.default_rng(0))
    theta = np.array([0.3, -2.3])
    draws = with_linear(linear, np.tile(theta, (20_000, 1)), np.random.default_rng(2))[:, 2:]
    _, design = linear.design_at(theta)
    prior = np.linalg.inv(linear.linear_covariance)
    covariance = np.linalg.inv(prior + design.T @ design * np.exp(-2 * theta[1]))
    weighed = design.T @ linear.measured * np.exp(-2 * theta[1]) + prior @ linear.linear_mean
    sd = np.sqrt(np.diag(covariance))
    assert np.abs((draws.mean(axis=0) - covariance @ weighed) / sd).max() < 0.03
    assert np.cov(draws, rowvar=False) / np.outer(sd, sd) == pytest.approx(
        covariance / np.outer(sd, sd), abs=0.04
    )


def test_both_ways_give_one_posterior() -> None:
    linear, full = decay(np.random.default_rng(0))
    short = infer_linear(linear, "standard", np.random.default_rng(3), count=6000)
    long = infer(full, "standard", np.random.default_rng(4), count=6000)
    assert short.names == long.names
    assert short.status.trusted
    sd = long.draws.std(axis=0)
    away = (short.draws.mean(axis=0) - long.draws.mean(axis=0)) / sd
    assert np.abs(away).max() < 0.07
    assert short.draws.std(axis=0) == pytest.approx(sd, rel=0.05)
    assert np.corrcoef(short.draws, rowvar=False) == pytest.approx(
        np.corrcoef(long.draws, rowvar=False), abs=0.05
    )
    gaps = [short.log_posterior(u) - long.log_posterior(u) for u in long.draws[:20]]
    assert np.ptp(gaps) < 1e-8


def test_a_design_that_overflows_is_impossible_rather_than_an_error() -> None:
    linear, _ = decay(np.random.default_rng(0))
    assert marginalised(linear).log_posterior(np.array([np.nan, -1.0])) == -np.inf
