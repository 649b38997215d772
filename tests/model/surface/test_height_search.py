"""Nearest points of height fields: closed forms, conditions of Lagrange, dense nets, ties."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import KDTree

from scissorcal.model.surface import Cylinder, HeightField, Sphere, nearest
from tests.model.surface.shapes import X_M, Y_M, rough, spline_of

EPS = np.finfo(float).eps


def cloud(size, count=100, seed=3):
    return np.random.default_rng(seed).normal(size=(count, 3)) * size


@pytest.mark.parametrize("radius", [0.1, -0.1])
def test_nearest_points_of_a_spline_of_a_sphere_are_the_spheres(radius):
    def height(x, y):
        return math.copysign(1.0, radius) * np.sqrt(radius**2 - x**2 - y**2) - radius

    field, sphere = spline_of(height), Sphere(radius)
    p = np.random.default_rng(4).uniform(-0.015, 0.015, (100, 3))
    found, exact = field.nearest_points(p), sphere.nearest_points(p)
    np.testing.assert_allclose(found.distance, exact.distance, atol=2e-9)
    np.testing.assert_allclose(found.points, exact.points, atol=1e-7)
    assert found.unique.all()
    assert found.converged.all()


def test_nearest_points_of_a_tilted_plane():
    field = spline_of(lambda x, y: 1e-3 + 0.3 * x - 0.4 * y, (3, 2))
    out = np.array((-0.3, 0.4, 1.0)) / math.sqrt(1.25)
    for size in (1e-3, 1.0, 1e3):
        p = cloud(size)
        distance = p @ out - 1e-3 * out[2]
        found = field.nearest_points(p)
        np.testing.assert_allclose(found.distance, distance, atol=20 * EPS * (size + 1e-3) * 10)
        off = np.abs(found.points - (p - distance[:, None] * out)).max()
        assert off < 1e-12 * (size + 1e-3) * 10
        assert found.unique.all()


@settings(max_examples=40)
@given(seed=st.integers(0, 10_000), power=st.floats(-4, 3))
def test_the_line_to_the_nearest_point_is_normal_to_the_surface(seed, power):
    field, p = rough(seed), cloud(10.0**power, 20, seed)
    found = field.nearest_points(p)
    assert found.converged.all()
    q = found.points
    assert np.abs(field.level(q)).max() <= 4 * EPS * (np.abs(q).max() + 1e-3)
    gradient = field.gradient(q)
    across = np.linalg.norm(np.cross(p - q, gradient), axis=-1) / np.linalg.norm(gradient, axis=-1)
    # a place known to rounding turns the normal by its rounding x curvature
    bend = np.abs(field.hessian(q)).max(axis=(1, 2))
    size = np.linalg.norm(p, axis=-1) + np.linalg.norm(q, axis=-1) + 1e-3
    assert (across <= 1e-12 * size * (1.0 + np.abs(found.distance) * bend)).all()
    np.testing.assert_allclose(np.abs(found.distance), np.linalg.norm(p - q, axis=-1))
    assert (np.sign(found.distance) == np.sign(field.level(p))).all()


@pytest.mark.parametrize("size", [0.005, 0.03, 0.3])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_no_place_of_a_dense_net_is_nearer(seed, size):
    field, p = rough(seed), cloud(size, 300, seed)
    x, y = np.meshgrid(np.linspace(-0.06, 0.06, 500), np.linspace(-0.05, 0.05, 500))
    net = np.stack((x, y, np.zeros_like(x)), axis=-1).reshape(-1, 3)
    net[:, 2] = -field.level(net)
    dense, _ = KDTree(net).query(p)
    found = field.nearest_points(p)
    assert (np.abs(found.distance) - dense).max() < 1e-12


def test_moving_the_rectangle_moves_the_nearest_points():
    field, p = rough(8), cloud(0.03)
    moved = HeightField((X_M[0] + 1.0, X_M[1] + 1.0), Y_M, field.weights_m)
    step = np.array((1.0, 0.0, 0.0))
    one, other = field.nearest_points(p), moved.nearest_points(p + step)
    np.testing.assert_allclose(other.distance, one.distance, atol=1e-13)
    swapped = HeightField(Y_M, X_M, field.weights_m.T).nearest_points(p[:, [1, 0, 2]])
    np.testing.assert_allclose(swapped.distance, one.distance, atol=1e-13)


def test_two_sides_of_a_trough_are_equally_near():
    trough = spline_of(lambda x, y: 20.0 * y**2 + 0.0 * x, (4, 4))
    above = [[0.0, 0.0, 0.03], [0.0, 1e-4, 0.03], [0.0, 0.0, 0.02]]
    found = trough.nearest_points(above)
    assert found.converged.all()
    assert found.unique.tolist() == [False, True, True]  # 20 y^2 has the radius 25 mm at y = 0
    height = 0.03 - 1 / 40
    np.testing.assert_allclose(abs(found.points[0, 1]), math.sqrt(height / 20.0), rtol=1e-9)
    assert found.distance[2] == pytest.approx(0.02)


def test_at_a_centre_of_curvature_the_nearest_point_is_not_unique():
    trough = spline_of(lambda x, y: 20.0 * y**2 + 0.0 * x, (4, 4))
    found = trough.nearest_points([0.0, 0.0, 0.025])
    assert bool(found.converged)
    assert not bool(found.unique)
    assert found.distance == pytest.approx(0.025, rel=1e-6)


def test_a_flat_trough_has_the_nearest_points_of_its_cylinder():
    radius = -0.05
    field = spline_of(lambda x, y: 0.05 - np.sqrt(radius**2 - y**2) + 0.0 * x, (2, 24))
    p = cloud(0.004)
    np.testing.assert_allclose(nearest(field, p), nearest(Cylinder(radius), p), atol=2e-7)


def test_points_that_are_none_and_no_points_at_all():
    field = rough()
    found = field.nearest_points([[math.nan, 0.0, 0.0], [0.0, math.inf, 0.0], [0.0, 0.0, 0.01]])
    assert found.converged.tolist() == [False, False, True]
    assert np.isnan(found.points[:2]).all()
    assert np.isnan(found.distance[:2]).all()
    empty = field.nearest_points(np.zeros((0, 3)))
    assert empty.points.shape == (0, 3)
    assert empty.distance.shape == (0,)
    one = field.nearest_points([0.0, 0.0, 0.01])
    assert one.points.shape == (3,)
    assert one.distance.shape == ()
