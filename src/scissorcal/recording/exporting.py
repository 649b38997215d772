"""Export a recording to Parquet or CSV, with units in the columns' names."""

import csv
import json
from pathlib import Path

from scissorcal.errors import InputError, file_error
from scissorcal.files import replacing
from scissorcal.recording import layout
from scissorcal.recording.header import METADATA_NAME
from scissorcal.recording.parquetfile import require_pyarrow
from scissorcal.recording.recording import Recording
from scissorcal.recording.schema import describe


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
    path = Path(path)
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
            _WRITERS[path.suffix.lower()](recording, part)
    except OSError as error:
        raise file_error(error, path, "The recording is unchanged.") or error from None
    return path


def _write_csv(recording: Recording, path: Path) -> None:
    columns = layout.columns(recording)
    with path.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        writer.writerows(zip(*(column.tolist() for column in columns.values()), strict=True))


def _write_parquet(recording: Recording, path: Path) -> None:
    pa, pq = require_pyarrow()
    metadata = describe(
        recording.kind,
        recording.joint,
        recording.handle_radius_m,
        recording.strokes,
        recording.recipe_toml,
        recording.device,
    )
    table = pa.table(layout.columns(recording)).replace_schema_metadata(
        {
            METADATA_NAME: metadata.model_dump_json(),
            "scissorcal.notes": json.dumps(recording.notes, ensure_ascii=False),
        }
    )
    pq.write_table(table, path, compression="zstd")


_WRITERS = {".parquet": _write_parquet, ".csv": _write_csv}
