"""Why a target was not found in a photograph: a sentence with the remedy."""

import numpy as np

from scissorcal.vision.photo import Photo, Picture
from scissorcal.vision.targets.boards import (
    DICTIONARY,
    TARGETS,
    Board,
    CharucoBoard,
    Chessboard,
    dictionary,
    targets_of,
)
from scissorcal.vision.targets.misread import markers_seen, misread_sentence

BLURRED_PX = 2.5
"""A picture is blurred if its sharpest edge has a larger standard deviation."""

_LEAST_SIDE_PX = 200
_REDUCED_PX = 1000
_OTHERS = ("DICT_4X4_250", "DICT_6X6_250", "DICT_7X7_250", "DICT_ARUCO_ORIGINAL")
_APRIL = ("DICT_APRILTAG_36h11",)


def no_board_sentence(photo: Photo, board: Board, found: int, least: int) -> str:
    """Sentence that says what a photograph shows instead of ``board``.

    The board in another layout, mirrored or inverted; another target of scissorcal, markers of
    another dictionary, too few corners, a picture too small or too blurred, or nothing.
    """
    grey = _reduced(photo.grey)
    name = photo.source
    if min(photo.width, photo.height) < _LEAST_SIDE_PX:
        return (
            f"{name} has only {photo.width} x {photo.height} pixels: take photographs of at least "
            "640 x 480."
        )
    if not found and (misread := misread_sentence(grey, board, name)):
        return misread
    other = _other_target(grey, board)
    if other and not found:
        return f"{name} shows {other}, not the {board.name}: {_use(board)}."
    blur = sharpest_edge_px(photo.grey)
    if blur > BLURRED_PX:
        return (
            f"{name} is too blurred: its sharpest edges are {2.56 * blur:.0f} px wide. Focus on "
            f"the {board.name}, hold the camera still and give more light."
        )
    if not found and not isinstance(board, Chessboard) and _plain_chessboard(grey, board):
        return f"{name} shows a plain chessboard, not the {board.name}: {_use(board)}."
    if found:
        return (
            f"{name} shows {found} corners of the {board.name}; {least} are needed. Show the whole "
            "board at 40 px per square or more, without glare or fingers."
        )
    if isinstance(board, Chessboard):
        return (
            f"{name} shows no chessboard of {board.columns} x {board.rows} inner corners: show "
            "the whole board with its white border, and check the number of corners."
        )
    if count := markers_seen(grey, board):
        return (
            f"{name} shows {count} markers of the {board.name}, but too few, or not where that has "
            "them: show the whole board, and check its columns, rows and marker numbers."
        )
    return (
        f"{name} shows no marker of the {board.name} ({board.dictionary} {board.ids[0]}-"
        f"{board.ids[-1]}): show it sharply at 40 px per square or more."
    )


def sharpest_edge_px(grey: Picture) -> float:
    """Standard deviation in pixels of the blur of the sharpest edges of a picture.

    A step blurred by a Gaussian has a steepest slope of its height over sqrt(2 pi) times its
    standard deviation; heights and slopes are taken from the picture's extremes. Infinite for a
    picture of one shade.
    """
    import cv2

    smooth = cv2.GaussianBlur(grey.astype(np.float32), (0, 0), 1.0)
    low, high = np.percentile(smooth, [2.0, 98.0])
    slope = np.hypot(cv2.Sobel(smooth, cv2.CV_32F, 1, 0), cv2.Sobel(smooth, cv2.CV_32F, 0, 1)) / 8.0
    steepest = float(np.percentile(slope, 99.8))
    if high - low < 8.0 or steepest <= 0.0:
        return float("inf")
    total = float(high - low) / (np.sqrt(2.0 * np.pi) * steepest)
    return float(np.sqrt(max(total**2 - 1.0, 0.0)))


def _reduced(grey: Picture) -> Picture:
    """A reduced picture, in which many searches are fast."""
    import cv2

    zoom = _REDUCED_PX / max(grey.shape)
    if zoom >= 1.0:
        return grey
    size = (round(grey.shape[1] * zoom), round(grey.shape[0] * zoom))
    return np.asarray(cv2.resize(grey, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)


def _other_target(grey: Picture, board: Board) -> str | None:
    """Name another target, or markers of another dictionary, in the picture."""
    import cv2

    def ids_of(name: str) -> list[int]:
        _, ids, _ = cv2.aruco.ArucoDetector(dictionary(name)).detectMarkers(grey)
        return [] if ids is None else [int(marker) for marker in np.ravel(ids)]

    own = getattr(board, "dictionary", None)
    counts = targets_of(ids_of(DICTIONARY))
    counts.pop(board.name, None)
    if counts and (board in TARGETS or not _share_markers(own, DICTIONARY)):
        return f"the {next(iter(counts))}"
    if own is not None and own != DICTIONARY:
        wrong = [marker for marker in ids_of(own) if marker not in getattr(board, "ids", ())]
        if wrong:
            return f"markers of {own} with other numbers ({min(wrong)}-{max(wrong)})"
    for name in (*_OTHERS, *_APRIL):
        if not _share_markers(own, name) and len(ids_of(name)) >= 2:
            return f"markers of {name}"
    return None


def _share_markers(one: str | None, other: str) -> bool:
    """Whether two dictionaries begin with the same markers, as DICT_4X4_50 and DICT_4X4_250."""
    if one is None:
        return False
    first, second = dictionary(one).bytesList, dictionary(other).bytesList
    shared = min(len(first), len(second))
    return first.shape[1:] == second.shape[1:] and bool(np.all(first[:shared] == second[:shared]))


def _plain_chessboard(grey: Picture, board: Board) -> bool:
    """Whether the picture shows a chessboard other than the board with its markers unread."""
    import cv2

    own = (board.columns - 1, board.rows - 1) if isinstance(board, CharucoBoard) else None
    sizes = ((9, 6), (8, 6), (7, 6), (8, 5), (7, 5), (6, 5), (6, 4), (7, 4))
    return any(
        cv2.findChessboardCorners(grey, size, flags=cv2.CALIB_CB_FAST_CHECK)[0]
        for size in sizes
        if size not in (own, own and own[::-1])
    )


def _use(board: Board) -> str:
    if board in TARGETS:
        return "photograph that one ('scissorcal target' prints it)"
    if isinstance(board, CharucoBoard):
        return "photograph that one, or name the board that was photographed with --board"
    return "photograph that one"
