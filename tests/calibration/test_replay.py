"""Record-and-replay: right on what it has seen, and beaten where the motion is another."""

import numpy as np
import pytest

from scissorcal.calibration import fit_friction
from scissorcal.calibration.replay import compare_with_replay, replay_from_stroke
from scissorcal.recipe import FitFriction
from tests.calibration.test_checks import fitted, motion
from tests.calibration.truth import Truth, friction_recording

SIMPLE = FitFriction(law="coulomb+viscous", symmetry="asymmetric")


@pytest.fixture(scope="module")
def found():
    rng = np.random.default_rng(1)
    recording = friction_recording(Truth(viscous=0.01), rng)
    return fit_friction((recording,), SIMPLE, effort="standard", rng=rng)


def test_a_stroke_replayed_at_its_own_openings_is_itself_but_for_the_noise():
    rng = np.random.default_rng(0)
    opening = np.linspace(0.85, 0.2, 2000)
    torque = np.sin(5 * opening)
    replay = replay_from_stroke(opening, torque + 0.1 * rng.standard_normal(2000))
    left = replay(opening) - torque
    assert np.sqrt(np.mean(left**2)) < 0.03, "means over some 33 samples each"
    assert np.all(np.diff(replay.opening) > 0)
    assert not replay.covers(np.array([0.1, 0.9])).any()
    assert replay(np.array([0.1, 0.9])) == pytest.approx([replay.torque[0], replay.torque[-1]])


def test_at_another_speed_the_law_beats_the_replay(found):
    """Viscous friction of 10 mN m s/rad: a replay is off by that times the difference in speed."""
    compared = found.replay
    assert compared.kind == "closing"
    other = [row for row in compared.rows if row.novelty == "speed"]
    assert len(other) >= 6
    for row in other:
        expected = 0.01 * abs(row.speed - compared.speed)
        assert row.replay_rms == pytest.approx(np.hypot(expected, 1e-3), rel=0.35)
        assert row.model_rms < 1.3e-3
    assert (
        f"better on {sum(r.model_rms < r.replay_rms for r in compared.rows)}"
        in found.replay.sentence
    )


def test_the_replayed_stroke_is_not_among_the_unseen_ones(found):
    strokes = [row.stroke for row in found.replay.rows]
    assert found.replay.stroke not in strokes
    assert len(set(strokes)) == len(strokes)


def test_two_closing_strokes_are_too_few_to_compare():
    bins = motion(strokes=2)
    chosen, _ = fitted(bins)
    unknown = np.full(len(bins.rate), np.nan)
    args = (chosen, bins, np.ones(len(bins.rate)), unknown, ("a.mcap",))
    assert compare_with_replay(*args, refit=False) is None


def test_what_is_new_about_a_stroke_is_named():
    bins = motion(speeds=(0.3, 0.3, 0.3, 0.6))
    chosen, _ = fitted(bins)
    measured = np.ones(len(bins.rate)) * (bins.stroke == 7) + 1e-3 * bins.opening
    contact = np.where(bins.stroke == 2, 0.05, 0.02)
    compared = compare_with_replay(chosen, bins, measured, contact, ("a.mcap",), refit=True)
    novelty = {row.stroke: row.novelty for row in compared.rows}
    assert novelty[3] == novelty[7] == "speed"
    assert novelty[2] == "contact"
    assert set(novelty.values()) == {"none", "speed", "contact"}
    assert all(np.isfinite(row.one_stroke_rms) for row in compared.rows)
    assert "Fitted to that one stroke alone" in compared.sentence


def test_the_prior_is_drawn_as_the_fit_had_it(found):
    """90 % of a wide prior's draws lie within a factor of 100 of its centre."""
    names = [parameter.name for parameter in found.parameters]
    draws = np.log(found.prior_draws[:, names.index("coulomb_pos")])
    assert draws.std() == pytest.approx(2.8, rel=0.1)
