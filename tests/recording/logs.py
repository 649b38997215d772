"""A made-up log, as a table in text, and what an import of it must hold."""

from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from scissorcal.errors import InputError
from scissorcal.recording import ImportOptions, Recording, import_table

COLUMNS: dict[str, str | int] = {"time": "t", "opening": "angle", "motor_torque": "torque"}
UNITS = {"time": "s", "opening": "rad", "motor_torque": "Nm"}


def rows(count: int = 400) -> list[list[float]]:
    """Half a turn each second between 0.2 and 0.8 rad, 100 samples a second."""
    time = np.arange(count) / 100
    opening = 0.5 + 0.3 * np.cos(np.pi * time)
    torque = 0.1 * np.sin(3 * time) + 1e-3
    return [list(row) for row in np.column_stack([time, opening, torque]).tolist()]


def written(
    path: Path, table: list[list[Any]], delimiter: str = ",", head: str | None = "t,angle,torque"
) -> Path:
    lines = [] if head is None else [head.replace(",", delimiter)]
    lines += [delimiter.join(map(str, row)) for row in table]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return path


def assert_holds(recording: Recording, table: list[list[float]]) -> None:
    expected = np.array(table)
    np.testing.assert_allclose(recording.device_time_s, expected[:, 0], rtol=0, atol=5e-7)
    np.testing.assert_array_equal(recording.samples["opening"], expected[:, 1])
    np.testing.assert_array_equal(recording.samples["motor_torque"], expected[:, 2])


def imported(path: Path, **chosen: Any) -> Recording:
    """`import_table`, with its options among the other keywords."""
    names = {field.name for field in fields(ImportOptions)} & set(chosen)
    options = ImportOptions(**{name: chosen.pop(name) for name in names})
    return import_table(path, **chosen, options=options)


def refusal(path: Path, **options: Any) -> str:
    chosen = {"columns": COLUMNS, "units": UNITS, **options}
    with pytest.raises(InputError) as caught:
        imported(path, **chosen)
    return str(caught.value)
