"""Write a recording, or a channel of it, as a table; units stand in the columns' names."""

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.errors import InputError, file_error
from scissorcal.files import replacing
from scissorcal.recipe.euler_angles import euler_deg, singular_within_deg
from scissorcal.recording.header import METADATA_NAME
from scissorcal.recording.layout import CHANNELS, TelemetryChannel
from scissorcal.recording.recording import Recording, columns
from scissorcal.recording.scan import scan_file
from scissorcal.recording.schema import RecordingFacts, describe
from scissorcal.recording.table_file import require_pyarrow


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
