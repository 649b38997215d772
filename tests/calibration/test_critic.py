"""The critic: finds what a law lacks, finds nothing where nothing is, and says what it cannot."""

import dataclasses

import numpy as np
import pytest
from scipy.ndimage import uniform_filter1d

from scissorcal.calibration import fit_friction
from scissorcal.calibration.conditioning import condition
from scissorcal.calibration.critic import FEWEST_STROKES, RECURS, criticise
from scissorcal.calibration.friction_experiment import design
from scissorcal.calibration.ladder import climb
from scissorcal.model.terms import TERMS, Motion
from scissorcal.recipe.schema import FitFriction
from scissorcal.recording.recording import Recording
from tests.calibration.test_friction import emps
from tests.calibration.truth import Truth, friction_recording

SEEDS = range(10)
MISSING = {
    "rate^2": lambda opening, rate: 5e-4 * rate**2,
    "rate*|rate|": lambda opening, rate: 5e-4 * rate * np.abs(rate),
    "sign*opening": lambda opening, rate: 1e-3 * np.sign(rate) * opening,
}


def with_term(recording: Recording, term) -> Recording:
    """The same motion with a torque more; AR noise of rho = 0.9 is in the recording already."""
    samples = recording.samples.copy()
    rate = uniform_filter1d(np.gradient(samples["opening"]) * 1000.0, 5)
    samples["motor_torque"] += term(samples["opening"], rate)
    return dataclasses.replace(recording, samples=samples)


def critique(recording: Recording, seed: int, keep: int | None = None):
    """Criticise Coulomb + viscous, asymmetric; over the first ``keep`` strokes where given."""
    every = condition((recording,), 100.0)
    bins = every.where(every.moving & (every.stroke >= 0))
    if keep is not None:
        bins = bins.where(bins.stroke < keep)
    law = design(bins, bins.stroke, "coulomb+viscous", False, recording.joint)
    climbed = climb(law.rung(bins.drive), bins.series, bins.stroke)
    motion = Motion(bins.opening, bins.rate, bins.acceleration)
    rng = np.random.default_rng(seed)
    return criticise("friction", climbed, motion, recording.joint, rng)


@pytest.mark.parametrize("name", list(MISSING))
def test_a_missing_term_is_recovered_in_nine_of_ten_recordings(name):
    recovered = 0
    for seed in SEEDS:
        recording = friction_recording(Truth(), np.random.default_rng(seed))
        found = critique(with_term(recording, MISSING[name]), seed).proposals
        recovered += [proposal.name for proposal in found] == [name]
    assert recovered >= 9


def test_nothing_is_proposed_where_nothing_is_missing_in_nine_of_ten_recordings():
    proposed = sum(
        bool(critique(friction_recording(Truth(), np.random.default_rng(seed)), seed).proposals)
        for seed in SEEDS
    )
    assert proposed <= 1


def test_a_proposal_says_how_much_how_often_and_how_to_adopt_it():
    recording = friction_recording(Truth(), np.random.default_rng(3))
    found = critique(with_term(recording, MISSING["rate^2"]), 3)
    (proposal,) = found.proposals
    assert proposal.coefficient == pytest.approx(5e-4, rel=0.1)
    assert 0 < proposal.coefficient_sd < 0.1 * proposal.coefficient
    assert proposal.unit == "N m s^2/rad^2"
    assert proposal.inclusion >= RECURS
    assert proposal.held_out_gain > 0
    assert proposal.held_out_nats > 3
    assert proposal.adopted_by == 'fit.friction.adopt = ["rate^2"]'
    assert proposal.adopted_by in proposal.sentence
    assert "proposes rate^2" in found.sentence


def test_what_the_law_can_imitate_is_never_proposed():
    """Coulomb and viscous terms of another size are the law's own business."""
    recording = friction_recording(Truth(), np.random.default_rng(4))
    more = with_term(recording, lambda opening, rate: 4e-3 * np.sign(rate) + 1e-3 * rate)
    assert critique(more, 4).proposals == ()


def test_few_strokes_are_not_searched():
    recording = friction_recording(Truth(), np.random.default_rng(5))
    found = critique(with_term(recording, MISSING["rate^2"]), 5, keep=FEWEST_STROKES - 1)
    assert found.proposals == ()
    assert f"needs {FEWEST_STROKES} strokes" in found.sentence


def test_every_proposable_term_is_of_the_shared_library():
    recording = friction_recording(Truth(), np.random.default_rng(6))
    found = critique(with_term(recording, MISSING["sign*opening"]), 6)
    assert {proposal.name for proposal in found.proposals} <= set(TERMS)


def test_the_critic_is_asked_at_standard_effort_only_and_can_be_told_to_keep_quiet():
    recording = friction_recording(Truth(), np.random.default_rng(7))
    spoken = {}
    for effort, critic in (("draft", True), ("standard", False), ("standard", True)):
        settings = FitFriction(rung="coulomb+viscous", symmetry="asymmetric", critic=critic)
        rng = np.random.default_rng(7)
        found = fit_friction((recording,), settings, effort=effort, rng=rng)
        spoken[effort, critic] = found.diagnostics["critic"]
    assert spoken["draft", True] == spoken["standard", False] == "The critic was not asked."
    assert "terms over 100 resamples" in spoken["standard", True]


def test_emps_leaves_a_drag_that_grows_with_the_square_of_the_rate():
    settings = FitFriction(rung="coulomb+viscous", symmetry="asymmetric")
    found = fit_friction((emps(),), settings, effort="standard", rng=np.random.default_rng(0))
    (proposal,) = found.critic
    assert proposal.name == "rate*|rate|"
    assert proposal.coefficient == pytest.approx(-395, rel=0.05)
    assert proposal.held_out_gain == pytest.approx(0.034, abs=0.005)
    assert proposal.unit == "N s^2/m^2"
