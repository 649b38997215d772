"""Kinematics of a point of the blade against complex-step derivatives and the edge's own height."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scissorcal.model.blade_point import BladePoint
from scissorcal.model.edge import Edge, edge_height

STEP = 1e-30
ANGLES = st.floats(-math.pi, math.pi)
LENGTHS = st.floats(-1e3, 1e3)


@given(LENGTHS, LENGTHS, st.sampled_from([1, 2]), ANGLES, LENGTHS)
def test_the_jacobian_is_the_derivative_of_the_place(station, offset, moving, opening, advance):
    point = BladePoint(station, offset, moving)
    columns = [
        np.imag(point.place(np.array([opening, advance]) + 1j * STEP * axis)) / STEP
        for axis in np.eye(2)
    ]
    scale = 1.0 + abs(station) + abs(offset)
    jacobian = point.jacobian([opening, advance])
    np.testing.assert_allclose(jacobian, np.stack(columns, axis=1), rtol=0, atol=1e-14 * scale)


@pytest.mark.parametrize("moving", [1, 2])
def test_a_point_of_the_edge_lies_at_the_edges_height(moving):
    edge = Edge("cubic", -0.008, 0.03, 0.07, curvature_per_m=0.4, bend_per_m2=-3.0)
    opening, advance = math.radians(23.0), -0.031
    place = BladePoint.on_edge(edge, 0.045, moving).place([opening, advance])
    view = edge_height(edge, place[0] - advance, opening / moving)
    assert view.station == pytest.approx(0.045, abs=1e-14)
    assert place[1] == pytest.approx(float(view.height), abs=1e-15)


def test_arrays_give_what_each_place_gives():
    point = BladePoint(0.07, -0.008, 2)
    q = np.random.default_rng(1).normal(size=(5, 3, 2))
    assert point.jacobian(q).shape == (5, 3, 3, 2)
    for index in np.ndindex(5, 3):
        np.testing.assert_array_equal(point.place(q)[index], point.place(q[index]))
        np.testing.assert_array_equal(point.jacobian(q)[index], point.jacobian(q[index]))


@pytest.mark.parametrize("bad", [{"moving_blades": 3}, {"offset_m": math.nan}])
def test_a_point_that_cannot_be_is_refused(bad):
    good = {"station_m": 0.07, "offset_m": 0.0, "moving_blades": 1}
    with pytest.raises(ValueError, match=r"blades move|finite"):
        BladePoint(**(good | bad))
