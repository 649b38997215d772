"""Corners of markers that a lens distorts: without what it bends of their sides."""

from dataclasses import replace

import numpy as np
import pytest

from scissorcal.vision.geometry.board_pose import Corners
from scissorcal.vision.geometry.camera import Camera
from scissorcal.vision.geometry.pose import Pose
from scissorcal.vision.targets.boards import PLATE_BOARD, PLATE_STRIP
from scissorcal.vision.targets.detect import Detection

BENDS = {
    "barrel": (-0.2, 0.05, 8e-4, -5e-4, 0.0),
    "pincushion": (0.12, -0.05, -4e-4, 6e-4, 0.0),
    "rational": (0.1, -0.02, 3e-4, -2e-4, 0.01, 0.25, 0.02, 0.0),
}
POSE = Pose.from_rotation_vector([0.3, -0.4, 0.2], [-0.11, 0.03, 0.32])


def camera_with(bend: tuple[float, ...]) -> Camera:
    return Camera(900.0, 905.0, 503.2, 371.9, bend, 1000, 750)


def straight_crossings(camera: Camera) -> np.ndarray:
    """Pixels (24, 2) where straight lines along the bent sides of the strip's markers cross.

    Each line is fitted by total least squares to 500 points of a side's middle three quarters.
    """
    share = np.linspace(0.12, 0.88, 500)[:, None]
    pixels = []
    for corners in PLATE_STRIP.points.reshape(-1, 4, 3):
        lines = []
        for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
            side = camera.project(POSE.apply(start + share * (end - start)))
            normal = np.linalg.svd(side - side.mean(axis=0))[2][1]
            lines.append((normal, normal @ side.mean(axis=0)))
        for k in range(4):
            (a, b), (c, d) = lines[k - 1], lines[k]
            pixels.append(np.linalg.solve([a, c], [b, d]))
    return np.array(pixels)


def detection(pixels: np.ndarray) -> Detection:
    ids = np.arange(len(PLATE_STRIP.points))
    return Detection(PLATE_STRIP, ids, pixels, 80.0, "strip.png", 1000, 750)


@pytest.mark.parametrize("bend", BENDS.values(), ids=BENDS)
def test_corners_lie_where_the_camera_sees_them(bend: tuple[float, ...]) -> None:
    """To a twentieth of the bend, which is 0.03 px and more."""
    camera = camera_with(bend)
    truth, crossings = camera.project(POSE.apply(PLATE_STRIP.points)), straight_crossings(camera)
    bent_px = np.abs(crossings - truth).max()
    assert bent_px > 0.03
    corners = Corners.of(detection(crossings)).unbent(camera)
    assert np.abs(corners.pixels - truth).max() < 0.05 * bent_px
    assert np.array_equal(corners.unbent(camera).pixels, corners.pixels), "taken off once"


def test_without_distortion_corners_stay() -> None:
    camera = camera_with((0.0,) * 5)
    pixels = straight_crossings(camera)
    assert np.abs(Corners.of(detection(pixels)).unbent(camera).pixels - pixels).max() < 1e-9


def test_corners_of_a_chessboard_stay() -> None:
    camera = camera_with(BENDS["barrel"])
    pixels = camera.project(POSE.apply(PLATE_BOARD.points))
    seen = Detection(PLATE_BOARD, np.arange(len(pixels)), pixels, 60.0, "board.png", 1000, 750)
    assert np.array_equal(Corners.of(seen).unbent(camera).pixels, pixels)


def test_corners_in_any_order_and_of_markers_seen_in_part() -> None:
    camera = camera_with(BENDS["barrel"])
    both = Corners.of(*[detection(straight_crossings(camera))] * 2)
    mixed = np.random.default_rng(213_003).permutation(len(both.pixels))
    unbent = both.unbent(camera).pixels
    assert np.allclose(both.where(mixed).unbent(camera).pixels, unbent[mixed], rtol=0, atol=1e-9)
    fewer = np.arange(len(both.pixels)) != 5
    unbent[4:8] = both.pixels[4:8]
    assert np.allclose(both.where(fewer).unbent(camera).pixels, unbent[fewer], rtol=0, atol=1e-9)
    lost = both.pixels.copy()
    lost[5] = np.nan
    marked = replace(both, pixels=lost).unbent(camera).pixels
    assert np.allclose(marked[fewer], unbent[fewer], rtol=0, atol=1e-9)
    single = both.where(np.arange(len(both.pixels)) % 4 == 0)
    assert np.array_equal(single.unbent(camera).pixels, single.pixels)


def test_a_marker_beyond_where_the_distortion_holds_keeps_its_corners() -> None:
    camera = camera_with((-0.2, 0.0, 0.0, 0.0, 0.0))
    pixels = straight_crossings(camera)
    unbent = Corners.of(detection(pixels)).unbent(camera).pixels
    beyond = pixels.copy()
    beyond[:4] += 5000.0
    assert not np.isfinite(camera.rays(beyond[:4])).any()
    kept = Corners.of(detection(beyond)).unbent(camera).pixels
    assert np.array_equal(kept[:4], beyond[:4])
    assert np.allclose(kept[4:], unbent[4:], rtol=0, atol=1e-9)
