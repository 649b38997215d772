"""A point of the blade on a surface: rows against differences, motion on a plane and a ball."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scissorcal.model.blade_point import BladePoint
from scissorcal.model.friction import FrictionLaw
from scissorcal.model.mechanism import (
    AxisLaw,
    constrained_motion,
    rig_mechanism,
    surface_constraint,
)

TIP = BladePoint(0.07, -0.008, 2)
UPRIGHT = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
"""A plate whose face looks up in the rig's plane: its z is the rig's y."""


class Flat:
    def at(self, point):
        return float(point[2]), np.array([0.0, 0.0, 1.0]), np.zeros((3, 3))


class Ball:
    """A ball of a radius below the origin, as a level that is no distance."""

    def __init__(self, radius):
        self.radius = radius

    def at(self, point):
        away = point + np.array([0.0, 0.0, self.radius])
        level = 0.5 * (away @ away - self.radius**2)
        return float(level), away, np.eye(3)


def turned(angle, tilt):
    """The upright plate turned in the rig's plane and tilted out of it."""
    c, s = math.cos(angle), math.sin(angle)
    d, t = math.cos(tilt), math.sin(tilt)
    in_plane = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    out = np.array([[1.0, 0.0, 0.0], [0.0, d, -t], [0.0, t, d]])
    return in_plane @ out @ UPRIGHT


@given(
    st.floats(-1.0, 1.0), st.floats(-0.5, 0.5), st.floats(0.1, 0.9), st.sampled_from([0.02, 0.2])
)
def test_on_the_surface_the_rows_are_the_gaps_derivatives(angle, tilt, opening, radius):
    """With the origin where the tip is, the gap is 0 there, and rows and gap must agree."""
    q, rates = np.array([opening, -0.03]), np.array([0.7, 0.05])
    pose = turned(angle, tilt)
    held = surface_constraint(TIP, Ball(radius), pose, TIP.place(q))
    step = 1e-6
    jacobian = [
        (held.value(q + step * axis) - held.value(q - step * axis)) / (2.0 * step)
        for axis in np.eye(2)
    ]
    np.testing.assert_allclose(held.jacobian(q)[0], np.ravel(jacobian), atol=1e-8)
    row = held.jacobian(q)[0]
    along = np.array([row[1], -row[0]])
    slow = 1e-4
    second = (held.value(q + slow * along) - 2 * held.value(q) + held.value(q - slow * along)) / (
        slow**2
    )
    np.testing.assert_allclose(held.bias(q, along), second, atol=1e-5 / radius)
    assert held.value(q)[0] == pytest.approx(0.0, abs=1e-15)
    assert held.bias(q, 2.0 * rates) == pytest.approx(4.0 * held.bias(q, rates))


def test_a_force_on_the_gap_is_in_newtons_along_the_unit_normal():
    q = np.array([0.5, -0.03])
    held = surface_constraint(TIP, Ball(0.02), UPRIGHT, TIP.place(q) - np.array([0.01, 0.0, 0.0]))
    row = held.jacobian(q)[0]
    force = np.linalg.lstsq(TIP.jacobian(q)[:2].T, row, rcond=None)[0]
    assert np.linalg.norm(force) == pytest.approx(1.0)


def test_a_tip_that_slides_on_a_plane_goes_straight():
    rig = rig_mechanism(AxisLaw(2e-4, FrictionLaw()), AxisLaw(0.8, FrictionLaw()))
    q = np.array([0.6, -0.02])
    held = surface_constraint(TIP, Flat(), UPRIGHT, TIP.place(q))
    motion = constrained_motion(rig, held, q, [0.0, 0.1], [-0.2, 0.4])
    assert motion.acceleration == pytest.approx([0.0, 0.5], abs=1e-12)
    lever = TIP.jacobian(q)[1, 0]
    assert motion.force[0] == pytest.approx(0.2 / lever)


def test_a_tip_that_slides_over_a_ball_bears_less_than_its_press():
    """Along the ball's top at a speed v the force is lower by what the curve takes."""
    rig = rig_mechanism(AxisLaw(2e-4, FrictionLaw()), AxisLaw(0.8, FrictionLaw()))
    q, radius, speed = np.array([0.6, -0.02]), 0.05, 0.3
    lever = TIP.jacobian(q)[:, 0]
    held = surface_constraint(TIP, Ball(radius), UPRIGHT, TIP.place(q))
    motion = constrained_motion(rig, held, q, [0.0, speed], [-0.2, 0.0])
    curve = speed**2 / radius
    assert motion.acceleration[0] == pytest.approx(-curve / lever[1])
    assert motion.force[0] == pytest.approx((0.2 - 2e-4 * curve / lever[1]) / lever[1])
    assert motion.acceleration[1] == pytest.approx(0.0, abs=1e-12)
