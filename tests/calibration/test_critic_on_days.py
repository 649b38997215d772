"""The critic on whole days of a rig of other construction: named what is planted, else nothing."""

import numpy as np
import pytest

from scissorcal.calibration import fit_friction
from scissorcal.calibration.fit_model import FrictionRun
from scissorcal.recipe import FitFriction
from scissorcal.verdicts import Verdict
from tests.calibration.planted import planted
from tests.second_rig import capture_friction, coarse, fine, recipe_for
from tests.second_rig.parameters import draw_truth

LAW = FitFriction(law="stribeck+angle", symmetry="asymmetric")
NAMES = {
    "drift": "sign*time",
    "ripple": "wave(2 periods)",
    "eccentricity": "misread wave(",
    "second minimum": "sign*bump(",
    "hysteresis": "sign*exp(-way/",
}
FELT = {"drift", "ripple", "hysteresis"}
SEEDS = range(5)


FIRST = 183


def day(seed: int, make=fine):
    rng = np.random.default_rng([FIRST, seed])
    rig = draw_truth(make(), rng)
    return capture_friction(rig, recipe_for(rig), rng)[0]


def criticised(recording, law=LAW) -> tuple[tuple[str, ...], Verdict]:
    rng = np.random.default_rng(183)
    fit = fit_friction((recording,), law, effort="draft", rng=rng, run=FrictionRun(critic=True))
    judged = next(one for one in fit.verdicts if one.check == "structure left")
    return tuple(proposal.name for proposal in fit.critic), judged


def test_a_drift_of_friction_is_named_and_fails_by_its_torque():
    names, judged = criticised(planted(day(0), "drift", np.random.default_rng(0)))
    assert NAMES["drift"] in names
    assert judged.status == "fail"
    assert "sign*time" in judged.why


@pytest.mark.slow
@pytest.mark.parametrize("what", [what for what in NAMES if what != "second minimum"])
def test_what_is_planted_is_named_on_five_of_five_days(what):
    for seed in SEEDS:
        names, judged = criticised(planted(day(seed), what, np.random.default_rng(seed)))
        assert any(name.startswith(NAMES[what]) for name in names), (seed, names)
        assert judged.status == "fail" or what not in FELT, (seed, judged)


@pytest.mark.slow
def test_a_second_minimum_is_named_at_the_latest_when_a_drag_is_adopted():
    """A law whose Stribeck friction reached for the dip leaves what a drag explains best."""
    for seed in SEEDS:
        recording = planted(day(seed), "second minimum", np.random.default_rng(seed))
        first, judged = criticised(recording)
        assert judged.value > 0.04
        adopted = LAW.model_copy(update={"adopt": tuple({*first} & {"rate*|rate|"})})
        second, _ = criticised(recording, adopted)
        assert any(name.startswith("sign*bump(0.375)") for name in (*first, *second)), seed


@pytest.mark.slow
def test_nothing_is_named_on_38_of_40_clean_days():
    """A rate of 2 % is stated; at that rate more than two of 40 come by chance once in 20 times."""
    found = [criticised(day(seed, make)) for make in (fine, coarse) for seed in range(20)]
    assert sum(bool(names) for names, _ in found) <= 2
    assert not any(judged.status == "fail" for _, judged in found)
