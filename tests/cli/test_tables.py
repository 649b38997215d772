"""scissorcal import, export and recording show."""

import os
from pathlib import Path

import numpy as np
import pytest

from .conftest import Cli

EMPS = Path(__file__).resolve().parents[2].parent / "shared" / "data" / "emps" / "DATA_EMPS.mat"


def log(folder: Path, edit: str = "") -> Path:
    """Write a CSV of a slow to-and-fro motion; ``edit`` replaces its 500th row."""
    time = np.arange(4000) * 1e-3
    angle = 30 + 15 * np.cos(2 * np.pi * time / 2)
    torque = 0.015 * np.sign(np.gradient(angle))
    rows = [f"{t:.3f},{a:.6f},{u:.6f}" for t, a, u in zip(time, angle, torque, strict=True)]
    if edit:
        rows[499] = edit
    path = folder / "log.csv"
    path.write_text("\n".join(["time [s],angle [deg],torque [N m]", *rows]) + "\n")
    return path


COLUMNS = ["-c", "time=time [s]", "-c", "opening=angle [deg]", "-c", "motor_torque=torque [N m]"]


def test_a_log_becomes_a_recording_and_goes_out_again(cli: Cli, workspace: Path) -> None:
    said = cli("import", log(workspace), *COLUMNS, "--json")
    assert said.code == 0
    result = said.envelope["result"]
    assert (result["samples"], result["joint"], result["effort_unit"]) == (4000, "rotary", "N m")
    (recording,) = said.envelope["files"]
    assert Path(recording).parent == workspace / "captures"

    shown = cli("recording", "show", recording)
    assert shown.code == 0
    assert "4000 samples in 4.0 s at 1000 Hz, nothing missing" in shown.out
    facts = cli("recording", "show", recording, "--json").envelope["result"]["recording"]
    opening = next(row for row in facts["ranges"] if row["channel"] == "opening")
    assert opening["high"] == pytest.approx(np.radians(45))

    for ending in ("csv", "parquet"):
        table = workspace / f"out.{ending}"
        assert cli("export", recording, table, "--json").envelope["result"]["rows"] == 4000
        assert table.is_file()
        assert cli("export", recording, table).code == 2
        assert cli("export", recording, table, "--overwrite").code == 0
    assert "opening_rad" in (workspace / "out.csv").read_text().splitlines()[0]


def test_without_a_workspace_the_output_is_named(cli: Cli, tmp_path: Path) -> None:
    target = tmp_path / "friction.mcap"
    said = cli("import", log(tmp_path), *COLUMNS, "--output", target)
    assert said.code == 0
    assert target.is_file()


@pytest.mark.parametrize(
    ("edit", "place"),
    [
        ("0.499,nan,0.01", "501"),
        ("0.499,,0.01", "501"),
        ("0.499,fast,0.01", "501"),
        ("0.498,30,0.01", "501"),
        ("0.6,30,0.01", "502"),
    ],
)
def test_a_bad_row_is_named(edit: str, place: str, cli: Cli, workspace: Path) -> None:
    said = cli("import", log(workspace, edit), *COLUMNS)
    assert said.code == 2
    assert "log.csv" in said.err
    assert place in said.err
    assert not list(workspace.glob("captures/*"))


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (["-c", "angle"], "is not of the form CHANNEL=..."),
        (["-c", "time=time [s]", "-c", "time=x"], "time is given twice"),
        (["-c", "opning=angle [deg]"], "Did you mean 'opening'"),
        ([*COLUMNS[:4], "-c", "motor_torque=moment"], "log.csv"),
        ([*COLUMNS, "-u", "opening=mm"], "joint"),
    ],
)
def test_a_wrong_request_is_mended(
    words: list[str], expected: str, cli: Cli, workspace: Path
) -> None:
    said = cli("import", log(workspace), *words)
    assert said.code == 2
    assert expected in said.err


@pytest.mark.parametrize("content", [b"", b"no recording at all", os.urandom(4096)])
def test_a_foreign_recording_is_named(content: bytes, cli: Cli, tmp_path: Path) -> None:
    path = tmp_path / "foreign.mcap"
    path.write_bytes(content)
    for words in (["recording", "show", path], ["export", path, tmp_path / "x.csv"]):
        said = cli(*words)
        assert said.code == 2
        assert "foreign.mcap" in said.err


@pytest.mark.skipif(not EMPS.is_file(), reason=f"real data not here: {EMPS}")
def test_a_real_linear_axis_is_imported_and_fitted(cli: Cli, workspace: Path) -> None:
    words = "-c time=t -c opening=qm -c motor_torque=vir -u time=s -u opening=m -u motor_torque=V"
    options = [*words.split(), "-s", "motor_torque=gtau", "--joint", "linear"]
    said = cli("import", EMPS, *options, "--json")
    assert said.code == 0
    assert said.envelope["result"]["effort_unit"] == "N"
    assert said.envelope["result"]["samples"] == 24841
    fitted = cli("fit", "friction", "--effort", "draft", "--json").envelope["result"]
    units = {parameter["name"]: parameter["unit"] for parameter in fitted["parameters"]}
    assert units["inertia"] == "kg"
    mass = next(row for row in fitted["parameters"] if row["name"] == "inertia")
    assert mass["mean"] == pytest.approx(95.154, rel=0.02)
