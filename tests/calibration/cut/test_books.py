"""Each kind of segment against a virtual rig's own books: true work, true place of the crack.

Friction, inertia, cogging and delay are the rig's own here, so that what is tested is the path, the
work over it, and where segments are cut. No statistic of residuals shows what these tests show.
"""

from dataclasses import dataclass

import numpy as np
import pytest

from scissorcal.calibration.cut.geometry import geometry_of_prior
from scissorcal.calibration.cut.guess import Guess
from scissorcal.calibration.cut.known import KnownFriction, MaterialData
from scissorcal.calibration.cut.path_motion import path_motion
from scissorcal.calibration.cut.path_work import mean_torque
from scissorcal.calibration.cut.segments import cut_into_segments
from scissorcal.calibration.cut.structure import edge_of
from scissorcal.calibration.signals.torque_noise import TorqueNoise
from scissorcal.model import FrictionLaw, Response
from tests.second_rig import (
    capture_cut,
    coarse,
    cotton,
    draw_truth,
    fine,
    paper,
    recipe_for,
    true_parameters,
)

pytestmark = pytest.mark.slow
CENTER_RAD = 0.5
LEAST_SHARE = 0.05
"""Segments with less than this share of their piece's largest torque tell no relative error."""


@dataclass(frozen=True)
class Compared:
    """Work over segments of one kind, measured over true, less 1: mean and spread over pieces.

    ``place_um`` is how far the crack's place by unloading alone is from the true one, by rest.
    """

    bias: dict[str, float]
    spread: dict[str, float]
    place_um: np.ndarray


def compared(rig, seed: int) -> Compared:
    rng = np.random.default_rng(seed)
    rig = draw_truth(rig, rng, spread=0.3, shape="uniform")
    recipe = recipe_for(rig)
    recording, books = capture_cut(rig, recipe, rng)
    reference_m = recipe.fit.cut.reference_indentation_mm * 1e-3
    truth = true_parameters(rig, reference_indentation_m=reference_m, angle_center=CENTER_RAD)
    known = _known(rig, truth)
    motions = path_motion((recording,), known.inertia)
    materials = tuple(known.material(motion) for motion in motions)
    kappa, load = truth["kappa"], truth.get("load_share", 0.0)
    response = Response("power", truth["response_force"], truth["response_exponent"], reference_m)
    mean = truth["fracture_energy"] * (1.0 + kappa) / 2.0
    geometry = geometry_of_prior(recipe, edge_of(recipe))
    segments = cut_into_segments(
        MaterialData(motions, materials, known.noise, known.stroke_sd),
        geometry,
        Guess(response, mean, 2.0 / (1.0 + kappa), load),
        True,
    )
    found: dict[str, list[float]] = {}
    places = []
    delay_ticks = truth["delay"] / motions[0].tick_s
    for part in (*segments.pieces, *segments.stretches):
        motion = motions[part.motion]
        torque, late = mean_torque(motion, materials[part.motion].work, part.ends)
        rows = books.rows[part.ends + int(motion.source[0])]
        path = np.diff(rows["opening"])
        true = np.diff(rows["cut_work"]) / path * (1.0 - load * part.direction)
        felt = true > LEAST_SHARE * true.max()
        kind = getattr(part, "kind", "running")
        error = (torque - delay_ticks * late - true)[felt] @ path[felt]
        found.setdefault(kind, []).append(float(error / (true[felt] @ path[felt])))
        if kind == "unloading":
            places.append(segments.rests[part.rest].place - float(rows["crack"][0]))
    return Compared(
        {kind: float(np.mean(errors)) for kind, errors in found.items()},
        {kind: float(np.std(errors)) for kind, errors in found.items()},
        1e6 * np.array(places),
    )


@pytest.mark.parametrize(
    ("rig", "seed"),
    [(fine(paper()), 501), (fine(paper()), 502), (fine(cotton()), 503)],
)
def test_a_fine_encoder_gives_each_kind_of_segment_its_true_work(rig, seed):
    """Limits are about three times what five other days showed."""
    found = compared(rig, seed)
    assert abs(found.bias["running"]) < 0.006
    assert abs(found.bias["unloading"]) < 0.03
    assert abs(found.bias["fresh"]) < 0.35
    assert abs(found.bias["loading"]) < 0.2
    assert abs(np.median(found.place_um)) < 25.0


@pytest.mark.parametrize(
    ("rig", "seed"),
    [
        (coarse(paper(), load_share=0.1), 504),
        (coarse(paper(), load_share=0.0), 505),
        (coarse(cotton(), load_share=0.1), 506),
    ],
)
def test_a_coarse_encoder_gives_running_segments_their_true_work(rig, seed):
    """Steps of 0.31 mrad, friction with memory, a bent edge; limits as above."""
    found = compared(rig, seed)
    assert abs(found.bias["running"]) < 0.03
    assert abs(found.bias["unloading"]) < 0.04
    assert abs(np.median(found.place_um)) < 80.0


def _known(rig, truth) -> KnownFriction:
    names = (
        "coulomb_pos",
        "coulomb_neg",
        "viscous_pos",
        "viscous_neg",
        "stribeck",
        "stribeck_rate",
        "angle_slope",
        "angle_curvature",
    )
    law = FrictionLaw(
        {
            "presliding_share": truth.get("presliding_share", 0.0),
            "presliding_length": truth.get("presliding_length", 1.0),
            **{name: truth[name] for name in names},
        },
        angle_center=CENTER_RAD,
    )
    motor, sensors = rig.motor, rig.sensors
    wave = np.array([np.sin(motor.cogging_phase_rad), np.cos(motor.cogging_phase_rad)])
    noise = TorqueNoise(sensors.torque_white_Nm, sensors.torque_slow_Nm, sensors.noise_time_s)
    return KnownFriction(
        law=law,
        offset=truth["offset"],
        inertia=truth["inertia"],
        cogging=(*(motor.cogging_Nm * wave).tolist(), float(motor.cogging_periods_per_turn)),
        noise=noise,
        closing_sd=1e-4,
        opening_sd=1e-4,
        stroke_sd=1e-4,
    )
