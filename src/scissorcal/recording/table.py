"""Tables of numbers: text, Parquet or MATLAB by the file's extension, and their columns by name."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.errors import InputError
from scissorcal.foreign import reading, refuse_unless_regular
from scissorcal.foreign.formats import LOG, MATLAB, PARQUET

Wanted = Mapping[str, str | int]
"""Channel to column: the column's heading, or its number from 0."""

LONGEST_COLUMN_NUMBER = 9
"""Digits of a column's number; a longer one is a heading."""


SHOWN = 60
"""Characters of a heading or a line that a sentence shows."""


@dataclass(frozen=True)
class Column:
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


def refuse_no_table(path: Path) -> None:
    """Raise InputError where a file is missing, or of another known kind than its extension says.

    For a request that cannot be checked before: what a photograph has no columns for is no fault
    of the request.
    """
    kinds = {".mat": MATLAB, ".parquet": PARQUET, ".pq": PARQUET}
    refuse_unless_regular(path, kinds.get(path.suffix.lower(), LOG))


def read_table(
    path: Path, wanted: Wanted, delimiter: str | None = None, *, drop_last_line: bool = True
) -> Table:
    """Read the wanted columns of a table; the file's extension says its format.

    ``.mat`` is MATLAB, ``.parquet`` and ``.pq`` are Parquet, everything else is text with one
    row a line, of which a last one without its end is left out (``drop_last_line``). Every number
    is finite. Raises InputError naming file, place and remedy.
    """
    suffix = path.suffix.lower()
    if suffix == ".mat":
        from scissorcal.recording.matfile import read_mat

        table = read_mat(path, wanted)
    elif suffix in (".parquet", ".pq"):
        from scissorcal.recording.parquetfile import read_parquet

        table = read_parquet(path, wanted)
    else:
        from scissorcal.recording.textfile import read_text

        with reading(path, LOG):
            table = read_text(path, wanted, delimiter, drop_last_line=drop_last_line)
    _check_lengths(table)
    _check_finite(table)
    return table


def _check_lengths(table: Table) -> None:
    lengths = {column.heading: len(column.values) for column in table.columns.values()}
    if len(set(lengths.values())) > 1:
        listed = ", ".join(
            f"{shortened(heading)!r} has {length}" for heading, length in lengths.items()
        )
        raise InputError(
            f"{table.path}: its columns differ in length ({listed}). Name columns that were "
            "recorded together."
        )
    if table.length < 2:
        raise InputError(
            f"{table.path} holds {table.length} rows of numbers; a motion needs at least two. "
            "Check the names of file and columns."
        )


def _check_finite(table: Table) -> None:
    bad = {
        channel: int(np.argmin(np.isfinite(column.values)))
        for channel, column in table.columns.items()
        if not np.isfinite(column.values).all()
    }
    if bad:
        channel = min(bad, key=lambda name: bad[name])
        value = table.columns[channel].values[bad[channel]]
        count = sum(int(np.sum(~np.isfinite(table.columns[name].values))) for name in bad)
        raise InputError(
            f"{table.place(bad[channel], channel)}: {value} is not a measurement ({count} such "
            "cells in total). Remove those rows, or export the log again."
        )


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
