"""Candidates are distinguishable where strokes say so, and only there; PSIS-LOO against refits."""

import dataclasses

import numpy as np
import pytest

from scissorcal.calibration.candidates import is_positive
from scissorcal.calibration.comparison import candidate_rows, choose, comparison_text
from scissorcal.calibration.fit_candidate import (
    Candidate,
    FittedCandidate,
    Likelihood,
    fit_candidate,
)
from scissorcal.calibration.parameters import Layout, Parameter
from scissorcal.calibration.signals.filtering import Bins
from scissorcal.model import IDENTITY
from scissorcal.recording import Joint

STROKES, BINS = 12, 40


def line(
    outcome: np.ndarray, columns: np.ndarray, name: str, strokes: np.ndarray, sd: float = 0.5
) -> Candidate:
    """A linear law with normal noise of known size, whose leave-out densities are exact."""
    count = columns.shape[1]
    layout = Layout(
        tuple(Parameter(f"b{i}", "1", IDENTITY, 0.0, 10.0, "weight") for i in range(count))
    )

    def residuals(u: np.ndarray) -> np.ndarray:
        return outcome - columns @ u

    def normal(u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return residuals(u) / sd, np.full(len(outcome), np.log(sd))

    return Candidate(
        name=name,
        key={},
        layout=layout,
        likelihood=Likelihood(residuals, normal),
        starts=np.zeros((1, count)),
        prior_mean=np.zeros(count),
        prior_precision=np.eye(count) / 100.0,
    )


def design(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    strokes = np.repeat(np.arange(STROKES), BINS)
    x = rng.standard_normal(STROKES * BINS)
    return x, x**2 - 1.0, strokes


def exact_leave_out(outcome, columns, strokes, share, sd=0.5) -> float:
    """Sum over strokes of the tempered log density of each, by the posterior without it."""
    total = 0.0
    for label in np.unique(strokes):
        seen = strokes != label
        weight = share / sd**2
        precision = np.eye(columns.shape[1]) / 100.0 + weight * columns[seen].T @ columns[seen]
        mean = np.linalg.solve(precision, weight * columns[seen].T @ outcome[seen])
        x, y = columns[~seen], outcome[~seen]
        noise = sd**2 / share
        spread = noise * np.eye(len(y)) + x @ np.linalg.solve(precision, x.T)
        away = y - x @ mean
        _, logdet = np.linalg.slogdet(spread)
        density = -0.5 * (away @ np.linalg.solve(spread, away) + logdet)
        # exp(share * log N(y; m, sd)) is N(y; m, sd / sqrt(share)) up to this constant.
        constant = len(y) * (0.5 * np.log(noise) - share * np.log(sd))
        total += (density + constant) / share
    return total


@pytest.mark.parametrize("seed", range(3))
def test_psis_loo_over_strokes_equals_the_closed_form(seed):
    rng = np.random.default_rng(seed)
    x, square, strokes = design(rng)
    columns = np.column_stack([np.ones_like(x), x, square])
    outcome = 1.0 + 2.0 * x + 0.5 * rng.standard_normal(len(x))
    found = fit_candidate(line(outcome, columns, "quadratic", strokes), strokes, strokes)
    assert np.all(found.left_out.reliable)
    expected = exact_leave_out(outcome, columns, strokes, found.share)
    assert found.left_out.scores.sum() == pytest.approx(expected, abs=0.1)


def fitted_pair(bend: float, seed: int) -> list[FittedCandidate]:
    rng = np.random.default_rng(seed)
    x, square, strokes = design(rng)
    outcome = 1.0 + 2.0 * x + bend * square + 0.5 * rng.standard_normal(len(x))
    straight = np.column_stack([np.ones_like(x), x])
    laws = (("line", straight), ("parabola", np.column_stack([straight, square])))
    return [fit_candidate(line(outcome, c, name, strokes), strokes, strokes) for name, c in laws]


def test_equivalent_candidates_are_one_class_and_the_simplest_is_used():
    fitted = fitted_pair(0.0, 1)
    chosen = choose(fitted)
    assert chosen.name == "line"
    assert chosen.equivalent == ("line", "parabola")
    assert [row["equivalent"] for row in candidate_rows(fitted, chosen)] == [True, True]
    assert [row["chosen"] for row in candidate_rows(fitted, chosen)] == [True, False]


def test_a_distinguishable_candidate_is_not_equivalent():
    fitted = fitted_pair(0.2, 1)
    chosen = choose(fitted)
    assert chosen.name == "parabola"
    rows = candidate_rows(fitted, chosen)
    assert [row["equivalent"] for row in rows] == [False, True]
    assert np.isfinite(rows[1]["loo"])
    assert np.isnan(rows[0]["loo"])  # far behind: PSIS-LOO could not speak for it
    assert rows[1]["loo_se"] > 0


def test_bic_counts_as_many_bins_as_are_independent():
    """-2 log L + k log n (Schwarz 1978), with log L and n of that share of the bins.

    Left out of log L is log(2 pi) / 2 of each bin, which all candidates have.
    """
    fitted = fitted_pair(0.2, 1)
    share = fitted[1].share  # of the best
    for one, row, k in zip(fitted, candidate_rows(fitted, choose(fitted)), (2, 3), strict=True):
        z, log_sd = one.candidate.likelihood.normal(one.optimum.point)
        expected = share * np.sum(z**2 + 2.0 * log_sd) + k * np.log(share * STROKES * BINS)
        assert row["bic"] == pytest.approx(expected, rel=1e-12)


def test_evidence_decides_however_small_a_difference_is():
    """What a person would not feel is decided where a model is rendered; a stated error counts."""
    fitted = fitted_pair(0.2, 1)
    assert choose(fitted, signal_rms=1e3).equivalent == ("parabola",)
    assert choose(fitted, signal_rms=1e3, negligible=0.01).equivalent == ("line", "parabola")


@pytest.mark.slow
def test_the_simple_truth_is_seldom_rejected():
    """The test's own level is 5 % and it wants 3 nats besides: at most 2 of 20 (99 %)."""
    rejected = sum(choose(fitted_pair(0.0, seed)).name != "line" for seed in range(20))
    assert rejected <= 2


def test_a_single_candidate_is_not_compared():
    fitted = fitted_pair(0.0, 2)[:1]
    (row,) = candidate_rows(fitted, choose(fitted))
    assert row["equivalent"]
    assert np.isnan(row["loo"])


def test_one_stroke_alone_gives_no_evidence():
    gained = np.full(12, -0.1)
    gained[3] = 50.0
    assert not is_positive(gained)
    assert is_positive(np.full(12, 0.5))
    assert not is_positive(np.full(12, 0.1)), "consistent, but less than 3 nats"


def test_units_in_which_candidates_do_not_differ_are_no_evidence_against_the_best():
    """A camera's distortion shows in photographs of the corners only."""
    gained = np.array([4.0, 10.0, 9.0, 5.0, 5.0, 11.0, -0.2, 0.1, -0.1, -0.2, 0.0, -0.1])
    assert is_positive(gained)


def test_a_stroke_that_alone_decides_a_parameter_is_called_unreliable():
    rng = np.random.default_rng(4)
    _, _, strokes = design(rng)
    only = np.where(strokes == 5, rng.standard_normal(len(strokes)), 0.0)
    columns = np.column_stack([np.ones(len(strokes)), only])
    outcome = 1.0 + 3.0 * only + 0.5 * rng.standard_normal(len(strokes))
    found = fit_candidate(line(outcome, columns, "one stroke's", strokes), strokes, strokes)
    assert np.flatnonzero(~found.left_out.reliable).tolist() == [5]


def test_segments_of_a_path_are_counted_and_not_timed():
    """A cut's segments have no length in seconds: no sentence may say "nan s"."""
    fitted = fitted_pair(0.02, 1)
    chosen = choose(fitted)
    count = STROKES * BINS
    numbers, zeros = np.zeros(count, dtype=np.int64), np.zeros(count)
    segments = Bins(
        time_s=zeros,
        opening=np.tile(np.linspace(0.8, 0.2, BINS), STROKES),
        rate=np.repeat(-np.linspace(0.1, 1.0, STROKES), BINS),
        acceleration=zeros,
        drive=zeros,
        advance=zeros,
        moving=np.ones(count, dtype=bool),
        series=numbers,
        recording=numbers,
        stroke=np.repeat(np.arange(STROKES), BINS),
        sheet=numbers,
        bin_s=float("nan"),
        rate_floor=0.0,
    )
    contact = np.full(count, np.nan)
    said = comparison_text(fitted, chosen, segments, contact, Joint())
    assert "more segments of the path there would distinguish them" in said
    assert "nan" not in said
    timed = dataclasses.replace(segments, bin_s=0.005)
    assert "s more of motion" in comparison_text(fitted, chosen, timed, contact, Joint())


def test_strokes_without_a_density_do_not_break_the_comparison():
    """Where no density is finite the candidate is left out of PSIS-LOO; the fit goes on."""
    fitted = fitted_pair(0.2, 1)
    broken = dataclasses.replace(fitted[1], information=np.full((3, 3), 1e-30))
    assert broken.left_out.scores.shape == (STROKES,)
    assert choose([fitted[0], broken]).name == "parabola"
