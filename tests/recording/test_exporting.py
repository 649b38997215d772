"""Exported tables hold the same numbers, and come back by import."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from pyarrow import csv
from pyarrow import parquet as pq

from scissorcal.errors import InputError
from scissorcal.recording import (
    SAMPLE_DTYPE,
    ImportOptions,
    Joint,
    Recording,
    export_table,
    import_table,
)
from scissorcal.recording.layout import column_name
from tests.recording.made import made_recording, made_samples


def written_and_read(recording: Recording, path: Path) -> dict[str, np.ndarray]:
    export_table(recording, path)
    table = pq.read_table(path) if path.suffix == ".parquet" else csv.read_csv(path)
    return {name: table.column(name).to_numpy() for name in table.column_names}


@pytest.mark.parametrize("suffix", [".parquet", ".csv"])
@pytest.mark.parametrize("kind", ["rotary", "linear"])
def test_every_number_reads_back_the_same(tmp_path: Path, suffix: str, kind: str) -> None:
    joint = Joint("rotary" if kind == "rotary" else "linear")
    recording = Recording("friction", made_samples(1000), joint=joint)
    found = written_and_read(recording, tmp_path / f"a{suffix}")
    for field in SAMPLE_DTYPE.names or ():
        np.testing.assert_array_equal(found[column_name(field, joint)], recording.samples[field])
    np.testing.assert_array_equal(found["time_s"], recording.device_time_s)
    assert ("opening_m" in found) == (kind == "linear")
    assert ("motor_torque_Nm" in found) == (kind == "rotary")
    assert [path.name for path in tmp_path.iterdir()] == [f"a{suffix}"]


@pytest.mark.parametrize("suffix", [".parquet", ".csv"])
def test_an_export_is_imported_without_stating_units(tmp_path: Path, suffix: str) -> None:
    recording = made_recording(2500)
    path = export_table(recording, tmp_path / f"a{suffix}")
    channels = ("advance", "motor_torque", "handle_force", "torque_command", "force_command")
    found = import_table(
        path,
        columns={
            "time": "time_s",
            "opening": "opening_rad",
            **{channel: column_name(channel, recording.joint) for channel in channels},
        },
        options=ImportOptions(kind="cut", handle_radius_m=0.06),
    )
    for channel in ("opening", *channels):
        np.testing.assert_array_equal(found.samples[channel], recording.samples[channel])
    np.testing.assert_array_equal(
        np.diff(found.samples["device_time_us"]), np.diff(recording.samples["device_time_us"])
    )
    assert [stroke.kind for stroke in found.strokes] == ["closing", "opening", "closing"]


def test_parquet_carries_the_description(tmp_path: Path) -> None:
    path = export_table(made_recording(20), tmp_path / "a.parquet")
    metadata = pq.read_schema(path).metadata
    described = json.loads(metadata[b"scissorcal.recording"])
    assert described["recipe_toml"].startswith('name = "paper"')
    assert described["strokes"][0]["kind"] == "closing"
    assert json.loads(metadata[b"scissorcal.notes"]) == ["Two frames were garbled."]


def test_existing_files_are_kept_and_wrong_names_are_refused(tmp_path: Path) -> None:
    recording = made_recording(20)
    path = tmp_path / "a.csv"
    path.write_text("precious")
    with pytest.raises(InputError, match=r"a\.csv exists"):
        export_table(recording, path)
    assert path.read_text() == "precious"
    export_table(recording, path, overwrite=True)
    assert path.read_text().startswith("sequence,")
    with pytest.raises(InputError, match=r"written as \.parquet or \.csv"):
        export_table(recording, tmp_path / "a.xlsx")
    with pytest.raises(InputError, match="is not a folder"):
        export_table(recording, tmp_path / "nowhere" / "a.csv")


def test_an_empty_recording_gives_a_table_without_rows(tmp_path: Path) -> None:
    found = written_and_read(Recording("friction", made_samples(0)), tmp_path / "a.parquet")
    assert len(found["opening_rad"]) == 0


def test_without_pyarrow_csv_works_and_parquet_names_the_extra(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    recording = made_recording(20)
    assert export_table(recording, tmp_path / "a.csv").is_file()
    with pytest.raises(InputError, match=r"pip install 'scissorcal\[parquet\]', or use CSV"):
        export_table(recording, tmp_path / "a.parquet")
    (tmp_path / "b.parquet").write_bytes(b"PAR1")
    with pytest.raises(InputError, match=r"scissorcal\[parquet\]"):
        import_table(tmp_path / "b.parquet", columns={"time": 0, "opening": 1, "motor_torque": 2})
    assert not (tmp_path / "a.parquet").exists()
