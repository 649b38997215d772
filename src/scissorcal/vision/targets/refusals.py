"""Why a target was not found in a photograph: a sentence with the remedy.

Where its markers are readable, the picture and its mirrored and inverted copies are searched for
them, and where these lie is compared with the named layout, the layout of OpenCV before 4.6,
columns and rows swapped, and other numbers of columns.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.vision.photo import Photo, Picture
from scissorcal.vision.targets.boards import (
    DICTIONARY,
    TARGETS,
    Board,
    CharucoBoard,
    Chessboard,
    MarkedBoard,
    dictionary,
    targets_of,
    words_of_board,
)

LEAST_MARKERS = 4
"""Four markers have 32 coordinates for the 8 unknowns of a homography, and span an area."""

WITHIN_SQUARES = 0.5
"""A corner nearer than this to its place is nearer to it than to the same corner of any other
marker, which lies at least a square away."""

LEAST_SHARE = 0.75
"""Of the markers that have to fit, so that what is read as a marker and is none does not decide.
With an even number of columns the layout of the other age fits every second row, half of the
markers, and this is half way to all; with an odd number it fits most: the better fit decides."""

_SEARCHES = 200
"""Of four corners by RANSAC: at that share one of 200 has no stray with a chance of 1 - 1e-33."""

MOST_COLUMNS = 40


class _Markers(NamedTuple):
    """Markers of a picture: numbers (n,) and corners (n, 4, 2) in pixels."""

    ids: NDArray[np.int64]
    corners: Array


BLURRED_PX = 2.5
"""A picture is blurred if its sharpest edge has a larger standard deviation."""

_LEAST_SIDE_PX = 200
_REDUCED_PX = 1000
_OTHERS = ("DICT_4X4_250", "DICT_6X6_250", "DICT_7X7_250", "DICT_ARUCO_ORIGINAL")
_APRIL = ("DICT_APRILTAG_36h11",)


def no_board_sentence(photo: Photo, board: Board, corners: int, least: int) -> str:
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
    if not corners and (misread := _misread_sentence(grey, board, name)):
        return misread
    other = _other_target(grey, board)
    if other and not corners:
        return f"{name} shows {other}, not the {board.name}: {_use(board)}."
    blur = _sharpest_edge_px(photo.grey)
    if np.isinf(blur):
        return f"{name} is of one shade: uncover the lens, and show the {board.name} in good light."
    if blur > BLURRED_PX:
        return (
            f"{name} is too blurred: its sharpest edges are {2.56 * blur:.0f} px wide. Focus on "
            f"the {board.name}, hold the camera still and give more light."
        )
    if not corners and not isinstance(board, Chessboard) and _plain_chessboard(grey, board):
        return f"{name} shows a plain chessboard, not the {board.name}: {_use(board)}."
    if corners:
        return (
            f"{name} shows {corners} corners of the {board.name}; {least} are needed. Show the "
            "whole board at 40 px per square or more, without glare or fingers."
        )
    if isinstance(board, Chessboard):
        return (
            f"{name} shows no chessboard of {board.columns} x {board.rows} inner corners: show "
            "the whole board with its white border, and check the number of corners."
        )
    if count := _markers_seen(grey, board):
        return (
            f"{name} shows {count} markers of the {board.name}, but too few, or not where that has "
            "them: show the whole board, and check its columns, rows and marker numbers."
        )
    return (
        f"{name} shows no marker of the {board.name} ({board.dictionary} {board.ids[0]}-"
        f"{board.ids[-1]}): show it sharply at 40 px per square or more."
    )


def _sharpest_edge_px(grey: Picture) -> float:
    """Standard deviation in pixels of the blur of the sharpest edges of a picture.

    A step blurred by a Gaussian has a steepest slope of its height over sqrt(2 pi) times its
    standard deviation; heights and slopes are taken from the picture's extremes. Infinite for a
    picture of one shade.
    """
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
    zoom = _REDUCED_PX / max(grey.shape)
    if zoom >= 1.0:
        return grey
    size = (round(grey.shape[1] * zoom), round(grey.shape[0] * zoom))
    return np.asarray(cv2.resize(grey, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)


def _other_target(grey: Picture, board: Board) -> str | None:
    """Name another target, or markers of another dictionary, in the picture."""

    def ids_of(name: str) -> list[int]:
        _, ids, _ = cv2.aruco.ArucoDetector(dictionary(name)).detectMarkers(grey)
        return [] if ids is None else [int(marker) for marker in np.ravel(ids)]

    dictionary_name = getattr(board, "dictionary", None)
    counts = targets_of(ids_of(DICTIONARY))
    counts.pop(board.name, None)
    if counts and (board in TARGETS or not _share_markers(dictionary_name, DICTIONARY)):
        return f"the {next(iter(counts))}"
    if dictionary_name is not None and dictionary_name != DICTIONARY:
        wrong = [
            marker for marker in ids_of(dictionary_name) if marker not in getattr(board, "ids", ())
        ]
        if wrong:
            return f"markers of {dictionary_name} with other numbers ({min(wrong)}-{max(wrong)})"
    for name in (*_OTHERS, *_APRIL):
        if not _share_markers(dictionary_name, name) and len(ids_of(name)) >= 2:
            return f"markers of {name}"
    return None


def _share_markers(first_name: str | None, second_name: str) -> bool:
    """Whether two dictionaries begin with the same markers, as DICT_4X4_50 and DICT_4X4_250."""
    if first_name is None:
        return False
    first, second = dictionary(first_name).bytesList, dictionary(second_name).bytesList
    shared = min(len(first), len(second))
    return first.shape[1:] == second.shape[1:] and bool(np.all(first[:shared] == second[:shared]))


def _plain_chessboard(grey: Picture, board: Board) -> bool:
    """Whether the picture shows a chessboard other than the board with its markers unread."""
    inner = (board.columns - 1, board.rows - 1) if isinstance(board, CharucoBoard) else None
    sizes = ((9, 6), (8, 6), (7, 6), (8, 5), (7, 5), (6, 5), (6, 4), (7, 4))
    return any(
        cv2.findChessboardCorners(grey, size, flags=cv2.CALIB_CB_FAST_CHECK)[0]
        for size in sizes
        if size not in (inner, inner and inner[::-1])
    )


def _use(board: Board) -> str:
    if board in TARGETS:
        return "photograph that one ('scissorcal target' prints it)"
    if isinstance(board, CharucoBoard):
        return "photograph that one, or name the board that was photographed with --board"
    return "photograph that one"


def _misread_sentence(grey: Picture, board: Board, name: str) -> str | None:
    """What of the named board does not fit the picture ``name``; None where that is unknown.

    A right board that is too small, blurred or covered has other causes: None.
    """
    if board.kind == "chessboard":
        return None
    for looks, remedy, picture in _copies(grey):
        markers = _seen(picture, board)
        layout = _layout(markers, board)
        if layout == board and not looks:
            return None
        if layout is not None:
            return f"{name} shows the {board.name} {_what(looks, remedy, board, layout)}."
    return None


def _markers_seen(grey: Picture, board: MarkedBoard) -> int:
    """How many markers with numbers of the board a picture shows."""
    return len(_seen(grey, board).ids)


def _copies(grey: Picture) -> Iterator[tuple[str, str, Picture]]:
    """The picture, mirrored, inverted, and both: in words, with the remedy."""
    mirror = "turn off the camera's mirror image, or print the board the right way round"
    negative = "print it black on white, or save the picture as a positive"
    yield "", "", grey
    flipped = np.ascontiguousarray(grey[:, ::-1])
    yield "mirrored", mirror, flipped
    yield "with black and white swapped", negative, 255 - grey
    yield "mirrored, with black and white swapped", f"{mirror}; {negative}", 255 - flipped


def _seen(grey: Picture, board: MarkedBoard) -> _Markers:
    """Markers of the board's dictionary; of a target of scissorcal its own numbers alone."""
    corners, ids, _ = cv2.aruco.ArucoDetector(dictionary(board.dictionary)).detectMarkers(grey)
    numbers = np.zeros(0, np.int64) if ids is None else np.asarray(ids, dtype=np.int64).ravel()
    places = np.array(corners, dtype=np.float64).reshape(-1, 4, 2)
    of_board = np.isin(numbers, board.ids) if board in TARGETS else numbers >= 0
    return _Markers(numbers[of_board], places[of_board])


def _layout(markers: _Markers, board: MarkedBoard) -> MarkedBoard | None:
    """The layout that most markers fit; the named one of several, and None of several others."""
    least = max(LEAST_MARKERS, LEAST_SHARE * len(markers.ids))
    if len(markers.ids) < least:
        return None
    named: list[MarkedBoard] = [board]
    square_board = board if isinstance(board, CharucoBoard) and board not in TARGETS else None
    if square_board is not None:
        named += _same_squares(square_board)
    counts = [(_fitting(markers, layout), layout) for layout in named]
    if square_board is not None and max(count for count, _ in counts) < len(markers.ids):
        counts += [
            (_fitting(markers, layout), layout) for layout in _other_columns(markers, square_board)
        ]
    most = max(count for count, _ in counts)
    best = [layout for count, layout in counts if count == most]
    known = [layout for layout in best if layout in named]
    if most < least:
        return None
    if board in best:
        return board
    return known[0] if len(known) == 1 else best[0] if len(best) == 1 else None


def _same_squares(board: CharucoBoard) -> Iterator[CharucoBoard]:
    """The layout of the other age, and both with columns and rows swapped; each once."""
    turned = replace(board, columns=board.rows, rows=board.columns)
    if board.rows % 2 == 0:
        yield replace(board, legacy=not board.legacy)
    if board.columns == board.rows:
        return
    yield turned
    if turned.rows % 2 == 0:
        yield replace(turned, legacy=not turned.legacy)


def _other_columns(markers: _Markers, board: CharucoBoard) -> Iterator[CharucoBoard]:
    """Boards of other numbers of columns, with as many rows as the largest number needs."""
    if not len(markers.ids):
        return
    needed = int(markers.ids.max()) - board.first_id + 1
    for columns in range(3, MOST_COLUMNS + 1):
        if columns in (board.columns, board.rows):
            continue
        rows = -(-2 * needed // columns)
        even = rows + rows % 2
        yield replace(board, columns=columns, rows=even, legacy=False)
        yield replace(board, columns=columns, rows=even, legacy=True)


def _fitting(markers: _Markers, board: MarkedBoard) -> int:
    """How many markers one homography brings to their places on the board."""
    places = dict(zip(board.ids, _marker_places(board), strict=False))
    has = [int(number) in places for number in markers.ids]
    if sum(has) < LEAST_MARKERS:
        return 0
    wanted = np.concatenate([places[int(number)] for number in markers.ids[has]])
    pitch = board.square_m if isinstance(board, CharucoBoard) else board.marker_m
    within = WITHIN_SQUARES * pitch
    corners = markers.corners[has].reshape(-1, 2)
    matrix, _ = cv2.findHomography(corners, wanted, cv2.RANSAC, within, maxIters=_SEARCHES)
    if np.shape(matrix) != (3, 3):
        return 0
    mapped = cv2.perspectiveTransform(corners[None], np.asarray(matrix))[0]
    off = np.linalg.norm(mapped - wanted, axis=1).reshape(-1, 4).max(axis=1)
    return int(np.sum(off < within))


def _marker_places(board: MarkedBoard) -> list[Array]:
    """Corners (4, 2) of each marker, in the order of its numbers."""
    if isinstance(board, CharucoBoard):
        outlines = board.as_opencv().getObjPoints()
        return [np.asarray(outline, dtype=np.float64)[:, :2] for outline in outlines]
    return [board.marker_corners(outline)[:, :2] for outline in board.ids]


def _what(looks: str, remedy: str, board: MarkedBoard, layout: MarkedBoard) -> str:
    """What was found instead, and what to do."""
    if layout == board or not isinstance(layout, CharucoBoard) or board.kind != "charuco":
        return f"{looks}: {remedy}"
    words = words_of_board(layout)
    name = f"name it --board {words}"
    if layout.columns not in (board.columns, board.rows):
        rows = words.replace(f"x{layout.rows}:", "xROWS:", 1)
        layout_words = (
            f"with {layout.columns} columns of squares: count its rows, and name it --board {rows}"
        )
    elif layout.columns != board.columns:
        layout_words = f"with {layout.columns} columns and {layout.rows} rows, not as named: {name}"
    elif layout.legacy:
        layout_words = f"as OpenCV before 4.6 drew it: {name}"
    else:
        layout_words = f"as OpenCV draws it since 4.6: {name}"
    return f"{looks}, and {layout_words}; {remedy}" if looks else layout_words
