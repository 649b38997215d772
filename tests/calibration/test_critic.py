"""The critic: finds what a law lacks, finds nothing where nothing is, and says what it cannot."""

import dataclasses

import numpy as np
import pytest
from scipy.ndimage import uniform_filter1d

from scissorcal.calibration import fit_friction
from scissorcal.calibration.critic import (
    FEWEST_STROKES,
    NOT_ASKED,
    RECURS,
    Critique,
    Structure,
    criticise,
    structure_verdict,
)
from scissorcal.calibration.fit_candidate import fit_candidate
from scissorcal.calibration.fit_model import FrictionRun
from scissorcal.calibration.friction.fit import friction_experiment
from scissorcal.model import LIBRARY
from scissorcal.recipe import FitFriction
from scissorcal.recording import Recording
from tests.calibration.friction.test_fit import emps
from tests.calibration.truth import QUICK, Truth, friction_recording

SIMPLE = FitFriction(law="coulomb+viscous", symmetry="asymmetric")
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


@pytest.fixture(scope="module")
def template():
    """A fit whose law every recording here is given."""
    rng = np.random.default_rng(100)
    return fit_friction((friction_recording(Truth(), rng),), SIMPLE, effort="draft", rng=rng)


def critique(recording: Recording, seed: int, template):
    """Criticise Coulomb + viscous, asymmetric."""
    law = friction_experiment((recording,), SIMPLE, template)
    chosen = fit_candidate(law.candidate(law.observed), law.series, law.strokes)
    rng = np.random.default_rng(seed)
    return criticise(law, chosen, recording.joint, rng)


def test_fewer_bins_than_terms_are_criticised_too(template):
    """Eight strokes of five bins, where law and library have some sixty columns."""
    recording = friction_recording(Truth(), np.random.default_rng(101), QUICK)
    law = friction_experiment((recording,), SIMPLE, template)
    strokes = np.unique(law.strokes)[:8]
    few = [np.flatnonzero(law.strokes == stroke)[::7][:5] for stroke in strokes]
    kept = np.isin(np.arange(len(law.strokes)), np.concatenate(few))
    law = dataclasses.replace(
        law, windows=law.windows.where(kept), strokes=law.strokes[kept], shared=None, share=None
    )
    chosen = fit_candidate(law.candidate(law.observed), law.series, law.strokes)
    rng = np.random.default_rng(0)
    assert isinstance(criticise(law, chosen, recording.joint, rng), Critique)


@pytest.mark.slow
@pytest.mark.parametrize("name", MISSING)
def test_a_missing_term_is_recovered_in_nine_of_ten_recordings(name, template):
    recovered = 0
    for seed in SEEDS:
        recording = friction_recording(Truth(), np.random.default_rng(seed))
        found = critique(with_term(recording, MISSING[name]), seed, template).proposals
        recovered += [proposal.name for proposal in found] == [name]
    assert recovered >= 9


@pytest.mark.slow
def test_nothing_is_proposed_where_nothing_is_missing_in_nine_of_ten_recordings(template):
    proposed = sum(
        bool(
            critique(
                friction_recording(Truth(), np.random.default_rng(seed)), seed, template
            ).proposals
        )
        for seed in SEEDS
    )
    assert proposed <= 1


def test_a_proposal_says_how_much_how_often_and_how_to_adopt_it(template):
    recording = friction_recording(Truth(), np.random.default_rng(3))
    found = critique(with_term(recording, MISSING["rate^2"]), 3, template)
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


def test_what_the_law_can_imitate_is_never_proposed(template):
    """Coulomb and viscous terms of another size are the law's own business."""
    recording = friction_recording(Truth(), np.random.default_rng(4))
    more = with_term(recording, lambda opening, rate: 4e-3 * np.sign(rate) + 1e-3 * rate)
    assert critique(more, 4, template).proposals == ()


def test_few_strokes_are_not_searched(template):
    recording = friction_recording(Truth(), np.random.default_rng(5))
    few = recording.samples[recording.samples["stroke"] < FEWEST_STROKES - 1]
    found = critique(dataclasses.replace(recording, samples=few), 5, template)
    assert found.proposals == ()
    assert f"needs {FEWEST_STROKES} strokes" in found.sentence


def test_every_proposable_term_is_of_the_shared_library(template):
    recording = friction_recording(Truth(), np.random.default_rng(6))
    found = critique(with_term(recording, MISSING["sign*opening"]), 6, template)
    assert {proposal.name for proposal in found.proposals} <= set(LIBRARY)


def test_the_critic_is_asked_at_standard_effort_only_unless_it_is_asked_for():
    recording = friction_recording(Truth(), np.random.default_rng(7), QUICK)
    spoken = {}
    for effort, critic, asked in (
        ("draft", True, False),
        ("standard", False, False),
        ("standard", True, False),
        ("draft", False, True),
    ):
        settings = FitFriction(law="coulomb+viscous", symmetry="asymmetric", critic=critic)
        rng = np.random.default_rng(7)
        found = fit_friction(
            (recording,), settings, effort=effort, rng=rng, run=FrictionRun(critic=asked)
        )
        judged = next(one for one in found.verdicts if one.check == "structure left")
        spoken[effort, critic, asked] = found.diagnostics["critic"], judged.status
    silent = (NOT_ASKED, "not_evaluated")
    assert spoken["draft", True, False] == spoken["standard", False, False] == silent
    for said, status in (spoken["standard", True, False], spoken["draft", False, True]):
        assert said.startswith("The critic tried ")
        assert status == "pass"


def test_emps_leaves_friction_that_bends_over_speed_and_place():
    """One bump gains 77 nats on unseen strokes, a drag with the square of the rate 46."""
    found = fit_friction((emps(),), SIMPLE, effort="standard", rng=np.random.default_rng(0))
    assert [one.name for one in found.critic] == ["sign*bump(0.375)", "sign*wave(1 period)"]
    assert found.critic[0].coefficient == pytest.approx(-3.4, rel=0.2)
    assert found.critic[0].held_out_gain == pytest.approx(0.043, abs=0.005)
    assert found.critic[0].unit == "N"
    (judged,) = (one for one in found.verdicts if one.check == "structure left")
    assert judged.status == "pass"


def test_fewer_strokes_than_terms_name_what_all_of_them_show(template):
    recording = friction_recording(Truth(), np.random.default_rng(8), QUICK)
    few = recording.samples[recording.samples["stroke"] < FEWEST_STROKES + 1]
    few = dataclasses.replace(recording, samples=few)
    quiet = critique(few, 8, template)
    assert quiet.proposals == ()
    assert np.isfinite(quiet.structure.high)
    found = critique(
        with_term(few, lambda opening, rate: 4e-3 * np.sign(rate) * opening), 8, template
    )
    assert "tried 39 terms over 7 strokes" in found.sentence
    assert [one.name for one in found.proposals] == ["sign*opening"]


def test_what_is_proposed_is_worth_the_torque_that_was_added(template):
    recording = friction_recording(Truth(), np.random.default_rng(9))
    ramp = np.linspace(-1.0, 1.0, len(recording.samples))
    found = critique(
        with_term(recording, lambda opening, rate: 1e-3 * ramp * np.sign(rate)), 9, template
    )
    (proposal,) = found.proposals
    assert proposal.name == "sign*time"
    assert proposal.adopted_by == ""
    assert proposal.size == pytest.approx(2e-3 / np.sqrt(3.0), rel=0.2)  # slow strokes weigh more
    assert found.structure.low < proposal.size < found.structure.high
    assert 2.0 * np.sqrt(np.mean(found.torque**2)) == pytest.approx(proposal.size, rel=1e-6)


@pytest.mark.parametrize(
    ("structure", "status"),
    [
        (Structure(2e-3, 1.5e-3, 2.5e-3), "fail"),
        (Structure(1e-3, 0.5e-3, 1.5e-3), "not_evaluated"),
        (Structure(0.5e-3, 0.4e-3, 0.6e-3), "pass"),
        (Structure(0.0, 0.0, 1.5e-3), "not_evaluated"),
        (None, "not_evaluated"),
    ],
)
def test_structure_is_judged_by_its_interval(structure, status):
    verdict = structure_verdict(Critique((), "It.", structure), 0.02, "N m", 0.07)
    assert verdict.status == status
    assert verdict.threshold == 0.07
