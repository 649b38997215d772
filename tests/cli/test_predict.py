"""scissorcal predict: numbers, files, and what it refuses."""

import sys
from pathlib import Path

import pytest

from scissorcal.recording import export_table, read_recording
from scissorcal.workday import Workspace
from tests.workday.made import fitted_copy, quick_workspace, record_friction

from .conftest import Cli


@pytest.fixture(scope="module")
def fitted(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    return fitted_copy(tmp_path_factory, tmp_path_factory.mktemp("predict") / "paper", "friction")


@pytest.fixture(scope="module")
def fresh(fitted: Workspace, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of the same joint that no fit has seen."""
    other = quick_workspace(tmp_path_factory.mktemp("fresh") / "paper")
    return record_friction(other, seed=5)


def test_a_fresh_recording_lies_in_the_band_as_often_as_promised(
    fitted: Workspace, fresh: Path, cli: Cli, tmp_path: Path
) -> None:
    """Six strokes of noise with memory: the share scatters by 4 %, so 0.75 is a bound of 4 sds."""
    plot, table = tmp_path / "torque.svg", tmp_path / "torque.csv"
    words = ("predict", "friction", fresh, "-w", fitted.root, "--plot", plot, "--table", table)
    said = cli(*words)
    assert said.code == 0
    assert "90% band: +- " in said.out
    assert "of the samples of a new stroke" in said.out
    assert "prediction: reading recordings" in said.err
    assert plot.read_text().startswith("<?xml")
    head, *rows = table.read_text().splitlines()
    assert head.split(",")[:4] == ["time_s", "opening_rad", "opening_rate_rad_per_s", "moving"]
    assert head.split(",")[-1] == "high_Nm"
    result = cli(*words, "--json").envelope["result"]
    assert len(rows) == result["samples"]
    assert 0.75 < result["share_inside"] <= 1.0
    assert result["band"]["unit"] == "stroke"
    assert result["band"]["count"] == 6


def test_a_table_of_motion_alone_is_enough(
    fitted: Workspace, fresh: Path, cli: Cli, tmp_path: Path
) -> None:
    whole = export_table(read_recording(fresh), tmp_path / "whole.csv")
    head, *rows = whole.read_text().splitlines()
    names = head.replace('"', "").split(",")
    kept = [names.index("time_s"), names.index("opening_rad")]
    bare = tmp_path / "motion.csv"
    cells = [",".join(row.split(",")[i] for i in kept) for row in (head, *rows)]
    bare.write_text("\n".join(cells) + "\n")
    said = cli("predict", "friction", bare, "-w", fitted.root, "--plot", tmp_path / "bare.png")
    assert said.code == 0
    assert "no effort to compare with" in said.out
    by_motion = cli("predict", "friction", bare, "-w", fitted.root, "--json").envelope["result"]
    assert by_motion["share_inside"] is None


def test_a_plot_without_matplotlib_is_refused_before_anything_is_read(
    workspace: Path, cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing was captured or fitted here, which would be said first, with exit code 5."""
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    said = cli("predict", "friction", tmp_path / "none.mcap", "--plot", tmp_path / "plot.svg")
    assert said.code == 2
    assert "--plot needs matplotlib, which is not installed" in said.err
    assert "pip install 'scissorcal[plots]', or give --table FILE.csv." in said.err


def test_wrong_files_and_laws_are_refused_with_the_mend(
    fitted: Workspace, fresh: Path, workspace: Path, cli: Cli, tmp_path: Path
) -> None:
    at = ("-w", fitted.root)
    said = cli("predict", "load", fresh, *at)
    assert said.code == 2
    assert "has no load" in said.err
    said = cli("predict", "friction", tmp_path / "none.mcap", *at)
    assert said.code == 2
    assert "does not exist" in said.err
    wrong = tmp_path / "wrong.csv"
    wrong.write_text("t,angle\n0,1\n")
    said = cli("predict", "friction", wrong, *at)
    assert said.code == 2
    assert "time_s and opening_rad" in said.err
    said = cli("predict", "friction", fresh, *at, "--plot", tmp_path / "plot.doc")
    assert said.code == 2
    assert ".svg or .png" in said.err
    assert cli("predict", "friction", fresh).code == 5
