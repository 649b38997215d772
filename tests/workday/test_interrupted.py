"""Commands that a kill or a disk ends at any step of their writing: nothing is lost or stuck.

``python -m tests.workday.interrupted`` and ``python -m tests.workday.disks`` make all cases; here
are some of each.
"""

from pathlib import Path

import pytest

from tests.workday.disks import can_mount, every_command, on_disks
from tests.workday.interrupted import at_events, at_moments, commands_that_write, finished_day

FEW = 2


@pytest.fixture(scope="module")
def day(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return finished_day(tmp_path_factory.mktemp("day") / "paper").root


def names() -> list[object]:
    """Every command that writes."""
    every = ("recording exclude", "capture", "device probe", "fit", "fit restore", "report")
    every = (*every, "report sign", "package build", "render")
    return [pytest.param(name, marks=pytest.mark.slow) for name in every]


@pytest.mark.parametrize("name", names())
def test_a_command_ended_at_any_event_loses_nothing(day: Path, tmp_path: Path, name: str) -> None:
    from scissorcal.workday.workspace import Workspace

    words = commands_that_write(Workspace(day))[name]
    most = 1 if name == "capture" else FEW  # each is a whole capture
    for ended in at_events(day, tmp_path / "work", words, ("kill", "full"), most=most):
        assert ended.wrong == (), ended


@pytest.mark.slow
@pytest.mark.parametrize("name", ["fit", "report", "package build"])
def test_a_command_killed_at_any_moment_loses_nothing(day: Path, tmp_path: Path, name: str) -> None:
    from scissorcal.workday.workspace import Workspace

    words = commands_that_write(Workspace(day))[name]
    for ended in at_moments(day, tmp_path / "work", words, FEW):
        assert ended.wrong == (), ended


@pytest.mark.slow
@pytest.mark.skipif(not can_mount(), reason="only root may mount a file system here")
def test_disks_without_space_or_rights_are_named(day: Path, tmp_path: Path) -> None:
    for name, words in every_command(day, tmp_path).items():
        for ended in on_disks(day, tmp_path / "disk", name, words, ("read-only", "0")):
            assert ended.wrong == (), ended
