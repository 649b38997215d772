"""Closed forms for a straight edge agree with the search along any edge."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scissorcal.model import (
    Cutting,
    Edge,
    Response,
    Turned,
    held_torque,
    settle,
    settled_contact,
    take_stance,
)
from scissorcal.model.cutting import torque_at

OPENINGS = np.linspace(0.15, 0.9, 40)


@given(
    offset=st.floats(-0.015, 0.002),
    taper=st.floats(-0.05, 0.08),
    kappa=st.floats(0.3, 1.0),
    family=st.sampled_from(["power", "exponential"]),
    closure=st.sampled_from(["work", "eq4"]),
    curvature=st.sampled_from([0.0, 0.3]),
)
def test_a_stance_settles_and_bears_as_the_edge_does(
    offset, taper, kappa, family, closure, curvature
):
    edge = Edge("arc" if curvature else "line", offset, taper, 0.075, curvature)
    cutting = Cutting(edge, Response(family, 2.0, 1.6, 3e-4), 2, 5e-5, 0.5, kappa, closure)
    stance = take_stance(edge, Turned.at(OPENINGS, 2))
    settled = settle(cutting, stance)
    exact = settled_contact(cutting, OPENINGS)
    cuts = np.isfinite(exact)
    assert np.array_equal(cuts, np.isfinite(settled.contact))
    assert np.allclose(settled.contact[cuts], exact[cuts], atol=1e-12)
    contact = np.linspace(0.02, 0.06, 40)
    torque = held_torque(cutting, stance, contact)
    assert torque == pytest.approx(torque_at(cutting, OPENINGS, contact), rel=1e-9, abs=1e-12)


def test_damping_stiffens_going_in_and_never_pulls():
    edge = Edge("line", -0.008, 0.03, 0.075)
    response = Response("power", 2.0, 1.6, 3e-4)
    cutting = Cutting(edge, response, 2, 5e-5, None, rate_damping=20.0)
    stance = take_stance(edge, Turned.at(np.full(3, 0.4), 2))
    contact = np.full(3, 0.03)
    still = held_torque(cutting, stance, contact)
    moving = held_torque(cutting, stance, contact, np.array([-1.0, 0.0, 50.0]))
    assert moving[0] > still[0] > 0.0
    assert moving[1] == still[1]
    assert moving[2] == 0.0
