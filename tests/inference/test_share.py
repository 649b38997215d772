"""A likelihood counts by the share of its terms that are independent."""

from dataclasses import replace

import numpy as np
import pytest

from scissorcal.inference import Problem, find_optimum, infer
from scissorcal.inference.autocorrelation import long_run_covariance
from scissorcal.inference.laplace import shape_at
from tests.inference.test_long_run import regression, sweeps

TIMES = 40
COUNT = 600


def problems(believed: float = 0.01) -> tuple[Problem, Problem]:
    """Sweeps with an offset that a prior of sd ``believed`` nearly knows: once, and 40 times."""
    rng = np.random.default_rng(3)
    columns = np.column_stack([np.ones(COUNT), sweeps(COUNT)])
    measured = columns @ np.array([0.3, 1.0, 0.5, 0.2]) + 0.5 * rng.standard_normal(COUNT)
    series = np.zeros(COUNT, dtype=np.int64)

    def log_prior(u: np.ndarray) -> float:
        return -0.5 * float((u[0] / believed) ** 2 + np.sum((u[1:] / 50.0) ** 2))

    once = replace(regression(columns, measured, series), log_prior=log_prior)
    often = regression(
        np.tile(columns, (TIMES, 1)), np.tile(measured, TIMES), np.repeat(np.arange(TIMES), COUNT)
    )
    return once, replace(often, log_prior=log_prior, share=1.0 / TIMES)


def test_what_is_said_forty_times_is_worth_what_it_is_worth_once() -> None:
    once, often = problems()
    there, here = find_optimum(once).point, find_optimum(often).point
    assert here == pytest.approx(there, abs=1e-5)
    assert often.log_posterior(there) == pytest.approx(once.log_posterior(there))
    shapes = [shape_at(one, there) for one in (once, often)]
    assert shapes[1].information == pytest.approx(shapes[0].information, rel=1e-6, abs=1e-6)
    assert shapes[1].slope == pytest.approx(shapes[0].slope, abs=1e-6)


def test_terms_in_full_overrule_a_prior_that_a_share_heeds() -> None:
    """Forty times 600 terms move the offset to 0.30, 30 of its prior's sds; a share of them 5."""
    _, often = problems()
    heeded, overruled = (find_optimum(one).point[0] for one in (often, replace(often, share=1.0)))
    assert heeded < 0.06
    assert overruled > 4.0 * heeded


def test_the_scores_covariance_counts_the_share_twice() -> None:
    """So that what it says of the data, H J^-1 H, does not depend on the share."""
    once, _ = problems()
    point = find_optimum(once).point
    whole, half = (
        long_run_covariance(one, shape.scores, shape.slopes).covariance
        for one in (once, replace(once, share=0.5))
        for shape in (shape_at(one, point),)
    )
    assert half == pytest.approx(0.25 * whole, abs=1e-6 * whole.max())


def test_intervals_are_as_wide_as_the_scores_vary_whatever_the_share() -> None:
    """White noise: a share of a quarter is wrong about it, and no interval is twice as wide."""
    once, _ = problems(believed=50.0)
    plain = infer(once, "draft", np.random.default_rng(0))
    shared = infer(replace(once, share=0.25), "draft", np.random.default_rng(0))
    assert shared.inflation[1:-1] == pytest.approx(np.ones(3), rel=0.1)
    assert plain.inflation[1:-1] == pytest.approx(np.ones(3), rel=0.1)


def test_a_search_without_squares_weighs_a_share_alike() -> None:
    """Student-t terms are searched by values; with many degrees of freedom they are normal."""
    _, often = problems()
    here = find_optimum(often).point
    there = find_optimum(replace(often, standardised=None)).point
    assert there == pytest.approx(here, abs=2e-3)


def test_a_direction_without_data_keeps_its_prior_whatever_the_share() -> None:
    """The information that keeps such directions well defined is not divided by the share."""
    columns = np.column_stack([np.zeros(COUNT), sweeps(COUNT)])
    noise = 0.5 * np.random.default_rng(3).standard_normal(COUNT)
    measured = columns @ np.array([0.3, 1.0, 0.5, 0.2]) + noise
    blind = regression(columns, measured, np.zeros(COUNT, dtype=np.int64))
    for share in (1.0, 1e-3):
        posterior = infer(replace(blind, share=share), "draft", np.random.default_rng(0))
        assert posterior.draws[:, 0].std() == pytest.approx(50.0, rel=0.05)
