"""The judge: closed forms of the cutting torque, re-expansion, and the ripple's average."""

import math

import numpy as np
import pytest

from scissorcal.device.sim.blade import Sheet, blade_on
from scissorcal.device.sim.cutting import Cut
from scissorcal.device.sim.specimen import Specimen, load_specimen
from scissorcal.device.sim.truth import (
    average_torque,
    tip_at_drive,
    true_parameters,
    varied,
)
from tests.device.sim.build import specimen

THROUGH_PIVOT = {"offset_mm": 0.0, "taper_deg": 0.0, "length_mm": 200.0}


def torque_of_stroke(truth: Specimen, opening: np.ndarray) -> np.ndarray:
    """Torque (N m) along a slow stroke on a fresh sheet of mean toughness, ripple included."""
    cut = Cut(blade_on(truth), Sheet(truth.material, None))
    return np.array([cut.move_to(float(theta), -0.01).torque for theta in opening])


@pytest.mark.parametrize("response", ["power", "exponential"])
@pytest.mark.parametrize("force", [0.5, 2.0, 200.0])
@pytest.mark.parametrize("moving", ["both", "upper"])
def test_a_smooth_cut_with_an_edge_through_the_pivot(
    response: str, force: float, moving: str
) -> None:
    """tau = J_c h x_c / sin(theta), or 2 J_c h x_c / sin(2 theta), whatever the stiffness."""
    truth = specimen(
        blade=THROUGH_PIVOT | {"moving": moving},
        material={
            "thickness_mm": 20.0,
            "toughness_J_per_m2": 25.0,
            "kappa": 1.0,
            "response": response,
            "response_force_N": force,
        },
    )
    blade = blade_on(truth)
    for opening in (0.3, 0.6, 0.9):
        contact = tip_at_drive(blade, opening, 0.5)
        if moving == "both":
            expected = 0.5 * contact / math.sin(opening)
        else:
            expected = 2 * 0.5 * contact / math.sin(2 * opening)
        torque = float(average_torque(truth, opening, 0.0, 0.0, friction=False))
        assert torque == pytest.approx(expected, rel=1e-9)
        assert contact < blade.crossing(opening)


def test_beyond_the_settled_place_the_torque_is_the_responses_own() -> None:
    truth = specimen()
    blade = blade_on(truth)
    inner = tip_at_drive(blade, 0.4, 0.5)
    outer = tip_at_drive(blade, 0.4, 0.5 * 0.75)
    just_touching = outer + 0.9 * (blade.crossing(0.4) - outer)
    held = float(average_torque(truth, 0.4, 0.0, just_touching, friction=False))
    assert held == blade.touch(0.4, just_touching).torque
    settled = average_torque(truth, 0.4, 0.0, [0.0, inner - 1e-3, inner], friction=False)
    assert np.ptp(settled) == 0.0
    assert blade.touch(0.4, outer).torque < settled[0] < blade.touch(0.4, inner).torque


def test_friction_resists_the_motion() -> None:
    truth = specimen()
    bare = average_torque(truth, 0.4, 0.0, 0.2, friction=False)
    assert average_torque(truth, 0.4, -0.3, 0.2) > bare
    assert average_torque(truth, 0.4, 0.3, 0.2) < bare


@pytest.mark.parametrize("name", ["office-paper", "cotton-cloth"])
def test_a_slow_rippled_stroke_averages_to_the_average_torque(name: str) -> None:
    truth = load_specimen(name)
    opening = np.radians(np.linspace(45.0, 12.0, 60_000))
    torque = torque_of_stroke(truth, opening)
    average = average_torque(truth, opening[::40], 0.0, 0.0, friction=False)
    for part in range(1, 6):
        stroke = slice(part * 10_000, (part + 1) * 10_000)
        coarse = slice(part * 250, (part + 1) * 250)
        assert torque[stroke].mean() == pytest.approx(average[coarse].mean(), rel=0.01)


def test_the_length_of_a_step_does_not_raise_the_mean() -> None:
    truth = load_specimen("office-paper")
    means = []
    for count in (400, 4_000, 40_000):
        opening = np.radians(np.linspace(40.0, 12.0, count))
        torque = torque_of_stroke(truth, opening)
        means.append(torque.mean())
    assert means[0] == pytest.approx(means[2], rel=0.01)
    assert means[1] == pytest.approx(means[2], rel=0.002)


def test_reclosing_over_a_cut_gives_no_torque() -> None:
    truth = specimen()
    closing = np.radians(np.linspace(45.0, 20.0, 5_000))
    stroke = np.concatenate([closing, closing[::-1], closing[:-100]])
    torque = torque_of_stroke(truth, stroke)
    assert torque[3_000:5_000].min() > 0.0
    assert np.all(torque[10_000:-200] == 0.0)


def test_parameters_re_expand_exactly() -> None:
    truth = load_specimen("office-paper")
    friction = truth.mechanism.friction
    moved = true_parameters(truth, angle_center=0.4, reference_indentation_m=1e-4)
    for opening in (0.2, 0.5, 0.8):
        away = opening - math.radians(friction.angle_center_deg)
        old = friction.coulomb_closing_Nm * (
            1 + friction.angle_slope_per_rad * away + friction.angle_curvature_per_rad2 * away**2
        )
        away = opening - 0.4
        new = moved["coulomb_neg"] * (
            1 + moved["angle_slope"] * away + moved["angle_curvature"] * away**2
        )
        assert new == pytest.approx(old, rel=1e-12)
    power = moved["response_force"] * 3.0 ** moved["response_exponent"]
    assert power == pytest.approx(truth.material.response_force_N, rel=1e-12)
    pad = load_specimen("soft-pad")
    half = true_parameters(pad, reference_indentation_m=0.5e-3)
    scale = half["response_force"] / math.expm1(half["response_exponent"])
    whole = scale * math.expm1(2.0 * half["response_exponent"])
    assert whole == pytest.approx(pad.material.response_force_N, rel=1e-12)
    assert "fracture_energy" not in half


def test_symmetric_truth_is_the_mean_of_both_directions() -> None:
    truth = true_parameters(specimen(), symmetric=True)
    assert truth["coulomb"] == pytest.approx(0.014)
    assert "coulomb_pos" not in truth


def test_varied_specimens_differ_and_stay_valid() -> None:
    rng = np.random.default_rng(5)
    base = load_specimen("cotton-cloth")
    others = [varied(base, rng) for _ in range(20)]
    energies = {other.material.fracture_energy for other in others}
    assert len(energies) == 20
    assert all(0.4 <= other.material.kappa <= 0.95 for other in others)
    assert all(other.blade == base.blade for other in others)
