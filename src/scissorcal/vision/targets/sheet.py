"""The printed sheets: boards at true scale, with rulers to check the printer."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from scissorcal.vision.targets.boards import (
    BLADE_MAT,
    CAMERA_BOARD,
    MAT_PIVOT_M,
    PLATE_BOARD,
    PLATE_STRIP,
    RIG_MARKERS,
    CharucoBoard,
    MarkedBoard,
    dictionary,
)

Paper = Literal["A4", "Letter"]
SheetName = Literal["camera", "blade", "plate"]

PAPER_MM: dict[Paper, tuple[float, float]] = {"A4": (297.0, 210.0), "Letter": (279.4, 215.9)}
"""Width and height of a sheet that lies on its long side."""

RULERS_MM = (200.0, 150.0)
"""Lengths of the ruler below and of the one at the left."""
_PIVOT_GREY = 0.6


@dataclass(frozen=True)
class Rectangle:
    """A filled rectangle in mm from the sheet's upper left corner; level 0 is black, 1 white."""

    x: float
    y: float
    width: float
    height: float
    level: float = 0.0


@dataclass(frozen=True)
class Words:
    """A line of text: its left end and baseline in mm, and the height of its letters' body."""

    x: float
    y: float
    size: float
    text: str


@dataclass(frozen=True)
class Sheet:
    """One page: what is on it, all in mm from the upper left corner, y downward.

    ``boards`` are the targets on it with the place of each one's frame.
    """

    name: SheetName
    paper: Paper
    width: float
    height: float
    boards: tuple[tuple[MarkedBoard, float, float], ...]
    rectangles: tuple[Rectangle, ...]
    words: tuple[Words, ...]


def target_sheet(name: SheetName, paper: Paper = "A4") -> Sheet:
    """Lay out a sheet: "camera" (ChArUco board), "blade" (mat) or "plate" (plate and rig markers).

    Every sheet has a ruler along each side, since a printer may scale its two axes differently, and
    states which target it is and how to check it.

    >>> sheet = target_sheet("blade", "Letter")
    >>> sheet.width, [board.name for board, _, _ in sheet.boards]
    (279.4, ['blade mat'])
    """
    width, height = PAPER_MM[paper]
    boards = _places(name, width, height)
    shapes = [shape for board, x, y in boards for shape in board_ink(board, x, y)]
    shapes += _ruler(0.5 * (width - RULERS_MM[0]), height - 7.0, RULERS_MM[0], across=True)
    shapes += _ruler(5.5, 0.5 * (height - RULERS_MM[1]), RULERS_MM[1], across=False)
    if name == "blade":
        _, x, y = boards[0]
        shapes += _pivot_mark(x + 1e3 * MAT_PIVOT_M[0], y + 1e3 * MAT_PIVOT_M[1])
    if name == "plate":
        shapes += [line for board, x, y in boards for line in _cut_marks(board, x, y)]
    words = _sentences(name, boards, width, height)
    return Sheet(name, paper, width, height, boards, tuple(shapes), tuple(words))


def _places(
    name: SheetName, width: float, height: float
) -> tuple[tuple[MarkedBoard, float, float], ...]:
    if name != "plate":
        board: MarkedBoard = CAMERA_BOARD if name == "camera" else BLADE_MAT
        across = _twentieths(0.5 * (width - 1e3 * board.width_m))
        return ((board, across, _twentieths(0.5 * (height - 3.0 - 1e3 * board.height_m))),)
    left = _twentieths(0.5 * (width - 1e3 * PLATE_STRIP.width_m))
    lower = 68.0
    gap = 1e3 * (PLATE_STRIP.width_m - RIG_MARKERS.width_m)
    return (
        (PLATE_STRIP, left, 22.0),
        (PLATE_BOARD, left, lower),
        (RIG_MARKERS, left + gap, lower + 10.0),
    )


def _twentieths(length: float) -> float:
    return round(length * 20.0) / 20.0


def board_ink(
    board: MarkedBoard, x: float = 0.0, y: float = 0.0, ids: Sequence[int] | None = None
) -> Iterator[Rectangle]:
    """The black parts of a board whose frame is at (x, y) mm; ``ids`` leaves out other markers."""
    if isinstance(board, CharucoBoard):
        square = 1e3 * board.square_m
        for row in range(board.rows):
            for column in range((row + board.begins_white) % 2, board.columns, 2):
                yield Rectangle(x + column * square, y + row * square, square, square)
    cells = dictionary(board.dictionary).markerSize + 2
    for marker in board.ids:
        if ids is not None and marker not in ids:
            continue
        corner = 1e3 * board.marker_corners(marker)[0]
        yield from _marker(board, marker, x + corner[0], y + corner[1], cells)


def _marker(board: MarkedBoard, marker: int, x: float, y: float, cells: int) -> Iterator[Rectangle]:
    import cv2

    bits = cv2.aruco.generateImageMarker(dictionary(board.dictionary), marker, cells) == 0
    cell = 1e3 * board.marker_m / cells
    for row, dark in enumerate(bits):
        edges = np.flatnonzero(np.diff(np.concatenate([[False], dark, [False]]).astype(int)))
        for first, last in edges.reshape(-1, 2):
            yield Rectangle(x + first * cell, y + row * cell, (last - first) * cell, cell)


def _ruler(x: float, y: float, length: float, *, across: bool) -> list[Rectangle]:
    """Draw millimetre ticks; the ruler's ends are the outer faces of its first and last tick."""
    thin = 0.1
    ticks = []
    for at in range(round(length) + 1):
        long = 3.0 if at % 10 == 0 else 2.0 if at % 5 == 0 else 1.2
        # outer faces of the end ticks, centres of all others, are at whole millimetres
        shift = 0.0 if at == 0 else -thin if at == round(length) else -0.5 * thin
        if across:
            ticks.append(Rectangle(x + at + shift, y - long, thin, long))
        else:
            ticks.append(Rectangle(x, y + at + shift, long, thin))
    spine = Rectangle(x, y - thin, length, thin) if across else Rectangle(x, y, thin, length)
    return [*ticks, spine]


def _pivot_mark(x: float, y: float) -> list[Rectangle]:
    """Draw a small grey cross, open in the middle, that a blade's edge never lies on."""
    arm, gap, thin = 4.0, 0.6, 0.2
    half = 0.5 * thin
    return [
        Rectangle(x - arm, y - half, arm - gap, thin, _PIVOT_GREY),
        Rectangle(x + gap, y - half, arm - gap, thin, _PIVOT_GREY),
        Rectangle(x - half, y - arm, thin, arm - gap, _PIVOT_GREY),
        Rectangle(x - half, y + gap, thin, arm - gap, _PIVOT_GREY),
    ]


def _cut_marks(board: MarkedBoard, x: float, y: float) -> Iterator[Rectangle]:
    """Draw the corners of where to cut: 5 mm of white are left around a board."""
    white, arm, thin = 5.0, 4.0, 0.1
    left, top = x - white, y - white
    right, low = x + 1e3 * board.width_m + white, y + 1e3 * board.height_m + white
    for across, inward in ((left, 0.0), (right, -arm)):
        for down, upward in ((top, 0.0), (low, -arm)):
            yield Rectangle(across + inward, down, arm, thin, 0.5)
            yield Rectangle(across, down + upward, thin, arm, 0.5)


_USE: dict[SheetName, str] = {
    "camera": "Glue it to something stiff and flat. Photograph it from 15 places: near and far, "
    "in every corner, tilted every way.",
    "blade": "Lay the blade flat, its pivot on the cross, its tip to the right. Keep most markers "
    "in view.",
    "plate": "Cut along the corner marks, keep the white rims. Strip or board: flat on the plate. "
    "Rig markers: on what carries the scissors.",
}


def _sentences(
    name: SheetName,
    boards: tuple[tuple[MarkedBoard, float, float], ...],
    width: float,
    height: float,
) -> Iterator[Words]:
    left = 0.5 * (width - RULERS_MM[0])
    yield Words(
        left, 6.5, 3.0, "scissorcal  " + "  ".join(_identity(board) for board, *_ in boards)
    )
    yield Words(left, 10.5, 2.6, _USE[name])
    yield Words(
        left,
        height - 12.5,
        2.6,
        f"Print at 100 % (actual size). The ruler below must be {RULERS_MM[0]:.1f} mm from end to "
        f"end, the one at the left {RULERS_MM[1]:.1f} mm: if not, correct the printer's scaling.",
    )
    if name == "plate":
        for board, x, y in boards:
            yield Words(x, y + 1e3 * board.height_m + 3.4, 2.2, _identity(board))


def _identity(board: MarkedBoard) -> str:
    size = (
        f"squares {1e3 * board.square_m:g} mm"
        if isinstance(board, CharucoBoard)
        else f"markers {1e3 * board.marker_m:g} mm"
    )
    return f"{board.name} ({board.dictionary} {board.ids[0]}-{board.ids[-1]}, {size})"
