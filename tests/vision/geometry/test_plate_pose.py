"""A plate in one picture: what is new in that picture, and what all pictures share."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from scipy.stats import chi2

from scissorcal.vision.geometry.board_pose import Corners, locate_board
from scissorcal.vision.geometry.camera import Camera
from scissorcal.vision.geometry.pose import Pose, difference
from scissorcal.vision.geometry.rig_frame import RigPose, locate_plate
from scissorcal.vision.targets.boards import PLATE_BOARD

LENS = (0.05, -0.1, 0.0, 0.0, 0.0)
KNOWLEDGE = np.diag([0.8, 0.8, 0.6, 0.6, 1e-3, 3e-3, 1e-4, 1e-4, 1e-3]) ** 2
CAMERA = Camera(1000.0, 1000.0, 640.0, 360.0, LENS, 1280, 720, KNOWLEDGE)
TARGET = Pose.from_rotation_vector([np.pi, 0.0, 0.0], [0.03, 0.01, 0.0])
BACK = TARGET.inverse()
PIXEL = 0.1
PICTURES = 8
WORLDS = 60


def corners_by(camera: Camera, pose: Pose, scale: np.ndarray, rng: np.random.Generator) -> Corners:
    """The board's corners in one picture of a camera, printed off by ``scale``."""
    points = PLATE_BOARD.points
    pixels = camera.project(pose.apply(points * np.append(scale, 1.0)))
    pixels = pixels + PIXEL * rng.standard_normal(pixels.shape)
    numbers = np.arange(len(points))
    return Corners(pixels, points, np.zeros(len(points), dtype=np.int64), numbers)


def an_offset(rng: np.random.Generator) -> tuple[Camera, np.ndarray]:
    """A true camera and print, off as their covariance says."""
    off = rng.multivariate_normal(np.zeros(9), KNOWLEDGE)
    camera = Camera.of(CAMERA.parameters + off, 1280, 720)
    return camera, 1.0 + 1e-3 * rng.standard_normal(2)


def a_view(rng: np.random.Generator) -> Pose:
    tilt = np.radians(rng.uniform(15, 50)) * np.array([*_unit(rng), 0.0])
    turn = Rotation.from_rotvec(tilt) * Rotation.from_rotvec([0, 0, rng.uniform(-3, 3)])
    middle = PLATE_BOARD.points.mean(axis=0)
    return Pose.from_matrix(turn.as_matrix(), [0.02, -0.01, 0.4] - turn.as_matrix() @ middle)


def _unit(rng: np.random.Generator) -> np.ndarray:
    angle = rng.uniform(0, 2 * np.pi)
    return np.array([np.cos(angle), np.sin(angle)])


@pytest.fixture(scope="module")
def scores() -> tuple[float, float, float]:
    """Mean squares by their covariance: of pictures about their mean, of the mean, of pictures.

    60 cameras, each with 8 pictures of one plate at one pose; 6 numbers each.
    """
    rng = np.random.default_rng(3)
    between, means, single = [], [], []
    for _ in range(WORLDS):
        camera, scale = an_offset(rng)
        truth = a_view(rng)
        seen = [
            locate_plate(
                locate_board(corners_by(camera, truth, scale, rng), CAMERA), CAMERA, TARGET
            )
            for _ in range(PICTURES)
        ]
        away = np.array([difference(one.pose, truth.after(BACK)) for one in seen])
        mean = away.mean(axis=0)
        noise = np.mean([one.noise for one in seen], axis=0)
        shared = seen[0].shared
        inverse = np.linalg.inv(noise)
        between += [e @ inverse @ e * PICTURES / (PICTURES - 1) for e in away - mean]
        means.append(mean @ np.linalg.solve(shared + noise / PICTURES, mean))
        single.append(away[0] @ np.linalg.solve(seen[0].pose.covariance, away[0]))
    return float(np.mean(between)), float(np.mean(means)), float(np.mean(single))


def test_pictures_scatter_by_their_noise(scores: tuple[float, float, float]) -> None:
    """Within the 99.9 % band of a chi-square with 6 x 7 x 60 degrees of freedom."""
    freedom = 6 * (PICTURES - 1) * WORLDS
    low, high = 6.0 * chi2.ppf([0.0005, 0.9995], freedom) / freedom
    assert low < scores[0] < high


def test_their_mean_is_off_by_what_they_share(scores: tuple[float, float, float]) -> None:
    low, high = chi2.ppf([0.0005, 0.9995], 6 * WORLDS) / WORLDS
    assert low < scores[1] < high
    assert low < scores[2] < high


def test_taking_the_whole_covariance_for_noise_is_overconfident() -> None:
    """Averaging 8 pictures would divide the shared errors by 8: they do not become smaller."""
    rng = np.random.default_rng(4)
    naive = []
    for _ in range(30):
        camera, scale = an_offset(rng)
        truth = a_view(rng)
        corners = (corners_by(camera, truth, scale, rng) for _ in range(PICTURES))
        seen = [locate_plate(locate_board(one, CAMERA), CAMERA, TARGET) for one in corners]
        mean = np.mean([difference(one.pose, truth.after(BACK)) for one in seen], axis=0)
        naive.append(mean @ np.linalg.solve(seen[0].pose.covariance / PICTURES, mean))
    assert np.mean(naive) > 4.0 * 6.0


def test_both_parts_make_up_the_whole_in_the_rigs_frame() -> None:
    rng = np.random.default_rng(5)
    root = 1e-4 * rng.standard_normal((6, 6))
    camera_rig = Pose.from_rotation_vector([2.0, 0.4, 0.1], [0.02, -0.03, 0.5], root @ root.T)
    by_camera = 1e-5 * rng.standard_normal((6, 9))
    rig = RigPose(camera_rig, camera_rig, 0.1, (), by_camera)
    found = locate_board(corners_by(CAMERA, a_view(rng), np.ones(2), rng), CAMERA)
    seen = locate_plate(found, CAMERA, TARGET, rig)
    np.testing.assert_allclose(seen.noise + seen.shared, seen.pose.covariance, atol=1e-18)
    turned = camera_rig.matrix.T @ found.noise[:3, :3] @ camera_rig.matrix
    np.testing.assert_allclose(seen.noise[:3, :3], turned, atol=1e-15)
    scale = float(np.abs(seen.shared).max())
    assert np.linalg.eigvalsh(seen.shared).min() > -1e-9 * scale
    assert seen.other is not None
    known = rig.holds(found, CAMERA).after(BACK)
    np.testing.assert_allclose(difference(seen.pose, known), 0.0, atol=1e-15)
