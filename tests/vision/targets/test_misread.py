"""A board that is named otherwise than it was printed, or seen mirrored: what it is, in words."""

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from scissorcal.errors import InputError
from scissorcal.vision.photo import read_photo
from scissorcal.vision.sim import Looks
from scissorcal.vision.targets.boards import BLADE_MAT, Board, CharucoBoard, board_from_words
from scissorcal.vision.targets.detect import find_board
from tests.vision.scenes import lens, photo_of, picture, pose_before

CASES = Path(__file__).resolve().parents[3].parent / "shared" / "cases" / "boards"
needs_cases = pytest.mark.skipif(not CASES.is_dir(), reason="the photographs are not here")

Change = Callable[[NDArray[np.uint8]], NDArray[np.uint8]]

WORDS = "charuco:8x6:30:22:DICT_4X4_50"
OLD = f"{WORDS}:legacy"


def board(words: str) -> CharucoBoard:
    found = board_from_words(words)
    assert isinstance(found, CharucoBoard)
    return found


def shot(printed: Board, looks: Looks | None = None, distance_m: float = 0.4) -> NDArray[np.uint8]:
    pose = pose_before(printed, distance_m, tilt=0.4, azimuth=1.0, turn=0.2)
    return picture(printed, pose, lens(), looks or Looks(softness_px=0.7, noise=0.01))


def mirrored(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    return np.ascontiguousarray(image[:, ::-1])


def negative(image: NDArray[np.uint8]) -> NDArray[np.uint8]:
    return 255 - image


def refusal(image: NDArray[np.uint8], named: Board) -> str:
    with pytest.raises(InputError) as caught:
        find_board(photo_of(image, "shot.jpg"), named)
    return str(caught.value)


@needs_cases
@pytest.mark.parametrize("words", ["chessboard:9x6:0.025", "charuco:5x7:0.04:0.02:DICT_6X6_250"])
def test_squares_in_metres_are_refused(words: str) -> None:
    with pytest.raises(InputError, match=r"give lengths in mm, (25|40) where that is in metres"):
        board_from_words(words)


def test_a_board_from_before_opencv_4_6_is_found_under_its_name() -> None:
    for path in sorted(CASES.glob("legacy_8x6_*.jpg")):
        photo = read_photo(path, colour=False)
        found = find_board(photo, board(OLD))
        assert len(found.ids) == 35
        assert off_pinhole_px(found.points, found.pixels) < 1.0
        with pytest.raises(InputError, match=f"before 4.6 drew it: name it --board {OLD}"):
            find_board(photo, board(WORDS))


def off_pinhole_px(points: NDArray[np.float64], pixels: NDArray[np.float64]) -> float:
    """Rms distance to the best pose before the camera that took the pictures."""
    import cv2

    matrix = np.array([[900.0, 0.0, 640.0], [0.0, 900.0, 360.0], [0.0, 0.0, 1.0]])
    _, turn, shift = cv2.solvePnP(points, pixels, matrix, np.zeros(5))
    drawn, _ = cv2.projectPoints(points, turn, shift, matrix, np.zeros(5))
    return float(np.sqrt(np.mean(np.sum((drawn.reshape(-1, 2) - pixels) ** 2, axis=1))))


@pytest.mark.parametrize("words", [WORDS, OLD])
def test_corners_of_both_ages_are_where_they_were_rendered(words: str) -> None:
    named = board(words)
    pose = pose_before(named, 0.4, tilt=0.4, azimuth=1.0, turn=0.2)
    found = find_board(photo_of(shot(named)), named)
    off = found.pixels - lens().sees(found.points[:, :2], pose)
    assert len(found.ids) == 35
    assert np.abs(off).max() < 0.3


@pytest.mark.parametrize(
    ("printed", "named", "says"),
    [
        (OLD, WORDS, f"as OpenCV before 4.6 drew it: name it --board {OLD}"),
        (WORDS, OLD, f"as OpenCV draws it since 4.6: name it --board {WORDS}"),
        (WORDS, WORDS.replace("8x6", "6x8"), f"with 8 columns and 6 rows.*--board {WORDS}"),
        (OLD, WORDS.replace("8x6", "6x8"), f"with 8 columns and 6 rows.*--board {OLD}"),
        (WORDS, WORDS.replace("8x6", "5x9"), "with 8 columns.*charuco:8xROWS:30:22:DICT_4X4_50"),
        (WORDS.replace("8x6", "9x5"), WORDS.replace("8x6", "5x9"), "with 9 columns and 5 rows"),
        (OLD.replace("4X4_50", "5X5_100"), WORDS.replace("4X4_50", "5X5_100"), "before 4.6"),
        (OLD.replace("8x6", "7x6"), WORDS.replace("8x6", "7x6"), "before 4.6"),
        (WORDS.replace("8x6", "7x6"), OLD.replace("8x6", "7x6"), "since 4.6"),
        (OLD.replace("8x6", "7x6"), WORDS.replace("8x6", "6x7"), "with 7 columns.*:legacy"),
        (WORDS.replace("8x6", "9x6"), WORDS.replace("8x6", "10x6"), "with 9 columns.*9xROWS"),
        (WORDS, WORDS.replace("4X4_50", "6X6_250"), "shows markers of DICT_4X4_250"),
    ],
)
def test_another_layout_is_named_with_what_to_write(printed: str, named: str, says: str) -> None:
    said = refusal(shot(board(printed)), board(named))
    assert said.startswith("shot.jpg shows ")
    assert re.search(says, said), said


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (mirrored, "8x6 mirrored: turn off"),
        (negative, "with black and white swapped: print"),
        (lambda image: negative(mirrored(image)), "mirrored, with black and white swapped: "),
    ],
)
def test_a_mirrored_or_inverted_picture_is_named(change: Change, says: str) -> None:
    assert says in refusal(change(shot(board(WORDS))), board(WORDS))
    both = refusal(change(shot(board(OLD))), board(WORDS))
    assert "before 4.6" in both
    assert says.split(":")[0] in both


@pytest.mark.parametrize(("change", "says"), [(mirrored, "mirrored"), (negative, "swapped")])
def test_so_is_that_of_a_target_of_scissorcal(change: Change, says: str) -> None:
    assert f"shows the blade mat {says}" in refusal(change(shot(BLADE_MAT)), BLADE_MAT).replace(
        "with black and white ", ""
    )


def test_a_right_board_that_is_blurred_far_or_covered_is_not_called_another() -> None:
    named = board(WORDS)
    blurred = refusal(shot(named, Looks(softness_px=0.7, defocus_px=14.0, noise=0.01)), named)
    assert "too blurred" in blurred
    far = refusal(shot(named, distance_m=3.5), named)
    covered = shot(named)
    covered[:, :575] = 128
    covered[:, 700:] = 128
    covered[430:] = 128
    for said in (far, refusal(covered, named)):
        assert "--board charuco" not in said
        assert "mirrored" not in said
        assert "DICT_4X4_250" not in said


def test_a_board_of_an_odd_number_of_rows_has_one_layout() -> None:
    words = WORDS.replace("8x6", "8x5")
    old = board(f"{words}:legacy")
    assert not old.begins_white
    assert len(find_board(photo_of(shot(board(words))), old).ids) == 28


def test_another_number_of_markers_does_not_hide_the_layout() -> None:
    """A marker read where none is does not decide, nor one that is missing."""
    printed = board(OLD)
    image = shot(printed)
    pose = pose_before(printed, 0.4, tilt=0.4, azimuth=1.0, turn=0.2)
    for marker in (0, 7, 20):
        middle = lens().sees(printed.marker_corners(marker)[:, :2], pose).mean(axis=0).astype(int)
        image[middle[1] - 8 : middle[1] + 8, middle[0] - 8 : middle[0] + 8] = 0
    assert "before 4.6" in refusal(image, replace(printed, legacy=False))
