"""A curved posterior is sampled by a proposal that follows it."""

from dataclasses import replace

import numpy as np
import pytest

from scissorcal.inference import Problem, infer
from scissorcal.inference.nested import DEPTH, nested_mixture

WIDE, NARROW, BEND = 1.0, 0.05, 2.0


def ridge() -> Problem:
    """x1 is N(0, 1), and x0 given it is N(2 x1^2, 0.05): a parabola, twenty times as long as wide.

    Its means are 2 and 0, its standard deviations sqrt(8 + 0.05^2) and 1.
    """

    def terms(u: np.ndarray) -> np.ndarray:
        return np.array([-0.5 * ((u[0] - BEND * u[1] ** 2) / NARROW) ** 2])

    return Problem(
        names=("along", "across"),
        log_prior=lambda u: -0.5 * float((u[1] / WIDE) ** 2),
        log_likelihood_terms=terms,
        series=np.zeros(1, dtype=np.int64),
        prior_sd=np.array([3.0, 1.0]),
        starts=np.zeros((1, 2)),
        lower=np.full(2, -100.0),
        upper=np.full(2, 100.0),
        independent=True,
        smooth=True,
    )


def test_moments_of_a_bent_ridge_are_exact() -> None:
    """2,000 draws: 4 standard errors of means and standard deviations."""
    found = infer(replace(ridge(), curved=(1,)), "standard", np.random.default_rng(1))
    assert found.status.trusted
    assert "follows the bend" in found.sentence
    assert found.draws.mean(axis=0) == pytest.approx([2.0, 0.0], abs=4.0 * 2.83 / np.sqrt(2000))
    assert found.draws[:, 1].std() == pytest.approx(1.0, rel=0.07)
    assert found.draws[:, 0].std() == pytest.approx(np.sqrt(8.0), rel=0.25)
    off = found.draws[:, 0] - BEND * found.draws[:, 1] ** 2
    assert off.std() == pytest.approx(NARROW, rel=0.07)


def test_it_takes_fewer_evaluations_than_a_mixture_that_adapts() -> None:
    plain = infer(ridge(), "standard", np.random.default_rng(1))
    followed = infer(replace(ridge(), curved=(1,)), "standard", np.random.default_rng(1))
    assert plain.evaluations > 2 * followed.evaluations


def test_a_normal_posterior_has_components_along_its_own_axes() -> None:
    """On a lattice of a normal with correlation 0.99, no node leaves the normal's line."""
    covariance = np.array([[1.0, 0.99], [0.99, 1.0]])
    precision = np.linalg.inv(covariance)
    found = nested_mixture(
        lambda points: -0.5 * np.einsum("ki,ij,kj->k", points, precision, points),
        np.zeros(2),
        covariance,
        (1,),
    )
    assert found is not None
    assert found.centres[:, 0] == pytest.approx(0.99 * found.centres[:, 1], abs=1e-6)
    inside = np.abs(found.centres[:, 1]) < np.sqrt(2.0 * DEPTH)
    assert np.all(inside)
    assert len(inside) == 7, "nodes at -3 to 3 sds: the next has 8 nats less"
    spread = found.roots @ found.roots.transpose(0, 2, 1)
    assert spread[:, 0, 0] - 0.99**2 * spread[:, 1, 1] == pytest.approx(1 - 0.99**2, abs=1e-6)


def test_there_is_no_proposal_where_the_density_is_not_finite() -> None:
    def beside_an_edge(points: np.ndarray) -> np.ndarray:
        return np.where(points[:, 0] > 0.0, -np.inf, -0.5 * np.sum(points**2, axis=1))

    assert nested_mixture(beside_an_edge, np.zeros(2), np.eye(2), (1,)) is None


def believed(away: float) -> Problem:
    """Data that see x0 - exp(x1) fall off, and priors N(0, 1) of x0 and N(away, 0.3) of x1."""
    plain = ridge()

    def terms(u: np.ndarray) -> np.ndarray:
        return np.array([-0.5 * (np.exp(u[0] - np.exp(u[1])) / 0.1) ** 2])

    def log_prior(u: np.ndarray) -> float:
        return -0.5 * float(u[0] ** 2 + ((u[1] - away) / 0.3) ** 2)

    starts = np.array([[0.0, away]])
    sized = replace(plain, prior_sd=np.array([1.0, 0.3]), starts=starts)
    return replace(sized, log_likelihood_terms=terms, log_prior=log_prior)


@pytest.mark.parametrize("effort", ["draft", "standard"])
def test_where_nothing_of_the_ridge_is_left_the_prior_keeps_its_shape(effort: str) -> None:
    """At exp(x1) = 7.4 data tell nothing: both are their priors."""
    found = infer(replace(believed(2.0), curved=(0, 1)), effort, np.random.default_rng(0))  # type: ignore[arg-type]
    assert found.draws.mean(axis=0) == pytest.approx([0.0, 2.0], abs=0.1)
    assert found.draws.std(axis=0) == pytest.approx([1.0, 0.3], rel=0.07)
    assert found.evaluations < 5000
