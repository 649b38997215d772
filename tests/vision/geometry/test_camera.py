"""The camera: against the distortion's written formula, there and back, and where it ends."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scissorcal.vision.geometry.camera import Camera
from scissorcal.vision.overlay import PLACES, SIZES, SLANTS, ViewCoverage, detection_words
from scissorcal.vision.sim import Lens, SimPose
from scissorcal.vision.targets.boards import CAMERA_BOARD
from scissorcal.vision.targets.detect import Detection
from tests.vision.scenes import lens, photo_of, pose_before

BEND = (-0.25, 0.07, 0.001, -0.0006, 0.02)
CAMERA = Camera(900.0, 900.0, 646.0, 351.0, BEND, 1280, 720)


def test_projection_is_browns_formula() -> None:
    rng = np.random.default_rng(0)
    points = rng.uniform([-0.5, -0.3, 0.7], [0.5, 0.3, 2.0], (200, 3))
    written = Lens(900.0, (646.0, 351.0), 1280, 720, BEND)
    assert CAMERA.project(points) == pytest.approx(
        written.bend(points[:, :2] / points[:, 2:]), abs=1e-9
    )


@given(st.floats(0.0, 1279.0), st.floats(0.0, 719.0))
def test_a_projected_ray_is_the_pixel(u: float, v: float) -> None:
    ray = CAMERA.rays([[u, v]])
    assert CAMERA.project(np.append(ray, 1.0)) == pytest.approx(np.array([[u, v]]), abs=1e-6)


def test_rays_of_projected_points_are_their_directions() -> None:
    points = np.array([[0.2, -0.1, 1.0], [0.0, 0.0, 1.0], [-0.4, 0.2, 1.3]])
    rays = CAMERA.rays(CAMERA.project(points))
    assert rays == pytest.approx(points[:, :2] / points[:, 2:], abs=1e-9)


def test_points_behind_have_no_pixel_and_folded_pixels_no_ray() -> None:
    assert np.isnan(CAMERA.project([[0.1, 0.1, -1.0], [0.0, 0.0, 0.0]])).all()
    barrel = Camera(500.0, 500.0, 320.0, 240.0, (-0.4, 0.0, 0.0, 0.0, 0.0), 640, 480)
    assert np.isnan(barrel.rays([[2000.0, 240.0]])).all()
    assert np.isfinite(barrel.rays([[330.0, 240.0]])).all()
    assert CAMERA.rays(np.empty((0, 2))).shape == (0, 2)


def test_a_scaled_camera_sees_the_same_through_larger_pixels() -> None:
    covariance = np.diag(np.arange(1.0, 10.0))
    half = Camera(*CAMERA.matrix[[0, 1, 0, 1], [0, 1, 2, 2]], BEND, 1280, 720, covariance)
    small = half.scaled(640, 360)
    points = np.array([[0.2, -0.1, 1.0], [-0.4, 0.2, 1.3]])
    assert (half.project(points) + 0.5) / 2.0 - 0.5 == pytest.approx(small.project(points))
    assert small.covariance is not None
    assert np.diag(small.covariance)[:5].tolist() == [0.25, 0.5, 0.75, 1.0, 5.0]


def seen(pose: SimPose) -> Detection:
    pixels = lens().sees(CAMERA_BOARD.points[:, :2], pose)
    return Detection(CAMERA_BOARD, np.arange(len(pixels)), pixels, 60.0, "board.jpg", 1280, 720)


@pytest.mark.parametrize(
    ("azimuth", "slant"),
    [(0.0, "facing left"), (np.pi, "facing right"), (np.pi / 2, "facing up"),
     (-np.pi / 2, "facing down")],
)  # fmt: skip
def test_slants_are_named_by_the_boards_normal(azimuth: float, slant: str) -> None:
    pose = pose_before(CAMERA_BOARD, 0.5, tilt=0.5, azimuth=azimuth)
    # The board's face looks along minus z of its frame; x is right and y down in the camera's.
    face = -pose.rotation[:, 2]
    facing = {"facing left": face[0] < 0, "facing right": face[0] > 0, "facing up": face[1] < 0,
              "facing down": face[1] > 0}  # fmt: skip
    photo = photo_of(np.zeros((720, 1280), dtype=np.uint8))
    named = detection_words(photo, seen(pose)).split(", ")[3].split(" (")[0]
    assert facing[named]
    assert abs(face[0 if "t" in named.split()[1] else 1]) > 0.4


def test_coverage_grows_until_it_is_complete() -> None:
    coverage = ViewCoverage()
    assert len(coverage.wanted) == 17
    coverage = coverage.with_view(seen(pose_before(CAMERA_BOARD, 0.5)), 1280, 720)
    assert SLANTS[0] in coverage.slants
    assert "middle" in coverage.places
    assert "facing up" in coverage.wanted
    assert "wanted" in coverage.sentence()
    everything = ViewCoverage(frozenset(PLACES), frozenset(SIZES), frozenset(SLANTS))
    assert everything.wanted == ()
    assert "wanted" not in everything.sentence()
