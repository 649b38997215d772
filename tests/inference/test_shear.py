"""A curved ridge is sampled in coordinates in which it is straight."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scissorcal.inference import Problem, infer
from scissorcal.inference.mixture import Mixture, Shear

WIDE, NARROW, BEND = 1.0, 0.05, 2.0
SHEAR = Shear(0, 1, lambda x: BEND * np.square(x))

finite = st.floats(-1e3, 1e3)


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


@given(finite, finite)
def test_bent_undoes_straight(first: float, second: float) -> None:
    point = np.array([first, second])
    assert SHEAR.bent(SHEAR.straight(point)) == pytest.approx(point, rel=1e-9, abs=1e-6)


def test_a_small_mixture_has_the_same_density_in_both_coordinates() -> None:
    """The Jacobian is 1: where the bend is nearly a line, a mapped mixture is the mixture."""
    rng = np.random.default_rng(0)
    centre, sd = np.array([1.0, 0.7]), 1e-5
    own = Mixture.of(np.ones(1), centre[None], sd**2 * np.eye(2)[None])
    draws = own.draw(50, rng)
    mapped = SHEAR.mixture(own)
    assert mapped.log_density(SHEAR.straight(draws)) == pytest.approx(
        own.log_density(draws), abs=1e-3
    )


def test_moments_of_a_bent_ridge_are_exact() -> None:
    """2,000 draws: 4 standard errors of means and standard deviations."""
    found = infer(replace(ridge(), shear=SHEAR), "standard", np.random.default_rng(1))
    assert found.draws.mean(axis=0) == pytest.approx([2.0, 0.0], abs=4.0 * 2.83 / np.sqrt(2000))
    assert found.draws[:, 1].std() == pytest.approx(1.0, rel=0.07)
    assert found.draws[:, 0].std() == pytest.approx(np.sqrt(8.0), rel=0.25)
    off = found.draws[:, 0] - BEND * found.draws[:, 1] ** 2
    assert off.std() == pytest.approx(NARROW, rel=0.07)
    assert found.k_hat < 0.3, "one Student-t fits it"
    assert found.evaluations < 5000


def test_without_such_coordinates_the_same_ridge_takes_a_mixture_and_more() -> None:
    plain = infer(ridge(), "standard", np.random.default_rng(1))
    straight = infer(replace(ridge(), shear=SHEAR), "standard", np.random.default_rng(1))
    assert plain.evaluations > 4 * straight.evaluations


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
    """At exp(x1) = 7.4 data tell nothing: both are their priors, where a sheared one would bend."""
    shear = Shear(0, 1, np.exp, most=3.0)
    found = infer(replace(believed(2.0), shear=shear), effort, np.random.default_rng(0))  # type: ignore[arg-type]
    assert found.draws.mean(axis=0) == pytest.approx([0.0, 2.0], abs=0.1)
    assert found.draws.std(axis=0) == pytest.approx([1.0, 0.3], rel=0.07)
    assert found.evaluations < 5000
