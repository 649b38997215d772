"""MATLAB and Parquet files come in as text tables do."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.io import savemat

from scissorcal.recording import import_table
from tests.recording.logs import COLUMNS, assert_holds, refusal, rows


def mat_variables() -> dict[str, Any]:
    table = np.array(rows())
    return {
        "t": table[:, :1],
        "angle": table[None, :, 1],
        "volts": table[:, 2] / 0.25,
        "gain": 0.25,
        "log": {"q": table[:, 1], "both": table[:, 1:]},
        "remark": "text",
    }


MAT_COLUMNS: dict[str, str | int] = {"time": "t", "opening": "angle", "motor_torque": "volts"}
MAT_UNITS = {"time": "s", "opening": "rad", "motor_torque": "V"}


def written_mat73(path: Path) -> None:
    import h5py

    with h5py.File(path, "w", userblock_size=512) as file:

        def put(group: Any, variables: dict[str, Any]) -> None:
            for name, value in variables.items():
                if isinstance(value, dict):
                    put(group.create_group(name), value)
                elif isinstance(value, str):
                    codes = np.array([list(value.encode("utf-16le")[::2])], dtype=np.uint16)
                    group.create_dataset(name, data=codes.T).attrs["MATLAB_class"] = b"char"
                else:
                    # MATLAB knows matrices only, and HDF5 keeps them transposed.
                    group.create_dataset(name, data=np.atleast_2d(np.asarray(value)).T)

        put(file, mat_variables())
    with path.open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\x00\x02IM")


@pytest.mark.parametrize("version", ["5", "7.3"])
def test_matlab_files(tmp_path: Path, version: str) -> None:
    path = tmp_path / "log.mat"
    if version == "5":
        savemat(path, mat_variables())
    else:
        written_mat73(path)
    expected = np.array(rows())
    scale: dict[str, str | float] = {"motor_torque": "gain"}
    recording = import_table(path, columns=MAT_COLUMNS, units=MAT_UNITS, scale=scale)
    np.testing.assert_array_equal(recording.samples["opening"], expected[:, 1])
    np.testing.assert_allclose(recording.samples["motor_torque"], expected[:, 2], rtol=1e-15)
    assert any("times gain = 0.25" in note for note in recording.notes)
    for name, place in (("log.q", 1), ("log.both[0]", 1), ("log.both[1]", 2)):
        found = import_table(
            path, columns={**MAT_COLUMNS, "opening": name}, units=MAT_UNITS, scale=scale
        )
        np.testing.assert_array_equal(found.samples["opening"], expected[:, place])

    def words(**options: Any) -> str:
        chosen = {"columns": MAT_COLUMNS, "units": MAT_UNITS, "scale": scale, **options}
        return refusal(path, **chosen)

    assert "no variable 'q' for opening. Name one of these: " in words(
        columns={**MAT_COLUMNS, "opening": "q"}
    )
    assert "is a matrix. Name the column" in words(columns={**MAT_COLUMNS, "opening": "log.both"})
    assert "has no column 5" in words(columns={**MAT_COLUMNS, "opening": "log.both[5]"})
    assert "no variable 0 for opening" in words(columns={**MAT_COLUMNS, "opening": 0})
    assert "differ in length" in words(columns={**MAT_COLUMNS, "opening": "gain"})
    assert "(these are: gain)" in words(scale={"motor_torque": "gian"})


def test_parquet_files(tmp_path: Path) -> None:
    import pyarrow as pa
    import pyarrow.parquet as pq

    table = np.array(rows())
    path = tmp_path / "log.parquet"
    stamps = pa.array((table[:, 0] * 1e9).round().astype("int64") + 1_700_000_000_000_000_000)
    columns = {
        "t": stamps.cast(pa.timestamp("ns")),
        "angle": table[:, 1],
        "torque": table[:, 2],
        "counts": np.arange(400, dtype=np.int32),
        "state": ["on"] * 400,
        "holes": pa.array([None if i == 7 else float(i) for i in range(400)]),
    }
    pq.write_table(pa.table(columns), path)
    units = {"opening": "rad", "motor_torque": "Nm"}
    assert_holds(import_table(path, columns=COLUMNS, units=units), rows())
    by_number = {"time": 0, "opening": 1, "motor_torque": 3}
    found = import_table(path, columns=by_number, units=units)
    assert found.samples["motor_torque"].tolist() == list(range(400))
    assert "holds string, not numbers" in refusal(
        path, columns={**COLUMNS, "opening": "state"}, units=units
    )
    assert "row 8, column 'holes': nan is not a measurement" in refusal(
        path, columns={**COLUMNS, "opening": "holes"}, units=units
    )
