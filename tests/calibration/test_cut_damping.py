"""Damping by rate: expected as a brute-force truth has it, and found in cuts that have it."""

from dataclasses import replace

import numpy as np
import pytest

from scissorcal.calibration import fit_cut
from scissorcal.calibration.cut_expected import Expected, Spread
from scissorcal.calibration.cut_ladder import allowed_laws
from scissorcal.calibration.cut_motion import cut_motion
from scissorcal.calibration.signals.filtering import condition
from scissorcal.model import Cutting, Edge, Response, Turned, held_torque, take_stance
from scissorcal.recording.recording import Stroke
from tests.calibration.test_cut import friction_of, recipe
from tests.calibration.truth import Truth, cut_recording, make_recording, sweep

DAMPED = Truth(kappa=1.0, damping=30.0)
EDGE = Edge("line", DAMPED.edge_offset, DAMPED.taper, 0.075)


def law(damping: float) -> Cutting:
    return Cutting(
        edge=EDGE,
        response=Response("power", DAMPED.force, DAMPED.exponent, DAMPED.reference),
        moving_blades=2,
        upper_face_m=DAMPED.upper_face,
        fracture_energy=DAMPED.fracture_energy,
        rate_damping=damping,
    )


def test_the_mean_is_that_of_a_truth_written_apart():
    """Without friction's own uncertainty: what the drive lacks is the material's torque."""
    silent = replace(DAMPED, noise=0.0, inertia=0.0, coulomb_pos=0.0, coulomb_neg=0.0, viscous=0.0)
    opening, strokes = [], []
    for a, b, speed in ((0.6, 0.3, 0.6), (0.3, 0.6, 1.0), (0.6, 0.25, 0.6), (0.25, 0.6, 1.0)):
        strokes.append(Stroke(len(strokes), "closing" if a > b else "opening", speed, 0))
        opening.append(sweep(a, b, speed))
    rng = np.random.default_rng(30)
    recording = make_recording("cut", opening, [-0.018] * 4, strokes, silent, rng, True)
    motion = cut_motion(
        condition((recording,), 300.0, 150.0), EDGE, 2, DAMPED.upper_face, DAMPED.reference
    )
    torque = -motion.bins.drive
    closing = motion.bins.rate < -0.3
    errors = [
        np.sqrt(np.mean((torque - Expected(motion, law(c), Spread(0.0, 0.0, 1e-9)).mean) ** 2))
        for c in (DAMPED.damping, 0.0)
    ]
    assert np.any(closing)
    assert errors[0] < 0.02 * np.sqrt(np.mean(torque**2))
    assert errors[0] < 0.2 * errors[1]


def test_at_rest_and_withdrawing_there_is_no_force_below_zero():
    stance = take_stance(EDGE, Turned.at(np.full(5, 0.4), 2))
    rates = np.array([-1.0, -1e-9, 0.0, 0.5, 500.0])
    torque = held_torque(law(30.0), stance, np.full(5, 0.02), rates)
    assert torque[2] == held_torque(law(0.0), stance, np.full(5, 0.02))[2] > 0.0
    assert np.all(np.diff(torque) <= 0.0)
    assert torque[-1] == 0.0
    air = held_torque(law(30.0), stance, np.full(5, 0.2), rates)
    assert np.all(air == 0.0)


def test_a_recipe_says_whether_damping_is_in_the_ladder():
    rungs = {
        mode: [law.name for law in allowed_laws(recipe(fracture="smooth", rate_damping=mode))]
        for mode in ("none", "fit", "auto")
    }
    assert rungs["none"] == ["power response, smooth fracture"]
    assert rungs["fit"] == ["power response, damped, smooth fracture"]
    assert rungs["auto"] == rungs["none"] + rungs["fit"]


@pytest.mark.slow
def test_damping_is_recovered_and_told_from_none():
    """Four standard deviations: false alarm 2e-4 for four parameters."""
    rng = np.random.default_rng(31)
    friction = friction_of(DAMPED, rng)
    for truth in (DAMPED, replace(DAMPED, damping=0.0)):
        cuts = cut_recording(truth, rng, sheets=1)
        wanted = recipe(fracture="smooth", critic=False, rate_damping="auto")
        fit = fit_cut((cuts,), wanted, friction, effort="draft", rng=rng)
        assert fit.structure["rate_damping"] == (truth.damping > 0.0)
        known = {"response_force": truth.force, "fracture_energy": truth.fracture_energy}
        if truth.damping > 0.0:
            known["rate_damping"] = truth.damping
        for name, value in known.items():
            parameter = fit.parameter(name)
            assert abs(parameter.mean - value) < 4 * parameter.sd, name
