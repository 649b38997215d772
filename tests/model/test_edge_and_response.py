"""Exact and property tests of the edge, the response and friction."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from scissorcal.model import Edge, FrictionLaw, Response, edge_height, friction_torque

TURN = st.floats(-0.1, 1.0)
PLACE = st.floats(-0.02, 0.2)
EXPONENT = st.floats(0.5, 8.0)
DEPTH = st.floats(1e-9, 3e-3)


@given(beta=TURN, x=PLACE, offset=st.floats(-0.02, 0.02), curvature=st.floats(-2.0, 2.0))
def test_edge_height_lies_on_the_turned_edge(beta, x, offset, curvature):
    """Wherever a parabola that bends upwards still reaches over x at all."""
    taper, sine = math.tan(math.radians(2.0)), math.sin(beta)
    run = math.cos(beta) - taper * sine
    assume(run**2 - 2.0 * curvature * sine * (x + offset * sine) > 0.05)
    edge = Edge("arc", offset, math.radians(2.0), 0.075, curvature)
    run = math.cos(beta) - math.tan(math.radians(2.0)) * math.sin(beta)
    # an edge bent so far that it is upright before it reaches x has no point over it
    assume(run**2 > 1.02 * 2.0 * curvature * math.sin(beta) * (x + offset * math.sin(beta)))
    view = edge_height(edge, x, beta)
    s, e = float(view.station), float(edge.offset_at(view.station))
    assert s * math.cos(beta) - e * math.sin(beta) == pytest.approx(x, abs=1e-12)
    assert s * math.sin(beta) + e * math.cos(beta) == pytest.approx(float(view.height), abs=1e-12)


@given(beta=st.floats(0.02, 0.6), x=st.floats(0.005, 0.08), curvature=st.floats(-1.0, 1.0))
def test_slope_and_lever_are_the_derivatives_of_the_height(beta, x, curvature):
    edge = Edge("arc", -0.008, math.radians(2.0), 0.075, curvature)
    step = 1e-6

    def height(x, beta):
        return float(edge_height(edge, x, beta).height)

    view = edge_height(edge, x, beta)
    by_x = (height(x + step, beta) - height(x - step, beta)) / (2 * step)
    by_beta = (height(x, beta + step) - height(x, beta - step)) / (2 * step)
    assert float(view.slope) == pytest.approx(by_x, rel=1e-6, abs=1e-9)
    assert float(view.lever) == pytest.approx(by_beta, rel=1e-6, abs=1e-9)


@pytest.mark.parametrize("family", ["power", "exponential"])
@given(exponent=EXPONENT, delta=DEPTH)
def test_force_is_the_derivative_of_the_energy(family, exponent, delta):
    response = Response(family, 2.0, exponent, 1e-3)
    step = 1e-4 * delta
    slope = (response.energy_at(delta + step) - response.energy_at(delta - step)) / (2 * step)
    assert float(slope) == pytest.approx(float(response.force_at(delta)), rel=1e-5)


@pytest.mark.parametrize("family", ["power", "exponential"])
@given(exponent=EXPONENT, delta=DEPTH)
def test_indentation_inverts_force_and_stiffness_is_its_slope(family, exponent, delta):
    response = Response(family, 2.0, exponent, 1e-3)
    force = response.force_at(delta)
    assert float(response.indentation_at(force)) == pytest.approx(delta, rel=1e-9)
    step = 1e-5 * delta
    slope = (response.force_at(delta + step) - response.force_at(delta - step)) / (2 * step)
    assert float(response.stiffness_at(delta)) == pytest.approx(float(slope), rel=1e-4)


@pytest.mark.parametrize("family", ["power", "exponential"])
@given(exponent=EXPONENT, delta=st.floats(-1.0, 1.0))
def test_response_is_finite_and_never_pulls(family, exponent, delta):
    force = float(Response(family, 2.0, exponent, 1e-3).force_at(delta))
    assert math.isfinite(force)
    assert force >= 0.0
    assert force == 0.0 or delta > 0


def test_both_families_agree_at_the_reference():
    for family in ("power", "exponential"):
        assert float(Response(family, 2.5, 1.7, 3e-4).force_at(3e-4)) == pytest.approx(2.5)


def test_friction_levels_by_direction_angle_and_speed():
    values = {
        "coulomb_pos": 0.01,
        "coulomb_neg": 0.02,
        "viscous_pos": 0.001,
        "viscous_neg": 0.003,
        "stribeck": 0.004,
        "stribeck_rate": 0.1,
    }
    law = FrictionLaw({**values, "angle_slope": 0.5}, angle_center=0.4)
    assert float(friction_torque(law, 0.4, 0.0)) == 0.0
    expected = 0.01 + 0.001 * 0.2 + 0.004 * math.exp(-4.0)
    assert float(friction_torque(law, 0.4, 0.2)) == pytest.approx(expected)
    assert float(friction_torque(law, 0.6, 0.2)) == pytest.approx(1.1 * expected)
    assert float(friction_torque(law, 0.4, -10.0)) == pytest.approx(-(0.02 + 0.03), rel=1e-9)


@given(rate=st.floats(-1e3, 1e3), opening=st.floats(0.0, 1.0))
def test_friction_never_drives(rate, opening):
    names = ("coulomb_pos", "coulomb_neg", "viscous_pos", "viscous_neg", "stribeck")
    values = dict(zip(names, (0.01, 0.02, 0.001, 0.003, 0.004), strict=True))
    place = {"stribeck_rate": 0.1, "angle_slope": 0.2, "angle_curvature": 0.1}
    law = FrictionLaw(values | place, angle_center=0.5)
    assert float(friction_torque(law, opening, rate)) * rate >= 0.0
    assert np.isfinite(friction_torque(law, opening, rate))
