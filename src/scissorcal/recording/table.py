"""Tables of numbers: text, Parquet or MATLAB by the file's extension, and their columns by name."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.errors import InputError

Wanted = Mapping[str, str | int]
"""Channel to column: the column's heading, or its number from 0."""

LONGEST_COLUMN_NUMBER = 9
"""Digits of a column's number; a longer one is a heading."""


SHOWN = 60
"""Characters of a heading or a line that a sentence shows."""


class Column(NamedTuple):
    """One column with its heading as it stands in the file, shape (N,), not yet converted."""

    heading: str
    values: Array


@dataclass(frozen=True)
class Table:
    """The wanted columns of a file by channel, all of one length, and the file's single numbers.

    ``lines`` has the line number of each row where the file is text, shape (N,). ``notes`` are
    sentences on what was left out.
    """

    path: Path
    columns: Mapping[str, Column]
    scalars: Mapping[str, float] = field(default_factory=dict)
    lines: NDArray[np.int64] | None = None
    notes: tuple[str, ...] = ()

    @property
    def length(self) -> int:
        return max((len(column.values) for column in self.columns.values()), default=0)

    def place(self, row: int, channel: str | None = None) -> str:
        """Name a row (from 0), and a channel's column, as they are found in the file."""
        where = f"line {self.lines[row]}" if self.lines is not None else f"row {row + 1}"
        column = f", column {shortened(self.columns[channel].heading)!r}" if channel else ""
        return f"{self.path}, {where}{column}"


def shortened(text: str) -> str:
    """A text of a file as a sentence shows it, without what is beyond ``SHOWN`` characters."""
    return text if len(text) <= SHOWN else f"{text[:SHOWN]}..."


def find_column(path: Path, headings: Sequence[str], column: str | int, channel: str) -> int:
    """Return the number of a column given by heading, heading without unit, or number.

    >>> find_column(Path("log.csv"), ["t [s]", "Torque [Nm]"], "torque", "motor_torque")
    1
    """
    if isinstance(column, str):
        for simplify in (str.strip, _plain, _without_unit):
            wanted = simplify(column)
            found = [i for i, heading in enumerate(headings) if simplify(heading) == wanted]
            if len(found) > 1:
                raise InputError(
                    f"{path} has {len(found)} columns called {column!r}. Name the one for "
                    f"{channel} by its number, from 0: {', '.join(map(str, found))}."
                )
            if found:
                return found[0]
    number = column if isinstance(column, int) else column_of(column)
    if isinstance(number, int):
        if 0 <= number < len(headings):
            return number
        raise InputError(
            f"{path} has no column {column} for {channel}: its columns are numbered 0 to "
            f"{len(headings) - 1}."
        )
    listed = ", ".join(repr(shortened(heading)) for heading in headings[:30])
    raise InputError(
        f"{path} has no column {column!r} for {channel}. Name one of these, or its number from 0: "
        f"{listed}."
    )


def column_of(word: str) -> str | int:
    """A column as a person names it: the number that it is, or else a heading.

    >>> column_of(" 12 "), column_of("²"), column_of("q")
    (12, '²', 'q')
    """
    digits = word.strip()
    return int(digits) if digits.isdecimal() and len(digits) <= LONGEST_COLUMN_NUMBER else word


def _plain(heading: str) -> str:
    return " ".join(heading.split()).casefold()


def in_brackets(heading: str) -> tuple[str, str] | None:
    """A heading that ends in brackets, without them, and what stands in them; None for others.

    >>> in_brackets("angle (front) [deg] "), in_brackets("angle")
    (('angle (front) ', 'deg'), None)
    """
    text = heading.rstrip()
    if not text.endswith(("]", ")")):
        return None
    body = text[:-1]
    first = max(body.rfind("]"), body.rfind(")")) + 1
    opening = [at for mark in "[(" if (at := body.find(mark, first)) >= 0]
    return (body[: min(opening)], body[min(opening) + 1 :]) if opening else None


def _without_unit(heading: str) -> str:
    parts = in_brackets(heading)
    return _plain(parts[0] if parts else heading)
