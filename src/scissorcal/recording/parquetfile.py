"""Read the wanted columns of a Parquet file, with pyarrow of the extra ``parquet``."""

from pathlib import Path
from typing import Any

from scissorcal.errors import InputError, needs_extra
from scissorcal.foreign import parse_isolated, read_foreign
from scissorcal.foreign.formats import PARQUET
from scissorcal.recording.table import Column, Table, Wanted, find_column

MOST_ROWS = 40_000_000
"""Eleven hours at 1 kHz. A file states its rows, and a few bytes can state any number."""


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
    read = parse_isolated(f"{__name__}:load_columns", data, path, PARQUET, **options)
    columns = {}
    for channel, number in chosen.items():
        heading, values = read[numbers.index(number)]
        columns[channel] = Column(heading, values)
    return Table(path, columns)


def parquet_headings(path: Path, data: bytes | None = None) -> list[str]:
    """The names of a Parquet file's columns. Raises InputError as `read_parquet` does."""
    require_pyarrow()
    data = read_foreign(path, PARQUET) if data is None else data
    found: list[str] = parse_isolated(f"{__name__}:load_headings", data, path, PARQUET)
    return found


def load_headings(data: bytes) -> list[str]:
    """The names of the columns; called in a child process."""
    pa, pq = require_pyarrow()
    return list(pq.read_schema(pa.BufferReader(data)).names)


def load_columns(data: bytes, numbers: list[int], path: str) -> list[tuple[str, Any]]:
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
    found = []
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
        found.append((heading, column.cast(pa.float64(), safe=False).to_numpy()))
    return found


def require_pyarrow() -> tuple[Any, Any]:
    """Import pyarrow and pyarrow.parquet. Raises InputError where they are not installed."""
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError:
        raise needs_extra("Parquet", "pyarrow", "parquet", "use CSV") from None
    return pa, pq
