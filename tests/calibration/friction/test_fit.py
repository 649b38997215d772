"""Friction from recordings with known truth, from real data, and from recordings that lack it."""

import dataclasses
from pathlib import Path

import numpy as np
import pytest

from scissorcal.calibration import fit_friction, load_fit, save
from scissorcal.calibration.fit_model import FrictionRun
from scissorcal.errors import InputError
from scissorcal.recipe import FitFriction
from scissorcal.recording import SAMPLE_DTYPE, Joint, Recording
from tests.calibration.truth import QUICK, Truth, friction_recording

SHARED = Path(__file__).resolve().parents[4] / "shared" / "data"
EMPS = SHARED / "emps" / "DATA_EMPS.mat"

SIMPLE = FitFriction(law="coulomb+viscous", symmetry="asymmetric")


@pytest.fixture(scope="module")
def recording() -> Recording:
    return friction_recording(Truth(), np.random.default_rng(1), QUICK)


@pytest.fixture(scope="module")
def fitted(recording):
    return fit_friction((recording,), SIMPLE, effort="standard", rng=np.random.default_rng(2))


def test_every_parameter_is_recovered_within_four_standard_deviations(fitted):
    """Coloured noise of 1 mN m and an encoder of 50 urad; 5 parameters: false alarm 3e-4."""
    truth = Truth()
    expected = {
        "inertia": truth.inertia,
        "coulomb_pos": truth.coulomb_pos,
        "coulomb_neg": truth.coulomb_neg,
        "viscous_pos": truth.viscous,
        "viscous_neg": truth.viscous,
    }
    for name, value in expected.items():
        parameter = fitted.parameter(name)
        assert abs(parameter.mean - value) < 4 * parameter.sd, name
        assert parameter.sd < 0.1 * value, name
    unknown = {verdict.check for verdict in fitted.verdicts if verdict.status != "pass"}
    assert unknown == {"sensor zeros"}, "the made recording has no idle second"


@pytest.fixture(scope="module")
def ladder(recording):
    """The fit of every law."""
    settings = FitFriction(critic=False)
    return fit_friction((recording,), settings, effort="standard", rng=np.random.default_rng(3))


def test_the_ladder_does_not_climb_higher_than_the_data(ladder):
    assert ladder.candidate.startswith("coulomb + viscous")
    assert [row["name"] for row in ladder.candidates if row["chosen"]] == [ladder.candidate]
    assert len(ladder.candidates) == 8
    assert ladder.diagnostics["evaluations"] > 8 * 50


def test_laws_with_build_up_are_not_searched_where_reversals_show_none(ladder):
    (note,) = (note for note in ladder.notes if note.startswith("Not fitted: "))
    assert "stribeck + angle + presliding, asymmetric" in note
    assert not any("presliding" in row["name"] for row in ladder.candidates)


def test_a_fit_names_equivalent_candidates_and_what_would_distinguish_them(ladder):
    alike = [row["name"] for row in ladder.candidates if row["equivalent"]]
    assert ladder.candidate in alike
    assert len(alike) > 1
    for name in alike:
        assert name in ladder.selection
    assert "is used" in ladder.selection
    assert "would distinguish them" in ladder.selection
    assert "rad/s" in ladder.selection


def test_draft_fits_the_law_that_was_chosen_last(recording):
    found = fit_friction(
        (recording,),
        FitFriction(),
        effort="draft",
        rng=np.random.default_rng(3),
        run=FrictionRun(last_chosen="coulomb + viscous, asymmetric"),
    )
    assert [row["name"] for row in found.candidates] == ["coulomb + viscous, asymmetric"]
    assert any("Draft effort fitted one law of 10" in note for note in found.notes)


def test_a_fit_that_runs_out_of_time_is_no_calibration(recording):
    """The optimum of sums by stroke takes milliseconds and is reached all the same."""
    rng = np.random.default_rng(3)
    found = fit_friction(
        (recording,), SIMPLE, effort="standard", rng=rng, run=FrictionRun(stop=lambda: True)
    )
    assert "k-hat" in {verdict.check for verdict in found.rejected}


def test_draft_says_that_its_intervals_are_unchecked(recording):
    found = fit_friction((recording,), SIMPLE, effort="draft", rng=np.random.default_rng(4))
    status = {verdict.check: verdict.status for verdict in found.verdicts}
    assert status["k-hat"] == "not_evaluated"
    said = "coulomb + viscous, asymmetric was compared with no other candidate."
    assert found.selection == said


def test_equal_seeds_give_equal_fits(recording, fitted):
    again = fit_friction((recording,), SIMPLE, effort="standard", rng=np.random.default_rng(2))
    assert again.parameters == fitted.parameters


def still(recording: Recording) -> Recording:
    samples = recording.samples.copy()
    samples["opening"] = 0.5
    return dataclasses.replace(recording, samples=samples)


def one_way(recording: Recording) -> Recording:
    samples = recording.samples[recording.samples["stroke"] == 0]
    return dataclasses.replace(recording, samples=samples)


def silent(recording: Recording) -> Recording:
    samples = recording.samples.copy()
    samples["motor_torque"] = 0.25
    return dataclasses.replace(recording, samples=samples)


def coarse(recording: Recording) -> Recording:
    samples = recording.samples[recording.samples["stroke"] == 0].copy()
    samples["opening"] = np.round(samples["opening"] / 0.01) * 0.01
    return dataclasses.replace(recording, samples=samples)


def standing_clock(recording: Recording) -> Recording:
    samples = recording.samples.copy()
    samples["device_time_us"] = 7
    return dataclasses.replace(recording, samples=samples)


@pytest.mark.parametrize(
    ("spoil", "says"),
    [
        (still, "hardly any motion"),
        (one_way, r"positive \(opening\) one is missing"),
        (silent, "constant while the joint moves"),
        (standing_clock, "clock does not advance"),
        (coarse, "does not show its direction"),
    ],
)
def test_poor_recordings_are_refused_with_what_is_missing(recording, spoil, says):
    with pytest.raises(InputError, match=says) as refused:
        fit_friction((spoil(recording),), SIMPLE, effort="draft", rng=np.random.default_rng(5))
    assert "friction.mcap" in str(refused.value)


def test_no_recording_at_all_is_refused():
    with pytest.raises(InputError, match="no recording"):
        fit_friction((), SIMPLE, effort="draft", rng=np.random.default_rng(5))


def emps() -> Recording:
    if not EMPS.is_file():
        pytest.skip(f"real data absent: {EMPS.name} is not beside the project")
    from scissorcal.recording import ImportOptions, import_table

    return import_table(
        EMPS,
        columns={"opening": "qm", "motor_torque": "vir", "time": "t"},
        units={"opening": "m", "motor_torque": "N", "time": "s"},
        scale={"motor_torque": "gtau"},
        options=ImportOptions(joint=Joint("linear")),
    )


PUBLISHED = {
    "symmetric": {
        "inertia": (95.1089, 0.1085),
        "viscous": (203.5034, 1.1460),
        "coulomb": (20.3935, 0.1012),
        "offset": (-3.1648, 0.0444),
    },
    "asymmetric": {
        "inertia": (95.1540, 0.1085),
        "viscous_pos": (166.7061, 1.1460),
        "coulomb_pos": (20.1440, 0.1012),
        "viscous_neg": (240.4236, 1.1460),
        "coulomb_neg": (20.6277, 0.1012),
    },
}


@pytest.mark.parametrize("symmetry", ["symmetric", "asymmetric"])
def test_emps_agrees_with_its_published_values(symmetry):
    """Within the fit's own standard deviation.

    The published fit has the turns in and this one leaves them out, so the two do not see the same
    samples.
    """
    settings = FitFriction(law="coulomb+viscous", symmetry=symmetry)
    found = fit_friction((emps(),), settings, effort="standard", rng=np.random.default_rng(0))
    for name, (value, _) in PUBLISHED[symmetry].items():
        own = found.parameter(name)
        assert abs(own.mean - value) < own.sd, name
    assert found.parameter("inertia").unit == "kg"
    assert found.parameter("inertia").sd > 0.05, "no tighter than its autocorrelated noise allows"


@pytest.mark.slow
def test_emps_prefers_an_asymmetric_law():
    """Evidence decides: Coulomb and viscous friction alone are 161 nats behind."""
    found = fit_friction(
        (emps(),), FitFriction(critic=False), effort="standard", rng=np.random.default_rng(0)
    )
    assert found.candidate == "stribeck + angle + presliding, asymmetric"
    behind = {row["name"]: row["behind"] for row in found.candidates}
    assert behind["coulomb + viscous, asymmetric"] > 100.0
    assert behind["coulomb + viscous, symmetric"] > behind["coulomb + viscous, asymmetric"] + 100.0
    assert found.parameter("inertia").mean == pytest.approx(95.1, rel=0.01)
    assert found.effort_unit == "N"


def test_an_adopted_term_is_fitted_recovered_and_kept(tmp_path):
    """Four standard deviations: false alarm 6e-5."""
    recording = friction_recording(Truth(), np.random.default_rng(21), QUICK)
    rate = np.gradient(recording.samples["opening"]) * 1000.0
    samples = recording.samples.copy()
    samples["motor_torque"] += 8e-4 * np.convolve(rate, np.full(5, 0.2), "same") ** 2
    bent = dataclasses.replace(recording, samples=samples)
    settings = SIMPLE.model_copy(update={"adopt": ("rate^2",), "critic": False})
    found = fit_friction((bent,), settings, effort="standard", rng=np.random.default_rng(22))
    assert found.candidate == "coulomb + viscous + rate^2, asymmetric"
    assert found.structure["adopt"] == ["rate^2"]
    term = found.parameter("rate^2")
    assert abs(term.mean - 8e-4) < 4 * term.sd
    assert term.sd < 2e-4
    assert term.unit == "N m s^2/rad^2"
    save(found, tmp_path / "friction.nc")
    back = load_fit(tmp_path / "friction.nc")
    assert back.parameters == found.parameters
    assert back.structure == found.structure


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        ({"adopt": ("sign",)}, "has already"),
        ({"adopt": ("rate^2", "rate^2")}, "has already"),
        ({"adopt": ("load*sign",)}, "needs the load"),
    ],
)
def test_terms_that_cannot_be_adopted_are_refused(recording, settings, says):
    wanted = SIMPLE.model_copy(update=settings)
    with pytest.raises(InputError, match=says):
        fit_friction((recording,), wanted, effort="draft", rng=np.random.default_rng(5))


@pytest.mark.slow
def test_presliding_is_recovered_from_turns():
    """Swings of several sizes, friction by Dahl's law in small steps; 4 sd, false alarm 1e-4."""
    rng = np.random.default_rng(23)
    time = np.arange(60000) / 1000
    opening = 0.5 + 0.2 * np.sin(1.3 * time) + 0.12 * np.sin(2.9 * time + 1)
    rate, z = np.gradient(opening) * 1000.0, 1.0
    state = np.empty(len(time))
    for i, step in enumerate(np.diff(opening, prepend=opening[0])):
        z = np.clip(z + (1.0 - z * np.sign(step)) * step / 0.03, -1, 1)
        state[i] = z
    samples = np.zeros(len(time), SAMPLE_DTYPE)
    samples["device_time_us"] = np.round(time * 1e6)
    samples["opening"] = np.round(opening / 2e-5) * 2e-5
    drive = 2e-4 * np.gradient(rate) * 1e3 + 0.02 * (0.4 * np.sign(rate) + 0.6 * state)
    samples["motor_torque"] = drive + 3e-4 * rng.standard_normal(len(time))
    samples["stroke"] = -1
    recording = Recording("friction", samples, source="turns")
    settings = FitFriction(law="coulomb+presliding", symmetry="symmetric", critic=False)
    found = fit_friction((recording,), settings, effort="standard", rng=rng)
    for name, value in (("presliding_share", 0.6), ("presliding_length", 0.03), ("coulomb", 0.02)):
        parameter = found.parameter(name)
        assert abs(parameter.mean - value) < 4 * parameter.sd + 0.01 * value, name
        assert parameter.sd < 0.1 * value, name
    every = FitFriction(symmetry="symmetric", critic=False)
    assert "presliding" in fit_friction((recording,), every, effort="standard", rng=rng).candidate
