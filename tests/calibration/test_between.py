"""Recordings of one system that differ: intervals grow, or a verdict fails."""

import dataclasses
from typing import Any

import numpy as np
import pytest

from scissorcal.calibration import FitResult, fit_friction, friction_experiment
from scissorcal.calibration.between import BetweenRecordings
from scissorcal.calibration.caveats import next_recording_sd, next_recording_sentence
from scissorcal.calibration.parameters import Layout, Parameter
from scissorcal.calibration.verify.check import StudySettings, assess, make_study, tasks_of
from scissorcal.calibration.verify.result import VerifyResult
from scissorcal.calibration.verify.simulator import friction_simulator
from scissorcal.calibration.verify.study import run
from scissorcal.model import LOG
from scissorcal.package import pick_draws
from scissorcal.recipe import FitFriction
from scissorcal.recording import Recording
from tests.calibration.friction.test_fit import emps
from tests.calibration.truth import QUICK, Truth, friction_recording

SETTINGS = FitFriction(law="coulomb+viscous", symmetry="symmetric", critic=False)


def recordings(*truths: Truth) -> tuple[Recording, ...]:
    rng = np.random.default_rng(11)
    return tuple(
        dataclasses.replace(friction_recording(truth, rng, QUICK), source=f"friction-{k}.mcap")
        for k, truth in enumerate(truths)
    )


def fitted(given: tuple[Recording, ...], settings: FitFriction = SETTINGS) -> FitResult:
    return fit_friction(given, settings, effort="draft", rng=np.random.default_rng(12))


@pytest.fixture(scope="module")
def alone() -> FitResult:
    """The fit of the first recording by itself."""
    return fitted(recordings(Truth()))


def halves(given: tuple[Recording, ...], fit: FitResult) -> VerifyResult:
    design = friction_experiment(given, SETTINGS, fit)
    simulator = friction_simulator(given, SETTINGS, fit, design.layout)
    study = make_study(design, fit, simulator, settings=StudySettings(seed=0))
    records = [run(study, task) for task in tasks_of(study, ("halves",), 0)]
    return assess(study, fit, ("halves",), records)


def without_between(fit: FitResult) -> FitResult:
    """The fit as it would be without a term between recordings."""
    kept: dict[str, Any] = {
        name: value
        for name, value in fit.diagnostics.items()
        if not name.startswith("between_recordings")
    }
    return dataclasses.replace(fit, diagnostics=kept)


def status(found: VerifyResult) -> dict[str, str]:
    return {verdict.check: verdict.status for verdict in found.verdicts}


def test_inertias_five_sds_apart_widen_the_interval_and_fail_the_halves_of_one_that_is_not(
    alone: FitResult,
):
    """The second inertia is 10 % higher, about 5 combined standard deviations or more."""
    given = recordings(Truth(), dataclasses.replace(Truth(), inertia=2.2e-4))
    fit = fitted(given)
    assert fit.diagnostics["between_recordings_z"]["inertia"] > 5
    inertia = fit.parameter("inertia")
    assert inertia.sd > 10 * alone.parameter("inertia").sd
    assert inertia.q05 < 2.0e-4
    assert inertia.q95 > 2.2e-4
    assert fit.parameter("coulomb").sd < 0.1 * fit.parameter("coulomb").mean
    assert any("They differ in inertia from 0.000" in note for note in fit.notes)
    assert status(halves(given, without_between(fit)))["halves"] == "fail"
    assert status(halves(given, fit)) == {"halves": "pass", "halves-effort": "pass"}


def test_a_second_recording_of_emps_with_another_inertia_is_found():
    """The real one, and itself with 2 kg more: some 6 of its own combined standard deviations."""
    real = emps()
    samples = real.samples.copy()
    smooth = np.convolve(samples["opening"], np.full(41, 1 / 41), "same")
    samples["motor_torque"] += 2.0 * np.gradient(np.gradient(smooth)) * 1e6 * (smooth != 0)
    samples["motor_torque"][:60] = real.samples["motor_torque"][:60]
    samples["motor_torque"][-60:] = real.samples["motor_torque"][-60:]
    given = (real, dataclasses.replace(real, samples=samples, source="second.mat"))
    settings = FitFriction(law="coulomb+viscous", symmetry="asymmetric", critic=False)
    single, fit = fitted(given[:1], settings), fitted(given, settings)
    assert fit.diagnostics["between_recordings_z"]["inertia"] > 5
    inertia, before = fit.parameter("inertia"), single.parameter("inertia")
    assert inertia.q95 - inertia.q05 > 5 * (before.q95 - before.q05)
    assert inertia.q05 < before.mean < inertia.q95
    assert any("They differ in inertia" in note for note in fit.notes)


def test_a_coulomb_level_that_jumps_is_no_calibration():
    stiffer = dataclasses.replace(Truth(), coulomb_pos=0.0195, coulomb_neg=0.024)
    fit = fitted(recordings(Truth(), stiffer))
    (verdict,) = (verdict for verdict in fit.rejected if verdict.check == "recordings")
    assert verdict.value is not None
    assert verdict.value > 0.3
    assert "friction-1.mcap" in verdict.why or "friction-0.mcap" in verdict.why
    left_out = fit.diagnostics["left_out_recordings"]
    assert [row["recording"] for row in left_out] == ["friction-0.mcap", "friction-1.mcap"]
    assert all(row["rms"] > row["pooled_rms"] > row["own_rms"] for row in left_out)


def test_recordings_that_agree_are_said_to_and_pass(alone: FitResult):
    given = recordings(Truth(), Truth(), Truth())
    fit = fitted(given)
    assert any("agree within 3 standard deviations" in note for note in fit.notes)
    for name in ("inertia", "coulomb", "viscous"):
        inner = fit.parameter(name).q95 - fit.parameter(name).q05
        assert inner < 2.0 * (alone.parameter(name).q95 - alone.parameter(name).q05), name
    found = halves(given, fit)
    assert set(status(found).values()) == {"pass"}
    assert found.halves is not None
    assert found.halves.split == "whole recordings, 2 of 3 in one half"


def test_one_recording_says_that_more_is_not_known(alone: FitResult):
    assert any("how much the law's parameters vary from recording" in n for n in alone.notes)
    assert "between_recordings_sd" not in alone.diagnostics
    why = next(v.why for v in halves(recordings(Truth()), alone).verdicts if v.check == "halves")
    assert "the variation between recordings is unknown" in why


def tails(draws: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Half-width over sd, and the farthest draw in robust sds, by column."""
    q05, q16, q50, q84, q95 = np.quantile(draws, [0.05, 0.16, 0.5, 0.84, 0.95], axis=0)
    over = 0.5 * (q95 - q05) / draws.std(axis=0, ddof=1)
    return over, np.abs(draws - q50).max(axis=0) / (0.5 * (q84 - q16))


@pytest.mark.parametrize("count", [2, 3])
def test_draws_of_several_recordings_have_the_tails_of_a_normal(count: int) -> None:
    """Before, the farthest of 2,000 draws lay 10 to 150 robust sds away, and few made the sd."""
    fit = fitted(recordings(*[Truth()] * count))
    for draws in (fit.draws, pick_draws(fit, None, np.random.default_rng(1))["draws/cut.npy"]):
        over, farthest = tails(draws)
        assert np.all((over > 1.4) & (over < 1.9))
        assert np.all(farthest < 8.0)
    assert all(parameter.moments for parameter in fit.parameters)


def test_the_size_between_recordings_stands_beside_the_parameter(alone: FitResult) -> None:
    fit = fitted(recordings(Truth(), dataclasses.replace(Truth(), inertia=2.2e-4)))
    seen = next_recording_sd(fit, fit.parameter("inertia"))
    assert seen is not None
    assert 0.5e-5 < seen < 4e-5
    assert next_recording_sentence(fit) == ""
    assert next_recording_sd(alone, alone.parameter("inertia")) is None
    assert "One recording does not show" in next_recording_sentence(alone)


def between_of(sd: np.ndarray) -> BetweenRecordings:
    """Two recordings that determine two parameters to 1 %, with draws of what they scatter by."""
    layout = Layout(tuple(Parameter(n, "1", LOG, 0.0, 3.0, "a parameter") for n in ("a", "b")))
    precisions = np.stack([np.array([[1e4, 4e3], [4e3, 1e4]])] * 2)
    return BetweenRecordings(
        layout, np.zeros((2, 2)), precisions, np.eye(2) / 9.0, sd, np.zeros(2), ()
    )


def test_draws_stay_where_recordings_do_not_scatter() -> None:
    draws = np.random.default_rng(1).standard_normal((50, 2)) ** 3
    still = between_of(np.full((10, 2), 1e-9))
    np.testing.assert_allclose(still.widened(draws, np.random.default_rng(2)), draws, atol=1e-7)


def test_draws_are_widened_by_the_interval_over_all_scatters() -> None:
    """Half of the scatters 1 %, half 10 %: of the mean over two 90 % lie within 9.97 %.

    That is where 0.5 (2 F(x / 0.0100) - 1) + 0.5 (2 F(x / 0.0711) - 1) = 0.9, with the variances
    (0.01^2 + 0.01^2 / (1 - 0.16)) / 2 and so for 0.1; 0.9 needs F(x / 0.0711) = 0.9.
    """
    sd = np.tile([[0.01, 0.01], [0.1, 0.1]], (20, 1))
    between = between_of(sd)
    pooled = np.linalg.inv(between.precisions.sum(axis=0) + between.prior)
    rng = np.random.default_rng(3)
    draws = rng.multivariate_normal(np.zeros(2), pooled, 40_000)
    found = between.widened(draws, rng)
    low, high = np.quantile(found, [0.05, 0.95], axis=0)
    wide = np.sqrt((0.1**2 + 1e-4 / (1.0 - 0.16)) / 2.0)
    assert 0.5 * (high - low) == pytest.approx(1.2816 * wide, rel=0.02)
    over, farthest = tails(found)
    assert over == pytest.approx(1.645, rel=0.02)
    assert np.all(farthest < 6.0)


def test_the_recipe_states_the_usual_size() -> None:
    """With 0.1 % two recordings that agree widen less than with 10 %."""
    given = recordings(Truth(), Truth())
    near, far = (
        fitted(given, FitFriction(**{**SETTINGS.model_dump(), "between_recordings_percent": size}))
        for size in (0.1, 10.0)
    )
    assert near.parameter("inertia").sd < 0.9 * far.parameter("inertia").sd


def test_the_jackknife_on_a_true_law_agrees_with_the_fit():
    """17 strokes of a law that is true: both estimate the same, within a factor of two or so.

    The inertia rests on the one excitation, which no other stroke repeats.
    """
    fit = fitted(recordings(Truth()), FitFriction(law="coulomb+viscous", symmetry="asymmetric"))
    found = fit.diagnostics["jackknife_sd"]
    assert "inertia" not in found
    for name in ("coulomb_pos", "coulomb_neg"):
        assert 0.3 < found[name] / fit.parameter(name).sd < 2.0, name


def test_on_emps_lack_of_fit_repeats_and_the_jackknife_does_not_see_it():
    settings = FitFriction(law="coulomb+viscous", symmetry="asymmetric", critic=False)
    fit = fitted((emps(),), settings)
    for name in ("coulomb_pos", "coulomb_neg"):
        assert fit.parameter(name).sd == pytest.approx(0.20, abs=0.03)
        assert fit.diagnostics["jackknife_sd"][name] < 0.25 * fit.parameter(name).sd
