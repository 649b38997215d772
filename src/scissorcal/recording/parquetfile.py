"""Read the wanted columns of a Parquet file, with pyarrow of the extra ``parquet``."""

from pathlib import Path
from typing import Any

from scissorcal.errors import InputError
from scissorcal.recording.table import Column, Table, Wanted, find_column


def read_parquet(path: Path, wanted: Wanted) -> Table:
    """Read the columns. Raises InputError where the file or a column cannot be used."""
    pa, pq = require_pyarrow()
    try:
        file = pq.ParquetFile(path)
        headings = file.schema_arrow.names
        chosen = {
            channel: find_column(path, headings, column, channel)
            for channel, column in wanted.items()
        }
        data = file.read(columns=sorted({headings[number] for number in chosen.values()}))
    except (pa.ArrowException, OSError) as error:
        raise InputError(
            f"{path} cannot be read as Parquet: {str(error).rstrip('. ')}. Write it again, or "
            "export it as CSV."
        ) from error
    columns = {}
    for channel, number in chosen.items():
        heading = headings[number]
        column = data.column(heading)
        if pa.types.is_timestamp(column.type) or pa.types.is_duration(column.type):
            heading = f"{heading} [{column.type.unit}]"
            column = column.cast(pa.int64())
        elif not (pa.types.is_integer(column.type) or pa.types.is_floating(column.type)):
            raise InputError(
                f"{path}, column {heading!r} holds {column.type}, not numbers. Convert it, or "
                f"name another column for {channel}."
            )
        columns[channel] = Column(heading, column.cast(pa.float64(), safe=False).to_numpy())
    return Table(path, columns)


def require_pyarrow() -> tuple[Any, Any]:
    """Import pyarrow and pyarrow.parquet. Raises InputError where they are not installed."""
    try:
        import pyarrow as pa
        import pyarrow.parquet as pq
    except ImportError:
        raise InputError(
            "Parquet needs pyarrow, which is not installed: pip install 'scissorcal[parquet]', or "
            "use CSV."
        ) from None
    return pa, pq
