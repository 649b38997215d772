"""Designed captures in a workspace: kept, read back while they hold, and captured."""

import json
from pathlib import Path

import pytest

from scissorcal.cli.root import run
from scissorcal.device.completeness import completeness
from scissorcal.errors import InputError
from scissorcal.recording import Recording, empty_samples, read_recording
from scissorcal.workday.engine import Engine
from scissorcal.workday.plan import make_plan
from scissorcal.workday.runs import design
from scissorcal.workday.runs.design import design_captures, stored_design
from scissorcal.workday.workspace import Workspace, create_workspace


@pytest.fixture(scope="module")
def designed(tmp_path_factory: pytest.TempPathFactory) -> Workspace:
    workspace = create_workspace(tmp_path_factory.mktemp("designed") / "day", "press-only")
    design_captures(workspace)
    return workspace


def test_a_design_is_kept_and_read_back_as_it_was(designed: Workspace) -> None:
    found = stored_design(Engine.of(designed))
    assert found is not None
    assert found.minutes < found.listed_minutes
    assert found.within_expected > 0.95
    assert found.rows[0].capture == "friction"
    assert found.rows[-1].total_minutes == pytest.approx(found.minutes)
    assert len(found.assumed) == 3
    assert make_plan(designed).design == found


def test_a_design_for_another_recipe_or_another_version_is_not_shown(designed: Workspace) -> None:
    text = designed.recipe_path.read_text(encoding="utf-8")
    kept = designed.design_path.read_text(encoding="utf-8")
    try:
        changed = text.replace("contact_mm = [39.0", "contact_mm = [40.0")
        assert changed != text
        designed.recipe_path.write_text(changed, encoding="utf-8")
        assert stored_design(Engine.of(designed)) is None
        designed.recipe_path.write_text(text, encoding="utf-8")
        assert stored_design(Engine.of(designed)) is not None
        other = {**json.loads(kept), "format": "scissorcal-capture-design/0"}
        designed.design_path.write_text(json.dumps(other), encoding="utf-8")
        assert stored_design(Engine.of(designed)) is None
        designed.design_path.write_text("not JSON", encoding="utf-8")
        assert make_plan(designed).design is None
    finally:
        designed.recipe_path.write_text(text, encoding="utf-8")
        designed.design_path.write_text(kept, encoding="utf-8")


def test_plan_shows_one_line_and_the_table_where_it_is_asked_to(
    designed: Workspace, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as end:
        run(["plan", "-w", str(designed.root)])
    assert end.value.code == 0
    out = capsys.readouterr().out
    assert out.count("captures: The list of") == 1
    assert "gain/min" not in out


def test_a_linear_joint_has_no_design(tmp_path: Path) -> None:
    workspace = create_workspace(tmp_path / "day", "press-only")
    text = workspace.recipe_path.read_text(encoding="utf-8")
    linear = text.replace("[rig]\n", '[rig]\njoint = "linear"\n', 1)
    workspace.recipe_path.write_text(linear, encoding="utf-8")
    with pytest.raises(InputError, match="linear joint"):
        design_captures(workspace)


@pytest.mark.slow
def test_a_designed_capture_is_whole_by_its_own_list(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    workspace = create_workspace(tmp_path / "day", "press-only")
    arguments = ["-w", str(workspace.root), "--device", "sim", "--yes"]
    for kind in ("friction", "cut"):
        with pytest.raises(SystemExit) as end:
            run(["capture", kind, *arguments])
        assert end.value.code == 0
    assert "is expected to bring" in capsys.readouterr().err
    states = {step.name: step.state for step in make_plan(workspace).steps}
    assert states["capture friction"] == "done"
    assert states["capture cut"] == "done"
    (path,) = workspace.recordings("friction")
    recording = read_recording(path)
    assert 'plan = "designed"' in recording.recipe_toml
    assert len(recording.strokes) == 8

    from scissorcal.device import count_recorded

    recipe = workspace.recipe()
    counts = count_recorded(recording, recipe, "friction")
    assert counts["designed"]
    whole = completeness([counts], recipe, "friction")
    assert whole.missing == ()
    assert whole.excitation is not None
    assert whole.excitation.planned_s == 4.0
    twice = completeness([counts, counts], recipe, "friction")
    assert len(twice.strokes) == 2 * len(whole.strokes)
    assert twice.missing == ()


@pytest.mark.slow
def test_on_a_virtual_day_the_designed_list_is_shorter_and_its_band_as_predicted() -> None:
    from benchmarks.design import one_day, summary

    row = one_day(9301, second_rig=True, tell=lambda line: None)
    assert row.designed_reached
    assert row.listed_reached
    assert row.designed_min < row.listed_min
    assert 0.7 < row.from_posterior < 1.4
    assert summary([row])["days"] == 1


def test_the_last_rig_is_that_of_the_latest_stamp(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Not of the last name: friction sorts after cut whenever it was recorded."""
    workspace = create_workspace(tmp_path / "day", "press-only")
    for name in ("friction-20260101T080000Z", "cut-20260102T080000Z"):
        path = workspace.root / "captures" / f"{name}.mcap"
        path.parent.mkdir(exist_ok=True)
        path.touch()
    asked: list[str] = []

    def header(path: Path) -> Recording:
        asked.append(path.stem)
        return Recording("cut", empty_samples(1))

    monkeypatch.setattr("scissorcal.recording.read_header", header)
    assert design._last_identity(workspace) is None
    assert asked == ["cut-20260102T080000Z", "friction-20260101T080000Z"]
