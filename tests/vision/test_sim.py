"""The renderer puts things where exact geometry has them."""

import math

import cv2
import numpy as np
import pytest
from benchmarks.photographs import centreline_turn, random_looks

from scissorcal.vision.geometry.camera import Camera
from scissorcal.vision.sim import (
    BladeShape,
    Lens,
    Looks,
    PaintLayer,
    SimPose,
    as_jpeg,
    blade_layer,
    render,
    target_layers,
)
from scissorcal.vision.sim.optics import coverage
from scissorcal.vision.targets.boards import BLADE_MAT, CAMERA_BOARD

SHARP = Looks(exposure=0.9, softness_px=0.0)
LENS = Lens(1500.0, (639.5, 479.5), 1280, 960, (-0.08, 0.03, 5e-4, -3e-4, 0.0))


def linear(picture):
    level = picture[:, :, 1] / 255.0
    return np.where(level <= 0.04045, level / 12.92, ((level + 0.055) / 1.055) ** 2.4)


@pytest.mark.parametrize("turn", [0.0, 0.1, 0.7, 1.5, 2.9])
def test_coverage_of_a_turned_rectangle_is_the_share_of_points_within(turn):
    c, s = math.cos(turn), math.sin(turn)
    back = np.array([[c, s], [-s, c]])
    box = np.array([[-7.3, -2.1], [7.3, -2.1], [7.3, 2.1], [-7.3, 2.1]])
    share = coverage([box @ back + (20.25, 15.6)], 41, 33)
    assert share.sum() == pytest.approx(14.6 * 4.2, rel=1e-5)
    fine = 32
    y, x = (np.mgrid[0 : 33 * fine, 0 : 41 * fine] + 0.5) / fine - 0.5
    u, v = np.moveaxis((np.stack([x, y], axis=-1) - (20.25, 15.6)) @ back.T, -1, 0)
    within = (np.abs(u) < 7.3) & (np.abs(v) < 2.1)
    np.testing.assert_allclose(
        share, within.reshape(33, fine, 41, fine).mean(axis=(1, 3)), atol=0.02
    )


def test_coverage_beyond_the_picture_and_holes():
    square = np.array([[-5.0, -5.0], [30.0, -5.0], [30.0, 30.0], [-5.0, 30.0]])
    hole = np.array([[4.0, 4.0], [4.0, 7.0], [7.0, 7.0], [7.0, 4.0]])
    share = coverage([square, hole], 12, 11)
    assert share.shape == (11, 12)
    assert share.sum() == pytest.approx(12 * 11 - 9.0, abs=1e-4)
    assert coverage([], 3, 2).sum() == 0.0
    assert coverage([square + 100.0], 12, 11).sum() == 0.0


@pytest.mark.parametrize("angle", [0.0, 0.03, 0.4, 0.785, 1.3])
def test_a_rendered_straight_edge_is_accurate(angle):
    along = np.array([math.cos(angle), math.sin(angle)])
    across = np.array([-along[1], along[0]])
    corner = np.array([0.0031, -0.0017])
    far = 0.5
    plane = np.array(
        [corner - far * along, corner + far * along, corner + far * (along + across),
         corner - far * (along - across)]
    )  # fmt: skip
    pose = SimPose.looking_at((0.0, 0.0), 0.3, tilt=0.2, azimuth=0.5)
    lens = Lens(1500.0, (319.5, 239.5), 640, 480)
    picture = render([PaintLayer([plane], pose, 0.9)], lens, SHARP, np.random.default_rng(0))
    bright = linear(picture)
    share = (bright - bright.min()) / (bright.max() - bright.min())
    ends = lens.sees(np.array([corner - 0.02 * along, corner + 0.02 * along]), pose)
    # a column's (or row's) sum of light says where the edge crosses it, exactly
    flat = abs(ends[1, 0] - ends[0, 0]) > abs(ends[1, 1] - ends[0, 1])
    table, axis = (share, 0) if flat else (share.T, 1)
    first, last = np.sort(ends[:, axis])
    lines = np.arange(int(first) + 2, int(last) - 1)
    wanted = np.interp(
        lines, *(ends[np.argsort(ends[:, axis])][:, k] for k in ((0, 1) if flat else (1, 0)))
    )
    found = []
    for line, near in zip(lines, np.rint(wanted).astype(int), strict=True):
        window = table[near - 12 : near + 13, line]
        lit = window.sum()
        found.append(near - 12.5 + (lit if window[0] > 0.5 else 25.0 - lit))
    assert len(lines) > 100
    # what is left is the rounding of bytes, also in what counts as black and white
    assert np.sqrt(np.mean(np.square(found - wanted))) < 0.02
    assert abs(np.mean(found - wanted)) < 0.01


def test_charuco_corners_have_no_bias():
    offsets = []
    rng = np.random.default_rng(2)
    board = CAMERA_BOARD
    for tilt, azimuth in ((0.0, 0.0), (0.3, 0.7), (0.4, 2.5)):
        pose = SimPose.looking_at(
            (board.width_m / 2, board.height_m / 2), 0.32, tilt=tilt, azimuth=azimuth, turn=0.2
        )
        looks = Looks(exposure=0.9, softness_px=0.7, noise=0.005)
        picture = render(target_layers(board, pose), LENS, looks, rng)
        found, ids, _, _ = cv2.aruco.CharucoDetector(board.as_opencv()).detectBoard(picture[..., 1])
        assert len(ids) > 40
        truth = LENS.sees(board.points[ids.ravel(), :2], pose)
        offsets.append(found.reshape(-1, 2) - truth)
    gaps = np.concatenate(offsets)
    assert np.abs(np.mean(gaps, axis=0)).max() < 0.05
    assert np.sqrt(np.mean(gaps**2)) < 0.12


def test_the_rendered_lens_equals_the_fitted_camera_model():
    """Two implementations of one formula, which share no code."""
    camera = Camera(1500.0, 1500.0, 639.5, 479.5, LENS.distortion, 1280, 960)
    pose = SimPose.looking_at((0.1, 0.05), 0.3, tilt=0.4, azimuth=1.0, turn=0.3)
    points = np.random.default_rng(1).uniform(0.0, 0.2, (50, 2))
    solid = np.column_stack([points, np.zeros(50)]) @ pose.rotation.T + pose.shift_m
    np.testing.assert_allclose(LENS.sees(points, pose), camera.project(solid), atol=1e-6)


def test_every_marker_of_the_mat_is_read_in_a_poor_photograph():
    rng = np.random.default_rng(5)
    pose = SimPose.looking_at((0.126, 0.09), 0.36, tilt=0.25, azimuth=1.0)
    layers = target_layers(BLADE_MAT, pose)
    picture = render(layers, LENS, random_looks(rng, 4.0), rng)
    data = np.frombuffer(as_jpeg(picture, 85), dtype=np.uint8)
    read = cv2.imdecode(data, cv2.IMREAD_GRAYSCALE)
    dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_250)
    _, ids, _ = cv2.aruco.ArucoDetector(dictionary).detectMarkers(read)
    assert sorted(ids.ravel().tolist()) == list(BLADE_MAT.ids)


def test_a_blade_covers_the_sheet_except_in_its_hole():
    pose = SimPose.looking_at((0.1, 0.05), 0.3)
    sheet = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    shape = BladeShape()
    layers = [PaintLayer([sheet], pose, 0.85), blade_layer(shape, pose, (0.08, 0.05), brushed=0.0)]
    bright = linear(render(layers, LENS, SHARP, np.random.default_rng(0)))
    hole, body, below = (
        LENS.sees(np.array([[0.08, 0.05], [0.11, 0.05], [0.11, 0.05 + 0.009]]), pose)
        .round()
        .astype(int)
    )
    assert bright[hole[1], hole[0]] == pytest.approx(0.85 * 0.9, rel=0.02)
    assert bright[body[1], body[0]] == pytest.approx(0.28 * 0.9, rel=0.02)
    assert bright[below[1], below[0]] == pytest.approx(0.85 * 0.9, rel=0.02)


def test_the_centreline_of_a_symmetric_blade_is_its_x_axis():
    assert centreline_turn(BladeShape(back_m=0.008, back_slope=-math.tan(0.035))) == pytest.approx(
        0.0, abs=1e-9
    )
    turned = centreline_turn(BladeShape(back_m=0.008, back_slope=-math.tan(0.035) + 0.02))
    assert turned == pytest.approx(0.01, abs=1e-3)
