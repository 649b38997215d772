"""BFGS on smooth log-posteriors that are no sums of squares."""

from collections.abc import Callable

import numpy as np
import pytest

from scissorcal.aliases import Array
from scissorcal.inference import Counter, Problem, SearchStatus, find_optimum
from scissorcal.inference.ascent import ascend


def problem(height: Callable[[Array], float], size: int, start: Array, sd: float = 10.0) -> Problem:
    """A smooth problem with a flat prior of known width."""
    return Problem(
        names=tuple(f"p{i}" for i in range(size)),
        log_prior=lambda u: 0.0,
        log_likelihood_terms=lambda u: np.array([height(u)]),
        series=np.zeros(1, dtype=np.int64),
        prior_sd=np.full(size, sd),
        starts=start[None],
        lower=np.full(size, -8 * sd),
        upper=np.full(size, 8 * sd),
        independent=True,
        smooth=True,
    )


def unit(given: Problem, point: Array) -> Array:
    """A rounding that knows nothing."""
    return np.diag(0.1 * given.prior_sd)


def ridge(u: Array) -> float:
    """A curved ridge, as Rosenbrock's."""
    return -50.0 * float((u[1] - u[0] ** 2) ** 2) - 0.5 * float((u[0] - 1.0) ** 2)


def test_a_correlated_normal_is_climbed_to_its_mean() -> None:
    rng = np.random.default_rng(0)
    root = rng.standard_normal((6, 6))
    precision, mean = root @ root.T + 0.1 * np.eye(6), rng.standard_normal(6)
    given = problem(lambda u: -0.5 * float((u - mean) @ precision @ (u - mean)), 6, np.zeros(6))
    found = ascend(given, np.zeros(6), unit)
    away = found.point - mean
    assert found.value == pytest.approx(-0.5 * away @ precision @ away, abs=1e-12)
    assert found.value > -1e-3


def test_the_root_is_that_of_the_covariance_at_the_optimum() -> None:
    precision = np.array([[4.0, 1.0], [1.0, 9.0]])
    given = problem(lambda u: -0.5 * float(u @ precision @ u), 2, np.array([3.0, -2.0]))

    def exact(given: Problem, point: Array) -> Array:
        return np.linalg.cholesky(np.linalg.inv(precision))

    found = ascend(given, np.array([3.0, -2.0]), exact)
    assert found.root @ found.root.T == pytest.approx(np.linalg.inv(precision), rel=0.05)
    assert found.promised < 1e-4


@pytest.mark.parametrize("start", [(-1.2, 1.0), (4.0, 12.0), (0.0, 0.0)])
def test_a_curved_ridge_is_followed_to_its_top(start: tuple[float, float]) -> None:
    given = problem(ridge, 2, np.array(start))
    found = find_optimum(given)
    assert found.status is SearchStatus.SETTLED
    assert found.value == pytest.approx(0.0, abs=0.05)
    assert found.point[1] == pytest.approx(found.point[0] ** 2, abs=0.05)


def test_a_cliff_is_not_stepped_over() -> None:
    """Where no number is finite the step is halved, and the best point seen is kept."""

    def height(u: Array) -> float:
        return -0.5 * float(np.sum((u - 2.0) ** 2)) if u[0] < 2.05 else -np.inf

    found = ascend(problem(height, 3, np.zeros(3)), np.zeros(3), unit)
    assert np.isfinite(found.value)
    assert found.value > -0.02


def test_a_start_that_has_no_number_is_given_back() -> None:
    found = ascend(problem(lambda u: -np.inf, 2, np.zeros(2)), np.array([1.0, 2.0]), unit)
    assert found.value == -np.inf
    assert found.point.tolist() == [1.0, 2.0]


def test_the_bounds_are_kept() -> None:
    given = problem(lambda u: float(u.sum()), 2, np.zeros(2), sd=1.0)
    found = ascend(given, np.zeros(2), unit)
    assert np.all(found.point <= given.upper)
    assert found.value > 10.0


def test_it_stops_when_told_to_and_spends_little() -> None:
    counter = Counter()
    given = counter.over(problem(ridge, 2, np.array([-1.2, 1.0])))
    ascend(given, np.array([-1.2, 1.0]), unit, stop=lambda: True)
    assert counter.calls <= 2
    ascend(given, np.array([-1.2, 1.0]), unit)
    assert counter.calls < 700
