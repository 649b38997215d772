"""Closed forms of the torque, the crack's condition, energy, ripple, extremes."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from scissorcal.model import (
    Cutting,
    Edge,
    Response,
    cut_torque_along,
    edge_height,
    mean_share,
    settled_contact,
)
from scissorcal.model.cutting import torque_at

PIVOT_EDGE = Edge("line", 0.0, 0.0, 0.2)
SCISSORS = Edge("line", -0.008, math.radians(2.0), 0.075)
SOFT = Response("power", 2.0, 1.6, 3e-4)


def cutting(
    edge=SCISSORS, blades=2, energy=0.5, response=SOFT, kappa=1.0, closure="work", top=5e-5
):
    return Cutting(edge, response, blades, top, energy, kappa, closure)


def settled_torque(law, theta, contact):
    """Torque after the crack has run outwards to where it stands, if it stands farther in."""
    if law.fracture_energy is not None:
        contact = np.maximum(contact, settled_contact(law, theta))
    return torque_at(law, theta, contact)


@pytest.mark.parametrize(
    ("blades", "closed"),
    [
        (2, lambda x, theta: x / np.sin(theta)),
        (1, lambda x, theta: 2 * x / np.sin(2 * theta)),
    ],
)
def test_straight_edge_through_the_pivot_has_a_closed_form(blades, closed):
    law = cutting(PIVOT_EDGE, blades, top=5e-3)
    theta = np.linspace(0.1, 0.6, 30)
    contact = settled_contact(law, theta)
    assert settled_torque(law, theta, 0.0) == pytest.approx(0.5 * closed(contact, theta), rel=1e-12)


@pytest.mark.parametrize("blades", [1, 2])
def test_smooth_torque_is_energy_times_advance_whatever_the_stiffness(blades):
    theta = np.linspace(0.25, 0.8, 40)
    for force in (0.2, 2.0, 200.0):
        law = cutting(blades=blades, response=Response("power", force, 1.6, 3e-4))
        contact = settled_contact(law, theta)
        view = edge_height(law.edge, contact, theta / blades)
        advance = view.lever / view.slope / blades
        assert settled_torque(law, theta, 0.0) == pytest.approx(0.5 * advance, rel=1e-9)


@pytest.mark.parametrize("curvature", [0.0, 1.0, -0.5])
@given(theta=st.floats(0.2, 0.9), energy=st.floats(1e-3, 10.0), exponent=st.floats(0.5, 8.0))
def test_settled_crack_just_bears_its_load(curvature, theta, energy, exponent):
    edge = Edge("arc", -0.008, math.radians(2.0), 0.075, curvature)
    law = cutting(edge, energy=energy, response=Response("power", 5.0, exponent, 1e-3))
    assume(float(law.response.indentation_at(energy)) < 0.005)
    contact = settled_contact(law, theta)
    assume(bool(np.isfinite(contact)))
    view = edge_height(edge, contact, theta / 2)
    released = 2 * law.response.force_at(law.upper_face_m - view.height) * view.slope
    assert float(released) == pytest.approx(energy, rel=1e-6)


@pytest.mark.parametrize("blades", [1, 2])
@given(theta=st.floats(0.15, 0.9), contact=st.floats(0.005, 0.07))
def test_work_closure_is_the_gradient_of_the_stored_energy(blades, theta, contact):
    law = cutting(blades=blades, energy=None)

    def stored(theta):
        height = edge_height(law.edge, contact, theta / blades).height
        return blades * float(law.response.energy_at(law.upper_face_m - height))

    step = 1e-6
    gradient = -(stored(theta + step) - stored(theta - step)) / (2 * step)
    assert float(torque_at(law, theta, contact)) == pytest.approx(gradient, rel=1e-5, abs=1e-9)


def test_eq4_closure_pins_its_factors():
    law = cutting(energy=None, closure="eq4")
    view = edge_height(SCISSORS, 0.02, 0.15)
    force = float(SOFT.force_at(law.upper_face_m - view.height))
    assert float(torque_at(law, 0.3, 0.02)) == pytest.approx(
        force * 0.02 * math.cos(math.radians(2))
    )


@pytest.mark.parametrize("closure", ["work", "eq4"])
def test_where_no_crack_can_stand_there_is_no_torque(closure):
    """Edges that open outwards: the contact is -inf, and no number is lost over it."""
    edge = Edge("line", -0.008, -0.3, 0.075)
    law = cutting(edge, closure=closure)
    contact = settled_contact(law, 0.1)
    assert np.isneginf(contact)
    assert torque_at(law, 0.1, contact) == 0.0


def test_reclosing_over_cut_material_gives_no_torque():
    law = cutting()
    once = np.concatenate([np.linspace(0.85, 0.3, 300), np.linspace(0.3, 0.85, 300)])
    torque, tip = cut_torque_along(law, np.tile(once, 2), np.full(1200, -0.015), 0.0)
    assert np.all(np.diff(tip) >= 0)
    second = slice(600, 900)
    assert torque[second][:-1].max() < torque[:300].max()
    still = np.flatnonzero(torque[second] > 0)
    assert still.size < 30, "only the last bit, where the crack's tip is reached again, may resist"


def test_the_stroke_does_not_depend_on_its_sampling():
    law = cutting()
    fine, coarse = np.linspace(0.85, 0.3, 5501), np.linspace(0.85, 0.3, 56)
    a, _ = cut_torque_along(law, fine, np.full(5501, -0.015), 0.0)
    b, _ = cut_torque_along(law, coarse, np.full(56, -0.015), 0.0)
    assert a[::100] == pytest.approx(b, rel=1e-12)


def test_smooth_stroke_conserves_energy():
    law = cutting()
    theta = np.linspace(0.85, 0.3, 20001)
    torque, tip = cut_torque_along(law, theta, np.full(theta.shape, -0.015), 0.0)
    work = -np.trapezoid(torque, theta)
    height = edge_height(law.edge, tip + 0.015, theta / 2).height
    stored = 2 * law.response.energy_at(law.upper_face_m - height)
    paid = stored[-1] - stored[0] + 0.5 * (tip[-1] - tip[0])
    assert work == pytest.approx(float(paid), rel=1e-5)


@given(kappa=st.floats(0.05, 0.999), exponent=st.floats(0.5, 4.0), peak=st.floats(0.01, 10.0))
def test_the_mean_share_is_that_of_a_sampled_cycle(kappa, exponent, peak):
    law = cutting(kappa=kappa, response=Response("power", 2.0, exponent, 3e-4))
    low = law.response.indentation_at(kappa * peak)
    high = law.response.indentation_at(peak)
    middle = low + (np.arange(4000) + 0.5) / 4000 * (high - low)
    force = law.response.force_at(middle)
    assert float(mean_share(law, peak)) == pytest.approx(force.mean() / peak, rel=1e-6)


@given(
    theta=st.floats(0.0, 1.5),
    contact=st.floats(-0.05, 0.3),
    energy=st.one_of(st.none(), st.floats(1e-4, 1e2)),
    exponent=st.floats(0.5, 8.0),
    kappa=st.floats(0.05, 1.0),
    taper=st.floats(-0.1, 0.1),
)
def test_torque_is_finite_at_the_extremes(theta, contact, energy, exponent, kappa, taper):
    law = cutting(
        Edge("line", -0.008, taper, 0.075),
        energy=energy,
        response=Response("power", 2.0, exponent, 3e-4),
        kappa=kappa,
    )
    assert np.isfinite(settled_torque(law, theta, contact))


def test_parallel_edges_cannot_cut():
    law = cutting(Edge("line", -0.008, -0.2, 0.075))
    assert float(settled_contact(law, 0.2)) == -math.inf
    assert np.isfinite(settled_torque(law, 0.2, 0.02))


def test_pressing_has_no_crack_to_ask_for():
    with pytest.raises(ValueError, match="nothing is cut"):
        settled_contact(cutting(energy=None), 0.3)


def test_damping_stiffens_going_in_and_never_pulls():
    law = Cutting(Edge("line", -0.008, 0.03, 0.075), SOFT, 2, 5e-5, None, rate_damping=20.0)
    theta, contact = np.full(3, 0.4), np.full(3, 0.03)
    still = torque_at(law, theta, contact)
    moving = torque_at(law, theta, contact, np.array([-1.0, 0.0, 50.0]))
    assert moving[0] > still[0] > 0.0
    assert moving[1] == still[1]
    assert moving[2] == 0.0
