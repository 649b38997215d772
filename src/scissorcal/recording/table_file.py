"""Read a table from a file of any kind that `import` and `summarise` take."""

from pathlib import Path

import numpy as np

from scissorcal.errors import InputError
from scissorcal.foreign import reading, refuse_unless_regular
from scissorcal.foreign.formats import LOG, MATLAB, PARQUET
from scissorcal.recording.table import Table, Wanted, shortened


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
