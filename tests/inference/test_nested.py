"""A curved posterior is sampled by a proposal that follows it."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from scissorcal.inference import Problem, infer
from scissorcal.inference.importance import sample_by_proposal
from scissorcal.inference.infer import _following
from scissorcal.inference.laplace import laplace, shape_at
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


@pytest.mark.slow
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
        10_000,
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

    assert nested_mixture(beside_an_edge, np.zeros(2), np.eye(2), (1,), 10_000) is None


def test_there_is_none_where_the_budget_is_too_small() -> None:
    standard = partial(np.einsum, "ki,ki->k")
    assert nested_mixture(lambda x: -0.5 * standard(x, x), np.zeros(3), np.eye(3), (1,), 40) is None


def test_a_bend_along_one_axis_leaves_the_others_their_reach() -> None:
    """x3 follows 2 x0^2: of 400 nodes those along x0 lie nearer, the other axes reach as far."""

    def height(points: np.ndarray) -> np.ndarray:
        off = points[:, 3] - 2.0 * points[:, 0] ** 2
        return -0.5 * (np.sum(points[:, :3] ** 2, axis=1) + (off / 0.2) ** 2)

    covariance = np.diag([1.0, 1.0, 1.0, 0.04])
    found = nested_mixture(height, np.zeros(4), covariance, (0, 1, 2), 10**6)
    assert found is not None
    reach = np.abs(found.centres).max(axis=0)
    assert np.all(reach[:3] > 2.4)
    assert len(np.unique(found.centres[:, 0].round(6))) > len(np.unique(found.centres[:, 1]))
    np.testing.assert_allclose(found.centres[:, 3], 2.0 * found.centres[:, 0] ** 2, atol=0.05)


def test_more_than_three_parameters_are_refused() -> None:
    with pytest.raises(ValueError, match="3 parameters at most"):
        replace(ridge(), curved=(0, 1, 2, 3))


def test_a_stretched_posterior_is_followed_in_either_coordinates() -> None:
    """The ridge's own moments, in the coordinates before it was stretched and sheared."""
    problem = replace(ridge(), curved=(1,))
    pivot, stretch = np.zeros(2), np.array([[0.5, 0.2], [0.0, 0.5]])
    local = replace(
        laplace(problem, shape_at(problem, pivot), None),
        stretch=stretch,
        log_posteriors=lambda u: problem.log_posteriors(pivot + (u - pivot) @ stretch.T),
        covariance=np.linalg.inv(stretch) @ np.diag([NARROW**2, 1.0]) @ np.linalg.inv(stretch).T,
    )
    sampled = [
        sample_by_proposal(local.log_posteriors, one, 2000, np.random.default_rng(0), 200_000)
        for one in _following(local, (1,), lambda: 10**6)
    ]
    assert len(sampled) == 2
    for found in sampled:
        assert found.trusted
        written = local.written(found.resample(2000, np.random.default_rng(1)))
        assert written[:, 1].std() == pytest.approx(1.0, rel=0.07)
        off = written[:, 0] - BEND * written[:, 1] ** 2
        assert off.std() == pytest.approx(NARROW, rel=0.07)


def test_where_nothing_of_the_ridge_is_left_the_prior_keeps_its_shape() -> None:
    """At exp(x1) = 7.4 data tell nothing of x0 - exp(x1): both are their priors."""

    def height(points: np.ndarray) -> np.ndarray:
        seen = (np.exp(points[:, 0] - np.exp(points[:, 1])) / 0.1) ** 2
        return -0.5 * (seen + points[:, 0] ** 2 + ((points[:, 1] - 2.0) / 0.3) ** 2)

    centre, covariance = np.array([0.0, 2.0]), np.diag([1.0, 0.09])
    mixture = nested_mixture(height, centre, covariance, (0, 1), 10**6)
    assert mixture is not None
    found = sample_by_proposal(height, mixture, 2000, np.random.default_rng(0), 200_000)
    draws = found.resample(2000, np.random.default_rng(1))
    assert found.k_hat < 0.5
    assert draws.mean(axis=0) == pytest.approx([0.0, 2.0], abs=0.1)
    assert draws.std(axis=0) == pytest.approx([1.0, 0.3], rel=0.07)
