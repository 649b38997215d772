"""Plane, cylinder and sphere against closed forms, at radii from a millimetre to a kilometre."""

import math

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scissorcal.errors import InputError
from scissorcal.model.surface import (
    Cylinder,
    Plane,
    Sphere,
    curvatures,
    nearest,
    normal,
)
from tests.model.surface.shapes import shape_operator

EPS = np.finfo(float).eps
RADIUS = st.builds(
    lambda sign, power: sign * 10.0**power, st.sampled_from([-1, 1]), st.floats(-3, 3)
)
ANGLE = st.floats(-math.pi, math.pi)
DISTANCE = st.floats(-6, 3).map(lambda power: 10.0**power)
POINT = st.builds(
    lambda size, a, b: size * np.array((np.cos(a) * np.cos(b), np.sin(a) * np.cos(b), np.sin(b))),
    DISTANCE,
    ANGLE,
    st.floats(-math.pi / 2, math.pi / 2),
)
SURFACES = st.one_of(
    st.just(Plane()), st.builds(Sphere, RADIUS), st.builds(Cylinder, RADIUS, ANGLE)
)


def radius_of(surface):
    return getattr(surface, "radius_m", math.inf)


def rounding_of(surface, p):
    """Of a gradient at p, which has no unit; that of a level is this times the size of p."""
    return 8 * EPS * (1.0 + np.linalg.norm(p) / abs(radius_of(surface)))


def turned(angle):
    c, s = math.cos(angle), math.sin(angle)
    return np.array(((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)))


@pytest.mark.parametrize("radius", [0.02, -0.02, 0.3])
def test_a_sphere_is_that_of_its_centre(radius):
    sphere, centre = Sphere(radius), np.array((0.0, 0.0, -radius))
    p = np.random.default_rng(1).normal(size=(50, 3)) * 0.05
    square = ((p - centre) ** 2).sum(axis=-1)
    np.testing.assert_allclose(sphere.level(p), (square - radius**2) / (2 * radius), atol=1e-15)
    np.testing.assert_allclose(sphere.gradient(p), (p - centre) / radius, atol=1e-14)
    np.testing.assert_allclose(sphere.hessian(p), np.broadcast_to(np.eye(3) / radius, (50, 3, 3)))
    away = p - centre
    on_it = centre + abs(radius) * away / np.linalg.norm(away, axis=-1, keepdims=True)
    np.testing.assert_allclose(nearest(sphere, p), on_it, atol=1e-15)
    np.testing.assert_allclose(curvatures(sphere, on_it), np.full((50, 2), 1 / radius), rtol=1e-13)
    out = math.copysign(1.0, radius) * (on_it - centre) / abs(radius)
    np.testing.assert_allclose(normal(sphere, on_it), out, atol=1e-14)


@pytest.mark.parametrize("radius", [0.02, -0.05])
@pytest.mark.parametrize("axis_deg", [0.0, 30.0, -90.0])
def test_a_cylinder_is_that_of_its_axis(radius, axis_deg):
    cylinder = Cylinder(radius, math.radians(axis_deg))
    along = np.array((math.cos(math.radians(axis_deg)), math.sin(math.radians(axis_deg)), 0.0))
    p = np.random.default_rng(2).normal(size=(50, 3)) * 0.05
    centre = np.array((0.0, 0.0, -radius)) + (p @ along)[:, None] * along
    away = p - centre
    size = np.linalg.norm(away, axis=-1)
    np.testing.assert_allclose(cylinder.level(p), (size**2 - radius**2) / (2 * radius), atol=1e-15)
    on_it = centre + abs(radius) * away / size[:, None]
    np.testing.assert_allclose(nearest(cylinder, p), on_it, atol=1e-15)
    np.testing.assert_allclose(
        curvatures(cylinder, on_it), [sorted((0.0, 1 / radius))] * 50, rtol=1e-12, atol=1e-12
    )
    bend = shape_operator(cylinder, on_it)
    assert np.abs(bend @ along).max() < 1e-12
    across = np.cross(along, normal(cylinder, on_it))
    np.testing.assert_allclose(
        np.einsum("ni,nij,nj->n", across, bend, across), 1 / radius, rtol=1e-12
    )


def test_a_plane_is_flat():
    p = np.random.default_rng(3).normal(size=(4, 5, 3))
    np.testing.assert_array_equal(Plane().level(p), p[..., 2])
    np.testing.assert_array_equal(nearest(Plane(), p), p * (1.0, 1.0, 0.0))
    np.testing.assert_array_equal(curvatures(Plane(), p), np.zeros((4, 5, 2)))
    np.testing.assert_array_equal(normal(Plane(), p), np.broadcast_to((0.0, 0.0, 1.0), p.shape))


@given(surface=SURFACES, p=POINT)
def test_one_point_is_as_many(surface, p):
    level, gradient, hessian = surface.at(p)
    off = rounding_of(surface, p)
    assert level == pytest.approx(float(surface.level(p)), abs=off * np.linalg.norm(p))
    np.testing.assert_allclose(gradient, surface.gradient(p), rtol=0.0, atol=off)
    np.testing.assert_array_equal(hessian, surface.hessian(p))


@given(surface=SURFACES, p=POINT)
def test_derivatives_are_those_of_complex_steps(surface, p):
    steps, off = p + 1e-30j * np.eye(3), rounding_of(surface, p)
    by_step = surface.level(steps).imag / 1e-30
    np.testing.assert_allclose(by_step, surface.gradient(p), rtol=0.0, atol=off)
    by_step = surface.gradient(steps).imag / 1e-30
    bend = 1.0 / abs(radius_of(surface))
    np.testing.assert_allclose(by_step, surface.hessian(p), rtol=0.0, atol=8 * EPS * bend)


@given(surface=SURFACES)
def test_every_surface_passes_through_the_origin_level(surface):
    level, gradient, _ = surface.at(np.zeros(3))
    assert level == 0.0
    assert gradient.tolist() == [0.0, 0.0, 1.0]
    outside = surface.at(np.array((0.0, 0.0, 1e-4 * min(1.0, abs(radius_of(surface))))))
    assert outside.level > 0.0


@given(surface=SURFACES, p=POINT)
def test_the_nearest_point_is_on_the_surface_below_the_point(surface, p):
    found = surface.nearest_points(p)
    q = found.points
    size = np.linalg.norm(p) + np.linalg.norm(q)
    bend = 1.0 / abs(radius_of(surface))
    assert abs(surface.level(q)) <= 20 * EPS * size * (1.0 + bend * size)
    gradient = surface.gradient(q)
    across = np.linalg.norm(np.cross(p - q, gradient)) / np.linalg.norm(gradient)
    assert across <= 20 * EPS * size * (1.0 + bend * size)
    assert abs(found.distance) == pytest.approx(np.linalg.norm(p - q), rel=1e-9, abs=8 * EPS * size)
    assert np.sign(found.distance) == np.sign(surface.level(p))


@given(surface=SURFACES, p=POINT, seed=st.integers(0, 1000))
def test_no_point_of_the_surface_is_nearer(surface, p, seed):
    rng = np.random.default_rng(seed)
    found = surface.nearest_points(p)
    others = found.points + rng.normal(size=(100, 3)) * abs(found.distance)
    others = nearest(surface, others)
    nearer = np.linalg.norm(others - p, axis=-1) - abs(found.distance)
    assert nearer.min() >= -1e-12 * (np.linalg.norm(p) + abs(found.distance))


@pytest.mark.parametrize("radius", [1e-3, 1e3, -1e-3, -1e3])
@pytest.mark.parametrize("kind", [Sphere, Cylinder])
def test_distances_at_extremes_agree_with_fifty_digits(kind, radius):
    surface = kind(radius)
    for p in (
        np.random.default_rng(5).normal(size=(20, 3)) * 10.0 ** np.linspace(-6, 3, 20)[:, None]
    ):
        with mpmath.workdps(50):
            x, y, z = (mpmath.mpf(float(v)) for v in p)
            round_ = (x if kind is Sphere else 0) ** 2 + y**2 + (z + radius) ** 2
            exact = float((mpmath.sqrt(round_) - abs(radius)) * (1 if radius > 0 else -1))
        found = float(surface.nearest_points(p).distance)
        assert found == pytest.approx(exact, rel=1e-12, abs=4 * EPS * np.linalg.norm(p))


@given(radius=RADIUS, axis=ANGLE, turn=ANGLE, p=POINT)
def test_turning_the_axis_turns_the_cylinder(radius, axis, turn, p):
    one, other = Cylinder(radius, axis), Cylinder(radius, axis + turn)
    turn_ = turned(turn)
    size = np.linalg.norm(p)
    off = 20 * EPS * size * (1.0 + size / abs(radius))
    assert abs(other.level(turn_ @ p) - one.level(p)) <= off
    here, there = one.nearest_points(p), other.nearest_points(turn_ @ p)
    assert there.distance == pytest.approx(here.distance, rel=1e-9, abs=off)


@given(surface=SURFACES, p=POINT, scale=st.floats(-3, 3).map(lambda power: 10.0**power))
def test_lengths_scale(surface, p, scale):
    larger = Plane()
    if isinstance(surface, Sphere):
        larger = Sphere(scale * surface.radius_m)
    elif isinstance(surface, Cylinder):
        larger = Cylinder(scale * surface.radius_m, surface.axis_rad)
    size = np.linalg.norm(p) * (1.0 + np.linalg.norm(p) / abs(radius_of(surface)))
    assert larger.level(scale * p) == pytest.approx(
        scale * surface.level(p), rel=1e-12, abs=8 * EPS * scale * size
    )


@given(radius=RADIUS, p=POINT)
def test_a_bowl_is_the_mirror_of_a_ball(radius, p):
    mirrored = p * (1.0, 1.0, -1.0)
    assert Sphere(-radius).level(mirrored) == -Sphere(radius).level(p)


def test_centres_and_axes_have_no_single_nearest_point():
    centre = [0.0, 0.0, -0.02]
    found = Sphere(0.02).nearest_points(centre)
    assert (bool(found.unique), bool(found.converged)) == (False, True)
    assert found.distance == pytest.approx(-0.02)
    assert np.linalg.norm(found.points - centre) == pytest.approx(0.02)
    assert np.isnan(normal(Sphere(0.02), [0.0, 0.0, -0.02])).all()
    found = Cylinder(-0.02).nearest_points([[0.3, 0.0, 0.02], [0.3, 1e-6, 0.02]])
    assert found.unique.tolist() == [False, True]
    assert found.points[0].tolist() == pytest.approx([0.3, 0.0, 0.0])


def test_points_that_are_none_have_no_nearest_point():
    found = Sphere(0.02).nearest_points([[math.nan, 0.0, 0.0], [0.0, 0.0, 0.01]])
    assert found.converged.tolist() == [False, True]
    assert np.isnan(found.points[0]).all()


@pytest.mark.parametrize("kind", [Sphere, Cylinder])
@pytest.mark.parametrize("radius", [0.0, math.nan, math.inf])
def test_a_radius_must_be_one(kind, radius):
    with pytest.raises(InputError, match=f"The radius of a {kind.__name__.lower()}.* must"):
        kind(radius)


def test_an_axis_must_have_an_angle():
    with pytest.raises(InputError, match=r"axis \(rad\) must be finite"):
        Cylinder(0.02, math.nan)


def test_points_need_three_coordinates():
    with pytest.raises(ValueError, match="shape"):
        Plane().level([0.0, 0.0])
