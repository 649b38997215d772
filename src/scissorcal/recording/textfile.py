"""Tables in text: delimiter, comments and headings are detected; every error names its line."""

import csv
import re
from collections import Counter
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from scissorcal.errors import InputError
from scissorcal.foreign import read_foreign
from scissorcal.foreign.formats import LOG
from scissorcal.recording.grouping import (
    MOST_LOOKED_AT,
    grouped_column,
    is_grouped,
    thousands,
    two_marks,
)
from scissorcal.recording.table import Column, Table, Wanted, find_column, shortened

COMMENT_MARKS = ("%", "#")
DELIMITERS = (",", ";", "\t", "|", None)
"""Tried in this order, the first of equals wins; None is white space."""
SEPARATOR_LINE = re.compile('"?sep=."?', re.IGNORECASE)
"""First line of a table for Excel: it names the delimiter, and is no heading."""
MOST_LINES = 10_000_000
"""2.8 hours at 1 kHz; each takes some 150 bytes of memory beside its text."""


class Line(NamedTuple):
    """A line of text with its number, from 1."""

    number: int
    text: str


def read_text(
    path: Path, wanted: Wanted, delimiter: str | None = None, *, drop_last_line: bool = True
) -> Table:
    """Read the wanted columns of a text table.

    A last line without its end, or with fewer cells, is one that a stopped logger may have cut off:
    it is left out, with a note, unless ``drop_last_line`` is false.

    Lines that begin with % or # are comments. The rows begin with the first line that is as wide
    as they are and holds a number; headings stand in the last such wide line before them (also
    a commented one), and a line of units may follow those. Decimal commas are read where
    the comma does not separate the cells.
    """
    headings, rows, delimiter, notes = _opened(path, wanted, delimiter, drop_last_line)
    chosen = {c: find_column(path, headings, column, c) for c, column in wanted.items()}
    values = _numbers(path, rows, delimiter, chosen, headings)
    columns = {
        channel: Column(headings[number], values[:, place])
        for place, (channel, number) in enumerate(chosen.items())
    }
    numbers = np.array([line.number for line in rows], dtype=np.int64)
    return Table(path, columns, lines=numbers, notes=notes)


def text_headings(path: Path, delimiter: str | None = None) -> list[str]:
    """The headings of a text table, "column 3" where it has none. Raises as `read_text` does."""
    return _opened(path, {}, delimiter, drop_last_line=True)[0]


def _opened(
    path: Path, wanted: Wanted, delimiter: str | None, drop_last_line: bool
) -> tuple[list[str], list[Line], str | None, tuple[str, ...]]:
    """Headings, rows of numbers, the delimiter of both, and notes on what was left out."""
    comments, lines, cut = _lines(path)
    last = [line for line in lines[-21:] if line != cut] or lines
    tail = [line.text for line in last]
    delimiter = _named(delimiter) if delimiter else _find_delimiter(tail)
    widths = Counter(len(_cells(text, delimiter)) for text in tail)
    width = widths.most_common(1)[0][0] if widths else 0
    start = next((i for i, line in enumerate(lines) if _is_row(line.text, delimiter, width)), None)
    if start is None:
        raise InputError(
            f"{path} has no row of numbers. Name a table in text, Parquet or MATLAB format."
        )
    rows, notes = lines[start:], tuple[str, ...]()
    why = _why_incomplete(rows[-1], cut, delimiter, width)
    if drop_last_line and why and len(rows) > 1:
        rows, notes = rows[:-1], (_dropped(rows[-1], why),)
    _check_width(path, rows, delimiter, width)
    commented = [line for line in comments if line.number < rows[0].number]
    first = _cells(rows[0].text, delimiter)
    if not any(
        len(_cells(line.text, delimiter)) == len(first) for line in lines[:start] + commented
    ):
        _refuse_other_headings(path, lines[:start], rows, delimiter, wanted)
    return _headings(lines[:start], commented, delimiter, first), rows, delimiter, notes


def _refuse_other_headings(
    path: Path, before: list[Line], rows: list[Line], delimiter: str | None, wanted: Wanted
) -> None:
    """Refuse rows of more cells than headings, where it is not known which belong together.

    ``before`` are the lines before the rows, of which the last has words only. Commas that separate
    the cells may also stand in the numbers, where those have no dot; or the first column has row
    names and no heading, as R writes tables.
    """
    heading = _cells(before[-1].text, delimiter) if before else []
    row, cells = rows[0], _cells(rows[0].text, delimiter)
    if not 1 < len(heading) < len(cells) or any(map(_is_number, heading)):
        return
    where = f"{path}, line {row.number} has {len(cells)} cells, and line {before[-1].number} has"
    if delimiter == "," and "." not in row.text and '"' not in row.text and all(cells):
        raise InputError(
            f"{where} {len(heading)} headings: commas within numbers, as for decimals or "
            "thousands, look like those between cells. Export the log with dots, or with "
            "semicolons."
        )
    if len(heading) == len(cells) - 1 and cells[-1]:
        names = [_cells(line.text, delimiter)[0] for line in rows[:2]]
        counted = all(map(str.isdecimal, names)) and int(names[-1]) - int(names[0]) == 1
        by_name = any(isinstance(column, str) for column in wanted.values())
        if counted or by_name or not _is_number(names[0]):
            raise InputError(
                f"{where} {len(heading)} headings: which column has none is not known. Give each "
                "column a heading (where R writes the log, with row.names = FALSE)."
            )


def _why_incomplete(line: Line, cut: Line | None, delimiter: str | None, width: int) -> str:
    """Why the last line may not be whole; empty where it is."""
    cells = _cells(line.text, delimiter)
    if len(cells) < width:
        return f"has {len(cells)} cells where the others have {width}"
    if line == cut:
        return "has no end, so that its last number may be cut off"
    return ""


def _dropped(line: Line, why: str) -> str:
    text = shortened(line.text)
    return (
        f"Line {line.number}, the last one, {why}: it was left out ({text!r}). --keep-last-line "
        "reads it."
    )


def _lines(path: Path) -> tuple[list[Line], list[Line], Line | None]:
    """Return comment lines without their mark, other lines that are not blank, and a cut one.

    The cut one is the last of the others, where the file ends without the end of a line.
    """
    data = read_foreign(path, LOG)
    if b"\0" in data:
        raise InputError(
            f"{path} is not a text table: it contains zero bytes. Save it as CSV in UTF-8, or give "
            "it the extension of its format (.mat, .parquet)."
        )
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    comments, lines = [], []
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    if text.count("\n") > MOST_LINES:
        raise InputError(
            f"{path} has {text.count(chr(10)):,} lines, and {MOST_LINES:,} are read at most: split "
            "the log, or save it as Parquet."
        )
    split = text.split("\n")
    for number, raw in enumerate(split, 1):
        line = raw.strip(" ")
        if number == 1 and SEPARATOR_LINE.fullmatch(line):
            continue
        if line.startswith(COMMENT_MARKS):
            comments.append(Line(number, line.lstrip("".join(COMMENT_MARKS))))
        elif line.strip():
            lines.append(Line(number, line))
    cut = lines[-1] if lines and lines[-1].number == len(split) else None
    return comments, lines, cut


def _is_row(text: str, delimiter: str | None, width: int) -> bool:
    """Whether a line is a row of numbers, not headings or remarks ("Rate, 1000").

    A row has numbers only, or is as wide as the rows and has at least one: then its error is
    reported, not skipped.
    """
    numbers = [_is_number(cell) for cell in _cells(text, delimiter)]
    return all(numbers) or (len(numbers) == width and any(numbers))


def _named(delimiter: str) -> str | None:
    """Return the delimiter; "tab" and "space" are names."""
    meant = {"tab": "\t", "\\t": "\t", "space": None, " ": None}.get(delimiter, delimiter)
    if meant is not None and (len(meant) != 1 or meant.isalnum() or meant in "\"'+-.\n\r"):
        raise InputError(
            f"{delimiter!r} cannot separate the columns of a table. Give one character such as "
            "; or the words tab or space."
        )
    return meant


def _find_delimiter(rows: Sequence[str]) -> str | None:
    """Return the delimiter that gives most rows of numbers only, and most numbers."""

    def score(delimiter: str | None) -> tuple[int, int]:
        numbers = [[_is_number(cell) for cell in _cells(row, delimiter)] for row in rows]
        return sum(all(row) for row in numbers), sum(sum(row) for row in numbers)

    likeliest = max(DELIMITERS, key=score)
    if likeliest is None and score("\t")[1] > score("\t")[0] == len(rows):
        return "\t"  # cells with spaces in them, as between thousands
    return likeliest


def _cells(text: str, delimiter: str | None) -> list[str]:
    if delimiter is None:
        return text.split()
    if '"' in text:
        return [cell.strip() for cell in next(csv.reader([text], delimiter=delimiter))]
    return [cell.strip() for cell in text.split(delimiter)]


def _is_number(cell: str) -> bool:
    try:
        float(cell.replace(",", ".", 1))
    except ValueError:
        return is_grouped(cell)
    return True


def _check_width(path: Path, rows: list[Line], delimiter: str | None, width: int) -> None:
    for line in rows:
        if delimiter is not None and line.text.count(delimiter) == width - 1:
            continue  # nearly all lines, and twenty times as fast as to divide each
        count = len(_cells(line.text, delimiter))
        if count != width:
            raise InputError(
                f"{path}, line {line.number} has {count} cells where the others have {width}. "
                "Complete or remove that line."
            )


def _headings(
    before: list[Line], comments: list[Line], delimiter: str | None, row: list[str]
) -> list[str]:
    """Return one heading a column; "column 3" where the file has none.

    ``row`` are the cells of the first row. A delimiter behind the last cell may stand in the rows
    alone, or in the headings alone.
    """

    def as_wide(lines: list[Line]) -> list[list[str]]:
        wide = [_cells(line.text, delimiter) for line in lines]
        wide = [cells[:-1] if cells[len(row) :] == [""] else cells for cells in wide]
        wide = [[*cells, ""] if row[len(cells) :] == [""] else cells for cells in wide]
        return [cells for cells in wide if len(cells) == len(row)]

    rows = as_wide(before) or as_wide(comments)[-1:]
    if not rows:
        return [f"column {number}" for number in range(len(row))]
    if len(rows) == 1:
        return rows[0]
    return [f"{name} [{unit.strip('[]()')}]" for name, unit in zip(*rows[-2:], strict=True)]


def _numbers(
    path: Path,
    rows: list[Line],
    delimiter: str | None,
    chosen: dict[str, int],
    headings: list[str],
) -> np.ndarray[tuple[int, int], np.dtype[np.float64]]:
    """Return the chosen columns, shape (N, len(chosen)), by NumPy's parser."""
    unquoted, delimiter = _without_quotes(rows, delimiter)
    if unquoted is not rows:
        rows = unquoted
        _refuse_groups(path, rows, delimiter, chosen, headings, thousands)
    texts = [line.text for line in rows]
    if delimiter != "," and any("," in text for text in texts):
        looked_at = [*rows[:MOST_LOOKED_AT], *rows[MOST_LOOKED_AT:][-MOST_LOOKED_AT:]]
        if any("." in line.text for line in looked_at):
            _refuse_groups(path, looked_at, delimiter, chosen, headings, two_marks)
        texts = [text.replace(",", ".") for text in texts]
    try:
        values: np.ndarray[tuple[int, int], np.dtype[np.float64]] = np.loadtxt(
            texts,
            delimiter=delimiter,
            usecols=list(chosen.values()),
            comments=None,
            quotechar='"',
            ndmin=2,
        )
    except ValueError as error:
        raise InputError(_first_fault(path, rows, texts, delimiter, chosen, headings)) from error
    for place, number in enumerate(chosen.values()):

        def cell(row: int, number: int = number) -> str:
            return _cells(rows[row].text, delimiter)[number]

        at = grouped_column(values[:, place], cell)
        if at is not None:
            raise InputError(_grouped(path, rows[at], headings[number], cell(at)))
    return values


def _without_quotes(rows: list[Line], delimiter: str | None) -> tuple[list[Line], str | None]:
    """Rows of quoted cells, some with commas in them, as rows between semicolons."""
    if delimiter != "," or not any('"' in line.text for line in rows):
        return rows, delimiter
    split = [(line.number, _cells(line.text, delimiter)) for line in rows]
    if not any("," in cell for _, cells in split for cell in cells):
        return rows, delimiter
    marks = str.maketrans(';"', "  ")
    plain = [Line(number, ";".join(cell.translate(marks) for cell in row)) for number, row in split]
    return plain, ";"


def _refuse_groups(
    path: Path,
    rows: list[Line],
    delimiter: str | None,
    chosen: dict[str, int],
    headings: list[str],
    find: Callable[[list[list[str]]], tuple[int, int] | None],
) -> None:
    """Refuse the cell of the chosen columns that ``find`` names as digits in groups, if any."""
    split = [_cells(line.text, delimiter) for line in rows]
    place = find([[cells[number] for number in chosen.values()] for cells in split])
    if place:
        row, column = place
        number = list(chosen.values())[column]
        raise InputError(_grouped(path, rows[row], headings[number], split[row][number]))


def _grouped(path: Path, line: Line, heading: str, cell: str) -> str:
    return (
        f"{path}, line {line.number}, column {shortened(heading)!r}: {shortened(cell)!r} stands "
        "where digits are in groups, and thousands separators are not read. Export the log without "
        "them, and with one decimal mark."
    )


def _first_fault(
    path: Path,
    rows: list[Line],
    texts: list[str],
    delimiter: str | None,
    chosen: dict[str, int],
    headings: list[str],
) -> str:
    """Find the first cell that is not a number; slow, so only called after an error."""
    for line, text in zip(rows, texts, strict=True):
        cells = _cells(text, delimiter)
        for number in chosen.values():
            written = _cells(line.text, delimiter)[number]
            if is_grouped(written) or (delimiter == "," and "," in written):
                return _grouped(path, line, headings[number], written)
            try:
                float(cells[number].encode("ascii"))  # other digits are none to NumPy
            except ValueError:
                what = f"{shortened(written)!r} is not a number" if written else "it is empty"
                return (
                    f"{path}, line {line.number}, column {shortened(headings[number])!r}: {what}. "
                    "Correct or remove that line."
                )
    return f"{path} cannot be read as numbers. Save it as plain CSV with a decimal point."
