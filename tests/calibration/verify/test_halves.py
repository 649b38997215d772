"""Splits see all speeds, and the difference of halves has the distribution that is claimed."""

import numpy as np
import pytest

from scissorcal.calibration.verify.statistics import (
    HalfFit,
    StrokeFacts,
    compare,
    effort_difference,
    split_strokes,
)

SPEEDS = (0.1, 0.3, 0.8, 1.5)


def facts(repeats: int, excitation: bool = False) -> list[StrokeFacts]:
    rows = [
        (kind, speed) for _ in range(repeats) for speed in SPEEDS for kind in ("closing", "opening")
    ]
    found = [StrokeFacts(i, kind, speed) for i, (kind, speed) in enumerate(rows)]
    if excitation:
        found.append(StrokeFacts(len(rows), "excitation", float("nan")))
    return found


def test_both_halves_see_every_speed_in_every_direction():
    strokes = np.repeat(np.arange(16), 10)
    every = facts(2)
    split = split_strokes(strokes, every)
    assert split is not None
    assert not np.any(split.first & split.second)
    assert np.all(split.first | split.second)
    for half in (split.first, split.second):
        seen = {(every[label].kind, every[label].speed) for label in np.unique(strokes[half])}
        assert len(seen) == 8
    for label in range(16):
        assert len(set(split.first[strokes == label])) == 1, "strokes stay whole"


def test_without_repeats_speeds_alternate_by_direction_and_an_excitation_is_split():
    strokes = np.repeat(np.arange(9), 40)
    split = split_strokes(strokes, facts(1, excitation=True))
    assert split is not None
    first = {label for label in range(8) if split.first[strokes == label].all()}
    assert len(first) == 4
    assert len({label // 2 for label in first}) == 4, "each speed once"
    assert split.first[strokes == 8].tolist() == [True] * 10 + [False] * 20 + [True] * 10


def test_sheets_stay_whole():
    strokes = np.repeat(np.arange(6), 5)
    split = split_strokes(strokes, [StrokeFacts(i, "closing", 0.1, i // 2) for i in range(6)])
    assert split is not None
    assert sorted(set(strokes[split.first])) == [0, 1, 4, 5]
    assert "whole sheets" in split.words


def test_recordings_stay_whole_before_sheets_and_speeds():
    strokes = np.repeat(np.arange(6), 5)
    rows = [StrokeFacts(i, "closing", 0.1 * i, i, recording=i // 2) for i in range(6)]
    split = split_strokes(strokes, rows)
    assert split is not None
    assert sorted(set(strokes[split.first])) == [0, 1, 4, 5]
    assert split.recordings == (2, 1)
    assert split.words == "whole recordings, 2 of 3 in one half"


def test_one_stroke_cannot_be_split():
    assert split_strokes(np.zeros(10, dtype=int), [StrokeFacts(0, "closing", 0.1)]) is None


def halves_of_a_linear_model(rng, truth, prior_precision, widths, count=2000):
    """Two posteriors of independent normal data with a common prior, exact."""
    found = []
    for width in widths:
        information = np.linalg.inv(width @ width.T)
        estimate = truth + width @ rng.standard_normal(len(truth))
        covariance = np.linalg.inv(information + prior_precision)
        found.append(HalfFit(covariance @ information @ estimate, covariance, count))
    return found


def test_differences_match_their_covariance_with_a_strong_common_prior():
    """300 draws from prior and data: p-values uniform (Kolmogorov, 1 in 10000), z of unit size."""
    from scipy.stats import kstest

    rng = np.random.default_rng(1)
    prior = np.diag([4.0, 1e-4, 1.0])
    widths = [np.array([[0.5, 0, 0], [0.3, 0.2, 0], [0, 0, 0.7]]), np.diag([0.4, 0.3, 1.0])]
    p, z, effort = [], [], []
    slopes = rng.standard_normal((40, 3))
    for _ in range(300):
        truth = rng.standard_normal(3) / np.sqrt(np.diag(prior))
        first, second = halves_of_a_linear_model(rng, truth, prior, widths)
        found = compare(first, second, prior)
        p.append(found.p_value)
        z.append(found.z)
        effort.append(effort_difference(found, slopes, rng)[2] if len(effort) < 60 else np.nan)
    assert kstest(p, "uniform").pvalue > 1e-4
    assert kstest([value for value in effort if np.isfinite(value)], "uniform").pvalue > 1e-4
    assert np.std(z, axis=0) == pytest.approx([1, 1, 1], abs=0.13)


def test_overconfident_halves_are_detected():
    rng = np.random.default_rng(2)
    width = 0.1 * np.eye(4)
    alarms = []
    for _ in range(200):
        first, second = halves_of_a_linear_model(rng, np.zeros(4), 1e-6 * np.eye(4), [width] * 2)
        bold = [HalfFit(half.mean, half.covariance / 4**2, 500) for half in (first, second)]
        alarms.append(compare(*bold, 1e-6 * np.eye(4)).p_value < 0.0025)
    assert np.mean(alarms) > 0.9


def test_few_independent_observations_are_allowed_for():
    """Covariances estimated from 15 observations: a chi-square would raise 5 times the alarms."""
    rng = np.random.default_rng(3)
    alarms = []
    for _ in range(1000):
        halves = []
        for _ in range(2):
            data = rng.standard_normal((15, 3))
            halves.append(HalfFit(data.mean(axis=0), np.cov(data, rowvar=False) / 15, 14.0))
        alarms.append(compare(*halves, 1e-9 * np.eye(3)).p_value < 0.05)
    assert np.mean(alarms) < 0.07


def test_directions_that_only_repeat_the_prior_are_left_out():
    prior = np.eye(2)
    silent = HalfFit(np.zeros(2), np.diag([1.0, 0.01]), 100.0)
    found = compare(silent, HalfFit(np.array([0.0, 0.05]), silent.covariance, 100.0), prior)
    assert found.dimensions == 1
    assert np.isnan(found.z[0])
    assert found.z[1] == pytest.approx(0.05 / np.sqrt(2 * 0.01 - 2 * 0.01**2))
    nothing = compare(silent, silent, prior)
    assert nothing.statistic == 0.0
    assert (
        compare(
            HalfFit(np.zeros(2), np.eye(2), 100.0), HalfFit(np.zeros(2), np.eye(2), 100.0), prior
        ).dimensions
        == 0
    )
