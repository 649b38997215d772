"""The families of edges, and distributions of one."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BSpline

from scissorcal.model import Cutting, Edge, EdgeDistribution, Response, draw_edges, edge_height
from scissorcal.model.bspline import spline_design, spline_value
from scissorcal.model.cutting import settled_contact

WEIGHTS = (-0.008, -0.0078, -0.0073, -0.0071, -0.0064, -0.0062, -0.0059)
EDGES = {
    "line": Edge("line", -0.008, 0.03, 0.075),
    "arc": Edge("arc", -0.008, 0.03, 0.075, curvature_per_m=-1.0),
    "cubic": Edge("cubic", -0.008, 0.03, 0.075, curvature_per_m=-1.0, bend_per_m2=40.0),
    "spline": Edge("spline", 0.0, 0.0, 0.075, spline_m=WEIGHTS, spline_start_m=0.005),
}
NAMES = {
    "line": ("offset_m", "taper_rad"),
    "arc": ("offset_m", "taper_rad", "curvature_per_m"),
    "cubic": ("offset_m", "taper_rad", "curvature_per_m", "bend_per_m2"),
    "spline": tuple(f"spline_m_{index}" for index in range(len(WEIGHTS))),
}
FAMILIES = sorted(EDGES)


@pytest.mark.parametrize("family", FAMILIES)
@given(x=st.floats(-0.01, 0.08), beta=st.floats(-0.1, 0.7))
def test_height_lies_on_the_turned_edge_and_slope_is_its_derivative(family, x, beta):
    edge = EDGES[family]
    view = edge_height(edge, x, beta)
    s, e = float(view.station), float(edge.offset_at(view.station))
    assert s * math.cos(beta) - e * math.sin(beta) == pytest.approx(x, abs=1e-12)
    assert s * math.sin(beta) + e * math.cos(beta) == pytest.approx(float(view.height), abs=1e-12)
    step = 1e-6
    high, low = (float(edge_height(edge, x + h, beta).height) for h in (step, -step))
    assert float(view.slope) == pytest.approx((high - low) / (2 * step), abs=2e-5)


@pytest.mark.parametrize("family", FAMILIES)
@given(s=st.floats(-0.02, 0.1))
def test_slope_is_the_derivative_of_the_offset(family, s):
    edge, step = EDGES[family], 1e-6
    rise = (edge.offset_at(s + step) - edge.offset_at(s - step)) / (2 * step)
    assert float(edge.slope_at(s)) == pytest.approx(float(rise), abs=2e-5)


def test_the_spline_is_that_of_scipy_between_its_ends_and_straight_beyond():
    knots = 0.005 + (0.07 / 4) * np.arange(-3, 8)
    s = np.linspace(0.005, 0.075, 101)
    reference = BSpline(knots, np.array(WEIGHTS), 3)
    np.testing.assert_allclose(EDGES["spline"].offset_at(s), reference(s), atol=1e-15)
    np.testing.assert_allclose(EDGES["spline"].slope_at(s), reference(s, 1), atol=1e-13)
    beyond = EDGES["spline"].offset_at(np.array([0.075, 0.085, 0.095]))
    assert beyond[2] - beyond[1] == pytest.approx(beyond[1] - beyond[0], abs=1e-15)
    np.testing.assert_allclose(
        spline_design(7, 0.005, 0.075, s) @ np.array(WEIGHTS), reference(s), atol=1e-15
    )


def test_a_spline_needs_four_weights_and_a_length():
    for weights, end in (((1.0, 2.0, 3.0), 1.0), ((1.0, 2.0, 3.0, 4.0), 0.0)):
        with pytest.raises(ValueError, match="four weights"):
            spline_value(weights, 0.0, end, 0.5)


def test_only_a_line_is_straight():
    assert {name for name, edge in EDGES.items() if edge.straight} == {"line"}
    assert Edge("arc", -0.008, 0.03, 0.075).straight


@pytest.mark.parametrize("family", FAMILIES)
def test_a_distribution_gives_its_edge_back_and_draws_with_its_covariance(family):
    names = NAMES[family]
    rng = np.random.default_rng(3)
    root = rng.standard_normal((len(names), len(names))) * 1e-5
    distribution = EdgeDistribution(EDGES[family], names, root @ root.T)
    assert distribution.with_values(distribution.mean) == EDGES[family]
    assert (
        distribution.with_values(dict(zip(names, distribution.mean, strict=True))) == EDGES[family]
    )
    values = distribution.draws(rng, 20_000)
    np.testing.assert_allclose(
        np.cov(values, rowvar=False),
        distribution.covariance,
        atol=0.05 * distribution.covariance.max(),
    )


@pytest.mark.parametrize("family", FAMILIES)
def test_drawn_edges_broadcast_with_stations_angles_and_the_crack(family):
    names = NAMES[family]
    distribution = EdgeDistribution(EDGES[family], names, 1e-12 * np.eye(len(names)))
    rng = np.random.default_rng(4)
    values = distribution.draws(rng, 5)
    edges = distribution.with_values(values)
    assert edges.shape == (5, 1)
    assert draw_edges(distribution, rng, 3).shape == (3, 1)
    response = Response("power", 2.0, 1.5, 1e-3)
    x, beta = np.linspace(0.01, 0.07, 4), np.linspace(0.2, 0.5, 4)
    many = edge_height(edges, x, beta)
    settled = settled_contact(Cutting(edges, response, 2, 0.0, 5.0), 2 * beta)
    for row in range(5):
        one = distribution.with_values(values[row])
        assert one.shape == ()
        view = edge_height(one, x, beta)
        np.testing.assert_allclose(many.height[row], view.height, atol=1e-14)
        alone = settled_contact(Cutting(one, response, 2, 0.0, 5.0), 2 * beta)
        np.testing.assert_allclose(settled[row], alone, atol=1e-12)


def test_a_distribution_of_the_wrong_size_is_refused():
    with pytest.raises(ValueError, match="covariance"):
        EdgeDistribution(EDGES["line"], ("offset_m",), np.eye(2))
    with pytest.raises(ValueError, match="2 values"):
        EdgeDistribution(EDGES["line"], ("offset_m", "taper_rad"), np.eye(2)).with_values([1.0])
