"""The contour of a posed surface in the blades' plane, against closed forms and differences."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from scissorcal.control.surface_path import contour_at, foot_of, on_plate
from scissorcal.model import Cylinder, HeightField, Plane, Sphere
from scissorcal.tracking import PlatePose, fixed_pose, level_plate

NONE = np.zeros((6, 6))
LEVEL = level_plate((0.0, 0.0, 0.0))[0]


Three = tuple[float, float, float]


def pose_of(angles_deg: Three, place_mm: Three) -> PlatePose:
    turn = Rotation.from_euler("ZYX", angles_deg, degrees=True).as_matrix()
    return PlatePose(0.0, turn @ LEVEL, 1e-3 * np.array(place_mm), NONE)


ANGLES = st.tuples(*[st.floats(-20, 20)] * 3)
PLACES = st.tuples(st.floats(-30, 30), st.floats(-20, 20), st.floats(-5, 5))


@settings(max_examples=60)
@given(angles=ANGLES, place=PLACES, x=st.floats(-0.02, 0.02), up=st.floats(-2e-3, 8e-3))
def test_the_foot_on_a_plane_is_the_lot(
    angles: tuple[float, float, float], place: tuple[float, float, float], x: float, up: float
) -> None:
    pose = pose_of(angles, place)
    normal = pose.rotation[:2, 2]
    share = float(np.hypot(*normal))
    line = normal / share
    at = np.array((pose.translation[0] + x, pose.translation[1] + up))
    foot = foot_of(Plane(), pose, *at)
    assert foot is not None
    height = (np.array((*at, 0.0)) - pose.translation) @ pose.rotation[:, 2] / share
    assert np.array(foot.point) == pytest.approx(at - height * line, abs=1e-9)
    assert np.array(foot.normal) == pytest.approx(line, abs=1e-9)
    assert foot.share == pytest.approx(share)
    assert foot.curvature == pytest.approx(0.0, abs=1e-9)


@settings(max_examples=60)
@given(
    radius=st.floats(0.02, 0.2),
    place=PLACES,
    across=st.floats(-0.3, 0.3),
    up=st.floats(-0.05, 0.2),
    turn=st.floats(-15, 15),
)
def test_a_sphere_meets_the_plane_in_a_circle(
    radius: float, place: tuple[float, float, float], across: float, up: float, turn: float
) -> None:
    pose = pose_of((turn, 0.0, 0.0), place)
    centre = pose.translation - radius * pose.rotation[:, 2]
    own = math.sqrt(radius**2 - centre[2] ** 2)
    direction = np.array((math.sin(across), math.cos(across)))
    turned = Rotation.from_euler("z", turn, degrees=True).as_matrix()[:2, :2] @ direction
    at = centre[:2] + own * (1.0 + up) * turned
    foot = foot_of(Sphere(radius), pose, *at)
    assert foot is not None
    assert np.array(foot.point) == pytest.approx(centre[:2] + own * turned, abs=1e-7)
    assert np.array(foot.normal) == pytest.approx(turned, abs=1e-5)
    assert foot.curvature == pytest.approx(1.0 / own, rel=1e-6)
    assert foot.share == pytest.approx(own / radius, rel=1e-6)


def test_a_place_on_the_plate_is_found() -> None:
    pose = pose_of((5.0, 3.0, -4.0), (20.0, 10.0, 1.0))
    for surface in (Plane(), Cylinder(0.05, math.pi / 2), Sphere(0.06), Cylinder(0.05, 0.3)):
        foot = on_plate(surface, pose, 0.012, pose.translation[:2])
        assert foot is not None
        assert foot.in_plate[0] == pytest.approx(0.012, abs=1e-9)
        assert float(surface.level(foot.in_plate)) == pytest.approx(0.0, abs=1e-9)
        back = pose.rotation @ foot.in_plate + pose.translation
        assert back == pytest.approx([*foot.point, 0.0], abs=1e-9)


def test_where_a_sphere_ends_there_is_no_contour() -> None:
    pose = pose_of((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    assert on_plate(Sphere(0.02), pose, 0.03, np.zeros(2)) is None
    beside = pose_of((0.0, 0.0, 0.0), (0.0, 0.0, 30.0))
    assert foot_of(Sphere(0.02), beside, 0.0, 0.0) is None


def test_a_plate_that_leans_far_sideways_has_no_contour() -> None:
    assert foot_of(Plane(), pose_of((0.0, 0.0, 70.0), (0.0, 0.0, 0.0)), 0.01, 0.0) is None
    assert foot_of(Plane(), pose_of((0.0, 0.0, 50.0), (0.0, 0.0, 0.0)), 0.01, 0.0) is not None


def test_a_height_field_has_the_curvature_of_its_contour() -> None:
    """By differences of the normals of neighbouring feet."""
    rng = np.random.default_rng(4)
    field = HeightField((-0.03, 0.03), (-0.02, 0.02), 2e-4 * rng.standard_normal((9, 8)))
    pose = pose_of((4.0, 2.0, -3.0), (5.0, 3.0, 0.5))
    start = pose.translation[:2]
    h = 2e-5
    for x in (-0.02, -0.004, 0.013):
        feet = [on_plate(field, pose, x + d, start) for d in (-h, 0.0, h)]
        assert all(foot is not None for foot in feet)
        before, middle, after = feet
        way = math.dist(after.point, before.point)  # type: ignore[union-attr]
        angle = [math.atan2(f.normal[0], f.normal[1]) for f in (before, after)]  # type: ignore[union-attr]
        assert middle.curvature == pytest.approx((angle[1] - angle[0]) / way, rel=5e-3, abs=1e-3)  # type: ignore[union-attr]


def test_what_moves_with_the_plate_moves_the_contour() -> None:
    moving = PlatePose(
        1.0, LEVEL, np.array((0.0, 0.01, 0.0)), NONE, np.array((0.01, 0.02, 0.0)),
        np.array((0.0, 0.0, 0.5)),
    )  # fmt: skip
    foot = foot_of(Plane(), moving, 0.03, 0.012)
    assert foot is not None
    contour = contour_at(foot, 0.03, moving, lift=True)
    assert contour.velocity == pytest.approx((0.01, 0.02 + 0.5 * 0.03))
    assert contour.turn_rate == 0.5
    assert contour.lift
    later = moving.at(1.1)
    assert later.translation == pytest.approx((0.001, 0.012, 0.0))
    assert later.rotation[:2, 0] == pytest.approx((math.cos(0.05), math.sin(0.05)))


def test_a_fixed_pose_stays() -> None:
    rotation, translation = level_plate((20.0, 10.0, 0.0), 5.0)
    pose = fixed_pose(rotation, translation)(3.0, np.zeros(0))  # type: ignore[arg-type]
    assert pose is not None
    assert pose.time == 3.0
    assert pose.at(9.0) is pose
