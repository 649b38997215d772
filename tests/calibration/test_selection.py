"""Rungs: told apart where strokes tell them apart, and only there; PSIS-LOO against refits."""

import dataclasses

import numpy as np
import pytest
from scipy.stats import wilcoxon

from scissorcal.calibration import fit_friction
from scissorcal.calibration.candidates import (
    Climbed,
    Likelihood,
    Rung,
    beaten,
    choose,
    climb,
    signed_rank_chance,
)
from scissorcal.calibration.parameters import Layout, Parameter
from scissorcal.calibration.rung_table import rung_table
from scissorcal.calibration.selection import selection_sentence
from scissorcal.calibration.signals.filtering import Bins
from scissorcal.model.transforms import IDENTITY
from scissorcal.recipe.schema import FitFriction
from scissorcal.recording.recording import Joint
from tests.calibration.truth import Truth, friction_recording

STROKES, BINS = 12, 40


def line(
    outcome: np.ndarray, columns: np.ndarray, name: str, strokes: np.ndarray, sd: float = 0.5
) -> Rung:
    """A linear law with normal noise of known size, whose leave-out densities are exact."""
    count = columns.shape[1]
    layout = Layout(
        tuple(Parameter(f"b{i}", "1", IDENTITY, 0.0, 10.0, "weight") for i in range(count))
    )

    def residuals(u: np.ndarray) -> np.ndarray:
        return outcome - columns @ u

    def normal(u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return residuals(u) / sd, np.full(len(outcome), np.log(sd))

    return Rung(
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
    found = climb(line(outcome, columns, "quadratic", strokes), strokes, strokes)
    assert np.all(found.left_out.reliable)
    expected = exact_leave_out(outcome, columns, strokes, found.share)
    assert found.left_out.scores.sum() == pytest.approx(expected, abs=0.1)


def climbed_pair(bend: float, seed: int) -> list[Climbed]:
    rng = np.random.default_rng(seed)
    x, square, strokes = design(rng)
    outcome = 1.0 + 2.0 * x + bend * square + 0.5 * rng.standard_normal(len(x))
    straight = np.column_stack([np.ones_like(x), x])
    laws = (("line", straight), ("parabola", np.column_stack([straight, square])))
    return [climb(line(outcome, c, name, strokes), strokes, strokes) for name, c in laws]


def test_rungs_that_predict_alike_are_one_class_and_the_cheapest_is_used():
    climbed = climbed_pair(0.0, 1)
    chosen = choose(climbed)
    assert chosen.rung.name == "line"
    assert chosen.alike == ("line", "parabola")
    assert [row["equivalent"] for row in rung_table(climbed, chosen)] == [True, True]
    assert [row["chosen"] for row in rung_table(climbed, chosen)] == [True, False]


def test_a_rung_that_strokes_tell_apart_is_out_of_the_class():
    climbed = climbed_pair(0.2, 1)
    chosen = choose(climbed)
    assert chosen.rung.name == "parabola"
    rows = rung_table(climbed, chosen)
    assert [row["equivalent"] for row in rows] == [False, True]
    assert rows[1]["loo"] > rows[0]["loo"]
    assert rows[1]["loo_se"] > 0


def test_a_difference_that_nobody_feels_is_no_difference():
    climbed = climbed_pair(0.2, 1)
    assert choose(climbed, signal_rms=1e3).alike == ("line", "parabola")


def test_the_simple_truth_is_seldom_rejected():
    """The test's own level is 5 % and it wants 3 nats besides: at most 2 of 20 (99 %)."""
    rejected = sum(choose(climbed_pair(0.0, seed)).rung.name != "line" for seed in range(20))
    assert rejected <= 2


def test_a_single_rung_is_not_compared():
    climbed = climbed_pair(0.0, 2)[:1]
    (row,) = rung_table(climbed, choose(climbed))
    assert row["equivalent"]
    assert np.isnan(row["loo"])


@pytest.mark.parametrize("count", [6, 13, 40])
def test_the_chance_of_signed_ranks_is_scipys(count):
    gained = np.random.default_rng(count).normal(0.2, 1.0, count)
    expected = wilcoxon(gained, alternative="greater", method="exact").pvalue
    assert signed_rank_chance(gained) == pytest.approx(expected, rel=1e-12)


def test_one_lucky_stroke_beats_nothing():
    gained = np.full(12, -0.1)
    gained[3] = 50.0
    assert not beaten(gained)
    assert beaten(np.full(12, 0.5))
    assert not beaten(np.full(12, 0.1)), "consistent, but less than 3 nats"


def test_a_stroke_that_alone_decides_a_parameter_is_called_unreliable():
    rng = np.random.default_rng(4)
    _, _, strokes = design(rng)
    only = np.where(strokes == 5, rng.standard_normal(len(strokes)), 0.0)
    columns = np.column_stack([np.ones(len(strokes)), only])
    outcome = 1.0 + 3.0 * only + 0.5 * rng.standard_normal(len(strokes))
    found = climb(line(outcome, columns, "one stroke's", strokes), strokes, strokes)
    assert np.flatnonzero(~found.left_out.reliable).tolist() == [5]


def test_a_fit_names_what_cannot_be_told_apart_and_what_would_tell_it():
    recording = friction_recording(Truth(), np.random.default_rng(1))
    ladder = FitFriction(critic=False)
    found = fit_friction((recording,), ladder, effort="standard", rng=np.random.default_rng(3))
    alike = [row["name"] for row in found.rungs if row["equivalent"]]
    assert found.rung in alike
    assert len(alike) > 1
    for name in alike:
        assert name in found.selection
    assert "is used" in found.selection
    assert "would tell them apart" in found.selection
    assert "rad/s" in found.selection
    named = FitFriction(rung="coulomb+viscous", symmetry="asymmetric")
    alone = fit_friction((recording,), named, effort="draft", rng=np.random.default_rng(3))
    assert "named in the recipe" in alone.selection


def test_segments_of_a_path_are_counted_and_not_timed():
    """A cut's segments have no length in seconds: no sentence may say "nan s"."""
    climbed = climbed_pair(0.02, 1)
    chosen = choose(climbed)
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
    said = selection_sentence(climbed, chosen, segments, contact, Joint())
    assert "more segments of the path there would tell them apart" in said
    assert "nan" not in said
    timed = dataclasses.replace(segments, bin_s=0.005)
    assert "s more of motion" in selection_sentence(climbed, chosen, timed, contact, Joint())


def test_bad_strokes_do_not_break_the_comparison():
    """Where no density is finite the rung is kept out of PSIS-LOO, not the fit stopped."""
    climbed = climbed_pair(0.2, 1)
    broken = dataclasses.replace(climbed[1], information=np.full((3, 3), 1e-30))
    assert broken.left_out.scores.shape == (STROKES,)
    assert choose([climbed[0], broken]).rung.name == "parabola"
