"""The printed sheets: boards at true scale, with rulers to check the printer, as PDF and PNG.

The PDF is version 1.4, written by bytes alone (PDF 32000-1:2008): the objects and their table
(7.5), paths and grey levels (8.5, 8.6.4), text in Helvetica, which every reader has (9.6.2.2), and
no scaling by the printer (12.2, PrintScaling). The PNG has 20 pixels per millimetre.
"""

import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import accumulate
from pathlib import Path
from typing import Literal, NamedTuple

import cv2
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from scissorcal.errors import file_error
from scissorcal.files import replacing
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

_POINTS_PER_MM = 72.0 / 25.4


PIXELS_PER_MM = 20


Paper = Literal["A4", "Letter"]
SheetName = Literal["camera", "blade", "plate"]

PAPER_MM: dict[Paper, tuple[float, float]] = {"A4": (297.0, 210.0), "Letter": (279.4, 215.9)}
"""Width and height of a sheet that lies on its long side."""

RULERS_MM = (200.0, 150.0)
"""Lengths of the ruler below and of the one at the left."""
_PIVOT_GREY = 0.6


class Rectangle(NamedTuple):
    """A filled rectangle in mm from the sheet's upper left corner; level 0 is black, 1 white."""

    x: float
    y: float
    width: float
    height: float
    level: float = 0.0


class Words(NamedTuple):
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


def write_target(sheet: Sheet, folder: Path) -> tuple[Path, Path]:
    """Write target-<name>-<paper>.pdf and .png into ``folder``; both at true scale.

    The same sheet gives the same bytes every time. Raises InputError where the folder cannot be
    written.
    """
    stem = f"target-{sheet.name}-{sheet.paper}"
    contents = {folder / f"{stem}.pdf": sheet_pdf(sheet), folder / f"{stem}.png": sheet_png(sheet)}
    try:
        folder.mkdir(parents=True, exist_ok=True)
        for path, content in contents.items():
            with replacing(path) as part:
                part.write_bytes(content)
    except OSError as error:
        raise file_error(error, folder) or error from None
    pdf, png = contents
    return pdf, png


def sheet_png(sheet: Sheet) -> bytes:
    """Give a sheet as a grey PNG whose resolution is stated in it."""
    stream = io.BytesIO()
    inch = PIXELS_PER_MM * 25.4
    _sheet_picture(sheet).save(stream, format="PNG", dpi=(inch, inch), compress_level=6)
    return stream.getvalue()


def _sheet_picture(sheet: Sheet) -> "Image.Image":
    """Draw a sheet at `PIXELS_PER_MM`."""
    scale = PIXELS_PER_MM
    picture = Image.new("L", (round(sheet.width * scale), round(sheet.height * scale)), 255)
    draw = ImageDraw.Draw(picture)
    for shape in sheet.rectangles:
        left, top = round(shape.x * scale), round(shape.y * scale)
        right = round((shape.x + shape.width) * scale) - 1
        low = round((shape.y + shape.height) * scale) - 1
        draw.rectangle((left, top, right, low), fill=round(255 * shape.level))
    for words in sheet.words:
        place = (words.x * scale, words.y * scale)
        letters = ImageFont.load_default(words.size * scale)
        draw.text(place, words.text, fill=0, font=letters, anchor="ls")
    return picture


def sheet_pdf(sheet: Sheet) -> bytes:
    """Give a sheet as a PDF of one page; the same sheet gives the same bytes."""
    drawn = "\n".join((*_rectangles(sheet), *_lines(sheet))).encode("cp1252")
    title = _escaped(f"scissorcal target: {sheet.name} ({sheet.paper})")
    size = f"{_points(sheet.width)} {_points(sheet.height)}"
    return _file(
        (
            b"<< /Type /Catalog /Pages 2 0 R /ViewerPreferences << /PrintScaling /None >> >>",
            b"<< /Type /Pages /Kids [3 0 R] /Count 1 >>",
            f"<< /Type /Page /Parent 2 0 R /MediaBox [0 0 {size}] /Contents 4 0 R "
            "/Resources << /Font << /F 5 0 R >> >> >>".encode(),
            b"<< /Length %d >>\nstream\n%b\nendstream" % (len(drawn), drawn),
            b"<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica /Encoding /WinAnsiEncoding >>",
            f"<< /Title ({title}) >>".encode("cp1252"),
        )
    )


def _rectangles(sheet: Sheet) -> list[str]:
    """One path for each shade: neighbours in one path have no seam between them."""
    drawn = []
    for level in sorted({shape.level for shape in sheet.rectangles}):
        drawn.append(f"{level:.4f} g")
        drawn += [
            _rectangle(sheet, rectangle)
            for rectangle in sheet.rectangles
            if rectangle.level == level
        ]
        drawn.append("f")
    return drawn


def _rectangle(sheet: Sheet, shape: Rectangle) -> str:
    low = sheet.height - shape.y - shape.height  # PDF counts from the lower left corner
    return " ".join(map(_points, (shape.x, low, shape.width, shape.height))) + " re"


def _lines(sheet: Sheet) -> list[str]:
    return ["0 g", *(_line(sheet, words) for words in sheet.words)]


def _line(sheet: Sheet, words: Words) -> str:
    place = f"{_points(words.x)} {_points(sheet.height - words.y)}"
    return f"BT /F {_points(words.size)} Tf {place} Td ({_escaped(words.text)}) Tj ET"


def _points(millimetres: float) -> str:
    """A length in PDF's unit, 1/72 inch, to 4 nm."""
    return f"{millimetres * _POINTS_PER_MM:.5f}".rstrip("0").rstrip(".")


def _escaped(text: str) -> str:
    """Text as it stands between the parentheses of a string."""
    return text.replace("\\", r"\\").replace("(", r"\(").replace(")", r"\)")


def _file(objects: tuple[bytes, ...]) -> bytes:
    """The file of these objects, numbered from 1: the first is the catalog, the last the title."""
    head = b"%PDF-1.4\n%\xe2\xe3\xcf\xd3\n"
    numbered = [
        b"%d 0 obj\n%b\nendobj\n" % (number, content)
        for number, content in enumerate(objects, start=1)
    ]
    *places, table = accumulate(map(len, numbered), initial=len(head))
    count = len(objects) + 1
    rows = b"".join(b"%010d 00000 n \n" % place for place in places)
    return b"".join(
        (
            *(head, *numbered),
            b"xref\n0 %d\n0000000000 65535 f \n%b" % (count, rows),
            b"trailer\n<< /Size %d /Root 1 0 R /Info %d 0 R >>\n" % (count, count - 1),
            b"startxref\n%d\n%%%%EOF\n" % table,
        )
    )
