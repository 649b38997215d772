"""A posterior over two laws: weights by evidence, draws in the richer law's terms."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

from scissorcal.calibration.cut.structure import CutLaw
from scissorcal.calibration.cut.widening import (
    AveragedLaw,
    Inferred,
    average,
    by_load,
    load_note,
    log_evidence,
)
from scissorcal.calibration.parameters import Layout, Parameter
from scissorcal.inference import Problem, find_optimum, infer
from scissorcal.model import IDENTITY

DATA_SD = 0.3
NO_LAYOUT = Layout(())


@dataclass(frozen=True)
class Candidate:
    name: str
    prior_precision: np.ndarray


@dataclass(frozen=True)
class Fitted:
    candidate: Candidate
    optimum: object
    information: np.ndarray
    equivalent: tuple[str, ...] = ()


@dataclass(frozen=True)
class Design:
    law: CutLaw
    layout: Layout = NO_LAYOUT


def problem(data, names):
    """Normal data of a mean that is the sum of the parameters, each of prior sd one."""
    size = len(names)
    return Problem(
        names=names,
        log_prior=lambda u: -0.5 * float(u @ u),
        log_likelihood_terms=lambda u: -0.5 * ((data - u.sum()) / DATA_SD) ** 2,
        series=np.zeros(len(data), dtype=np.int64),
        prior_sd=np.ones(size),
        starts=np.zeros((1, size)),
        lower=np.full(size, -8.0),
        upper=np.full(size, 8.0),
        independent=True,
    )


def fitted(name, data, names):
    size = len(names)
    optimum = find_optimum(problem(data, names))
    information = np.full((size, size), len(data) / DATA_SD**2)
    return Fitted(Candidate(name, np.eye(size)), optimum, information)


def exact_log_evidence(data, size):
    """Of normal data whose mean is a sum of ``size`` standard normal parameters."""
    covariance = DATA_SD**2 * np.eye(len(data)) + size
    away = np.linalg.solve(covariance, data)
    return -0.5 * data @ away - 0.5 * np.linalg.slogdet(covariance)[1]


def test_the_evidence_of_normal_laws_is_exact():
    data = np.array([0.4, -0.2, 0.9, 0.5])
    one, two = fitted("one", data, ("a",)), fitted("two", data, ("a", "b"))
    found = log_evidence(two) - log_evidence(one)
    assert found == pytest.approx(
        exact_log_evidence(data, 2) - exact_log_evidence(data, 1), abs=1e-6
    )


def pair(data):
    plain = CutLaw("power", "rippled")
    return [
        (fitted("plain", data, ("a",)), Design(plain)),
        (fitted("loaded", data, ("a", "b")), Design(replace(plain, loaded=True))),
    ]


def test_laws_are_weighed_by_their_evidence_the_richest_first():
    data = np.array([0.4, -0.2, 0.9, 0.5])
    compared = pair(data)
    laws = by_load(compared[0][0], compared)
    assert [c.design.law.loaded for c in laws] == [True, False]
    odds = np.exp(exact_log_evidence(data, 2) - exact_log_evidence(data, 1))
    assert laws[0].probability == pytest.approx(odds / (1.0 + odds), abs=1e-6)
    assert sum(c.probability for c in laws) == pytest.approx(1.0)
    (note,) = load_note(laws)
    assert f"{laws[0].probability:.0%} probable" in note


def test_an_improbable_law_is_left_out():
    data = np.full(40, 9.0)
    compared = pair(data)
    (only,) = by_load(compared[0][0], compared)
    assert only.design.law.loaded
    assert only.probability == 1.0
    assert load_note([only]) == ()


def test_a_share_below_zero_is_no_friction():
    data = np.array([-0.9, -1.4, -1.1])
    (plain, design), (loaded, other) = pair(data)
    shares = tuple(Parameter(n, "1", IDENTITY, 0.0, 1.0, "") for n in ("a", "load_share"))
    compared = [(plain, design), (loaded, replace(other, layout=Layout(shares)))]
    assert loaded.optimum.point[1] < 0.0
    (only,) = by_load(loaded, compared)
    assert only.fitted.candidate.name == "plain"
    assert only.probability == 1.0


def test_a_law_without_a_twin_stands_alone():
    compared = pair(np.array([0.4, -0.2]))[:1]
    assert [c.fitted.candidate.name for c in by_load(compared[0][0], compared)] == ["plain"]


def test_draws_come_from_each_law_as_often_as_it_is_probable():
    data = np.array([0.4, -0.2, 0.9, 0.5])
    compared = pair(data)
    rng = np.random.default_rng(5)

    def infer_one(law: AveragedLaw) -> Inferred:
        names = ("a", "b") if law.design.law.loaded else ("a",)
        return Inferred(law, infer(problem(data, names), "standard", rng, count=1000), None)

    loaded, plain = by_load(compared[0][0], compared)
    inferred = average([loaded, plain], infer_one, rng)
    found, best = inferred.posterior, inferred.law.fitted.optimum.point
    assert plain.probability > loaded.probability
    assert best[1] == 0.0
    assert best[0] == pytest.approx(plain.fitted.optimum.point[0], abs=1e-4)
    assert found.names == ("a", "b")
    without = np.mean(found.draws[:, 1] == 0.0)
    assert without == pytest.approx(plain.probability, abs=1e-3)
    first = np.mean(found.draws[:200, 1] == 0.0)
    assert first == pytest.approx(plain.probability, abs=4 * np.sqrt(0.25 / 200))
    mean = len(data) * data.mean() / (len(data) + DATA_SD**2)
    own = found.draws[found.draws[:, 1] == 0.0, 0]
    assert own.mean() == pytest.approx(mean, abs=4 * DATA_SD / np.sqrt(len(own) * len(data)))
