"""A board's description, as given on the command line."""

import re

from scissorcal.errors import InputError
from scissorcal.vision.targets.boards import CAMERA_BOARD, CharucoBoard, Chessboard

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


def board_from_words(words: str) -> CharucoBoard | Chessboard:
    """Read "camera" (the printed board) or one of `FORMS`. Raises InputError.

    >>> board_from_words("chessboard:9x6:25")
    Chessboard(name='chessboard 9x6', columns=9, rows=6, square_m=0.025, kind='chessboard')
    >>> board_from_words("charuco:5x7:40:20:DICT_6X6_250").ids[-1]
    16
    """
    if words == "camera":
        return CAMERA_BOARD
    if found := _CHESSBOARD.fullmatch(words):
        columns, rows, square = int(found[1]), int(found[2]), float(found[3])
        if min(columns, rows) >= 3 and square > 0.0:
            _refuse_metres(square, words)
            return Chessboard(f"chessboard {columns}x{rows}", columns, rows, 1e-3 * square)
    elif found := _CHARUCO.fullmatch(words):
        columns, rows, square, marker = (
            int(found[1]),
            int(found[2]),
            float(found[3]),
            float(found[4]),
        )
        if min(columns, rows) >= 3 and 0.0 < marker < square:
            _refuse_metres(square, words)
            return _charuco(
                columns, rows, 1e-3 * square, 1e-3 * marker, found[5], found[6] is not None
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
    import cv2

    dictionaries = [key for key in dir(cv2.aruco) if key.startswith("DICT_")]
    if name not in dictionaries:
        raise InputError(f"{name} is not a dictionary of markers: give one of {dictionaries}.")
    board = CharucoBoard(
        f"ChArUco {columns}x{rows}",
        columns,
        rows,
        square_m,
        marker_m,
        dictionary=name,
        legacy=legacy,
    )
    held = len(cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name)).bytesList)
    if len(board.ids) > held:
        raise InputError(f"{name} has {held} markers; the board needs {len(board.ids)}.")
    return board
