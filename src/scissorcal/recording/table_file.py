"""Tables as files: read those that `import` and `summarise` take, write those of a recording.

MATLAB files are of version 5 (scipy) or 7.3 (which is HDF5); Parquet takes pyarrow, of the extra
``parquet``; all else is text. Units stand in the columns' names.
"""

import csv
import json
import re
from collections.abc import Iterator, Mapping
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.errors import InputError, file_error, needs_extra
from scissorcal.files import replacing
from scissorcal.foreign import parse_isolated, read_foreign, reading, refuse_unless_regular
from scissorcal.foreign.formats import LOG, MATLAB, PARQUET
from scissorcal.recipe.euler_angles import euler_deg, singular_within_deg
from scissorcal.recording.header import METADATA_NAME
from scissorcal.recording.layout import CHANNELS, TelemetryChannel
from scissorcal.recording.recording import Recording, columns
from scissorcal.recording.scan import scan_file
from scissorcal.recording.schema import RecordingFacts, describe
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


def export_table(recording: Recording, path: str | Path, *, overwrite: bool = False) -> Path:
    """Write the samples as a table; the extension of ``path`` (.parquet or .csv) says which.

    One row a sample, one column a field of SAMPLE_DTYPE, named with its unit (``opening_rad``,
    or ``opening_m`` for a linear joint), and ``time_s``, the device clock from the first sample.
    Every number reads back as the same number. Parquet also carries the recording's description
    (the metadata of ``data_schemas/recording.schema.json``) and notes, under the keys
    ``scissorcal.recording`` and ``scissorcal.notes``.

    The file is written whole or not at all. Raises InputError for another extension, a missing
    folder, an existing file, unless ``overwrite``, or Parquet without pyarrow.
    """
    metadata = describe(
        recording.kind,
        recording.joint,
        RecordingFacts(
            recording.recipe_toml, recording.device, recording.handle_radius_m, recording.strokes
        ),
    )
    about = {
        METADATA_NAME: metadata.model_dump_json(),
        "scissorcal.notes": json.dumps(recording.notes, ensure_ascii=False),
    }
    return _write(columns(recording), about, Path(path), overwrite)


def export_channel(
    recording: str | Path, name: str, path: str | Path, *, overwrite: bool = False
) -> Path:
    """Write the rows of a channel beside the samples as a table: "pose", "picture" or "control".

    ``recording`` is the file. One row a message: ``host_time_ns``, then each field with its unit;
    an array has a column for each number (``translation_x_m``). Raises as `export_table` does,
    and InputError where the recording has no such channel.
    """
    scan = scan_file(Path(recording))
    known = {topic.rpartition("/")[2]: channel for topic, channel in CHANNELS.items()}
    del known["frame"]  # the same poses, for viewers
    there = [name for name in known if known[name].topic in scan.telemetry_rows()]
    if name not in known:
        listed = ", ".join(["sample", *known])
        raise InputError(f"A recording has no channel '{name}'. Name one of these: {listed}.")
    if name not in there:
        raise InputError(
            f"{recording} has no rows of '{name}'; it has: {', '.join(there) or 'samples alone'}."
        )
    channel = known[name]
    return _write(channel_columns(channel, scan.telemetry(channel)), {}, Path(path), overwrite)


def channel_columns(channel: TelemetryChannel, rows: NDArray[np.void]) -> dict[str, NDArray[Any]]:
    """Rows of a channel by column, each (n,), the unit in each column's name."""
    columns_of_channel: dict[str, NDArray[Any]] = {
        "host_time_ns": np.ascontiguousarray(rows["host_time_ns"])
    }
    for name, _, unit, _ in channel.fields:
        values = rows[name]
        plain = unit.replace(" ", "").replace("/", "_per_")
        end = f"_{plain}" if plain and not name.endswith(f"_{plain}") else ""
        parts = _PARTS.get(values.shape[1], ()) if values.ndim > 1 else ()
        for index, part in enumerate(parts):
            columns_of_channel[f"{name}_{part}{end}"] = np.ascontiguousarray(values[:, index])
        if not parts:
            columns_of_channel[f"{name}{end}"] = np.ascontiguousarray(values)
        if name.endswith("quaternion"):
            columns_of_channel |= _angles(rows, name)
    return columns_of_channel


def _angles(rows: NDArray[np.void], name: str) -> dict[str, NDArray[Any]]:
    """The Euler angles of a channel's quaternion, and whether yaw and roll alone are determined.

    Where a pose has a covariance in the same row, it counts for that: a pose's, not a picture's
    noise, which lacks the errors that all pictures share.
    """
    before = name.removesuffix("quaternion")
    degrees = euler_deg(rows[name])
    known = rows.dtype.names or ()
    turns = None
    if "covariance" in known and not before:
        turns = rows["covariance"].reshape(-1, 6, 6)[:, :3, :3]
    free = 90.0 - np.abs(degrees[:, 1]) > singular_within_deg(turns)
    angles: dict[str, NDArray[Any]] = {
        f"{before}{part}_deg": np.ascontiguousarray(degrees[:, index])
        for index, part in enumerate(("yaw", "pitch", "roll"))
    }
    return angles | {f"{before}yaw_and_roll_determined": free.astype(np.int8)}


_PARTS = {
    3: ("x", "y", "z"),
    4: ("w", "x", "y", "z"),
    6: ("turn_x", "turn_y", "turn_z", "x", "y", "z"),
    36: tuple(f"{row}_{column}" for row in range(1, 7) for column in range(1, 7)),
}
"""Names of an array's numbers, by their count."""


def _write(
    columns: dict[str, NDArray[Any]], about: dict[str, str], path: Path, overwrite: bool
) -> Path:
    if path.suffix.lower() not in _WRITERS:
        raise InputError(
            f"{path}: tables are written as {' or '.join(_WRITERS)}. Choose one of these "
            "extensions."
        )
    if path.exists() and not overwrite:
        raise InputError(f"{path} exists. Choose another name, or allow overwriting.")
    if not path.parent.is_dir():
        raise InputError(f"{path.parent} is not a folder. Create it first, or choose another.")
    try:
        with replacing(path) as part:
            _WRITERS[path.suffix.lower()](columns, about, part)
    except OSError as error:
        raise file_error(error, path, "The recording is unchanged.") or error from None
    return path


def _write_csv(columns: dict[str, NDArray[Any]], about: dict[str, str], path: Path) -> None:
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows(zip(*(column.tolist() for column in columns.values()), strict=True))


def _write_parquet(columns: dict[str, NDArray[Any]], about: dict[str, str], path: Path) -> None:
    pa, pq = require_pyarrow()
    table = pa.table(columns).replace_schema_metadata(about)
    pq.write_table(table, path, compression="zstd")


_WRITERS = {".parquet": _write_parquet, ".csv": _write_csv}
