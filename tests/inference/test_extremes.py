"""Inference where numbers end: rounding, under- and overflow, nothing to go by."""

import numpy as np
import pytest

from scissorcal.inference import (
    InferOptions,
    NotFiniteError,
    Problem,
    find_optimum,
    fit_ar,
    infer,
    ljung_box,
    robust_covariance_of_scores,
    smooth_weights,
    tails_of,
)
from scissorcal.inference.ascent import least_squares
from scissorcal.inference.between import between_groups
from scissorcal.inference.importance import sample_by_importance
from scissorcal.inference.mixture import Mixture
from scissorcal.inference.thorough import rank_r_hat

ONE = np.zeros(1, dtype=np.int64)


def _problem(log_density, size: int = 1, start: float = 0.5) -> Problem:
    return Problem(
        names=tuple("abcdefgh"[:size]),
        log_prior=lambda u: 0.0,
        log_likelihood_terms=lambda u: np.array([log_density(u)]),
        series=ONE,
        prior_sd=np.ones(size),
        starts=np.full((1, size), start),
        lower=np.full(size, -np.inf),
        upper=np.full(size, np.inf),
        independent=True,
    )


def test_weight_on_a_few_draws_is_not_trusted_whatever_its_tail() -> None:
    """A posterior 1e-3 as wide as the proposal: about 5 of 2,000 draws meet it, all alike."""
    proposal = Mixture.of(np.ones(1), np.zeros((1, 1)), np.eye(1)[None])
    rng = np.random.default_rng(1)
    sampled = sample_by_importance(
        lambda u: np.where(abs(u[:, 0]) < 2e-3, 0.0, -60.0), proposal, 2000, rng, rounds=1
    )
    assert sampled.effective < 50
    assert not sampled.trusted


@pytest.mark.slow
def test_a_ridge_that_is_longer_than_its_proposal_is_not_reported_too_short() -> None:
    """Trusted draws of a valley bent 20 times its width: the sd of N(0, 1) to 15 %."""

    def density(u: np.ndarray) -> float:
        return float(-0.5 * u[0] ** 2 - 0.5 * ((u[1] - u[0] ** 2) / 0.05) ** 2)

    for seed in (2, 4):
        rng = np.random.default_rng(seed)
        found = infer(_problem(density, 2, 1.0), "standard", rng, options=InferOptions(40_000))
        assert not found.status.trusted or abs(found.draws[:, 0].std() - 1.0) < 0.15


def test_a_log_posterior_that_rounding_hides_is_refused() -> None:
    with pytest.raises(NotFiniteError, match="rounding hides"):
        infer(_problem(lambda u: -1e18 - u[0] ** 2), "draft", np.random.default_rng(1))


def test_no_data_give_the_prior_and_name_it() -> None:
    problem = Problem(
        names=("a",),
        log_prior=lambda u: -0.5 * float(u[0]) ** 2,
        log_likelihood_terms=lambda u: np.zeros(0),
        series=np.zeros(0, dtype=np.int64),
        prior_sd=np.ones(1),
        starts=np.zeros((1, 1)),
        lower=np.full(1, -np.inf),
        upper=np.full(1, np.inf),
        standardised=lambda u: (np.zeros(0), np.zeros(0)),
    )
    found = infer(problem, "standard", np.random.default_rng(1))
    assert found.null == ("a (100%)",)
    assert found.draws.std() == pytest.approx(1.0, abs=0.1)


@pytest.mark.slow
def test_a_prior_far_from_stretched_data_does_not_collapse_the_draws() -> None:
    """Prior 1e5 sds from the data; draws once came out 1e5 times too narrow, with a k-hat of -0.1.

    Sds of 1.3 times the prior's here follow from both: they must be of the prior's order.
    """
    x = np.stack([np.ones(60), np.linspace(-1, 1, 60)], axis=1)
    y = x @ [1.0, 2.0] + 1e6 + 0.1 * np.random.default_rng(1).standard_normal(60)

    def standardised(u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return (y - x @ u) / 0.1, np.full(60, np.log(0.1))

    problem = Problem(
        names=("a", "b"),
        log_prior=lambda u: float(-0.5 * np.sum(((u - 1e6) / 10.0) ** 2)),
        log_likelihood_terms=lambda u: -0.5 * standardised(u)[0] ** 2,
        series=np.zeros(60, dtype=np.int64),
        prior_sd=np.full(2, 10.0),
        starts=np.full((1, 2), 1e6),
        lower=np.full(2, -np.inf),
        upper=np.full(2, np.inf),
        standardised=standardised,
    )
    found = infer(problem, "standard", np.random.default_rng(1), options=InferOptions(30_000))
    assert not found.status.trusted or np.all(found.draws.std(axis=0) > 0.01)


@pytest.mark.parametrize("scale", [1e-200, 1.0, 1e200])
def test_whiteness_noise_and_tails_do_not_depend_on_units(scale: float) -> None:
    residuals = np.random.default_rng(1).standard_t(4, 2000)
    series = np.zeros(2000, dtype=np.int64)
    plain, scaled = ljung_box(residuals, series), ljung_box(scale * residuals, series)
    assert scaled.p_value == pytest.approx(plain.p_value, rel=1e-6)
    sd = fit_ar(scale * residuals, series).sd
    assert sd == pytest.approx(scale * fit_ar(residuals, series).sd, rel=1e-9)
    assert tails_of(scale * residuals, 1.0) == pytest.approx(tails_of(residuals, 1.0), rel=1e-3)


@pytest.mark.parametrize("count", [0, 1, 2, 3, 20, 21])
def test_few_residuals_are_tested_at_as_many_lags_as_they_have(count: int) -> None:
    residuals = np.random.default_rng(count).standard_normal(count)
    assert 0.0 < ljung_box(residuals, np.zeros(count, dtype=np.int64)).p_value <= 1.0


def test_residuals_equal_but_for_rounding_are_not_coloured() -> None:
    assert ljung_box(np.full(1000, 1 / 3), np.zeros(1000, dtype=np.int64)).p_value == 1.0


@pytest.mark.parametrize("values", [np.sin(0.3 * np.arange(1000.0)), np.arange(1000.0)])
def test_noise_that_follows_from_itself_has_a_finite_sd(values: np.ndarray) -> None:
    noise = fit_ar(values, np.zeros(1000, dtype=np.int64))
    assert noise.marginal_sd == pytest.approx(np.sqrt(np.mean(values**2)), rel=0.1)


def test_what_is_no_number_is_refused() -> None:
    bad = np.array([0.0, np.nan, 1.0])
    for refuse in (
        lambda: smooth_weights(bad),
        lambda: smooth_weights(np.zeros(0)),
        lambda: tails_of(bad, 1.0),
        lambda: robust_covariance_of_scores(bad[:, None], np.zeros(3, dtype=np.int64)),
        lambda: between_groups(bad[:, None], np.ones((3, 1, 1)), np.ones(1), np.eye(1),
                               np.random.default_rng(1)),
    ):  # fmt: skip
        with pytest.raises(ValueError, match=r"finite|importance ratios"):
            refuse()


def test_scores_that_follow_no_other_count_as_independent() -> None:
    scores = np.random.default_rng(1).standard_normal((200, 2))
    found = robust_covariance_of_scores(scores, np.arange(200))
    assert found == pytest.approx(scores.T @ scores)


def test_r_hat_of_chains_that_tell_nothing() -> None:
    assert np.isnan(rank_r_hat(np.ones((4, 100))))
    assert np.isnan(rank_r_hat(np.random.default_rng(1).standard_normal((4, 3))))
    assert np.isinf(rank_r_hat(np.arange(4.0)[:, None] * np.ones((4, 100))))


def test_groups_far_apart_leave_their_mean_as_open_as_they_are() -> None:
    far = between_groups(
        np.array([[1.0], [1e6]]),
        np.full((2, 1, 1), 100.0),
        np.full(1, 0.1),
        np.eye(1) * 1e-20,
        np.random.default_rng(1),
    )
    assert far.population.std() > 1e5


@pytest.mark.parametrize("slope", [np.nan, 1e200])
def test_least_squares_that_cannot_be_worked_out_have_not_converged(slope: float) -> None:
    def evaluate(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return x * slope - np.arange(1.0, 4.0), np.full((3, 1), slope)

    assert not least_squares(evaluate, np.zeros(1))[1]


def test_least_squares_with_too_few_residuals_are_refused() -> None:
    with pytest.raises(ValueError, match="as many residuals"):
        least_squares(lambda x: (np.ones(1), np.zeros((1, 2))), np.zeros(2))


def test_a_search_with_information_beyond_rounding_keeps_a_finite_point() -> None:
    """Slopes of 1e10 in one direction: eigenvalues of 1 come out of rounding below zero."""
    rng = np.random.default_rng(3)
    slopes = 1e10 * rng.standard_normal((200, 1)) * rng.standard_normal((1, 6))
    problem = Problem(
        names=tuple("abcdef"),
        log_prior=lambda u: -0.5 * float(u @ u),
        log_likelihood_terms=lambda u: slopes @ u,
        series=np.zeros(200, dtype=np.int64),
        prior_sd=np.ones(6),
        starts=np.zeros((1, 6)),
        lower=np.full(6, -5.0),
        upper=np.full(6, 5.0),
        smooth=True,
        independent=True,
    )
    assert np.all(np.isfinite(find_optimum(problem).point))
