"""Photographs of a capture that was killed are kept, and told of once."""

from pathlib import Path

import pytest

from scissorcal.files import is_running, part_of
from scissorcal.workday.photographs import recover_photographs
from scissorcal.workday.recordings import recover_recordings
from scissorcal.workday.workspace import Workspace


@pytest.fixture
def killed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Workspace:
    """A workspace with half a capture, of a process that runs no more."""
    part = part_of(tmp_path / "captures" / "plate-20261123T100000Z")
    part.mkdir(parents=True)
    (part / "001-a.jpg").write_bytes(b"a photograph")
    (part / "001-a-detected.png").write_bytes(b"what was found in it")
    monkeypatch.setattr("scissorcal.files.is_running", lambda pid: False)
    return Workspace(tmp_path)


def test_they_are_kept_and_told_of(killed: Workspace) -> None:
    killed.remove_left_over()
    (said,) = recover_recordings(killed)
    assert "those taken (1) are kept" in said
    kept = killed.captures_dir / "plate-20261123T100000Z.interrupted"
    assert (kept / "001-a.jpg").read_bytes() == b"a photograph"
    assert "'scissorcal capture plate'" in said
    assert recover_recordings(killed) == ()
    assert killed.photograph_indexes("plate") == []


def test_a_capture_without_a_photograph_leaves_nothing(killed: Workspace) -> None:
    (part,) = killed.captures_dir.iterdir()
    (part / "001-a.jpg").unlink()
    assert recover_photographs(killed.captures_dir) == ()
    assert list(killed.captures_dir.iterdir()) == []


def test_a_capture_that_runs_is_left_alone(
    killed: Workspace, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("scissorcal.files.is_running", is_running)
    assert recover_recordings(killed) == ()
    assert len(list(killed.captures_dir.glob("*.part"))) == 1
