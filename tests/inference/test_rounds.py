"""NLopt's BOBYQA, by which a search goes on where there are no squares, against SciPy's methods."""

from functools import partial

import numpy as np
import pytest
from scipy.optimize import minimize

from scissorcal.aliases import Array
from scissorcal.inference import Optimum, Problem, find_optimum, optimise
from scissorcal.inference.problem import Stop

SEEDS = range(6)
SAME_HEIGHT = 0.01
CALLS_A_PARAMETER = 25


def regression_with_outliers(seed: int) -> Problem:
    """A line in several correlated columns; noise is Student's t of two degrees of freedom."""
    rng = np.random.default_rng(seed)
    size = int(rng.integers(3, 7))
    columns = rng.normal(size=(80, size)) @ (np.eye(size) + 0.6 * rng.normal(size=(size, size)))
    measured = columns @ rng.normal(size=size) + 0.1 * rng.standard_t(2, 80)

    def terms(u: Array) -> Array:
        return np.asarray(-1.5 * np.log1p(((measured - columns @ u) / 0.1) ** 2 / 2.0))

    return Problem(
        names=tuple(f"p{index}" for index in range(size)),
        log_prior=lambda u: -0.5 * float(u @ u) / 9.0,
        log_likelihood_terms=terms,
        series=np.zeros(80, dtype=np.int64),
        prior_sd=np.full(size, 3.0),
        starts=1.5 * rng.normal(size=(1, size)),
        lower=np.full(size, -36.0),
        upper=np.full(size, 36.0),
        independent=True,
    )


def round_by_scipy(
    method: str, problem: Problem, centre: Array, value: float, root: Array, stop: Stop | None
) -> tuple[Array, float]:
    """A round of search in the same round coordinates, by one of SciPy's methods."""
    best, height = centre, value

    def cost(z: Array) -> float:
        nonlocal best, height
        point = np.clip(centre + root @ z, problem.lower, problem.upper)
        reached = problem.log_posterior(point)
        if reached > height:
            best, height = point, reached
        return -reached

    size = len(centre)
    simplex = np.vstack([np.zeros(size), np.eye(size)])
    options = {"maxfev": CALLS_A_PARAMETER * size, "ftol": 1e-6}
    if method == "Nelder-Mead":
        options = {"maxfev": CALLS_A_PARAMETER * size, "fatol": 1e-6, "initial_simplex": simplex}
    minimize(cost, np.zeros(size), method=method, options=options)
    return best, height


@pytest.mark.parametrize("method", ["Nelder-Mead", "Powell"])
def test_rounds_by_nlopt_reach_as_high_as_scipys_with_two_thirds_of_the_calls(
    method: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def optima() -> list[Optimum]:
        return [find_optimum(regression_with_outliers(seed)) for seed in SEEDS]

    by_nlopt = optima()
    monkeypatch.setattr(optimise, "_round", partial(round_by_scipy, method))
    by_scipy = optima()
    for nlopt, scipy in zip(by_nlopt, by_scipy, strict=True):
        assert nlopt.success
        assert nlopt.value > scipy.value - SAME_HEIGHT
    calls = [sum(optimum.evaluations for optimum in made) for made in (by_nlopt, by_scipy)]
    assert calls[0] < 2 / 3 * calls[1]


def test_without_rounds_a_regression_with_outliers_stays_at_its_start(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem = regression_with_outliers(0)
    reached = find_optimum(problem)
    monkeypatch.setattr(
        optimise, "_round", lambda problem, centre, value, root, stop: (centre, value)
    )
    assert find_optimum(problem).value < reached.value - 100.0
