"""Corners are found without bias, and a photograph that shows no target says what it shows."""

import cv2
import numpy as np
import pytest

from scissorcal.errors import InputError
from scissorcal.vision.sim import Looks, SimPose
from scissorcal.vision.targets.boards import (
    BLADE_MAT,
    CAMERA_BOARD,
    PLATE_BOARD,
    PLATE_STRIP,
    Board,
    CharucoBoard,
    Chessboard,
)
from scissorcal.vision.targets.detect import find_board, find_markers
from tests.vision.scenes import SOFT, lens, photo_of, picture, pose_before

CHESSBOARD = Chessboard("chessboard 9x6", 9, 6, 0.025)
OTHER = CharucoBoard("ChArUco 5x7", 5, 7, 0.04, 0.03, dictionary="DICT_6X6_250")


def errors(board: Board, size_px: float, looks: Looks, tilt: float, seed: int) -> np.ndarray:
    """Found minus true corners where a square (or marker) spans about ``size_px``."""
    unit = board.marker_m if board.kind == "markers" else board.square_m
    width, height = 1280, 800
    eye = lens(width, height)
    rng = np.random.default_rng(seed)
    pose = pose_before(
        board,
        unit * eye.focal_px / size_px,
        tilt=tilt,
        azimuth=float(rng.uniform(0.0, 6.28)),
        turn=float(rng.uniform(-0.3, 0.3)),
    )
    image = picture(board, pose, eye, looks, seed)
    found = find_board(photo_of(image), board, explain=False)
    return np.asarray(found.pixels - eye.sees(found.points[:, :2], pose))


@pytest.mark.parametrize(
    ("board", "size_px", "looks"),
    [
        (CAMERA_BOARD, 45.0, SOFT),
        (CAMERA_BOARD, 70.0, Looks(softness_px=0.5)),
        (CAMERA_BOARD, 70.0, Looks(softness_px=0.7, defocus_px=2.0, noise=0.01)),
        (CHESSBOARD, 45.0, SOFT),
        (CHESSBOARD, 80.0, Looks(softness_px=0.7, defocus_px=1.5, noise=0.01)),
    ],
)
def test_chessboard_corners_have_no_bias(board: Board, size_px: float, looks: Looks) -> None:
    # OpenCV 4.11 to 4.13 placed ChArUco corners half a pixel off: this is what would show it.
    found = np.concatenate([errors(board, size_px, looks, 0.4, seed) for seed in range(2)])
    assert len(found) > 0.8 * 2 * len(board.points)
    assert np.abs(found.mean(axis=0)).max() < 0.02
    assert np.sqrt(np.mean(found**2)) < 0.06


@pytest.mark.parametrize(
    "looks",
    [
        Looks(softness_px=0.5),
        Looks(softness_px=0.8, noise=0.01, tone=0.2),
        Looks(softness_px=0.7, defocus_px=2.0, noise=0.01),
    ],
)
def test_blur_does_not_shift_marker_corners(looks: Looks) -> None:
    width, height = 1280, 900
    eye = lens(width, height)
    pose = pose_before(BLADE_MAT, 0.021 * eye.focal_px / 80.0, tilt=0.3, azimuth=1.0)
    image = cv2.cvtColor(picture(BLADE_MAT, pose, eye, looks), cv2.COLOR_BGR2GRAY)
    found = find_markers(image, BLADE_MAT.dictionary, BLADE_MAT)
    assert sorted(found.ids) == list(BLADE_MAT.ids)
    assert found.sharp.all()
    true = np.array([eye.sees(BLADE_MAT.marker_corners(m)[:, :2], pose) for m in found.ids])
    off = found.corners - true
    outward = true - true.mean(axis=1, keepdims=True)
    outward /= np.linalg.norm(outward, axis=2, keepdims=True)
    assert abs(float(np.mean(np.sum(off * outward, axis=2)))) < 0.05
    assert np.sqrt(np.mean(off**2)) < 0.06
    # What a corner finder alone says lies far further inward.
    rough, _, _ = cv2.aruco.ArucoDetector(
        cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_250)
    ).detectMarkers(image)
    assert len(rough) == len(BLADE_MAT.ids)


def test_a_marker_with_a_covered_side_is_not_sharp() -> None:
    eye = lens()
    pose = pose_before(PLATE_STRIP, 0.4)
    image = picture(PLATE_STRIP, pose, eye)
    corner = eye.sees(PLATE_STRIP.marker_corners(81)[:, :2], pose)
    left, low = corner[3]
    # A finger over a third of one side, dark as the marker's border.
    image[int(low) - 2 : int(low) + 15, int(left) + 25 : int(left) + 60] = 15
    found = find_markers(cv2.cvtColor(image, cv2.COLOR_BGR2GRAY), PLATE_STRIP.dictionary)
    mine = found.ids == 81
    if mine.any() and found.sharp[mine][0]:
        assert np.abs(found.corners[mine][0] - corner).max() < 0.3


def test_a_board_may_be_seen_in_part() -> None:
    eye = lens()
    pose = pose_before(CAMERA_BOARD, 0.25)
    found = find_board(photo_of(picture(CAMERA_BOARD, pose, eye)), CAMERA_BOARD)
    assert 12 < len(found.ids) < len(CAMERA_BOARD.points)
    off = found.pixels - eye.sees(found.points[:, :2], pose)
    assert np.abs(off).max() < 0.3


def test_squares_of_forty_pixels_are_found_always_and_of_twelve_never() -> None:
    for size, least, most in ((40.0, 48, 48), (12.0, 0, 30)):
        counts = []
        for seed in range(2):
            try:
                counts.append(len(errors(CAMERA_BOARD, size, SOFT, 0.3, seed)))
            except InputError:
                counts.append(0)
        assert least <= min(counts)
        assert max(counts) <= most


def test_the_side_of_a_square_is_measured() -> None:
    eye = lens()
    found = find_board(
        photo_of(picture(CAMERA_BOARD, pose_before(CAMERA_BOARD, 0.5), eye)), CAMERA_BOARD
    )
    assert found.square_px == pytest.approx(0.026 * eye.focal_px / 0.5, rel=0.03)


def sentence(image: np.ndarray, board: Board) -> str:
    with pytest.raises(InputError) as caught:
        find_board(photo_of(image, "shot.jpg"), board)
    words = str(caught.value)
    assert words.startswith("shot.jpg")
    assert words.endswith(".")
    return words


def test_a_refusal_names_what_the_photograph_shows_instead() -> None:
    eye = lens()
    mat = picture(BLADE_MAT, pose_before(BLADE_MAT, 0.45), eye)
    assert "shows the blade mat, not the camera board" in sentence(mat, CAMERA_BOARD)
    assert "shows the blade mat, not the chessboard 9x6" in sentence(mat, CHESSBOARD)
    board = picture(CAMERA_BOARD, pose_before(CAMERA_BOARD, 0.45), eye)
    assert "shows the camera board, not the plate board" in sentence(board, PLATE_BOARD)
    foreign = picture(OTHER, pose_before(OTHER, 0.5), eye)
    assert "markers of DICT_6X6_250, not the camera board" in sentence(foreign, CAMERA_BOARD)
    plain = picture(CHESSBOARD, pose_before(CHESSBOARD, 0.5), eye)
    assert "a plain chessboard, not the camera board" in sentence(plain, CAMERA_BOARD)


def test_a_photograph_without_enough_corners_is_refused() -> None:
    eye = lens()
    rng = np.random.default_rng(0)
    noise = cv2.GaussianBlur(rng.integers(0, 255, (480, 640, 3), dtype=np.uint8), (0, 0), 2.0)
    assert "no marker of the camera board" in sentence(noise, CAMERA_BOARD)
    assert "no chessboard of 9 x 6 inner corners" in sentence(noise, CHESSBOARD)
    assert "of one shade" in sentence(np.full((720, 1280, 3), 90, np.uint8), CAMERA_BOARD)
    assert "160 x 120 pixels" in sentence(noise[:120, :160], CAMERA_BOARD)
    aside = SimPose.looking_at((-0.11, -0.03), 0.3)
    assert "are needed" in sentence(picture(CAMERA_BOARD, aside, eye), CAMERA_BOARD)


def test_a_blurred_photograph_is_refused() -> None:
    eye = lens()
    looks = Looks(softness_px=0.7, defocus_px=14.0, noise=0.01)
    blurred = picture(CAMERA_BOARD, pose_before(CAMERA_BOARD, 0.5), eye, looks)
    assert "too blurred" in sentence(blurred, CAMERA_BOARD)
