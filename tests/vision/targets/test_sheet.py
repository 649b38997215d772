"""Printed targets: at true scale, all their marks to be found, each telling its own name."""

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pypdfium2
import pytest
from PIL import Image

from scissorcal.vision.targets.boards import BLADE_MAT, DICTIONARY, MAT_FIELD_M, TARGETS, targets_of
from scissorcal.vision.targets.detect import find_board, find_markers
from scissorcal.vision.targets.sheet import (
    PAPER_MM,
    PIXELS_PER_MM,
    RULERS_MM,
    Paper,
    SheetName,
    Words,
    sheet_pdf,
    sheet_png,
    target_sheet,
    write_target,
)
from tests.vision.scenes import photo_of

SHEETS = [(name, paper) for name in ("camera", "blade", "plate") for paper in ("A4", "Letter")]
SCALE = 8.0


def pdf_pixels(name: SheetName, paper: Paper) -> np.ndarray:
    """Draw the PDF's page at about `SCALE` pixels per millimetre; see `millimetres`."""
    document = pypdfium2.PdfDocument(sheet_pdf(target_sheet(name, paper)))
    assert len(document) == 1
    page = document[0]
    drawn = np.asarray(page.render(scale=SCALE * 25.4 / 72.0, grayscale=True).to_numpy()).copy()
    page.close()
    document.close()
    return drawn.reshape(drawn.shape[:2])


def millimetres(pixels: np.ndarray, drawn: np.ndarray, paper: Paper) -> np.ndarray:
    """Bring pixels to millimetres: a page is drawn on a whole number of pixels."""
    return (pixels + 0.5) * np.array(PAPER_MM[paper]) / np.array(drawn.shape[::-1])


def test_no_two_targets_share_a_marker() -> None:
    ids = [marker for board in TARGETS for marker in board.ids]
    assert len(set(ids)) == len(ids)
    for board in TARGETS:
        assert targets_of(board.ids) == {board.name: len(board.ids)}
        assert board.dictionary == DICTIONARY


@pytest.mark.parametrize(("name", "paper"), SHEETS)
def test_the_pdf_is_at_true_scale(name: SheetName, paper: Paper) -> None:
    sheet = target_sheet(name, paper)
    drawn = pdf_pixels(name, paper)
    expected = np.array(PAPER_MM[paper])
    assert np.array(drawn.shape[::-1]) / SCALE == pytest.approx(expected, abs=0.2)
    found = find_markers(drawn, DICTIONARY)
    assert sorted(found.ids) == sorted(m for board, _, _ in sheet.boards for m in board.ids)
    for board, x, y in sheet.boards:
        mine = np.isin(found.ids, board.ids)
        seen = millimetres(found.corners[mine].reshape(-1, 2), drawn, paper)
        printed = np.concatenate([board.marker_corners(m)[:, :2] for m in found.ids[mine]])
        off = seen - (1e3 * printed + [x, y])
        # Half a pixel: a page is drawn with edges mixed in stored greys, not in light.
        assert np.abs(off).max() < 0.5 / SCALE, board.name
        assert np.abs(off.mean(axis=0)).max() < 0.005, board.name


@pytest.mark.parametrize("name", ["camera", "blade", "plate"])
def test_the_png_is_exact_to_a_pixel(name: SheetName) -> None:
    import io

    sheet = target_sheet(name)
    image = Image.open(io.BytesIO(sheet_png(sheet)))
    assert image.info["dpi"] == pytest.approx((508.0, 508.0), abs=0.01)
    assert image.size == (297 * PIXELS_PER_MM, 210 * PIXELS_PER_MM)
    pixels = np.asarray(image)
    for board, x, y in sheet.boards:
        for marker in board.ids:
            corners = 1e3 * board.marker_corners(marker)[:, :2] + [x, y]
            left, top = np.rint(corners[0] * PIXELS_PER_MM).astype(int)
            right, low = np.rint(corners[2] * PIXELS_PER_MM).astype(int)
            assert np.abs(corners * PIXELS_PER_MM - np.rint(corners * PIXELS_PER_MM)).max() < 1e-3
            assert pixels[top:low, left].max() == pixels[top, left:right].max() == 0
            assert pixels[top:low, right - 1].max() == pixels[low - 1, left:right].max() == 0
            assert pixels[top:low, left - 1].min() == pixels[top:low, right].min() == 255


@pytest.mark.parametrize(("name", "paper"), SHEETS)
def test_the_rulers_have_their_stated_length(name: SheetName, paper: Paper) -> None:
    drawn = pdf_pixels(name, paper) < 230
    width, height = PAPER_MM[paper]
    rows = drawn[int((height - 7.5) * SCALE) : int((height - 6.5) * SCALE)]
    row = rows[rows.sum(axis=1).argmax()]
    column = drawn[:, int(5.55 * SCALE)]
    assert np.count_nonzero(row) / SCALE == pytest.approx(RULERS_MM[0], abs=0.3)
    assert np.ptp(np.flatnonzero(row)) / SCALE == pytest.approx(RULERS_MM[0], abs=0.3)
    assert np.ptp(np.flatnonzero(column)) / SCALE == pytest.approx(RULERS_MM[1], abs=0.3)
    assert width > RULERS_MM[0] + 10.0


@pytest.mark.parametrize(("name", "paper"), SHEETS)
def test_the_sheet_is_within_the_printable_area(name: SheetName, paper: Paper) -> None:
    sheet = target_sheet(name, paper)
    margin = 4.0
    for shape in sheet.rectangles:
        assert min(shape.x, shape.y) > margin
        assert shape.x + shape.width < sheet.width - margin
        assert shape.y + shape.height < sheet.height - margin


def test_every_target_is_found_by_its_own_detector() -> None:
    for name in ("camera", "blade", "plate"):
        image = np.asarray(pdf_pixels(name, "A4"))
        sheet = target_sheet(name)
        for board, x, y in sheet.boards:
            found = find_board(photo_of(image), board)
            assert len(found.ids) == len(board.points)
            off = millimetres(found.pixels, image, "A4") - (1e3 * found.points[:, :2] + [x, y])
            assert np.abs(off).max() < 0.5 / SCALE


def test_the_mats_field_is_empty_except_for_the_pivot_mark() -> None:
    sheet = target_sheet("blade")
    _, x, y = sheet.boards[0]
    left, top, right, low = (1e3 * side for side in MAT_FIELD_M)
    inside = [
        shape
        for shape in sheet.rectangles
        if x + left < shape.x + shape.width
        and shape.x < x + right
        and y + top < shape.y + shape.height
        and shape.y < y + low
    ]
    assert len(inside) == 4
    assert all(max(shape.width, shape.height) < 5.0 and shape.level > 0.5 for shape in inside)
    assert BLADE_MAT.width_m - MAT_FIELD_M[2] == pytest.approx(MAT_FIELD_M[0])


def test_the_text_names_the_target_and_the_check() -> None:
    for name, paper in SHEETS:
        words = " ".join(line.text for line in target_sheet(name, paper).words)
        assert "100 %" in words
        assert "200.0 mm" in words
        for board, _, _ in target_sheet(name, paper).boards:
            assert f"{board.name} ({DICTIONARY} {board.ids[0]}-{board.ids[-1]}" in words


@pytest.mark.parametrize(("name", "paper"), SHEETS)
def test_the_pdf_holds_the_sheets_words(name: SheetName, paper: Paper) -> None:
    sheet = target_sheet(name, paper)
    document = pypdfium2.PdfDocument(sheet_pdf(sheet))
    page = document[0]
    read = page.get_textpage().get_text_range()  # of several blanks it gives one
    assert sorted(read.splitlines()) == sorted(" ".join(one.text.split()) for one in sheet.words)
    assert document.get_metadata_dict()["Title"] == f"scissorcal target: {name} ({paper})"
    document.close()


def test_signs_of_the_pdf_format_stay_text() -> None:
    """Parentheses and backslashes end a string, or change it, where they are not escaped."""
    text = r"a (b) \n) 20 × 30 mm, c:\t"
    sheet = replace(target_sheet("blade"), words=(Words(20.0, 20.0, 4.0, text),))
    document = pypdfium2.PdfDocument(sheet_pdf(sheet))
    assert document[0].get_textpage().get_text_range() == text
    document.close()


def test_the_pdfs_table_says_where_its_objects_are() -> None:
    """A reader that does not repair files needs each place exact to the byte."""
    data = sheet_pdf(target_sheet("camera"))
    table = int(data.rsplit(b"startxref\n", 1)[1].split()[0])
    head, count, *rows = data[table:].split(b"\n")
    assert (head, count) == (b"xref", b"0 7")
    for number, row in enumerate(rows[1:7], start=1):
        assert len(row) == 19  # and the end of its line: 20 bytes for each
        assert data[int(row[:10]) :].startswith(b"%d 0 obj\n" % number)
    length = int(re.search(rb"/Length (\d+) >>\nstream\n", data)[1])  # type: ignore[index]
    start = data.index(b"stream\n") + len(b"stream\n")
    assert data[start + length :].startswith(b"\nendstream")


def test_the_same_sheet_gives_the_same_bytes(tmp_path: Path) -> None:
    first = write_target(target_sheet("blade"), tmp_path / "a")
    second = write_target(target_sheet("blade"), tmp_path / "b")
    for one, other in zip(first, second, strict=True):
        assert one.read_bytes() == other.read_bytes()
    assert sorted(path.name for path in (tmp_path / "a").iterdir()) == [
        "target-blade-A4.pdf",
        "target-blade-A4.png",
    ]
