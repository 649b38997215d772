"""The printed targets: the places of their corners, and the identification of a target.

All targets use one dictionary of markers, each target with different numbers, so that a single
marker identifies its target. A board's frame has its origin at the pattern's upper left corner as
printed, x to the right, y down, z into the sheet; all in metres.
"""

import re
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from scissorcal.aliases import Array
from scissorcal.errors import InputError, UnknownNameError, unknown_name

FORMS = (
    "chessboard:COLUMNSxROWS:SQUARE_MM (inner corners) or "
    "charuco:COLUMNSxROWS:SQUARE_MM:MARKER_MM:DICTIONARY (squares), followed by :legacy where "
    "OpenCV before 4.6 drew an even number of rows"
)

LEAST_SQUARE_MM = 0.3
"""Squares have millimetres to 200 mm, which in metres is 0.2, and half as much again."""

_NUMBER = r"(\d+(?:\.\d+)?)"
_CHESSBOARD = re.compile(rf"chessboard:(\d{{1,3}})x(\d{{1,3}}):{_NUMBER}")
_CHARUCO = re.compile(rf"charuco:(\d{{1,3}})x(\d{{1,3}}):{_NUMBER}:{_NUMBER}:(\w+?)(:legacy)?")


DICTIONARY = "DICT_5X5_250"


@dataclass(frozen=True)
class CharucoBoard:
    """A chessboard with a marker in each white square; ``columns`` and ``rows`` count squares.

    Markers have the numbers ``first_id`` onward, row by row. ``legacy``: a board with an even
    number of rows that starts with a white square, as OpenCV drew them before 4.6.
    """

    name: str
    columns: int
    rows: int
    square_m: float
    marker_m: float
    first_id: int = 0
    dictionary: str = DICTIONARY
    legacy: bool = False
    kind: Literal["charuco"] = "charuco"

    @property
    def begins_white(self) -> bool:
        """Whether its upper left square is white."""
        return self.legacy and self.rows % 2 == 0

    @property
    def width_m(self) -> float:
        return self.columns * self.square_m

    @property
    def height_m(self) -> float:
        return self.rows * self.square_m

    @property
    def ids(self) -> tuple[int, ...]:
        """Numbers of its markers."""
        return tuple(range(self.first_id, self.first_id + self.columns * self.rows // 2))

    @property
    def points(self) -> Array:
        """Inner corners (n, 3), row by row: corner i of a detection is row i here."""
        offset = np.array([self.square_m, self.square_m, 0.0])
        return np.asarray(_grid(self.columns - 1, self.rows - 1, self.square_m) + offset)

    def marker_corners(self, marker: int) -> Array:
        """Corners (4, 3) of one marker: upper left, upper right, lower right, lower left."""
        return np.asarray(self.as_opencv().getObjPoints()[marker - self.first_id], dtype=np.float64)

    def as_opencv(self) -> Any:
        """Give the ``cv2.aruco.CharucoBoard`` of it."""
        import cv2

        made = cv2.aruco.CharucoBoard(
            (self.columns, self.rows),
            self.square_m,
            self.marker_m,
            dictionary(self.dictionary),
            np.array(self.ids),
        )
        made.setLegacyPattern(self.begins_white)
        return made


@dataclass(frozen=True)
class MarkerBoard:
    """Single markers of one size at known places.

    ``centres_m`` are (x, y) of each marker's middle, in the order of its numbers from ``first_id``.
    """

    name: str
    width_m: float
    height_m: float
    marker_m: float
    centres_m: tuple[tuple[float, float], ...]
    first_id: int
    dictionary: str = DICTIONARY
    kind: Literal["markers"] = "markers"

    @property
    def ids(self) -> tuple[int, ...]:
        """Numbers of its markers."""
        return tuple(range(self.first_id, self.first_id + len(self.centres_m)))

    @property
    def points(self) -> Array:
        """Corners (4 n, 3): rows 4 i to 4 i + 3 are those of the i-th marker."""
        return np.concatenate([self.marker_corners(marker) for marker in self.ids])

    def marker_corners(self, marker: int) -> Array:
        """Corners (4, 3) of one marker: upper left, upper right, lower right, lower left."""
        x, y = self.centres_m[marker - self.first_id]
        half = 0.5 * self.marker_m
        return np.array(
            [
                [x - half, y - half, 0.0],
                [x + half, y - half, 0.0],
                [x + half, y + half, 0.0],
                [x - half, y + half, 0.0],
            ]
        )


@dataclass(frozen=True)
class Chessboard:
    """A plain chessboard, which shows neither its identity nor its orientation.

    ``columns`` and ``rows`` count *inner corners*, as OpenCV does.
    """

    name: str
    columns: int
    rows: int
    square_m: float
    kind: Literal["chessboard"] = "chessboard"

    @property
    def width_m(self) -> float:
        return (self.columns + 1) * self.square_m

    @property
    def height_m(self) -> float:
        return (self.rows + 1) * self.square_m

    @property
    def points(self) -> Array:
        """Inner corners (n, 3), row by row."""
        offset = np.array([self.square_m, self.square_m, 0.0])
        return np.asarray(_grid(self.columns, self.rows, self.square_m) + offset)


Board = CharucoBoard | MarkerBoard | Chessboard
MarkedBoard = CharucoBoard | MarkerBoard


def _grid(columns: int, rows: int, pitch: float) -> Array:
    y, x = np.mgrid[0:rows, 0:columns]
    return np.column_stack([x.ravel() * pitch, y.ravel() * pitch, np.zeros(x.size)])


def _ring(columns: int, rows: int, pitch: float, marker: float) -> list[tuple[float, float]]:
    """Centres of markers around a rectangle: the upper row, the two sides, the lower row."""
    across = [0.5 * marker + pitch * index for index in range(columns)]
    down = [0.5 * marker + pitch * index for index in range(rows)]
    upper = [(x, down[0]) for x in across]
    sides = [(x, y) for y in down[1:-1] for x in (across[0], across[-1])]
    lower = [(x, down[-1]) for x in across]
    return upper + sides + lower


# Every length is a whole number of twentieths of a millimetre, and so is every cell of a marker
# (seven to its side): a picture of 20 pixels per millimetre holds them exactly.

CAMERA_BOARD = CharucoBoard("camera board", 9, 7, 26e-3, 18.9e-3, first_id=0)
"""Fits A4 and Letter. Its squares are 50 px wide where it fills 70 % of a 640-pixel picture."""

BLADE_MAT = MarkerBoard(
    "blade mat", 255e-3, 177e-3, 21e-3, tuple(_ring(10, 7, 26e-3, 21e-3)), first_id=40
)
"""Thirty markers around an empty field on which a blade lies."""

MAT_FIELD_M = (0.024, 0.024, 0.231, 0.153)
"""The mat's empty field in its frame: left, top, right, bottom. White except for the pivot mark."""

MAT_PIVOT_M = (0.062, 0.0885)
"""Place of the mat's pivot mark in its frame: a small cross for the blade's pivot."""

PLATE_STRIP = MarkerBoard(
    "plate strip",
    228e-3,
    28e-3,
    28e-3,
    tuple((0.014 + 0.040 * index, 0.014) for index in range(6)),
    first_id=80,
)
"""Six markers in a row, to be stuck along the plate's edge."""

PLATE_BOARD = CharucoBoard("plate board", 7, 5, 20e-3, 14e-3, first_id=100)
"""A small ChArUco board for plates with room for it: the most accurate plate target."""

RIG_MARKERS = MarkerBoard(
    "rig markers",
    78e-3,
    78e-3,
    28e-3,
    ((0.014, 0.014), (0.064, 0.014), (0.014, 0.064), (0.064, 0.064)),
    first_id=130,
)
"""Four markers on one card, to be stuck on the rig's moving frame."""

TARGETS: tuple[MarkedBoard, ...] = (CAMERA_BOARD, BLADE_MAT, PLATE_STRIP, PLATE_BOARD, RIG_MARKERS)


def targets_of(ids: Iterable[int]) -> dict[str, int]:
    """Count the markers of each target among numbers of `DICTIONARY`, most first.

    >>> targets_of([41, 42, 3, 249])
    {'blade mat': 2, 'camera board': 1}
    """
    numbers = [int(marker) for marker in ids]
    counts = {board.name: sum(marker in board.ids for marker in numbers) for board in TARGETS}
    return {name: counts[name] for name in sorted(counts, key=lambda n: -counts[n]) if counts[name]}


def dictionary(name: str) -> Any:
    """Give the ``cv2.aruco.Dictionary`` of a name such as "DICT_5X5_250".

    Raises UnknownNameError, which lists all names, where there is none of that name.
    """
    import cv2

    number = getattr(cv2.aruco, name, None) if name.startswith("DICT_") else None
    if number is None:
        known = [key for key in dir(cv2.aruco) if key.startswith("DICT_")]
        sentence = unknown_name("dictionary of markers", name, known)
        raise UnknownNameError(f"{sentence} There are: {', '.join(known)}.")
    return cv2.aruco.getPredefinedDictionary(number)


def as_board(board: Board | str) -> Board:
    """The board itself, or that of a name: one of `TARGETS` or of `FORMS`.

    Raises UnknownNameError, which lists the names, or InputError where it is neither.

    >>> as_board("plate board").ids[0], as_board("chessboard:9x6:25").square_m
    (100, 0.025)
    >>> as_board("plate bord")  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    scissorcal.errors.UnknownNameError: "plate bord" is no target. Did you mean "plate board"? ...
    """
    if isinstance(board, Board):
        return board
    named = {target.name: target for target in TARGETS}
    if not isinstance(board, str):
        raise InputError(
            f"{type(board).__name__} is no board: give a CharucoBoard, MarkerBoard or Chessboard "
            f"of scissorcal.vision, or one of these names: {', '.join(named)}."
        )
    if board in named:
        return named[board]
    if ":" in board:
        return board_from_words(board)
    sentence = unknown_name("target", board, named)
    raise UnknownNameError(f"{sentence} For another board give {FORMS}.")


def board_from_words(words: str) -> CharucoBoard | Chessboard:
    """Read "camera" (the printed board) or one of `FORMS`. Raises InputError.

    >>> board_from_words("chessboard:9x6:25")
    Chessboard(name='chessboard 9x6', columns=9, rows=6, square_m=0.025, kind='chessboard')
    >>> board_from_words("charuco:5x7:40:20:DICT_6X6_250").ids[-1]
    16
    """
    if words == "camera":
        return CAMERA_BOARD
    if match := _CHESSBOARD.fullmatch(words):
        columns, rows, square = int(match[1]), int(match[2]), float(match[3])
        if min(columns, rows) >= 3 and square > 0.0:
            _refuse_metres(square, words)
            return Chessboard(f"chessboard {columns}x{rows}", columns, rows, 1e-3 * square)
    elif match := _CHARUCO.fullmatch(words):
        columns, rows, square, marker = (
            int(match[1]),
            int(match[2]),
            float(match[3]),
            float(match[4]),
        )
        if min(columns, rows) >= 3 and 0.0 < marker < square:
            _refuse_metres(square, words)
            return _charuco(
                columns, rows, 1e-3 * square, 1e-3 * marker, match[5], match[6] is not None
            )
    raise InputError(f"{words!r} is not a board: give {FORMS}, for example chessboard:9x6:25.")


def _refuse_metres(square_mm: float, words: str) -> None:
    if square_mm < LEAST_SQUARE_MM:
        raise InputError(
            f"{words!r} has squares of {square_mm:g} mm: give lengths in mm, {1e3 * square_mm:g} "
            "where that is in metres."
        )


def words_of_board(board: CharucoBoard) -> str:
    """The words that name a ChArUco board.

    >>> words_of_board(board_from_words("charuco:8x6:30:22.5:DICT_4X4_50:legacy"))
    'charuco:8x6:30:22.5:DICT_4X4_50:legacy'
    """
    square, marker = round(1e3 * board.square_m, 6), round(1e3 * board.marker_m, 6)
    old = ":legacy" if board.begins_white else ""
    return f"charuco:{board.columns}x{board.rows}:{square:g}:{marker:g}:{board.dictionary}{old}"


def _charuco(
    columns: int, rows: int, square_m: float, marker_m: float, name: str, legacy: bool
) -> CharucoBoard:
    held = len(dictionary(name).bytesList)
    board = CharucoBoard(
        f"ChArUco {columns}x{rows}",
        columns,
        rows,
        square_m,
        marker_m,
        dictionary=name,
        legacy=legacy,
    )
    if len(board.ids) > held:
        raise InputError(f"{name} has {held} markers; the board needs {len(board.ids)}.")
    return board
