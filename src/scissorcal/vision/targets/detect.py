"""Detect a target in a photograph: its corners with subpixel accuracy, or why it is missing."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array, Integers
from scissorcal.errors import InputError
from scissorcal.vision.photo import Photo, Picture
from scissorcal.vision.targets.boards import (
    Board,
    CharucoBoard,
    Chessboard,
    MarkedBoard,
    MarkerBoard,
    dictionary,
)
from scissorcal.vision.targets.marker_corners import refine_marker_corners
from scissorcal.vision.targets.refusals import no_board_sentence

LEAST_CORNERS = 6
"""Least number of corners that determine a chessboard's pose."""

SMALL_PX = 40.0
"""Squares below this size are found less often, especially when blurred."""

_WINDOW_SHARE = 0.2


@dataclass(frozen=True)
class Markers:
    """Markers of one dictionary in a picture.

    ``corners`` (n, 4, 2) in pixels, clockwise from the upper left as printed; ``sharp`` (n,) says
    whether they were measured by their sides (to about 0.03 px) or coarsely (1 px).
    """

    ids: Integers
    corners: Array
    sharp: NDArray[np.bool_]


@dataclass(frozen=True)
class Detection:
    """A target as one photograph shows it.

    Row k of ``pixels`` (n, 2), in the whole photograph, is ``board.points[ids[k]]``. ``square_px``
    is the median length of a square's (or a marker's) side there.
    """

    board: Board
    ids: Integers
    pixels: Array
    square_px: float

    @property
    def points(self) -> Array:
        """Places (n, 3) of the corners in the board's frame, metres."""
        return np.asarray(self.board.points[self.ids])

    @property
    def px_per_m(self) -> float:
        """Pixels to a metre of the board."""
        board = self.board
        return self.square_px / (board.marker_m if board.kind == "markers" else board.square_m)


def find_board(
    photo: Photo, board: Board, *, window_px: int | None = None, explain: bool = True
) -> Detection:
    """Find a board's corners in a photograph.

    ChArUco boards and marker boards may be seen in part. ``window_px`` is half the side of the
    window in which a plain chessboard's corners are refined; None takes a fifth of each corner's
    smallest square, since a window that reaches into the next square pulls its corner away.

    Raises InputError with what the photograph shows instead: nothing, another target, too few
    corners, squares too small or too blurred. With ``explain`` False, as for a video's frames, the
    message has no explanation.
    """
    if isinstance(board, Chessboard):
        ids, pixels = _chessboard(photo.grey, board, window_px)
    elif isinstance(board, CharucoBoard):
        ids, pixels = _charuco(photo.grey, board)
    else:
        ids, pixels = _marker_board(photo.grey, board)
    least = 4 if isinstance(board, MarkerBoard) else LEAST_CORNERS
    if len(ids) < least:
        raise InputError(
            no_board_sentence(photo, board, len(ids), least)
            if explain
            else f"{photo.source} does not show the {board.name}."
        )
    whole = photo.whole(pixels)
    return Detection(board, ids, whole, _side_px(board, ids, whole))


def find_any_board(photo: Photo, boards: Sequence[Board], *, explain: bool = True) -> Detection:
    """Find the first of several boards that a photograph shows.

    Raises InputError as `find_board` does for the last one, where none is seen.
    """
    for board in boards[:-1]:
        try:
            return find_board(photo, board, explain=False)
        except InputError:
            continue
    return find_board(photo, boards[-1], explain=explain)


def find_markers(grey: Picture, dictionary_name: str, board: MarkedBoard | None = None) -> Markers:
    """Find every marker of a dictionary; ``board`` helps to find more of its markers.

    Markers are read with twice the default pixels per cell, which finds those blurred by half a
    cell; corners are then measured from the markers' sides.
    """
    import cv2

    detector = cv2.aruco.ArucoDetector(dictionary(dictionary_name), _reading())
    corners, ids, rejected = detector.detectMarkers(grey)
    if board is not None and ids is not None and len(ids) >= 2 and len(rejected):
        layout = cv2.aruco.Board(
            [board.marker_corners(marker).astype(np.float32) for marker in board.ids],
            dictionary(board.dictionary),
            np.array(board.ids),
        )
        corners, ids, _, _ = detector.refineDetectedMarkers(grey, layout, corners, ids, rejected)
    if ids is None or not len(ids):
        return Markers(np.zeros(0, np.int64), np.zeros((0, 4, 2)), np.zeros(0, np.bool_))
    rough = np.array([corner.reshape(4, 2) for corner in corners], dtype=np.float64)
    cells = int(dictionary(dictionary_name).markerSize) + 2
    fine, sharp = refine_marker_corners(grey, rough, 1.0 / cells)
    return Markers(np.asarray(ids, dtype=np.int64).ravel(), fine, sharp)


def _reading() -> Any:
    import cv2

    settings = cv2.aruco.DetectorParameters()
    settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
    settings.perspectiveRemovePixelPerCell = 8
    settings.perspectiveRemoveIgnoredMarginPerCell = 0.25
    return settings


def _charuco(grey: Picture, board: CharucoBoard) -> tuple[Integers, Array]:
    import cv2

    settings = cv2.aruco.CharucoParameters()
    settings.tryRefineMarkers = True
    detector = cv2.aruco.CharucoDetector(
        board.as_opencv(), settings, _reading(), cv2.aruco.RefineParameters()
    )
    corners, ids, _, _ = detector.detectBoard(grey)
    if ids is None or not len(ids):
        return np.zeros(0, np.int64), np.zeros((0, 2))
    pixels = np.asarray(corners, dtype=np.float64).reshape(-1, 2)
    return np.asarray(ids, dtype=np.int64).ravel(), pixels


def _marker_board(grey: Picture, board: MarkerBoard) -> tuple[Integers, Array]:
    seen = find_markers(grey, board.dictionary, board)
    own = np.isin(seen.ids, board.ids) & seen.sharp
    first = 4 * (seen.ids[own] - board.first_id)
    ids = (first[:, None] + np.arange(4)).ravel()
    return ids, seen.corners[own].reshape(-1, 2)


def _chessboard(grey: Picture, board: Chessboard, window_px: int | None) -> tuple[Integers, Array]:
    import cv2

    size = (board.columns, board.rows)
    flags = cv2.CALIB_CB_ADAPTIVE_THRESH | cv2.CALIB_CB_NORMALIZE_IMAGE
    found, corners = cv2.findChessboardCorners(grey, size, flags=flags)
    if not found:
        found, corners = cv2.findChessboardCornersSB(grey, size, flags=cv2.CALIB_CB_NORMALIZE_IMAGE)
    if not found:
        return np.zeros(0, np.int64), np.zeros((0, 2))
    rough = np.asarray(corners, dtype=np.float64).reshape(board.rows, board.columns, 2)
    windows = _windows(rough, window_px)
    refined = [
        _refined(grey, corner, int(window))
        for corner, window in zip(rough.reshape(-1, 2), windows.ravel(), strict=True)
    ]
    return np.arange(board.columns * board.rows), np.array(refined)


def _windows(corners: Array, window_px: int | None) -> Array:
    """Half sides (rows, columns) of the windows in which corners are refined."""
    if window_px is not None:
        return np.full(corners.shape[:2], window_px)
    across = np.linalg.norm(np.diff(corners, axis=1), axis=2)
    down = np.linalg.norm(np.diff(corners, axis=0), axis=2)
    nearest = np.minimum(
        np.minimum(
            np.pad(across, ((0, 0), (1, 0)), "edge"), np.pad(across, ((0, 0), (0, 1)), "edge")
        ),
        np.minimum(np.pad(down, ((1, 0), (0, 0)), "edge"), np.pad(down, ((0, 1), (0, 0)), "edge")),
    )
    return np.asarray(np.clip(np.floor(_WINDOW_SHARE * nearest), 2, 12))


def _refined(grey: Picture, corner: Array, window: int) -> Array:
    import cv2

    criteria = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, 50, 1e-4)
    given = corner.astype(np.float32).reshape(1, 1, 2)
    found = cv2.cornerSubPix(grey, given, (window, window), (-1, -1), criteria)
    return np.asarray(found, dtype=np.float64).reshape(2)


def _side_px(board: Board, ids: Integers, pixels: Array) -> float:
    """Median length in pixels of a square's (or marker's) side."""
    if isinstance(board, MarkerBoard):
        quads = pixels.reshape(-1, 4, 2)
        return float(np.median(np.linalg.norm(np.roll(quads, -1, axis=1) - quads, axis=2)))
    columns = board.columns - 1 if isinstance(board, CharucoBoard) else board.columns
    place = {int(name): pixel for name, pixel in zip(ids, pixels, strict=True)}
    sides = [
        np.linalg.norm(place[name + step] - pixel)
        for name, pixel in place.items()
        for step in (1, columns)
        if name + step in place and (step > 1 or (name + 1) % columns)
    ]
    return float(np.median(sides)) if sides else float("nan")
