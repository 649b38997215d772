"""Printed targets as layers: a white sheet and the ink on it."""

from collections.abc import Sequence

import numpy as np

from scissorcal.aliases import Array
from scissorcal.vision.sim.lens import SimPose
from scissorcal.vision.sim.photograph import PaintLayer
from scissorcal.vision.targets.boards import Board, Chessboard
from scissorcal.vision.targets.sheet import board_ink

PAPER, INK = 0.85, 0.04


def target_layers(
    board: Board,
    pose: SimPose,
    *,
    margin_m: float = 0.012,
    print_scale: tuple[float, float] = (1.0, 1.0),
    ids: Sequence[int] | None = None,
) -> list[PaintLayer]:
    """The sheet and its ink. ``print_scale`` is the printer's scale error by axis; ``ids`` leaves
    out all other markers."""
    scale = np.asarray(print_scale)
    sheet = _rectangle(-margin_m, -margin_m, board.width_m + margin_m, board.height_m + margin_m)
    ink = [outline * scale for outline in _ink(board, ids)]
    return [PaintLayer([sheet], pose, PAPER), PaintLayer(ink, pose, INK)]


def _ink(board: Board, ids: Sequence[int] | None) -> list[Array]:
    if isinstance(board, Chessboard):
        size = board.square_m
        return [
            _rectangle(c * size, r * size, (c + 1) * size, (r + 1) * size)
            for r in range(board.rows + 1)
            for c in range(board.columns + 1)
            if (r + c) % 2 == 0
        ]
    return [
        1e-3 * _rectangle(part.x, part.y, part.x + part.width, part.y + part.height)
        for part in board_ink(board, ids=ids)
    ]


def _rectangle(left: float, top: float, right: float, bottom: float) -> Array:
    return np.array([[left, top], [right, top], [right, bottom], [left, bottom]])
