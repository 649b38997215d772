"""Parameters of a friction fit: the recipe's priors, whatever the data are."""

import dataclasses

import numpy as np
import pytest

from scissorcal.calibration.friction.layout import LawChoice, friction_layout, friction_precision
from scissorcal.calibration.friction.model import design
from scissorcal.calibration.signals.weak_form import weigh
from scissorcal.model import LOG, LOGIT, law_names
from scissorcal.recipe import JointPriors, LogNormalPrior
from scissorcal.recording import Joint
from tests.calibration.truth import Truth, friction_recording


def test_no_prior_depends_on_the_data_that_are_fitted():
    """Ten times the torque, half the strokes: the same prior for every parameter but the delay."""
    recording = friction_recording(Truth(), np.random.default_rng(1))
    louder = recording.samples[: len(recording.samples) // 2].copy()
    louder["motor_torque"] *= 10.0
    layouts = []
    for one in (recording, dataclasses.replace(recording, samples=louder)):
        every = weigh((one,), 75.0)
        windows = every.where(every.bins.moving)
        law = design(
            windows,
            windows.bins.stroke,
            LawChoice(law_names()[-1], True, ("rate^2",), 120.0),
            one.joint,
            JointPriors(),
        )
        layouts.append(law.layout)
    assert layouts[0] == layouts[1]


def test_a_stated_prior_is_the_parameters_prior():
    stated = LogNormalPrior(median=0.5, factor_90=3.0)
    default = JointPriors().rotary
    priors = default.model_copy(update={"coulomb_Nm": stated})
    layout = friction_layout(LawChoice("coulomb", False), Joint(), priors)
    places = [layout.names.index(name) for name in ("coulomb_pos", "coulomb_neg")]
    for place in places:
        parameter = layout.parameters[place]
        assert (parameter.mean, parameter.sd) == stated.normal()
        assert parameter.transform == LOG


@pytest.mark.parametrize("kind", ["rotary", "linear"])
@pytest.mark.parametrize("law", law_names())
def test_every_law_has_parameters_with_units_and_proper_priors(law, kind):
    joint = Joint(kind)
    choice = LawChoice(law, False, ("rate^2",), cogging=120.0)
    layout = friction_layout(choice, joint, JointPriors().of(kind), 1e-3)
    assert layout.names[0] == "inertia"
    assert layout.names[-1] == "noise"
    assert len(set(layout.names)) == len(layout.names)
    assert np.all(np.isfinite(layout.mean))
    assert np.all(layout.sd > 0)
    units = {p.name: p.unit for p in layout.parameters}
    assert units["coulomb_pos"] == joint.effort_unit
    assert units["inertia"] == ("kg m^2" if kind == "rotary" else "kg")
    delay = layout.parameters[layout.names.index("delay")]
    assert (delay.mean, delay.sd) == pytest.approx((5e-4, 1e-3))
    if "presliding" in law:
        assert layout.parameters[layout.names.index("presliding_share")].transform == LOGIT


def test_nine_of_ten_draws_of_the_prior_are_hand_tools():
    """Nine of ten draws have an inertia, levels and a Stribeck speed as hand tools have, and static
    friction between 1.06 and 2.5 times Coulomb friction."""
    layout = friction_layout(LawChoice("stribeck", True), Joint(), JointPriors().rotary)
    rng = np.random.default_rng(3)
    covariance = np.linalg.inv(friction_precision(layout))
    values = layout.natural(rng.multivariate_normal(layout.mean, covariance, 4000))
    values["stribeck"] = values["stribeck"] / values["coulomb"]
    for name, low, high in (
        ("inertia", 3e-6, 3e-2),
        ("coulomb", 2e-4, 2.0),
        ("viscous", 2e-5, 0.2),
        ("stribeck", 0.06, 1.5),
        ("stribeck_rate", 0.01, 1.0),
    ):
        inside = np.mean((values[name] > low) & (values[name] < high))
        assert inside == pytest.approx(0.9, abs=0.025), name


@pytest.mark.parametrize("symmetric", [True, False])
def test_static_friction_goes_with_coulomb_friction(symmetric):
    """Friction ten times as large as the priors' centres has the same density of their ratio."""
    layout = friction_layout(LawChoice("stribeck", symmetric), Joint(), JointPriors().rotary)
    precision = friction_precision(layout)
    larger = np.array([np.log(10.0) * n.startswith(("coulomb", "stribeck")) for n in layout.names])
    larger[layout.names.index("stribeck_rate")] = 0.0
    alone = larger * np.array([n.startswith("coulomb") for n in layout.names])
    own = 0.5 * float(alone @ np.diag(1.0 / layout.sd**2) @ alone)
    assert 0.5 * float(larger @ precision @ larger) == pytest.approx(own)
    assert 0.5 * float(alone @ precision @ alone) > own + 2.0
