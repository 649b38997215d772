"""Why a board whose markers are readable was not found: another layout, a mirrored picture.

The picture and its mirrored and inverted copies are searched for the board's markers, and where
these lie is compared with the named layout, the layout of OpenCV before 4.6, columns and rows
swapped, and other numbers of columns.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.vision.photo import Picture
from scissorcal.vision.targets.board_words import words_of_board
from scissorcal.vision.targets.boards import (
    TARGETS,
    Board,
    CharucoBoard,
    MarkedBoard,
    dictionary,
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


@dataclass(frozen=True)
class Seen:
    """Markers of a picture: numbers (n,) and corners (n, 4, 2) in pixels."""

    ids: NDArray[np.int64]
    corners: Array


def misread_sentence(grey: Picture, board: Board, name: str) -> str | None:
    """What of the named board does not fit the picture ``name``; None where that is unknown.

    A right board that is too small, blurred or covered has other causes: None.
    """
    if board.kind == "chessboard":
        return None
    for looks, remedy, picture in _copies(grey):
        seen = _seen(picture, board)
        layout = _layout(seen, board)
        if layout == board and not looks:
            return None
        if layout is not None:
            return f"{name} shows the {board.name} {_what(looks, remedy, board, layout)}."
    return None


def markers_seen(grey: Picture, board: MarkedBoard) -> int:
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


def _seen(grey: Picture, board: MarkedBoard) -> Seen:
    """Markers of the board's dictionary; of a target of scissorcal its own numbers alone."""
    import cv2

    corners, ids, _ = cv2.aruco.ArucoDetector(dictionary(board.dictionary)).detectMarkers(grey)
    found = np.zeros(0, np.int64) if ids is None else np.asarray(ids, dtype=np.int64).ravel()
    places = np.array(corners, dtype=np.float64).reshape(-1, 4, 2)
    own = np.isin(found, board.ids) if board in TARGETS else found >= 0
    return Seen(found[own], places[own])


def _layout(seen: Seen, board: MarkedBoard) -> MarkedBoard | None:
    """The layout that most markers fit; the named one of several, and None of several others."""
    least = max(LEAST_MARKERS, LEAST_SHARE * len(seen.ids))
    if len(seen.ids) < least:
        return None
    named: list[MarkedBoard] = [board]
    own = board if isinstance(board, CharucoBoard) and board not in TARGETS else None
    if own is not None:
        named += _same_squares(own)
    counts = [(_fitting(seen, one), one) for one in named]
    if own is not None and max(count for count, _ in counts) < len(seen.ids):
        counts += [(_fitting(seen, one), one) for one in _other_columns(seen, own)]
    most = max(count for count, _ in counts)
    best = [one for count, one in counts if count == most]
    known = [one for one in best if one in named]
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


def _other_columns(seen: Seen, board: CharucoBoard) -> Iterator[CharucoBoard]:
    """Boards of other numbers of columns, with as many rows as the largest number needs."""
    if not len(seen.ids):
        return
    needed = int(seen.ids.max()) - board.first_id + 1
    for columns in range(3, MOST_COLUMNS + 1):
        if columns in (board.columns, board.rows):
            continue
        rows = -(-2 * needed // columns)
        even = rows + rows % 2
        yield replace(board, columns=columns, rows=even, legacy=False)
        yield replace(board, columns=columns, rows=even, legacy=True)


def _fitting(seen: Seen, board: MarkedBoard) -> int:
    """How many markers one homography brings to their places on the board."""
    import cv2

    places = dict(zip(board.ids, _marker_places(board), strict=False))
    has = [int(one) in places for one in seen.ids]
    if sum(has) < LEAST_MARKERS:
        return 0
    wanted = np.concatenate([places[int(one)] for one in seen.ids[has]])
    pitch = board.square_m if isinstance(board, CharucoBoard) else board.marker_m
    within = WITHIN_SQUARES * pitch
    found = seen.corners[has].reshape(-1, 2)
    matrix, _ = cv2.findHomography(found, wanted, cv2.RANSAC, within, maxIters=_SEARCHES)
    if np.shape(matrix) != (3, 3):
        return 0
    mapped = cv2.perspectiveTransform(found[None], np.asarray(matrix))[0]
    off = np.linalg.norm(mapped - wanted, axis=1).reshape(-1, 4).max(axis=1)
    return int(np.sum(off < within))


def _marker_places(board: MarkedBoard) -> list[Array]:
    """Corners (4, 2) of each marker, in the order of its numbers."""
    if isinstance(board, CharucoBoard):
        found = board.as_opencv().getObjPoints()
        return [np.asarray(one, dtype=np.float64)[:, :2] for one in found]
    return [board.marker_corners(one)[:, :2] for one in board.ids]


def _what(looks: str, remedy: str, board: MarkedBoard, layout: MarkedBoard) -> str:
    """What was found instead, and what to do."""
    if layout == board or not isinstance(layout, CharucoBoard) or board.kind != "charuco":
        return f"{looks}: {remedy}"
    words = words_of_board(layout)
    name = f"name it --board {words}"
    if layout.columns not in (board.columns, board.rows):
        rows = words.replace(f"x{layout.rows}:", "xROWS:", 1)
        found = (
            f"with {layout.columns} columns of squares: count its rows, and name it --board {rows}"
        )
    elif layout.columns != board.columns:
        found = f"with {layout.columns} columns and {layout.rows} rows, not as named: {name}"
    elif layout.legacy:
        found = f"as OpenCV before 4.6 drew it: {name}"
    else:
        found = f"as OpenCV draws it since 4.6: {name}"
    return f"{looks}, and {found}; {remedy}" if looks else found
