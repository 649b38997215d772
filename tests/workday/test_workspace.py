"""A workspace is found from below, names its files, and never overwrites."""

from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path

import pytest

from scissorcal.errors import MissingError
from scissorcal.workday.workspace import Workspace, create_workspace, find_workspace


def test_it_is_found_from_below(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = create_workspace(tmp_path / "work", "paper-80gsm")
    below = made.root / "captures" / "deep"
    below.mkdir(parents=True)
    assert find_workspace(below) == made
    monkeypatch.chdir(below)
    assert find_workspace() == made


def test_where_none_is_the_next_step_is_named(tmp_path: Path) -> None:
    with pytest.raises(MissingError, match="scissorcal init NAME --recipe"):
        find_workspace(tmp_path)


def test_recordings_are_stamped_in_utc_and_never_share_a_name(tmp_path: Path) -> None:
    workspace = Workspace(tmp_path)
    noon = datetime(2026, 1, 2, 12, 0, 5, tzinfo=timezone(timedelta(hours=3)))
    names = []
    for _ in range(3):
        path = workspace.new_recording("friction", noon)
        path.touch()
        names.append(path.name)
    assert names == [
        "friction-20260102T090005Z.mcap",
        "friction-20260102T090005Z-2.mcap",
        "friction-20260102T090005Z-3.mcap",
    ]
    workspace.new_recording("cut", datetime.now(UTC)).touch()
    assert [path.name for path in workspace.recordings("friction")] == names
    assert len(workspace.recordings("cut")) == 1


def test_a_running_capture_keeps_its_name_to_itself(tmp_path: Path) -> None:
    workspace = Workspace(tmp_path)
    now = datetime(2026, 1, 2, tzinfo=UTC)
    first = workspace.new_recording("cut", now)
    first.with_name(first.name + ".part").touch()
    assert workspace.new_recording("cut", now) != first
