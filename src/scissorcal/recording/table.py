"""A table of numbers from a file, and how its columns are found by name."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scissorcal.errors import InputError

Array = NDArray[np.float64]
Wanted = Mapping[str, str | int]
"""Channel to column: the column's heading, or its number from 0."""


@dataclass(frozen=True)
class Column:
    """One column with its heading as it stands in the file, shape (N,), not yet converted."""

    heading: str
    values: Array


@dataclass(frozen=True)
class Table:
    """The wanted columns of a file by channel, all of one length, and the file's single numbers.

    ``lines`` has the line number of each row where the file is text, shape (N,).
    """

    path: Path
    columns: Mapping[str, Column]
    scalars: Mapping[str, float] = field(default_factory=dict)
    lines: NDArray[np.int64] | None = None

    @property
    def length(self) -> int:
        return max((len(column.values) for column in self.columns.values()), default=0)

    def place(self, row: int, channel: str | None = None) -> str:
        """Name a row (from 0), and a channel's column, as they are found in the file."""
        where = f"line {self.lines[row]}" if self.lines is not None else f"row {row + 1}"
        column = f", column {self.columns[channel].heading!r}" if channel else ""
        return f"{self.path}, {where}{column}"


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
    if isinstance(column, int) or column.strip().isdecimal():
        if 0 <= int(column) < len(headings):
            return int(column)
        raise InputError(
            f"{path} has no column {column} for {channel}: its columns are numbered 0 to "
            f"{len(headings) - 1}."
        )
    listed = ", ".join(repr(heading) for heading in headings[:30])
    raise InputError(
        f"{path} has no column {column!r} for {channel}. Name one of these, or its number from 0: "
        f"{listed}."
    )


def _plain(heading: str) -> str:
    return " ".join(heading.split()).casefold()


def _without_unit(heading: str) -> str:
    return _plain(re.sub(r"[\[(][^\])]*[\])]\s*$", "", heading))
