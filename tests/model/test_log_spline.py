"""The spline response: a power law where its exponents agree, and what all responses must be."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scissorcal.model import Cutting, Edge, Response, mean_share

KNOTS = (5e-5, 1e-4, 2e-4, 4e-4, 8e-4)
SHAPE = st.tuples(*[st.floats(-1.0, 1.0)] * 3)
EXPONENT = st.floats(0.5, 4.0)
DEPTH = st.floats(-14.0, -4.0).map(math.exp)


def spline(exponent, shape, reference=3e-4):
    return Response("spline", 2.0, exponent, reference, shape, KNOTS)


@given(exponent=EXPONENT, depth=DEPTH)
def test_equal_exponents_are_a_power_law(exponent, depth):
    bent, straight = spline(exponent, (0.0,) * 3), Response("power", 2.0, exponent, 3e-4)
    for what in ("force_at", "energy_at", "stiffness_at"):
        assert getattr(bent, what)(depth) == pytest.approx(getattr(straight, what)(depth), rel=1e-9)
    force = straight.force_at(depth)
    assert bent.indentation_at(force) == pytest.approx(depth, rel=1e-9)


@given(exponent=EXPONENT, shape=SHAPE, depth=DEPTH, reference=st.sampled_from([2e-5, 3e-4, 2e-3]))
def test_force_energy_stiffness_and_inverse_belong_together(exponent, shape, depth, reference):
    response = spline(exponent, shape, reference)
    assert float(response.force_at(reference)) == pytest.approx(2.0)
    force = float(response.force_at(depth))
    assert float(response.indentation_at(force)) == pytest.approx(depth, rel=1e-7)
    step = 1e-5 * depth
    by_force = float(response.force_at(depth + step) - response.force_at(depth - step)) / (2 * step)
    assert float(response.stiffness_at(depth)) == pytest.approx(by_force, rel=1e-3)
    by_energy = float(response.energy_at(depth + step) - response.energy_at(depth - step))
    assert by_energy / (2 * step) == pytest.approx(force, rel=1e-4)


@given(exponent=EXPONENT, shape=SHAPE)
def test_it_rises_and_goes_on_as_powers(exponent, shape):
    response = spline(exponent, shape)
    depth = np.geomspace(1e-6, 1e-2, 400)
    force = response.force_at(depth)
    assert np.all(np.diff(force) > 0.0)
    growth = np.diff(np.log(force)) / np.diff(np.log(depth))
    for outside in (depth[:-1] > KNOTS[-1], depth[1:] < KNOTS[0]):
        assert np.ptp(growth[outside]) < 1e-6 * np.max(growth[outside])
    assert float(response.force_at(0.0)) == 0.0
    assert float(response.force_at(-1.0)) == 0.0
    assert float(response.energy_at(0.0)) == 0.0
    assert float(response.indentation_at(0.0)) == 0.0
    assert np.isfinite(response.force_at(1e6))


def test_draws_broadcast_as_one_by_one():
    rng = np.random.default_rng(3)
    exponent = np.exp(rng.normal(0.4, 0.1, (7, 1)))
    shape = rng.normal(0.0, 0.5, (7, 1, 3))
    force = np.exp(rng.normal(0.4, 0.1, (7, 1)))
    depth = np.geomspace(1e-5, 2e-3, 11)
    drawn = Response("spline", force, exponent, 3e-4, shape, KNOTS)
    for row in range(7):
        one = Response("spline", force[row, 0], exponent[row, 0], 3e-4, tuple(shape[row, 0]), KNOTS)
        for what in ("force_at", "energy_at", "stiffness_at"):
            assert np.allclose(getattr(drawn, what)(depth)[row], getattr(one, what)(depth))
        assert np.allclose(drawn.indentation_at(depth * 1e4)[row], one.indentation_at(depth * 1e4))


@given(exponent=EXPONENT, shape=SHAPE, kappa=st.floats(0.2, 0.95), peak=st.floats(0.01, 30.0))
def test_a_ripple_averages_over_it(exponent, shape, kappa, peak):
    response = spline(exponent, shape)
    cutting = Cutting(Edge("line", -0.008, 0.03, 0.075), response, 2, 5e-5, 0.5, kappa)
    share = float(mean_share(cutting, peak))
    assert kappa < share < 1.0
    low, high = response.indentation_at(np.array([kappa * peak, peak]))
    even = np.linspace(low, high, 4001)
    force = response.force_at(0.5 * (even[1:] + even[:-1]))
    assert share == pytest.approx(float(np.mean(force)) / peak, rel=1e-4)
