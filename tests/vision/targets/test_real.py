"""Photographs of boards and markers that others took, with what they published."""

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from scissorcal.calibration import fit_camera
from scissorcal.vision.camera_files import read_camera_file
from scissorcal.vision.photo import read_photo
from scissorcal.vision.targets.boards import CharucoBoard, Chessboard
from scissorcal.vision.targets.detect import Detection, find_board, find_markers

DATA = Path(__file__).resolve().parents[3].parent / "shared" / "data"
CHESS, ARUCO = DATA / "opencv_chessboard", DATA / "aruco"
needs_chessboard = pytest.mark.skipif(
    not CHESS.is_dir(), reason="the photographs of OpenCV's chessboard are not here"
)
needs_aruco = pytest.mark.skipif(
    not ARUCO.is_dir(), reason="the photographs of ArUco markers are not here"
)

BOARD = Chessboard("chessboard 9x6", 9, 6, 0.025)
PUBLISHED_WINDOW_PX = 11
"""Half the window that the published corners were refined in: in left02 and left13 it reaches over
neighbouring corners, which are 15 px away at the board's far end."""


def detections(window_px: int | None) -> dict[str, Detection]:
    return {
        path.stem: find_board(read_photo(path, colour=False), BOARD, window_px=window_px)
        for path in sorted(CHESS.glob("left*.jpg"))
    }


def photos(found: dict[str, Detection]) -> list[Detection]:
    return [replace(detection, source=name) for name, detection in found.items()]


@needs_chessboard
def test_published_poses_are_recovered_with_the_published_camera() -> None:
    published = CHESS / "left_intrinsics.yml"
    read = read_camera_file(published)
    camera = read.camera
    assert camera.fx == pytest.approx(535.9157, abs=1e-3)
    assert read.rms_px == pytest.approx(0.3926, abs=1e-4)
    storage = cv2.FileStorage(str(published), cv2.FILE_STORAGE_READ)
    poses = storage.getNode("extrinsic_parameters").mat()
    storage.release()
    found = detections(PUBLISHED_WINDOW_PX)
    assert len(found) == len(poses) == 13
    for detection, pose in zip(found.values(), poses, strict=True):
        # The published frame starts at the first inner corner.
        points = detection.points - [0.025, 0.025, 0.0]
        turn, shift = solved(points, detection.pixels, camera.matrix, camera.coefficients)
        apart = cv2.Rodrigues(cv2.Rodrigues(turn)[0] @ cv2.Rodrigues(pose[:3])[0].T)[0]
        assert np.degrees(np.linalg.norm(apart)) < 0.1
        assert np.linalg.norm(shift.ravel() - pose[3:]) < 0.5e-3


def solved(points: np.ndarray, pixels: np.ndarray, K: np.ndarray, bend: np.ndarray) -> tuple:
    _, turn, shift = cv2.solvePnP(points, pixels, K, bend)
    return cv2.solvePnPRefineLM(points, pixels, K, bend, turn, shift)


@needs_chessboard
def test_the_published_corners_give_the_published_camera_and_name_left02() -> None:
    fit = fit_camera(photos(detections(PUBLISHED_WINDOW_PX)), rng=np.random.default_rng(0))
    assert fit.camera.fx == pytest.approx(535.9157, rel=0.005)
    worst = max(fit.views, key=lambda view: view.rms_px)
    assert worst.name == "left02"
    assert worst.outlying
    (verdict,) = [v for v in fit.verdicts if v.check == "views"]
    assert verdict.status == "fail"
    assert "left02" in verdict.why


@needs_chessboard
def test_adaptive_windows_leave_no_outlying_photograph() -> None:
    # The published focal length is pulled up by left02's corners: without that photograph plain
    # least squares on the published corners gives 534.1, which is between the two.
    fit = fit_camera(photos(detections(None)), rng=np.random.default_rng(0))
    assert not any(view.outlying for view in fit.views)
    assert max(view.rms_px for view in fit.views) < 0.3
    assert fit.camera.fx == pytest.approx(535.9157, rel=0.006)
    assert fit.camera.covariance is not None
    sd = float(np.sqrt(fit.camera.covariance[0, 0]))
    assert sd < 0.003 * fit.camera.fx
    without = detections(PUBLISHED_WINDOW_PX)
    del without["left02"]
    points = [d.points.astype(np.float32) for d in without.values()]
    pixels = [d.pixels.astype(np.float32) for d in without.values()]
    _, K, *_ = cv2.calibrateCamera(points, pixels, (640, 480), None, None)
    assert abs(fit.camera.fx - K[0, 0]) < 2.0 * sd
    assert fit.cross is not None
    assert fit.cross.p_value > 0.05
    assert fit.cross.rms_px < fit.cross.claimed_px * 2.0
    # corners were seen in 46 % of the picture, which is what the note says and no check refuses
    assert [verdict.check for verdict in fit.verdicts if verdict.status == "fail"] == []
    assert "46 % of the picture" in fit.notes[0]


@needs_aruco
@pytest.mark.parametrize("name", ["img_00", "img_02"])
def test_every_marker_and_corner_of_a_charuco_board_is_found(name: str) -> None:
    board = CharucoBoard("ChArUco 5x7", 5, 7, 0.04, 0.02, dictionary="DICT_6X6_250")
    photo = read_photo(ARUCO / f"{name}.jpg", colour=False)
    markers = find_markers(photo.grey, board.dictionary, board)
    assert sorted(markers.ids) == list(range(17))
    found = find_board(photo, board)
    assert sorted(found.ids) == list(range(24))
    camera = read_camera_file(ARUCO / "tutorial_camera_charuco.yml").camera
    turn, shift = solved(found.points, found.pixels, camera.matrix, camera.coefficients)
    again = cv2.projectPoints(found.points, turn, shift, camera.matrix, camera.coefficients)[0]
    off = np.linalg.norm(again.reshape(-1, 2) - found.pixels, axis=1)
    assert np.sqrt(np.mean(off**2)) < 0.35


@needs_aruco
def test_every_single_marker_is_found() -> None:
    photo = read_photo(ARUCO / "singlemarkersoriginal.jpg", colour=False)
    found = find_markers(photo.grey, "DICT_6X6_250")
    assert sorted(found.ids) == [23, 40, 62, 98, 124, 203]
    assert found.sharp.all()


@needs_aruco
def test_corners_from_sides_fit_the_board_better_than_a_corner_detectors() -> None:
    board = CharucoBoard("ChArUco 5x7", 5, 7, 0.04, 0.02, dictionary="DICT_6X6_250")
    camera = read_camera_file(ARUCO / "tutorial_camera_charuco.yml").camera
    grey = read_photo(ARUCO / "img_00.jpg", colour=False).grey
    found = find_markers(grey, board.dictionary, board)
    settings = cv2.aruco.DetectorParameters()
    settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    corners, ids, _ = cv2.aruco.ArucoDetector(
        cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_6X6_250), settings
    ).detectMarkers(grey)
    rough = replace(found, ids=ids.ravel(), corners=np.array(corners).reshape(-1, 4, 2))
    sizes = []
    for markers in (found, rough):
        pixels = markers.corners.reshape(-1, 2)
        points = np.concatenate([board.marker_corners(int(m)) for m in markers.ids])
        rays = camera.rays(pixels)
        H, _ = cv2.findHomography(rays, points[:, :2])
        flat = cv2.perspectiveTransform(rays[:, None], H).reshape(-1, 4, 2)
        side = np.linalg.norm(np.roll(flat, -1, axis=1) - flat, axis=2).mean()
        sizes.append(float(side))
    # The board's own markers are 20 mm; a corner finder draws them together.
    assert abs(sizes[0] - 0.02) < abs(sizes[1] - 0.02)
