"""Recordings from which no cut can be fitted, and the sentences that say so."""

from dataclasses import replace

import numpy as np
import pytest

from scissorcal.calibration import fit_cut
from scissorcal.calibration.cut.structure import allowed_laws
from scissorcal.errors import InputError
from tests.calibration.cut.made_cuts import HIGH, LOW, cut, way
from tests.calibration.cut.recipes import friction_of, paper, pressing
from tests.calibration.truth import QUICK, Truth, cut_recording, friction_recording

TRUTH = Truth()


@pytest.fixture(scope="module")
def friction():
    return friction_of(TRUTH, np.random.default_rng(10), QUICK)


def test_cutting_air_is_refused(friction):
    rng = np.random.default_rng(13)
    air = cut_recording(Truth(force=1e-9), rng, sheets=1)
    with pytest.raises(InputError, match="hardly touched the material") as refused:
        fit_cut((air,), paper(fracture="smooth"), friction, effort="draft", rng=rng)
    assert "advance was zero at its near edge" in str(refused.value)
    assert "s are sound, " in str(refused.value)
    assert "s of these have a sheet in place, and in " in str(refused.value)


@pytest.mark.slow
@pytest.mark.parametrize("damage", ["a spike of six samples", "in mN m"])
def test_torques_far_from_every_law_are_refused_with_the_farthest_sample(
    friction, damage, monkeypatch
):
    """Without a bound the search took over 30,000 likelihoods, or ended at a point of NaN."""
    monkeypatch.setattr("scissorcal.calibration.cut.scout.MOST_EVALUATIONS", 500)
    rng = np.random.default_rng(16)
    made = cut_recording(TRUTH, rng, sheets=1)
    samples = made.samples.copy()
    if damage == "in mN m":
        samples["motor_torque"] *= 1e3
    else:
        samples["motor_torque"][3000:3006] = 1e3 * 0.5 ** np.arange(6.0)
    with pytest.raises(InputError, match="no law comes near") as refused:
        fit_cut(
            (replace(made, samples=samples),),
            paper(fracture="smooth"),
            friction,
            effort="draft",
            rng=rng,
        )
    away = np.abs(samples["motor_torque"] - np.median(samples["motor_torque"]))
    assert f"sample {np.argmax(away)}: " in str(refused.value)
    assert "check that torques are in N m" in str(refused.value)


def test_a_recording_without_sheets_is_refused(friction):
    rng = np.random.default_rng(14)
    empty = friction_recording(TRUTH, rng)
    with pytest.raises(InputError, match="no stroke through material") as refused:
        fit_cut((empty,), paper(), friction, effort="draft", rng=rng)
    assert "scissorcal capture cut" in str(refused.value)


def test_a_recording_without_unloading_is_refused(friction):
    """A cut that ends closed: nothing is unloaded."""
    rng = np.random.default_rng(15)
    closed = cut(way(HIGH, LOW)).made.recording
    with pytest.raises(InputError, match="unloading the material") as refused:
        fit_cut((closed,), paper(), friction, effort="draft", rng=rng)
    assert "open the blades wide in every stroke" in str(refused.value)


def test_a_sensor_that_clips_is_named_before_what_follows_from_it(friction):
    """A torque that is clipped wherever the blades press shows no unloading either."""
    rng = np.random.default_rng(15)
    made = cut(way(HIGH, LOW)).made.recording
    samples = made.samples.copy()
    samples["motor_torque"] += rng.normal(0.0, 2e-4, len(samples))
    high = float(np.quantile(samples["motor_torque"], 0.8))
    samples["motor_torque"] = np.minimum(samples["motor_torque"], high)
    with pytest.raises(InputError, match="unloading the material") as refused:
        fit_cut((replace(made, samples=samples),), paper(), friction, effort="draft", rng=rng)
    said = str(refused.value)
    assert said.index("is at the end of its range") < said.index("no stroke shows")


def test_other_errors_are_not_reported_as_missing_unloading(friction, monkeypatch):
    def broken(*_):
        raise ValueError("something else")

    monkeypatch.setattr("scissorcal.calibration.cut.fit.scout", broken)
    rng = np.random.default_rng(15)
    with pytest.raises(ValueError, match="something else"):
        fit_cut((cut(way(HIGH, LOW)).made.recording,), paper(), friction, effort="draft", rng=rng)


def test_a_recipe_says_which_laws_are_compared():
    def names(**cut):
        return [law.name for law in allowed_laws(paper(**{"response": "power", **cut}))]

    assert names(fracture="smooth") == ["power response, smooth fracture"]
    assert names(fracture="auto") == [
        "power response, smooth fracture",
        "power response, rippled fracture",
    ]
    assert names(fracture="smooth", rate_damping="auto") == [
        "power response, smooth fracture",
        "power response, damped, smooth fracture",
    ]
    assert names(fracture="smooth", load_share="fit") == [
        "power response, smooth fracture, load-dependent friction"
    ]
    families = {
        named: [law.response for law in allowed_laws(pressing(response=named))]
        for named in ("auto", "spline", "auto+spline")
    }
    assert set(families["auto"]) == {"power", "exponential"}
    assert set(families["spline"]) == {"spline"}
    assert set(families["auto+spline"]) == {"power", "exponential", "spline"}
