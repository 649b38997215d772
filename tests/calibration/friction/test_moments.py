"""Products by stroke say what the bins say: likelihood, slopes, strokes, and the optimum."""

import dataclasses

import numpy as np
import pytest

from scissorcal.calibration.friction.layout import LawChoice
from scissorcal.calibration.friction.model import design
from scissorcal.calibration.friction.search import search
from scissorcal.calibration.signals.weak_form import weigh
from scissorcal.inference import gradient
from scissorcal.recipe import FitFriction, JointPriors
from scissorcal.recording import SAMPLE_DTYPE, Recording
from tests.calibration.truth import Truth, friction_recording

LAWS = (
    "coulomb",
    "coulomb+viscous",
    "stribeck",
    "stribeck+angle",
    "stribeck+angle+load",
    "stribeck+angle+presliding",
)


@pytest.fixture(scope="module")
def windows():
    recording = friction_recording(Truth(), np.random.default_rng(1))
    samples = recording.samples.copy()
    rng = np.random.default_rng(2)
    samples["handle_force"] = 2.0 + np.cumsum(rng.standard_normal(len(samples))) * 0.02
    samples["torque_command"] = samples["motor_torque"]
    loaded = dataclasses.replace(recording, samples=samples, handle_radius_m=0.05)
    every = weigh((loaded,), FitFriction().cutoff_Hz)
    return every.where(every.bins.moving)


def experiment(windows, law: str, symmetric: bool = False, cogging: float = 120.0):
    joint = friction_recording(Truth(), np.random.default_rng(1)).joint
    strokes = windows.bins.stroke
    return design(
        windows, strokes, LawChoice(law, symmetric, ("rate^2",), cogging), joint, JointPriors()
    )


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("symmetric", [False, True])
def test_products_give_the_likelihood_of_the_bins(windows, law, symmetric):
    one = experiment(windows, law, symmetric)
    candidate = one.candidate(one.observed)
    reduced, layout = candidate.reduced, candidate.layout
    rng = np.random.default_rng(3)
    draws = candidate.starts[0] + 0.3 * layout.sd * rng.standard_normal((4, len(layout.names)))
    by_stroke = reduced.by_stroke(draws)
    for draw, sums in zip(draws, by_stroke, strict=True):
        terms = candidate.likelihood.terms(draw)
        assert reduced.log_likelihood(draw) == pytest.approx(terms.sum(), rel=1e-9)
        assert sums == pytest.approx(
            [terms[one.strokes == k].sum() for k in np.unique(one.strokes)], rel=1e-8
        )


@pytest.mark.parametrize("law", LAWS)
def test_slopes_are_those_of_the_likelihood(windows, law):
    one = experiment(windows, law)
    candidate = one.candidate(one.observed)
    reduced, point = candidate.reduced, candidate.starts[0]
    step = 1e-3 * np.ones(len(point))
    wanted = gradient(lambda u: np.array([reduced.log_likelihood(u)]), point, step)[0]
    assert reduced.slope(point) == pytest.approx(wanted, rel=1e-4, abs=1e-3 * np.abs(wanted).max())


def test_leaving_strokes_out_is_leaving_their_bins_out(windows):
    one = experiment(windows, "stribeck+angle")
    candidate = one.candidate(one.observed)
    point, gone = candidate.starts[0], np.unique(one.strokes)[::3]
    terms = candidate.likelihood.terms(point)[~np.isin(one.strokes, gone)]
    rest = candidate.reduced.without(gone)
    assert rest.log_likelihood(point) == pytest.approx(terms.sum(), rel=1e-9)
    assert rest.counted == len(terms)


def swings(length: float) -> Recording:
    """Swings of several sizes, friction by Dahl's law in small steps."""
    rng = np.random.default_rng(23)
    time = np.arange(30000) / 1000
    opening = 0.5 + 0.2 * np.sin(1.3 * time) + 0.12 * np.sin(2.9 * time + 1)
    rate, z = np.gradient(opening) * 1000.0, 1.0
    state = np.empty(len(time))
    for i, step in enumerate(np.diff(opening, prepend=opening[0])):
        z = np.clip(z + (1.0 - z * np.sign(step)) * step / length, -1, 1)
        state[i] = z
    samples = np.zeros(len(time), SAMPLE_DTYPE)
    samples["device_time_us"] = np.round(time * 1e6)
    samples["opening"] = np.round(opening / 2e-5) * 2e-5
    drive = 2e-4 * np.gradient(rate) * 1e3 + 0.02 * (0.4 * np.sign(rate) + 0.6 * state)
    samples["motor_torque"] = drive + 3e-4 * rng.standard_normal(len(time))
    samples["stroke"] = -1
    return Recording("friction", samples, source="turns")


@pytest.mark.parametrize("length", [0.002, 0.01, 0.1])
def test_the_scan_finds_a_length_far_from_every_start(length):
    """From the prior's own starts alone the search may end lower; the scan's starts do not."""
    recording = swings(length)
    every = weigh((recording,), 75.0)
    windows = every.where(every.bins.moving)
    ways = np.sign(windows.bins.rate)
    strokes = np.cumsum(np.diff(ways, prepend=ways[:1]) != 0)
    one = design(
        windows, strokes, LawChoice("coulomb+presliding", True), recording.joint, JointPriors()
    )
    candidate = one.candidate(one.observed)
    problem = candidate.problem(one.series)
    found = search(problem)
    values = one.layout.natural(found.point)
    assert float(values["presliding_length"]) == pytest.approx(length, rel=0.1)
    assert found.success
    places = [found.point + 0.01 * s * row for row in np.diag(one.layout.sd) for s in (-1, 1)]
    assert max(problem.log_posterior(place) for place in places) < found.value
