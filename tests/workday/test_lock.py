"""Two commands do not write results in one workspace at once."""

import errno
import fcntl
import json
import os
import shutil
import subprocess
import sys
import tempfile
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


@pytest.mark.parametrize("what", ["lock", "folder"])
def test_a_symbolic_link_in_the_place_of_the_lock_is_refused(tmp_path: Path, what: str) -> None:
    root, precious = tmp_path / "paper", tmp_path / "outside"
    precious.mkdir()
    (precious / "lock").write_text("precious")
    root.mkdir()
    if what == "folder":
        (root / ".scissorcal").symlink_to(precious)
    else:
        (root / ".scissorcal").mkdir()
        (root / ".scissorcal" / "lock").symlink_to(precious / "lock")
    with pytest.raises(InputError, match="symbolic link"), writing(Workspace(root), "fit"):
        pytest.fail("the command ran")
    assert (precious / "lock").read_text() == "precious"


@pytest.mark.parametrize("kind", ["pipe", "hard link"])
def test_a_lock_that_is_no_plain_file_is_refused(tmp_path: Path, kind: str) -> None:
    (tmp_path / ".scissorcal").mkdir()
    lock, precious = tmp_path / ".scissorcal" / "lock", tmp_path / "precious"
    if kind == "pipe":
        os.mkfifo(lock)
    else:
        precious.write_text("precious")
        os.link(precious, lock)
    with pytest.raises(InputError, match="plain file"), writing(Workspace(tmp_path), "fit"):
        pytest.fail("the command ran")
    assert kind == "pipe" or precious.read_text() == "precious"


def test_a_file_system_without_locks_is_told_of(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    told: list[str] = []
    monkeypatch.setattr(fcntl, "flock", refuse)
    with writing(Workspace(tmp_path), "scissorcal fit", told.append):
        pass
    assert "cannot be locked" in told[0]


def test_numbers_that_no_process_has_name_nobody(tmp_path: Path) -> None:
    (tmp_path / ".scissorcal").mkdir()
    (tmp_path / ".scissorcal" / "lock").write_text(
        '{"command": "fit", "host": "elsewhere", "pid": 1e999, "start_s": 0}'
    )
    told: list[str] = []
    with writing(Workspace(tmp_path), "scissorcal fit", told.append):
        pass
    assert told == []


@pytest.mark.skipif(os.geteuid() != 0, reason="only root may become another user")
def test_another_user_waits_too(tmp_path: Path) -> None:
    """In a folder that both may write, with a lock that the first one made."""
    root = Path(tempfile.mkdtemp())
    root.chmod(0o777)
    other = "import filelock\nos.setgid(65534); os.setuid(65534)\nwith writing"
    script = HOLDS.replace("with writing", other)
    try:
        with writing(Workspace(root), "scissorcal fit"):
            (root / ".scissorcal").chmod(0o777)
            done = subprocess.run(
                [sys.executable, "-c", script, str(root)],
                input="",
                capture_output=True,
                text=True,
                check=False,
            )
        assert "is being written by 'scissorcal fit'" in done.stderr
    finally:
        shutil.rmtree(root)
