"""Height fields against SciPy's splines, closed forms and complex steps; twice differentiable."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BSpline, NdBSpline

from scissorcal.model.bspline import spline_powers, spline_slope, spline_value
from scissorcal.model.surface import HeightField, Sphere, curvatures, normal
from tests.model.surface.shapes import X_M, Y_M, knots, rough, shape_operator, spline_of

SEED = st.integers(0, 1000)
PLACE = st.tuples(st.floats(-0.1, 0.1), st.floats(-0.1, 0.1), st.floats(-0.1, 0.1)).map(np.array)


def inner(count=200, seed=1):
    rng = np.random.default_rng(seed)
    x, y = (rng.uniform(*ends, count) for ends in (X_M, Y_M))
    return np.stack((x, y, np.zeros(count)), axis=-1)


@pytest.mark.parametrize("seed", [0, 1])
def test_value_and_derivatives_are_scipys(seed):
    field, p = rough(seed), inner()
    spline = NdBSpline((knots(X_M, 6), knots(Y_M, 8)), field.weights_m, 3)
    at = {
        order: spline(p[:, :2], nu=order)
        for order in [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)]
    }
    np.testing.assert_allclose(field.level(p), -at[0, 0], atol=1e-17)
    np.testing.assert_allclose(field.gradient(p)[:, 0], -at[1, 0], atol=1e-13)
    np.testing.assert_allclose(field.gradient(p)[:, 1], -at[0, 1], atol=1e-13)
    bend = field.hessian(p)
    for i, j, order in ((0, 0, (2, 0)), (0, 1, (1, 1)), (1, 0, (1, 1)), (1, 1, (0, 2))):
        np.testing.assert_allclose(bend[:, i, j], -at[order], atol=1e-10)
    assert not bend[:, 2].any()
    assert not bend[:, :, 2].any()


def test_pieces_of_a_spline_are_those_of_its_value_and_slope():
    weights = np.random.default_rng(2).normal(size=9)
    powers, t = spline_powers(weights), np.linspace(0.0, 1.0, 5)
    for piece, row in enumerate(powers):
        at = piece + t
        values = np.polynomial.polynomial.polyval(t, row)
        np.testing.assert_allclose(values, spline_value(weights, 0.0, 6.0, at), atol=1e-14)
        slopes = np.polynomial.polynomial.polyval(t, np.polynomial.polynomial.polyder(row))
        np.testing.assert_allclose(slopes, spline_slope(weights, 0.0, 6.0, at), atol=1e-13)


def test_a_cubic_is_a_height_field_exactly():
    def height(x, y):
        return 1e-3 + 0.1 * x - 3.0 * x * y + 200.0 * x**3 - 50.0 * y**3 * x**2

    field, p = spline_of(height, (3, 2)), inner()
    x, y = p[:, 0], p[:, 1]
    np.testing.assert_allclose(field.level(p), -height(x, y), atol=1e-16)
    slope = 0.1 - 3.0 * y + 600.0 * x**2 - 100.0 * y**3 * x
    np.testing.assert_allclose(field.gradient(p)[:, 0], -slope, atol=1e-13)
    np.testing.assert_allclose(field.hessian(p)[:, 1, 1], 300.0 * y * x**2, atol=1e-10)
    np.testing.assert_allclose(field.hessian(p)[:, 0, 1], 3.0 + 300.0 * y**2 * x, atol=1e-10)


@pytest.mark.parametrize("radius", [0.1, -0.1])
def test_a_height_field_of_a_sphere_has_its_normals_and_curvatures(radius):
    def height(x, y):
        return math.copysign(1.0, radius) * np.sqrt(radius**2 - x**2 - y**2) - radius

    field, sphere, p = spline_of(height), Sphere(radius), inner()
    p[:, 2] = height(p[:, 0], p[:, 1])
    np.testing.assert_allclose(field.level(p), 0.0, atol=2e-9)
    np.testing.assert_allclose(normal(field, p), normal(sphere, p), atol=3e-6)
    np.testing.assert_allclose(curvatures(field, p), curvatures(sphere, p), atol=0.02)
    np.testing.assert_allclose(shape_operator(field, p), shape_operator(sphere, p), atol=0.02)


def test_principal_curvatures_are_eigenvalues_of_the_shape_operator():
    field, p = rough(3), inner()
    bend = shape_operator(field, p)
    np.testing.assert_allclose(bend, bend.swapaxes(-1, -2), atol=1e-11)
    assert np.abs(np.einsum("nij,nj->ni", bend, normal(field, p))).max() < 1e-10
    both = curvatures(field, p)
    expected = np.sort(np.concatenate((both, np.zeros((len(p), 1))), axis=-1), axis=-1)
    np.testing.assert_allclose(np.linalg.eigvalsh(bend), expected, atol=1e-9)
    turned = HeightField(field.x_m, field.y_m, -field.weights_m)
    np.testing.assert_allclose(curvatures(turned, p), -both[:, ::-1], atol=1e-10)


@given(seed=SEED, p=PLACE)
def test_one_point_is_as_many(seed, p):
    field = rough(seed)
    level, gradient, hessian = field.at(p)
    assert level == pytest.approx(float(field.level(p)), abs=1e-15)
    np.testing.assert_allclose(gradient, field.gradient(p), atol=1e-12)
    np.testing.assert_allclose(hessian, field.hessian(p), atol=1e-9)


@given(seed=SEED, p=PLACE)
def test_derivatives_are_those_of_complex_steps(seed, p):
    field, steps = rough(seed), p + 1e-30j * np.eye(3)
    by_step = field.level(steps).imag / 1e-30
    np.testing.assert_allclose(by_step, field.gradient(p), atol=1e-12)
    by_step = field.gradient(steps).imag / 1e-30
    np.testing.assert_allclose(by_step, field.hessian(p), atol=1e-9)


def test_level_gradient_and_hessian_are_continuous_across_every_border():
    field = rough(4)
    (wide, high), (n, m) = field.interval_m, field.intervals
    between = np.linspace(-0.05, 0.05, 37)
    for axis, (start, width, count) in enumerate(((X_M[0], wide, n), (Y_M[0], high, m))):
        for border in start + width * np.arange(-1, count + 2):
            p = np.zeros((len(between), 3))
            p[:, 1 - axis] = between
            sides = []
            for end in (-np.inf, np.inf):
                p[:, axis] = border + 1e-13 * np.sign(end)
                sides.append((field.level(p), field.gradient(p), field.hessian(p)))
            for one, other, scale in zip(*sides, (1e-3, 1.0, 1e3), strict=True):
                assert np.abs(one - other).max() < 1e-8 * scale


def test_it_continues_straight_outwards_and_as_a_plane_beyond_corners():
    field = rough(5)
    (wide, high), y = field.interval_m, np.linspace(*Y_M, 7)
    beyond = np.stack((np.full(7, X_M[1] + 2.5 * wide), y, np.zeros(7)), axis=-1)
    assert not field.hessian(beyond)[:, 0, 0].any()
    assert field.hessian(beyond)[:, 1, 1].all()
    for x, y in (
        (X_M[0] - 2.5 * wide, Y_M[0] - 2.5 * high),
        (X_M[1] + 2.5 * wide, Y_M[1] + 2.5 * high),
    ):
        corner, gradient, hessian = field.at(np.array((x, y, 0.0)))
        assert not hessian.any()
        far = np.array((x + math.copysign(1e3, x), y + math.copysign(1e3, y), 0.0))
        straight = corner + gradient @ (far - (x, y, 0.0))
        assert field.at(far).level == pytest.approx(straight, rel=1e-12)
        assert not field.inside(far)


def test_inside_is_the_rectangle_or_the_outline_within_it():
    field = rough()
    p = np.array([[0.0, 0.0, 9.0], [0.03, 0.02, 0.0], [0.031, 0.0, 0.0], [0.0, -0.021, 0.0]])
    assert field.inside(p).tolist() == [True, True, False, False]
    below = np.array([[1.0, 1.0, -0.03]])  # x + y <= 30 mm
    half = HeightField(field.x_m, field.y_m, field.weights_m, below)
    assert half.inside(p).tolist() == [True, False, False, False]
    assert bool(half.inside(p[0]))


def test_exchanging_x_and_y_exchanges_derivatives():
    field, p = rough(6), inner()
    other = HeightField(field.y_m, field.x_m, field.weights_m.T)
    swapped = p[:, [1, 0, 2]]
    np.testing.assert_allclose(other.level(swapped), field.level(p), atol=1e-17)
    np.testing.assert_allclose(
        other.hessian(swapped), field.hessian(p)[:, [1, 0, 2]][:, :, [1, 0, 2]], atol=1e-11
    )


@pytest.mark.filterwarnings("ignore:invalid value")
@pytest.mark.parametrize("p", [[math.nan, 0.0, 0.0], [math.inf, 0.0, 0.0], [0.0, -math.inf, 0.0]])
def test_no_number_gives_no_number(p):
    field = rough()
    level, gradient, _ = field.at(np.array(p))
    assert not math.isfinite(level)
    assert not np.isfinite(gradient).all()
    assert not np.isfinite(field.level(p))


def test_scipys_basis_is_that_of_the_weights():
    field = rough(7)
    x = np.linspace(*X_M, 11)
    along = BSpline(knots(X_M, 6), field.weights_m, 3)(x)
    p = np.stack((x, np.full(11, Y_M[0]), np.zeros(11)), axis=-1)
    expected = along[:, :3] @ np.array((1.0, 4.0, 1.0)) / 6.0
    np.testing.assert_allclose(-field.level(p), expected, atol=1e-17)
