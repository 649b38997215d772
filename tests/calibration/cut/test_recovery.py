"""Known materials come back: each kind of law from recordings that share no code with the fit.

Four standard deviations: a false alarm of 6e-5 for each parameter.
"""

from dataclasses import replace

import numpy as np
import pytest

from scissorcal.calibration import FitResult, cut_experiment, cutting_from, fit_cut
from scissorcal.calibration.fit_model import CutRun
from scissorcal.calibration.store import load_fit, save
from scissorcal.model import Edge, EdgeDistribution
from tests.calibration.cut.recipes import friction_of, paper, pressing
from tests.calibration.truth import (
    Truth,
    TwoSlopes,
    cut_recording,
    loaded_cut_recording,
    press_recording,
)

pytestmark = pytest.mark.slow

SMOOTH = Truth(kappa=1.0)
RIPPLED = Truth(kappa=0.75)
KNEED = TwoSlopes(
    fracture_energy=1e9, upper_face=1e-3, force=2.0, exponent=1.0, reference=5e-4, knee=5e-4
)
LINE = Edge("line", SMOOTH.edge_offset, SMOOTH.taper, 0.075)
OF_TRUTH = {
    "response_force": "force",
    "response_exponent": "exponent",
    "fracture_energy": "fracture_energy",
    "kappa": "kappa",
    "rate_damping": "damping",
}


def recovers(fit: FitResult, truth: Truth, *names: str) -> None:
    """Each named parameter lies within four standard deviations of the truth."""
    for name in names:
        parameter, value = fit.parameter(name), getattr(truth, OF_TRUTH[name])
        away = (parameter.mean - value) / parameter.sd
        assert abs(away) < 4.0, f"{name} {parameter.mean:.4g} +- {parameter.sd:.2g}, not {value}"


@pytest.fixture(scope="module")
def friction() -> FitResult:
    return friction_of(SMOOTH, np.random.default_rng(10))


def test_a_smooth_cut(friction):
    rng = np.random.default_rng(11)
    cuts = cut_recording(SMOOTH, rng, sheets=2)
    found = fit_cut((cuts,), paper(fracture="smooth"), friction, effort="standard", rng=rng)
    recovers(found, SMOOTH, "response_force", "response_exponent", "fracture_energy")
    assert found.parameter("fracture_energy").sd < 0.01
    assert {v.check: v.status for v in found.verdicts}["k-hat"] == "pass"


def test_a_rippled_cut(friction):
    rng = np.random.default_rng(12)
    cuts = cut_recording(RIPPLED, rng, sheets=2)
    found = fit_cut((cuts,), paper(fracture="rippled"), friction, effort="draft", rng=rng)
    recovers(found, RIPPLED, "response_force", "response_exponent", "fracture_energy", "kappa")
    assert found.parameter("kappa").q95 < 0.95


def test_strokes_that_end_at_the_highest_force(friction):
    """Taken at their mean place, such rests would draw the exponent 5-15 % down."""
    rng = np.random.default_rng(25)
    cuts = loaded_cut_recording(RIPPLED, rng, sheets=3)
    fit = fit_cut((cuts,), paper(fracture="rippled"), friction, effort="draft", rng=rng)
    recovers(fit, RIPPLED, "response_force", "response_exponent", "fracture_energy", "kappa")
    assert fit.parameter("response_exponent").sd < 0.1


@pytest.mark.parametrize("damping", [30.0, 0.0])
def test_damping_is_separated_from_none(friction, damping):
    rng = np.random.default_rng(31)
    truth = replace(SMOOTH, damping=damping)
    cuts = cut_recording(truth, rng, sheets=1)
    wanted = paper(fracture="smooth", rate_damping="auto")
    fit = fit_cut((cuts,), wanted, friction, effort="standard", rng=rng)
    assert fit.structure["rate_damping"] == (damping > 0.0)
    recovers(fit, truth, "response_force", "fracture_energy")
    if damping:
        recovers(fit, truth, "rate_damping")


def test_an_uncertain_edge_is_among_the_draws(friction):
    rng = np.random.default_rng(23)
    cuts = cut_recording(SMOOTH, rng, sheets=1)
    edge = EdgeDistribution(LINE, ("offset_m", "taper_rad"), np.diag([5e-5, 1e-3]) ** 2)
    wanted = paper(fracture="smooth")
    fit = fit_cut((cuts,), wanted, friction, effort="draft", rng=rng, run=CutRun(edge=edge))
    recovers(fit, SMOOTH, "response_force", "response_exponent", "fracture_energy")
    for name, sd in zip(edge.names, np.sqrt(np.diag(edge.covariance)), strict=True):
        assert 0.0 < fit.parameter(f"edge_{name}").sd < 1.1 * sd


@pytest.fixture(scope="module")
def pressed_friction() -> FitResult:
    return friction_of(KNEED, np.random.default_rng(40))


def test_a_press_without_a_knee_is_a_power_law(pressed_friction):
    rng = np.random.default_rng(43)
    truth = replace(KNEED, exponent=1.8, steeper=1.8)
    pressed = press_recording(truth, rng)
    wanted = pressing(response="power")
    fit = fit_cut((pressed,), wanted, pressed_friction, effort="standard", rng=rng)
    recovers(fit, truth, "response_force", "response_exponent")


def test_two_slopes_are_separated_from_a_power_law_and_an_exponential(pressed_friction, tmp_path):
    """On hold-out strokes the spline's error is the noise, the others' is not."""
    rng = np.random.default_rng(41)
    pressed = press_recording(KNEED, rng)
    wanted = pressing(response="auto+spline")
    fit = fit_cut((pressed,), wanted, pressed_friction, effort="standard", rng=rng)
    assert fit.structure["response"] == "spline"
    knots = fit.structure["response_knots_m"]
    assert knots[-1] == pytest.approx(1.2e-3, rel=0.1)
    assert knots[0] == pytest.approx(knots[-1] / 8.0, rel=1e-3)
    save(fit, tmp_path / "cut.nc")
    design = cut_experiment((pressed,), wanted, pressed_friction, load_fit(tmp_path / "cut.nc"))
    assert tuple(design.key["response_knots_m"]) == tuple(knots)
    values = {p.name: fit.draws[:, [i]] for i, p in enumerate(fit.parameters)}
    drawn = cutting_from(fit.structure, values)
    depth = np.array([3e-4, 5e-4, 8e-4, 1.1e-3])
    true = np.array([KNEED.response(d) for d in depth])
    assert np.median(drawn.response.force_at(depth), axis=0) == pytest.approx(true, rel=0.07)
