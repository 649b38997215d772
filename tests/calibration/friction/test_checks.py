"""Laws that no joint can have are named; laws that one can have are not."""

import dataclasses

import numpy as np
import pytest
from scipy.ndimage import uniform_filter1d

from scissorcal.calibration import fit_friction
from scissorcal.calibration.friction.checks import bandwidth_verdict
from scissorcal.calibration.parameters import Layout, Parameter
from scissorcal.model import LOG
from scissorcal.recipe import FitFriction
from scissorcal.recording import Recording
from tests.calibration.truth import QUICK, Truth, friction_recording


def with_friction(recording: Recording, term) -> Recording:
    """The same motion with a torque more, of its rate."""
    samples = recording.samples.copy()
    rate = uniform_filter1d(np.gradient(samples["opening"]) * 1000.0, 5)
    samples["motor_torque"] += term(rate)
    return dataclasses.replace(recording, samples=samples)


def verdicts(recording: Recording, law: str, symmetry: str = "asymmetric"):
    settings = FitFriction(law=law, symmetry=symmetry)
    fit = fit_friction((recording,), settings, effort="draft", rng=np.random.default_rng(0))
    return {verdict.check: verdict for verdict in fit.verdicts}


@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(1, 6))]
)
@pytest.mark.parametrize("law", ["coulomb+viscous", "stribeck"])
def test_a_joint_as_joints_are_passes(seed, law):
    """Three standard deviations on at most six levels: false alarm below 1 % a fit."""
    truth = Truth(viscous=0.002)
    found = verdicts(friction_recording(truth, np.random.default_rng(seed), QUICK), law)
    assert found["physical"].status == "pass"
    assert found["start"].status == "pass"


def test_friction_that_falls_with_the_speed_is_named():
    recording = friction_recording(Truth(viscous=-0.001), np.random.default_rng(1), QUICK)
    found = verdicts(recording, "coulomb+viscous")["physical"]
    assert found.status == "fail"
    assert "viscous_pos = -0.00" in found.why
    assert "Stribeck" in found.why


def test_a_law_without_viscous_friction_is_offered_it():
    recording = friction_recording(Truth(viscous=-0.001), np.random.default_rng(2), QUICK)
    assert verdicts(recording, "coulomb")["physical"].status == "fail"
    honest = friction_recording(Truth(viscous=0.001), np.random.default_rng(2), QUICK)
    assert verdicts(honest, "coulomb")["physical"].status == "pass"


def test_static_below_coulomb_friction_is_named():
    recording = with_friction(
        friction_recording(Truth(), np.random.default_rng(3)),
        lambda rate: -0.005 * np.sign(rate) * np.exp(-((rate / 0.12) ** 2)),
    )
    found = verdicts(recording, "stribeck")["physical"]
    assert found.status == "fail"
    assert "stribeck = -" in found.why
    assert "slower sweeps" in found.why


def test_a_sign_that_changes_hardly_any_torque_is_no_negative_level():
    """Viscous friction of -0.2 mN m s/rad, 7 sds below zero: 1 % of the drive."""
    recording = friction_recording(Truth(viscous=-2e-4), np.random.default_rng(1), QUICK)
    found = verdicts(recording, "coulomb+viscous")["physical"]
    assert found.status == "pass"
    assert "negative levels, but its torque differs by only 1.0% of the drive" in found.why


def test_a_torque_of_the_wrong_sign_is_named():
    samples = friction_recording(Truth(), np.random.default_rng(4), QUICK).samples.copy()
    samples["motor_torque"] *= -1
    wrong = dataclasses.replace(
        friction_recording(Truth(), np.random.default_rng(4), QUICK), samples=samples
    )
    found = verdicts(wrong, "coulomb+viscous")
    assert found["physical"].status == "fail"
    assert "coulomb_pos" in found["physical"].why
    assert "check" in found["physical"].why


def test_an_estimate_that_moves_with_the_cutoff_is_named():
    layout = Layout((Parameter("inertia", "1", LOG, 0.0, 1.0, ""),))
    draws = np.random.default_rng(5).standard_normal((500, 1))
    here = np.zeros(1)
    steady = bandwidth_verdict(layout, draws, here, here + 1.0, (75.0, 91.0))
    assert steady.status == "pass"
    moved = bandwidth_verdict(layout, draws, here, here + 9.0, (75.0, 91.0))
    assert moved.status == "fail"
    assert "inertia changes by 9" in moved.why


def test_what_the_encoders_steps_take_off_the_inertia_is_expected():
    """Steps of 0.2 % and 0.5 % of the acceleration: 0.3 % less inertia is what they explain."""
    layout = Layout((Parameter("inertia", "1", LOG, 0.0, 1.0, ""),))
    draws = 5e-4 * np.random.default_rng(5).standard_normal((500, 1))
    here, shares = np.zeros(1), (2e-3, 5e-3)
    less = bandwidth_verdict(layout, draws, here, here - 3e-3, (61.0, 73.0), shares)
    more = bandwidth_verdict(layout, draws, here, here + 1e-2, (61.0, 73.0), shares)
    assert less.value == pytest.approx(0.0, abs=1e-9)
    assert (less.status, more.status) == ("pass", "fail")


def test_the_inertia_holds_what_the_encoders_steps_take_off():
    """0.1 mrad and 0.2 mN m of noise: without that the inertia is 6 of its sds too low."""
    truth = Truth(noise=2e-4, rho=0.0)
    settings = FitFriction(law="coulomb+viscous", symmetry="asymmetric", critic=False)
    for seed in (21, 22):
        recording = friction_recording(truth, np.random.default_rng(seed), (0.2, 0.6, 1.5))
        samples = recording.samples.copy()
        samples["opening"] = np.round(samples["opening"] / 1e-4) * 1e-4
        rough = dataclasses.replace(recording, samples=samples)
        fit = fit_friction((rough,), settings, effort="standard", rng=np.random.default_rng(7))
        inertia = fit.parameter("inertia")
        assert abs(inertia.mean - truth.inertia) < 3 * inertia.sd
        assert inertia.sd < 5e-3 * truth.inertia
        assert {v.check: v.status for v in fit.verdicts}["bandwidth"] == "pass"


def test_a_nuisance_that_moves_with_the_cutoff_fails_nothing():
    """The delay of the torque describes the motor's electronics, and is not rendered."""
    rows = [Parameter(name, "1", LOG, 0.0, 1.0, "") for name in ("inertia", "delay")]
    draws = np.random.default_rng(5).standard_normal((500, 2))
    here = np.zeros(2)
    moved = bandwidth_verdict(
        Layout(tuple(rows)), draws, here, here + np.array([1.0, 9.0]), (75.0, 91.0)
    )
    assert moved.status == "pass"
    assert "inertia changes" in moved.why


def test_windows_too_short_for_the_encoder_are_lengthened():
    """At 180 Hz the encoder's steps would draw the inertia towards zero."""
    recording = friction_recording(Truth(), np.random.default_rng(6), QUICK)
    rough = dataclasses.replace(recording, samples=recording.samples.copy())
    rough.samples["opening"] = np.round(rough.samples["opening"] / 1e-4) * 1e-4
    for cutoff_Hz in (75.0, 180.0):
        settings = FitFriction(
            law="coulomb+viscous", symmetry="asymmetric", cutoff_Hz=cutoff_Hz, critic=False
        )
        fit = fit_friction((rough,), settings, effort="standard", rng=np.random.default_rng(7))
        inertia = fit.parameter("inertia")
        assert abs(inertia.mean - Truth().inertia) < 3 * inertia.sd
        assert {v.check: v.status for v in fit.verdicts}["bandwidth"] == "pass"
        assert any("encoder's steps are coarse" in note for note in fit.notes)
