"""Printed targets as layers: a white sheet and what is black on it."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scissorcal.vision.sim.lens import Pose
from scissorcal.vision.sim.photograph import Layer
from scissorcal.vision.targets.boards import (
    Board,
    CharucoBoard,
    Chessboard,
    MarkerBoard,
    dictionary,
)

Array = NDArray[np.float64]

PAPER, INK = 0.85, 0.04


def target_layers(
    board: Board,
    pose: Pose,
    *,
    margin_m: float = 0.012,
    print_scale: tuple[float, float] = (1.0, 1.0),
    ids: Sequence[int] | None = None,
) -> list[Layer]:
    """The sheet and its ink. ``print_scale`` is the printer's error, by axis; ``ids`` leaves out
    all other markers."""
    scale = np.asarray(print_scale)
    sheet = _rectangle(-margin_m, -margin_m, board.width_m + margin_m, board.height_m + margin_m)
    ink = [outline * scale for outline in _ink(board, ids)]
    return [Layer([sheet], pose, PAPER), Layer(ink, pose, INK)]


def _ink(board: Board, ids: Sequence[int] | None) -> list[Array]:
    if isinstance(board, Chessboard):
        size = board.square_m
        return [
            _rectangle(c * size, r * size, (c + 1) * size, (r + 1) * size)
            for r in range(board.rows + 1)
            for c in range(board.columns + 1)
            if (r + c) % 2 == 0
        ]
    shown = [marker for marker in board.ids if ids is None or marker in ids]
    ink = [part for marker in shown for part in _marker(board, marker)]
    if isinstance(board, CharucoBoard):
        ink += _black_squares(board)
    return ink


def _black_squares(board: CharucoBoard) -> list[Array]:
    size = board.square_m
    middles = np.array([board.marker_corners(marker).mean(axis=0)[:2] for marker in board.ids])
    white = {(int(x // size), int(y // size)) for x, y in middles}
    return [
        _rectangle(c * size, r * size, (c + 1) * size, (r + 1) * size)
        for r in range(board.rows)
        for c in range(board.columns)
        if (c, r) not in white
    ]


def _marker(board: CharucoBoard | MarkerBoard, marker: int) -> list[Array]:
    """The black modules of one marker, row by row merged to bars."""
    import cv2

    chosen = dictionary(board.dictionary)
    side = int(chosen.markerSize) + 2
    modules = cv2.aruco.generateImageMarker(chosen, marker, side) < 128
    corners = board.marker_corners(marker)[:, :2]
    right, down = (corners[1] - corners[0]) / side, (corners[3] - corners[0]) / side
    bars = []
    for row in range(side):
        borders = np.flatnonzero(np.diff(modules[row].astype(np.int8), prepend=0, append=0))
        for first, last in borders.reshape(-1, 2):
            origin = corners[0] + row * down
            bars.append(
                np.array(
                    [
                        origin + first * right,
                        origin + last * right,
                        origin + last * right + down,
                        origin + first * right + down,
                    ]
                )
            )
    return bars


def _rectangle(left: float, top: float, right: float, bottom: float) -> Array:
    return np.array([[left, top], [right, top], [right, bottom], [left, bottom]])
