"""Read the tables that `import` and `summarise` take.

MATLAB files are of version 5 (scipy) or 7.3 (which is HDF5); Parquet takes pyarrow, of the extra
``parquet``; all else is text.
"""

import re
from collections.abc import Iterator, Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np

from scissorcal.errors import InputError, needs_extra
from scissorcal.foreign import parse_isolated, read_foreign, reading, refuse_unless_regular
from scissorcal.foreign.formats import LOG, MATLAB, PARQUET
from scissorcal.recording.table import Column, Table, Wanted, find_column, shortened
from scissorcal.recording.textfile import read_text, text_headings

MOST_ROWS = 40_000_000
"""Eleven hours at 1 kHz. A file states its rows, and a few bytes can state any number."""


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
        table = _read_mat(path, wanted)
    elif suffix in (".parquet", ".pq"):
        table = read_parquet(path, wanted)
    else:
        with reading(path, LOG):
            table = read_text(path, wanted, delimiter, drop_last_line=drop_last_line)
    _check_lengths(table)
    _check_finite(table)
    return table


def read_headings(path: Path, delimiter: str | None = None) -> list[str]:
    """What a table calls its columns; of a .mat file, variables as `read_table` takes them.

    A variable of size one is a number, not a column, and left out. Raises InputError where the file
    is missing or no table.
    """
    refuse_no_table(path)
    suffix = path.suffix.lower()
    if suffix in (".parquet", ".pq"):
        return parquet_headings(path)
    if suffix != ".mat":
        with reading(path, LOG):
            return text_headings(path, delimiter)
    data = read_foreign(path, MATLAB)
    variables = parse_isolated(f"{__name__}:_load_variables", data, path, MATLAB)
    names: list[str] = []
    for name, values in variables.items():
        if values.ndim == 2 and 1 not in values.shape:
            names += [f"{name}[{place}]" for place in range(values.shape[1])]
        elif values.size > 1:
            names.append(name)
    return names


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


def read_parquet(path: Path, wanted: Wanted) -> Table:
    """Read the columns. Raises InputError where the file or a column cannot be used."""
    require_pyarrow()
    data = read_foreign(path, PARQUET)
    headings = parquet_headings(path, data)
    chosen = {
        channel: find_column(path, headings, column, channel) for channel, column in wanted.items()
    }
    numbers = sorted(set(chosen.values()))
    options = {"numbers": numbers, "path": str(path)}
    read = parse_isolated(f"{__name__}:_load_columns", data, path, PARQUET, **options)
    columns = {}
    for channel, number in chosen.items():
        heading, values = read[numbers.index(number)]
        columns[channel] = Column(heading, values)
    return Table(path, columns)


def parquet_headings(path: Path, data: bytes | None = None) -> list[str]:
    """The names of a Parquet file's columns. Raises InputError as `read_parquet` does."""
    require_pyarrow()
    data = read_foreign(path, PARQUET) if data is None else data
    headings: list[str] = parse_isolated(f"{__name__}:_load_headings", data, path, PARQUET)
    return headings


def _load_headings(data: bytes) -> list[str]:
    """The names of the columns; called in a child process."""
    pa, pq = require_pyarrow()
    return list(pq.read_schema(pa.BufferReader(data)).names)


def _load_columns(data: bytes, numbers: list[int], path: str) -> list[tuple[str, Any]]:
    """Heading, with the unit of a time, and values of columns; called in a child process."""
    pa, pq = require_pyarrow()
    pa.set_cpu_count(1)
    file = pq.ParquetFile(pa.BufferReader(data))
    if file.metadata.num_rows > MOST_ROWS:
        raise InputError(
            f"{path} states {file.metadata.num_rows} rows, more than a log has ({MOST_ROWS}): "
            "export a part of it."
        )
    names = file.schema_arrow.names
    table = file.read(columns=[names[number] for number in numbers], use_threads=False)
    columns_read = []
    for number in numbers:
        heading = names[number]
        column = table.column(heading)
        if pa.types.is_timestamp(column.type) or pa.types.is_duration(column.type):
            heading = f"{heading} [{column.type.unit}]"
            column = column.cast(pa.int64())
        elif not (pa.types.is_integer(column.type) or pa.types.is_floating(column.type)):
            raise InputError(
                f"{path}, column {heading!r} holds {column.type}, not numbers. Convert it, or "
                "name another column."
            )
        columns_read.append((heading, column.cast(pa.float64(), safe=False).to_numpy()))
    return columns_read


def require_pyarrow() -> tuple[Any, Any]:
    """Import pyarrow and pyarrow.parquet. Raises InputError where they are not installed."""
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError:
        raise needs_extra("Parquet", "pyarrow", "parquet", "use CSV") from None
    return pa, pq


def _read_mat(path: Path, wanted: Wanted) -> Table:
    """Read variables of a MATLAB file as columns.

    A column is named as the variable is; ``data.q`` is a field of a structure, ``X[2]`` the third
    column of a matrix. All numbers of size one are the table's ``scalars``. The parsers of both
    versions run in a child process.
    """
    data = read_foreign(path, MATLAB)
    variables = parse_isolated(f"{__name__}:_load_variables", data, path, MATLAB)
    columns = {channel: _column(path, variables, name, channel) for channel, name in wanted.items()}
    scalars = {name: float(v.ravel()[0]) for name, v in variables.items() if v.size == 1}
    return Table(path, columns, scalars)


def _column(path: Path, variables: Mapping[str, Any], name: str | int, channel: str) -> Column:
    match = re.fullmatch(r"\s*([\w.]+)(?:\[(\d{1,9})\])?\s*", str(name))
    values = variables.get(match[1]) if match else None
    if match is None or values is None:
        listed = ", ".join(f"{key} {_size(value)}" for key, value in variables.items())
        raise InputError(
            f"{path} has no variable {name!r} for {channel}. Name one of these: {listed or 'none'}."
        )
    if match[2] is not None:
        if values.ndim != 2 or int(match[2]) >= values.shape[1]:
            raise InputError(
                f"{path}: {match[1]} {_size(values)} has no column {match[2]} (from 0) for "
                f"{channel}. Name one that it has."
            )
        values = values[:, int(match[2])]
    elif values.ndim == 2 and 1 not in values.shape:
        raise InputError(
            f"{path}: {match[1]} {_size(values)} is a matrix. Name the column for {channel} by "
            f"its number from 0, for example {match[1]}[0]."
        )
    return Column(str(name), values.astype(np.float64).ravel())


def _flat(variables: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield the real numeric arrays, those in structures under dotted names."""
    for name, value in variables.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{name}.")
        elif not name.startswith("__"):
            array = np.asarray(value)
            if array.dtype.kind in "fiub" and array.size:
                yield prefix + name, array


def _load_variables(data: bytes) -> dict[str, Any]:
    """The real numeric arrays of a MATLAB file by name; called in a child process."""
    load = _load_hdf5 if data.startswith(b"MATLAB 7.3") else _load_version_5
    return dict(_flat(load(data)))


def _load_version_5(data: bytes) -> Mapping[str, Any]:
    from scipy.io import loadmat

    stream: Any = BytesIO(data)
    variables: Mapping[str, Any] = loadmat(stream, simplify_cells=True)
    return variables


def _load_hdf5(data: bytes) -> Mapping[str, Any]:
    """Read version 7.3, which keeps arrays transposed in HDF5; cells and text are left out."""
    import h5py

    def read(group: Any) -> dict[str, Any]:
        variables: dict[str, Any] = {}
        for name, item in group.items():
            if name.startswith("#"):
                continue
            if isinstance(item, h5py.Group):
                variables[name] = read(item)
            elif item.dtype.kind in "fiub" and item.attrs.get("MATLAB_class") != b"char":
                variables[name] = np.asarray(item).T
        return variables

    with h5py.File(h5py.h5f.open_file_image(data), "r") as file:
        return read(file)


def _size(value: Any) -> str:
    shape = value.shape or (1,)
    return f"({' x '.join(map(str, shape))})"
