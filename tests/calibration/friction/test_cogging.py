"""Cogging is found where it is and nowhere else, and stays out of what is rendered."""

import dataclasses

import numpy as np
import pytest

from scissorcal.calibration import fit_friction
from scissorcal.calibration.friction.layout import LawChoice
from scissorcal.calibration.friction.model import design
from scissorcal.calibration.friction.noise import FALSE_ALARM, find_cogging
from scissorcal.calibration.signals.weak_form import weigh
from scissorcal.model import FrictionLaw
from scissorcal.recipe import FitFriction, JointPriors
from scissorcal.recording import Recording
from tests.calibration.truth import Truth, friction_recording

SIMPLE = FitFriction(law="coulomb+viscous", symmetry="asymmetric", critic=False)
PERIODS, SIZE = 137.0, 6e-4


def cogging(recording: Recording, size: float, periods: float = PERIODS) -> Recording:
    """The same motion, pushed by a torque that repeats over the opening."""
    samples = recording.samples.copy()
    samples["motor_torque"] -= size * np.sin(periods * samples["opening"] + 0.4)
    return dataclasses.replace(recording, samples=samples)


def searched(recording: Recording):
    every = weigh((recording,), 75.0)
    windows = every.where(every.bins.moving)
    strokes = windows.bins.stroke
    plain = design(windows, strokes, LawChoice("coulomb", False), recording.joint, JointPriors())
    return find_cogging(plain.moments)


@pytest.mark.parametrize(
    "seed", [*range(3), *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(3, 15))]
)
def test_none_is_found_where_there_is_none(seed):
    """Noise with memory, turns at equal places, counts that beat with the ticks; false alarm 1e-4
    for each by the noise."""
    assert FALSE_ALARM <= 1e-4
    assert not searched(friction_recording(Truth(), np.random.default_rng(seed))).found


@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(seed, marks=pytest.mark.slow) for seed in (1, 2))]
)
@pytest.mark.parametrize("periods", [60.0, 137.0, 300.0])
def test_a_ripple_is_found_at_its_period(seed, periods):
    clean = friction_recording(Truth(), np.random.default_rng(seed))
    found = searched(cogging(clean, SIZE, periods))
    assert found.found
    assert found.periods_per_turn == pytest.approx(periods, abs=1.0)
    assert found.power > 2 * found.threshold


def test_one_strokes_ripple_is_no_cogging():
    clean = friction_recording(Truth(), np.random.default_rng(1))
    samples, rippled = clean.samples.copy(), cogging(clean, 3e-3).samples
    here = samples["stroke"] == 2
    samples["motor_torque"][here] = rippled["motor_torque"][here]
    assert not searched(dataclasses.replace(clean, samples=samples)).found


def test_its_size_is_fitted_with_friction_and_is_no_friction():
    """Four standard deviations: false alarm 6e-5 each."""
    clean = friction_recording(Truth(), np.random.default_rng(5))
    fit = fit_friction(
        (cogging(clean, SIZE),), SIMPLE, effort="standard", rng=np.random.default_rng(6)
    )
    names = [one.name for one in fit.nuisance]
    cos, sin = (fit.nuisance[names.index(f"cogging_{wave}")] for wave in ("cos", "sin"))
    size = np.hypot(cos.mean, sin.mean)
    assert abs(size - SIZE) < 4 * np.hypot(cos.sd, sin.sd)
    assert fit.structure["cogging_periods_per_turn"] == pytest.approx(PERIODS, abs=1.0)
    assert any("packages do not render it" in note for note in fit.notes)
    assert not {"cogging_cos", "cogging_sin"} & {one.name for one in fit.parameters}
    values = {one.name: np.asarray(one.mean) for one in (*fit.parameters, *fit.nuisance)}
    law = FrictionLaw.of_fit(values, float(fit.structure["angle_center"]))
    assert {term.name for term in law.terms} == {"coulomb", "viscous"}
    plain = fit_friction((clean,), SIMPLE, effort="draft", rng=np.random.default_rng(6))
    for name in ("coulomb_pos", "coulomb_neg"):
        assert fit.parameter(name).mean == pytest.approx(plain.parameter(name).mean, rel=0.01)
    assert "cogging_periods_per_turn" not in plain.structure
