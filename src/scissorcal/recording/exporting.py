"""Export a recording to Parquet or CSV, with units in the columns' names."""

import math
from pathlib import Path
from typing import TYPE_CHECKING

from scissorcal.errors import InputError, ScissorcalError
from scissorcal.recording import layout
from scissorcal.recording.header import METADATA_NAME
from scissorcal.recording.recording import Recording
from scissorcal.recording.schema import RecordingMetadata, stroke_records, versions

if TYPE_CHECKING:
    import pyarrow as pa

SUFFIXES = (".parquet", ".csv")


def export_table(recording: Recording, path: str | Path, *, overwrite: bool = False) -> Path:
    """Write the samples as a table; the extension of ``path`` (.parquet or .csv) says which.

    One row a sample, one column a field of SAMPLE_DTYPE, named with its unit (``opening_rad``,
    or ``opening_m`` for a linear joint), and ``time_s``, the device clock from the first sample.
    Every number reads back as the same number. Parquet also carries the recording's description
    (the metadata of ``data_schemas/recording.schema.json``) and notes, under the keys
    ``scissorcal.recording`` and ``scissorcal.notes``.

    The file is written whole or not at all. Raises InputError for another extension, a missing
    folder, or an existing file, unless ``overwrite``.
    """
    path = Path(path)
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(
            f"{path}: tables are written as {' or '.join(SUFFIXES)}. Choose one of these "
            "extensions."
        )
    if path.exists() and not overwrite:
        raise InputError(f"{path} exists. Choose another name, or allow overwriting.")
    if not path.parent.is_dir():
        raise InputError(f"{path.parent} is not a folder. Create it first, or choose another.")
    draft = path.with_name(path.name + layout.PART_SUFFIX)
    try:
        _write(_as_table(recording), draft, path.suffix.lower())
        draft.replace(path)
    except OSError as error:
        draft.unlink(missing_ok=True)
        raise ScissorcalError(
            f"{path} could not be written: {error.strerror or error}. The recording is "
            "unchanged. Free disk space or choose another folder."
        ) from error
    return path


def _as_table(recording: Recording) -> "pa.Table":
    import json

    import numpy as np
    import pyarrow as pa

    columns = {}
    for field in layout.fields():
        name = layout.column_name(field, recording.joint)
        columns[name] = np.ascontiguousarray(recording.samples[field])
        if field == "device_time_us":
            columns["time_s"] = recording.device_time_s
    table = pa.table(columns)
    return table.replace_schema_metadata(
        {
            METADATA_NAME: _description(recording).model_dump_json(),
            "scissorcal.notes": json.dumps(recording.notes, ensure_ascii=False),
        }
    )


def _description(recording: Recording) -> RecordingMetadata:
    radius = recording.handle_radius_m
    return RecordingMetadata(
        kind=recording.kind,
        joint=recording.joint.kind,
        handle_radius_m=radius if math.isfinite(radius) else None,
        strokes=stroke_records(recording.strokes),
        recipe_toml=recording.recipe_toml,
        device=dict(recording.device),
        versions=versions(),
    )


def _write(table: "pa.Table", path: Path, suffix: str) -> None:
    if suffix == ".parquet":
        import pyarrow.parquet as pq

        pq.write_table(table, path, compression="zstd")
    else:
        from pyarrow import csv

        csv.write_csv(table, path)
