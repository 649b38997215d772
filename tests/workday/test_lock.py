"""Two commands do not write results in one workspace at once."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from scissorcal.errors import InputError
from scissorcal.workday.lock import writing
from scissorcal.workday.workspace import Workspace

HOLDS = """
import os, pathlib, signal, sys
from scissorcal.workday.lock import writing
from scissorcal.workday.workspace import Workspace
with writing(Workspace(pathlib.Path(sys.argv[1])), "scissorcal fit"):
    print("held", flush=True)
    sys.stdin.read()
"""


def holder(root: Path) -> "subprocess.Popen[str]":
    """A process that holds the lock, once it has it."""
    process = subprocess.Popen(
        [sys.executable, "-c", HOLDS, str(root)],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "held\n"
    return process


def test_a_second_writer_is_told_who_writes(tmp_path: Path) -> None:
    with holder(tmp_path) as other:
        named = rf"'scissorcal fit' \(process {other.pid} on .*, for \d+ s\)"
        with pytest.raises(InputError, match=named), writing(Workspace(tmp_path), "report"):
            pytest.fail("two commands held the workspace")
        other.communicate()


def test_the_lock_of_a_killed_writer_is_free(tmp_path: Path) -> None:
    with holder(tmp_path) as other:
        other.kill()
    with writing(Workspace(tmp_path), "scissorcal report"):
        said = json.loads((tmp_path / ".scissorcal" / "lock").read_text())
    assert (said["command"], said["pid"]) == ("scissorcal report", os.getpid())


def test_a_holder_on_another_computer_that_has_not_ended_is_told_of(tmp_path: Path) -> None:
    told: list[str] = []
    (tmp_path / ".scissorcal").mkdir()
    holder = {"command": "scissorcal fit", "host": "elsewhere", "pid": 7, "start_s": 0.0}
    (tmp_path / ".scissorcal" / "lock").write_text(json.dumps(holder))
    with writing(Workspace(tmp_path), "scissorcal report", told.append):
        pass
    (note,) = told
    assert "'scissorcal fit' (process 7 on elsewhere" in note
    assert "has not ended, or was killed" in note
    with writing(Workspace(tmp_path), "scissorcal report", told.append):
        pass
    assert len(told) == 1
