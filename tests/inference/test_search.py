"""What search and sampling count, when they stop, and how they take many points at once."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from scissorcal.aliases import Array
from scissorcal.inference import (
    Counter,
    InferOptions,
    Problem,
    SamplingStatus,
    SearchStatus,
    find_optimum,
    hessian,
    infer,
)

X = np.linspace(0.0, 4.0, 60)
TRUTH = np.array([2.0, 0.7, np.log(0.05)])


def decay(prior: float = 1.0) -> Problem:
    """y = a exp(-b x) with noise whose size is a parameter and grows with the mean."""
    rng = np.random.default_rng(0)

    def standardised(u: Array) -> tuple[Array, Array]:
        with np.errstate(all="ignore"):
            mean = u[0] * np.exp(-u[1] * X)
            log_sd = u[2] + 0.2 * mean
            return (measured - mean) / np.exp(log_sd), log_sd

    def terms(u: Array) -> Array:
        z, log_sd = standardised(u)
        with np.errstate(all="ignore"):
            return np.asarray(-0.5 * z**2 - log_sd)

    clean = TRUTH[0] * np.exp(-TRUTH[1] * X)
    measured = clean + np.exp(TRUTH[2] + 0.2 * clean) * rng.standard_normal(len(X))
    begin = np.array([0.5, 2.0, 0.0])
    sd = np.array([2.0, 1.0, 3.0])
    return Problem(
        names=("a", "b", "log_sd"),
        log_prior=lambda u: -0.5 * prior * float(np.sum(((u - begin) / sd) ** 2)),
        log_likelihood_terms=terms,
        series=np.zeros(len(X), dtype=np.int64),
        prior_sd=sd,
        starts=begin[None],
        lower=begin - 8 * sd,
        upper=begin + 8 * sd,
        standardised=standardised,
        independent=True,
    )


def at_once(problem: Problem) -> Callable[[Array], Array]:
    def many(points: Array) -> Array:
        return np.array([problem.log_prior(u) + problem.log_likelihood(u) for u in points])

    return many


def after(calls: int) -> Callable[[], bool]:
    """A clock that has run out after so many looks at it."""
    looks = iter(range(10**9))
    return lambda: next(looks) >= calls


def test_least_squares_and_bobyqa_reach_one_optimum_with_noise_that_depends_on_the_mean() -> None:
    problem = decay()
    by_squares, by_values = find_optimum(problem), find_optimum(replace(problem, standardised=None))
    assert by_squares.status is by_values.status is SearchStatus.SETTLED
    assert by_squares.value == pytest.approx(by_values.value, abs=1e-3)
    assert by_squares.evaluations < by_values.evaluations


@pytest.mark.parametrize("effort", ["draft", "standard", "thorough"])
@pytest.mark.parametrize("vectorised", [False, True])
def test_all_evaluations_are_counted(effort: str, vectorised: bool) -> None:
    problem, counter = decay(), Counter()
    if vectorised:
        problem = replace(problem, log_posterior_many=at_once(problem))
    found = infer(
        counter.over(problem), effort, np.random.default_rng(0), options=InferOptions(20_000)
    )
    assert found.evaluations == counter.calls


@pytest.mark.parametrize("independent", [True, False])
def test_many_points_at_once_give_the_same_draws(independent: bool) -> None:
    problem = replace(decay(), independent=independent)
    together = replace(problem, log_posterior_many=at_once(problem))
    one, other = (infer(p, "standard", np.random.default_rng(1)) for p in (problem, together))
    assert other.draws == pytest.approx(one.draws, abs=1e-9)
    assert other.evaluations == one.evaluations


def test_a_hessian_of_many_points_at_once_is_the_same() -> None:
    def bent(u: Array) -> float:
        return float(np.sin(u[0]) * u[1] + u[0] * u[1] * u[2] ** 2)

    point, step = np.array([0.3, -0.7, 1.1]), np.full(3, 1e-2)
    many = hessian(bent, point, step, lambda points: np.array([bent(u) for u in points]))
    assert many == pytest.approx(hessian(bent, point, step), abs=1e-12)
    x, y, z = point
    expected = [
        [-np.sin(x) * y, np.cos(x) + z**2, 2 * y * z],
        [np.cos(x) + z**2, 0.0, 2 * x * z],
        [2 * y * z, 2 * x * z, 2 * x * y],
    ]
    assert many == pytest.approx(np.array(expected), abs=1e-6)


@pytest.mark.parametrize("squares", [True, False])
def test_a_search_that_runs_out_of_time_says_so_and_keeps_the_best_point(squares: bool) -> None:
    problem = decay() if squares else replace(decay(), standardised=None)
    found = find_optimum(problem, stop=after(10))
    assert found.status is SearchStatus.TIME_USED_UP
    assert not found.success
    assert found.value >= problem.log_posterior(problem.starts[0])


@pytest.mark.parametrize("effort", ["standard", "thorough"])
@pytest.mark.parametrize("calls", [300, 3000])
def test_sampling_that_runs_out_of_time_gives_the_normal_approximation(
    effort: str, calls: int
) -> None:
    problem = decay()
    optimum = find_optimum(problem)
    rng = np.random.default_rng(0)
    found = infer(problem, effort, rng, optimum=optimum, options=InferOptions(stop=after(calls)))
    if effort == "standard" and calls == 3000:
        assert found.status is SamplingStatus.WEIGHED
        return
    assert found.status is SamplingStatus.BUDGET_USED_UP
    assert not found.status.trusted
    assert "The time ended first" in found.sentence
    assert found.draws.shape == (2000, 3)


def test_a_ridge_without_a_prior_is_no_optimum() -> None:
    """Each parameter matters by itself, their difference does not: any value of it does as well."""
    ridge = Problem(
        names=("a", "b"),
        log_prior=lambda u: 0.0,
        log_likelihood_terms=lambda u: np.array([-50.0 * float((u[0] + u[1]) ** 2)]),
        series=np.zeros(1, dtype=np.int64),
        prior_sd=np.full(2, 10.0),
        starts=np.array([[3.0, -2.0]]),
        lower=np.full(2, -200.0),
        upper=np.full(2, 200.0),
        independent=True,
    )
    found = infer(ridge, "draft", np.random.default_rng(0)).optimum
    assert found.status is SearchStatus.PLATEAU
    assert not found.success
    assert found.sentence.endswith("It concerns a, b.")
    held = replace(ridge, log_prior=lambda u: -0.005 * float(u @ u))
    kept = infer(held, "draft", np.random.default_rng(0)).optimum
    assert kept.status is SearchStatus.SETTLED
