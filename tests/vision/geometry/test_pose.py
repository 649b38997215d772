"""Poses of flat targets and of the rig: exact algebra, recovery, honest covariance, refusals."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from scissorcal.recipe import PlatePriors
from scissorcal.vision.geometry.board_pose import Corners, locate_board
from scissorcal.vision.geometry.camera import Camera
from scissorcal.vision.geometry.pose import Pose, between, difference, left_jacobian
from scissorcal.vision.geometry.rig_frame import CardView, locate_rig
from scissorcal.vision.targets.boards import PLATE_BOARD, PLATE_STRIP, RIG_MARKERS, MarkerBoard

LENS = (0.05, -0.1, 0.0, 0.0, 0.0)
CAMERA = Camera(1000.0, 1000.0, 640.0, 360.0, LENS, 1280, 720)
KNOWLEDGE = np.diag([0.8, 0.8, 0.6, 0.6, 1e-3, 3e-3, 1e-4, 1e-4, 1e-3]) ** 2

angles = st.floats(-3.1, 3.1)
lengths = st.floats(-0.5, 0.5)
poses = st.builds(
    lambda a, b, c, x, y, z: Pose.from_rotation_vector(
        np.array([a, b, c]) / max(1.0, np.linalg.norm([a, b, c]) / 3.14), [x, y, z]
    ),
    angles, angles, angles, lengths, lengths, lengths,
)  # fmt: skip


@given(poses, poses)
@settings(max_examples=60)
def test_a_pose_after_its_inverse_is_the_identity(a: Pose, b: Pose) -> None:
    assert np.allclose(
        difference(a.after(a.inverse()), Pose((1.0, 0, 0, 0), (0.0, 0, 0))), 0, atol=1e-9
    )
    points = np.random.default_rng(0).standard_normal((5, 3))
    assert np.allclose(a.after(b).apply(points), a.apply(b.apply(points)))
    assert a.quaternion[0] >= 0
    assert np.isclose(np.linalg.norm(a.quaternion), 1.0)


@pytest.mark.parametrize("angle", [0.0, 1e-8, 1e-3, 1.0, 3.0, np.pi - 1e-6])
def test_left_jacobian_is_the_derivative_of_the_rotation(angle):
    vector = angle * np.array([0.6, -0.48, 0.64])
    for column, reach in zip(left_jacobian(vector).T, 1e-6 * np.eye(3), strict=True):
        ahead, behind = Rotation.from_rotvec(vector + reach), Rotation.from_rotvec(vector - reach)
        turn = (ahead * behind.inv()).as_rotvec() / 2e-6
        assert np.allclose(turn, column, atol=1e-6)


def moved(pose: Pose, step) -> Pose:
    """The pose after a small error, as its covariance states errors."""
    turned = Rotation.from_rotvec(step[:3]).as_matrix() @ pose.matrix
    return Pose.from_matrix(turned, np.add(pose.translation_m, step[3:]))


def by_differences(make, covariance):
    """Covariance of the pose that ``make`` gives of small errors, by central differences."""
    expected, reach = make(np.zeros(len(covariance))), 1e-5
    slope = [
        (difference(make(step), expected) - difference(make(-step), expected)) / (2.0 * reach)
        for step in reach * np.eye(len(covariance))
    ]
    return np.transpose(slope) @ covariance @ slope


def assert_same_covariance(found, expected):
    """Equal to 1e-6 of the standard deviations: errors are cubic in a step of 1e-5."""
    sizes = np.sqrt(np.diag(expected))
    assert np.allclose(found / np.outer(sizes, sizes), expected / np.outer(sizes, sizes), atol=1e-6)


def test_covariances_of_inverse_and_product_are_those_of_small_errors():
    def loose(seed: int) -> Pose:
        root = 1e-3 * np.random.default_rng(seed).standard_normal((6, 6))
        turn = np.random.default_rng(seed + 9).standard_normal(3)
        return Pose.from_rotation_vector(turn, [0.3, -0.2, 0.5], root @ root.T)

    a, b = loose(2), loose(3)
    inverse = by_differences(lambda step: moved(a, step).inverse(), a.covariance)
    assert_same_covariance(inverse, a.inverse().covariance)
    both = np.block([[a.covariance, np.zeros((6, 6))], [np.zeros((6, 6)), b.covariance]])
    product = by_differences(lambda step: moved(a, step[:6]).after(moved(b, step[6:])), both)
    assert_same_covariance(product, a.after(b).covariance)


def test_common_errors_of_two_poses_cancel():
    """The pose between two of one joint covariance has that of small errors; of itself, none."""
    rng = np.random.default_rng(11)
    root = 1e-3 * rng.standard_normal((12, 12))
    joint = root @ root.T
    a = Pose.from_rotation_vector([0.4, -1.0, 0.3], [0.1, 0.2, 0.5], joint[:6, :6])
    b = Pose.from_rotation_vector([1.2, 0.1, -0.6], [0.0, -0.1, 0.4], joint[6:, 6:])
    found = by_differences(
        lambda step: moved(a, step[:6]).inverse().after(moved(b, step[6:])), joint
    )
    assert_same_covariance(found, between(a, b, joint[:6, 6:]).covariance)
    same = between(a, a, joint[:6, :6])
    assert np.allclose(same.covariance, 0.0, atol=1e-12)


def view(board, tilt_deg: float, rng, frames: int = 1, noise: float = 0.1, camera: Camera = CAMERA):
    axis = rng.uniform(0, 2 * np.pi)
    tilt = np.radians(tilt_deg) * np.array([np.cos(axis), np.sin(axis), 0.0])
    turn = (
        Rotation.from_rotvec(tilt) * Rotation.from_rotvec([0, 0, rng.uniform(-3, 3)])
    ).as_matrix()
    middle = board.points.mean(axis=0)
    truth = Pose.from_matrix(turn, [0.02, -0.01, 0.4] - turn @ middle)
    seen = camera.project(truth.apply(board.points))
    size = len(seen)
    corners = Corners(
        np.concatenate([seen + noise * rng.standard_normal(seen.shape) for _ in range(frames)]),
        np.tile(board.points, (frames, 1)),
        np.repeat(np.arange(frames), size),
        np.tile(np.arange(size), frames),
    )
    return truth, corners


@pytest.mark.parametrize("board", [PLATE_BOARD, PLATE_STRIP], ids=lambda board: board.name)
@pytest.mark.parametrize("tilt", [0.0, 3.0, 40.0, 80.0])
def test_without_noise_the_pose_is_exact(board, tilt):
    truth, corners = view(board, tilt, np.random.default_rng(4), noise=0.0)
    found = locate_board(corners, CAMERA)
    assert np.abs(difference(found.pose, truth)).max() < 1e-6
    assert found.used.all()


def test_covariance_covers_the_truth_with_an_uncertain_camera():
    """80 views, 6 numbers: 90 % intervals cover within 0.82 and 0.96 (3.5 sd, correlated)."""
    rng = np.random.default_rng(5)
    known = Camera(1000.0, 1000.0, 640.0, 360.0, LENS, 1280, 720, KNOWLEDGE)
    inside = []
    for _ in range(80):
        off = rng.multivariate_normal(np.zeros(9), KNOWLEDGE)
        lens = tuple(np.array(LENS) + off[4:])
        true = Camera(1000 + off[0], 1000 + off[1], 640 + off[2], 360 + off[3], lens, 1280, 720)
        truth, corners = view(PLATE_BOARD, rng.uniform(5, 60), rng, frames=2, camera=true)
        found = locate_board(corners, known, PlatePriors(print_scale_sd_percent=0.0))
        away = difference(found.pose, truth) / np.sqrt(np.diag(found.pose.covariance))
        inside.append(np.abs(away) < 1.645)
    assert 0.82 < float(np.mean(inside)) < 0.96


def test_a_small_marker_seen_square_on_keeps_both_poses():
    marker = MarkerBoard("one", 0.02, 0.02, 0.02, ((0.01, 0.01),), first_id=200)
    truth, corners = view(marker, 4.0, np.random.default_rng(6), noise=0.3)
    found = locate_board(corners, CAMERA)
    assert found.other is not None
    assert found.ambiguity < 2.0
    nearest = min(np.linalg.norm(difference(p, truth)[:3]) for p in (found.pose, found.other))
    assert nearest < np.radians(8), "one of both is near"


def test_a_misplaced_corner_is_left_out():
    truth, corners = view(PLATE_BOARD, 30.0, np.random.default_rng(7))
    corners.pixels[5] += [4.0, -3.0]
    found = locate_board(corners, CAMERA)
    assert not found.used[5]
    assert found.used.sum() == len(corners.points) - 1
    assert np.degrees(np.linalg.norm(difference(found.pose, truth)[:3])) < 0.2


def test_too_few_or_aligned_corners_are_refused():
    _, corners = view(PLATE_BOARD, 30.0, np.random.default_rng(8))
    few = np.arange(len(corners.points)) < 3
    with pytest.raises(ValueError, match="only 3 corners"):
        locate_board(corners.where(few), CAMERA)
    line = corners.points[:, 1] == corners.points[0, 1]
    with pytest.raises(ValueError, match="along one line"):
        locate_board(corners.where(line), CAMERA)


MIDDLE = np.array([RIG_MARKERS.width_m / 2, RIG_MARKERS.height_m / 2, 0.0])


def card_views(positions, rng, noise: float = 0.1) -> tuple[Pose, tuple[CardView, ...]]:
    around = [180 + rng.uniform(-40, 40), rng.uniform(-40, 40), rng.uniform(-180, 180)]
    turn = Rotation.from_euler("xyz", around, degrees=True).as_matrix()
    rig = Pose.from_matrix(turn, [0.02, -0.02, 0.45])
    turned = Pose.from_rotation_vector([0.05, -0.03, 1.0], np.zeros(3))
    place = np.array([0.05, 0.01, 0.0]) - turned.apply([MIDDLE])[0]
    card = Pose(turned.quaternion, tuple(place))
    views = []
    for advance, angle in positions:
        motion = Pose.from_rotation_vector([0.0, 0.0, angle], [advance, 0.0, 0.0])
        seen = CAMERA.project(rig.after(motion).after(card).apply(RIG_MARKERS.points))
        pixels = seen + noise * rng.standard_normal(seen.shape)
        numbers = np.arange(len(seen))
        corners = Corners(pixels, RIG_MARKERS.points, np.zeros(len(seen), dtype=np.int64), numbers)
        views.append(CardView(corners, advance, angle))
    return rig, tuple(views)


def test_the_rig_is_located_from_advances_and_turns():
    positions = [(a, b) for a in (0.0, 0.03, 0.06) for b in (0.1, 0.3, 0.5)]
    for seed in range(2):
        truth, views = card_views(positions, np.random.default_rng(seed))
        found = locate_rig(views, CAMERA, MIDDLE)
        assert found.undetermined == ()
        away = difference(found.camera_rig, truth) / np.sqrt(np.diag(found.camera_rig.covariance))
        assert np.abs(away).max() < 4.5
        assert np.degrees(np.linalg.norm(difference(found.camera_rig, truth)[:3])) < 1.0


def test_corners_that_other_pictures_contradict_are_left_out_of_the_rigs_frame():
    """A blade's edge is taken for a marker's corner; alone, twelve corners bend after it."""
    positions = [(a, b) for a in (0.0, 0.03, 0.06) for b in (0.1, 0.3, 0.5)]
    truth, views = card_views(positions, np.random.default_rng(4), noise=0.02)
    few = views[6].corners.where(np.arange(len(views[6].corners.pixels)) < 12)
    few.pixels[3] += [3.0, 9.0]
    found = locate_rig((*views[:6], CardView(few, 0.06, 0.1), *views[7:]), CAMERA, MIDDLE)
    assert found.rms_px < 0.05
    away = difference(found.camera_rig, truth) / np.sqrt(np.diag(found.camera_rig.covariance))
    assert np.abs(away).max() < 4.5


def test_a_picture_with_another_position_than_stated_is_not_left_out():
    """One advance of twelve is off by a millimetre: its corners are no outliers, and show it."""
    positions = [(a, b) for a in (0.0, 0.02, 0.04, 0.06) for b in (0.1, 0.3, 0.5)]
    _, views = card_views(positions, np.random.default_rng(5), noise=0.02)
    wrong = CardView(views[4].corners, views[4].advance_m + 1e-3, views[4].blade_angle_rad)
    found = locate_rig((*views[:4], wrong, *views[5:]), CAMERA, MIDDLE)
    assert found.rms_px > 0.4


def test_motion_that_determines_part_of_the_frame_names_the_rest():
    _, shifted = card_views([(a, 0.2) for a in (0.0, 0.03, 0.06)], np.random.default_rng(9))
    assert locate_rig(shifted, CAMERA, MIDDLE).undetermined
    _, still = card_views([(0.0, 0.2)], np.random.default_rng(9))
    with pytest.raises(ValueError, match="same position in all pictures"):
        locate_rig(still, CAMERA, MIDDLE)
