"""Thousands separators in a text table: 1.234,5 and 1,234.5 are not numbers that a reader knows."""

import re
from collections.abc import Callable, Sequence

import numpy as np

from scissorcal.aliases import Array

GROUPED = re.compile(
    r"[+-]?\d{1,3}(?P<mark>[.,'’_ \u00a0\u202f])(?:\d{2}(?P=mark))*\d{3}(?:(?P=mark)\d{3})*"
    r"(?:[.,]\d*)?"
)
"""Digits in groups of three, or as in India of two and a last one of three, behind one mark, and
perhaps a decimal mark after them."""
ONE_GROUP = re.compile(r"[+-]?[1-9]\d{0,2}[.,]\d{3}")
"""What may be a number of thousands, or one of three decimals."""
DECIMAL = re.compile(r"[+-]?\d*[.,]\d+(?:[eE][+-]?\d+)?")
MOST_LOOKED_AT = 2000
"""Cells of a column whose text is looked at: a number of three decimals ends in 0 once in ten, and
then a writer that leaves zeros out shows itself."""
NEAR = 1e-6
"""Of a number: what a sum of powers of two may be off a decimal one."""
REACH = 3
"""Cells beside a change from whole numbers to parts whose text is looked at."""
CLOSER = 10.0
"""Where the cells without a mark join those with one this many times better in thousands."""


def is_grouped(cell: str) -> bool:
    """Whether a cell can only be a number in groups of digits.

    >>> [is_grouped(cell) for cell in ("1.234,5", "1 234", "1.234.567", "1,23,456.7", "1.234")]
    [True, True, True, True, False]
    """
    return bool(GROUPED.fullmatch(cell)) and not DECIMAL.fullmatch(cell)


def grouped_column(values: Array, cell: Callable[[int], str]) -> int | None:
    """Row of a number of thousands in a column that was read with a decimal mark; None for none.

    ``values`` (n,) are the numbers as read, ``cell`` gives the text of a row. In 995, 1.000, 1.005
    the dot parts thousands: all cells with a mark have three digits behind it, those without are
    below 1,000, and both join only if the mark is none of a decimal. A column in which all cells
    have three decimals is read as decimals.

    >>> cells = ["990", "995", "1.000", "1.005"]
    >>> grouped_column(np.array([float(text) for text in cells]), cells.__getitem__)
    2
    """
    if not np.all(np.isfinite(values)):
        return None
    whole = values == np.rint(values)
    parts, edges = values[~whole], np.flatnonzero(whole[1:] != whole[:-1])
    if not len(edges) or np.abs(parts).min() < 1.0:
        return None
    if np.abs(1e3 * parts - np.rint(1e3 * parts)).max() > NEAR * np.abs(1e3 * parts).max():
        return None
    tenths = np.flatnonzero(~whole & (np.abs(1e2 * values - np.rint(1e2 * values)) < NEAR))
    near = np.unique(edges[:MOST_LOOKED_AT, None] + np.arange(-REACH, REACH + 2))
    near = near[(near >= 0) & (near < len(values))]
    texts = {int(row): cell(int(row)) for row in (*near, *tenths[:MOST_LOOKED_AT])}
    marked = np.array([_has_mark(texts[int(row)]) for row in near])
    if not all(ONE_GROUP.fullmatch(text) for text in texts.values() if _has_mark(text)):
        return None
    if np.all(marked) or np.abs(values[near[~marked]]).max() >= 1e3:
        return None
    meant = np.where(marked, 1e3, 1.0) * values[near]
    pairs = np.flatnonzero((marked[1:] != marked[:-1]) & (np.diff(near) == 1))
    as_read = np.abs(np.diff(values[near])[pairs])
    in_thousands = np.abs(np.diff(meant)[pairs]) / 1e3
    if len(pairs) and np.median(as_read) > CLOSER * np.median(in_thousands):
        return int(near[marked][0])
    return None


def _has_mark(cell: str) -> bool:
    return "." in cell or "," in cell


def thousands(cells: Sequence[Sequence[str]]) -> tuple[int, int] | None:
    """Row and column of a cell whose comma may part thousands, where no comma is a decimal one.

    ``cells`` are rows of the chosen columns, without dots for decimals.

    >>> thousands([["0", "1,800"], ["1", "1,805"]]), thousands([["0,001", "1,800"]])
    ((0, 1), None)
    """
    suspect = None
    for column in range(len(cells[0])):
        marked = [row for row, line in enumerate(cells) if "," in line[column]]
        if not marked:
            continue
        if not all(ONE_GROUP.fullmatch(cells[row][column].strip()) for row in marked):
            return None
        suspect = suspect or (marked[0], column)
    return suspect


def two_marks(cells: Sequence[Sequence[str]]) -> tuple[int, int] | None:
    """Row and column of a cell whose mark parts thousands, because decimals have the other mark.

    ``cells`` are rows of the chosen columns. Where dots and commas both stand in them, a column
    with both, or in which all that have a mark are groups of three digits, has thousands. None
    where every column has decimals, if behind unlike marks.

    >>> two_marks([["0.005", "2,003"], ["0.010", "1,998"]])
    (0, 1)
    """
    rows_of: dict[int, dict[str, int]] = {}
    for row, line in enumerate(cells):
        for column, cell in enumerate(line):
            for mark in ".,":
                if mark in cell:
                    rows_of.setdefault(column, {}).setdefault(mark, row)
    if len({mark for marks in rows_of.values() for mark in marks}) < 2:
        return None
    both = [(max(marks.values()), column) for column, marks in rows_of.items() if len(marks) > 1]
    if both:
        return both[0]
    groups, decimal = [], set()
    for column, marks in rows_of.items():
        ((mark, row),) = marks.items()
        if all(ONE_GROUP.fullmatch(line[column]) for line in cells if mark in line[column]):
            groups.append((mark, (row, column)))
        else:
            decimal.add(mark)
    return next((place for mark, place in groups if mark not in decimal), None)
