"""A page of filled rectangles and lines of text as PDF 1.4, at true scale and by bytes alone.

PDF 32000-1:2008: the objects and their table (7.5), paths and grey levels (8.5, 8.6.4), text in
Helvetica, which every reader has (9.6.2.2), and no scaling by the printer (12.2, PrintScaling).
"""

from itertools import accumulate

from scissorcal.vision.targets.sheet import Rectangle, Sheet, Words

_POINTS_PER_MM = 72.0 / 25.4


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
        drawn += [_rectangle(sheet, one) for one in sheet.rectangles if one.level == level]
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
