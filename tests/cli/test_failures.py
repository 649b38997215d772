"""Files that cannot be written are user errors: a sentence with the path and the remedy, code 2."""

import errno
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from scissorcal.cli.opening import open_workspace
from scissorcal.cli.output import LOG_FILE, Answer
from scissorcal.verdicts import Verdict

from .conftest import Cli, run_instead


@pytest.fixture(params=["size=1m", "size=1m,ro"], ids=["full", "read-only"])
def small_disk(tmp_path: Path, request: pytest.FixtureRequest) -> Iterator[Path]:
    """A file system of 1 MB without any space left, or one that is read-only."""
    folder = tmp_path / "disk"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", request.param, "tmpfs", str(folder)]
    if not Path("/bin/mount").exists() or subprocess.run(mount, capture_output=True).returncode:
        pytest.skip("only root may mount a file system here")
    try:
        if not request.param.endswith("ro"):
            with (folder / "filling").open("wb") as file:
                os.posix_fallocate(file.fileno(), 0, shutil.disk_usage(folder).free)
        yield folder
    finally:
        subprocess.run(["umount", "--lazy", str(folder)], check=True)


def words_that_write(folder: Path) -> tuple[tuple[str | Path, ...], ...]:
    return (
        ("init", folder / "work"),
        ("target", "blade", "--output", folder / "sheets"),
        ("demo", "--folder", folder / "demo"),
    )


def refused(cli: Cli, words: tuple[str | Path, ...], folder: Path) -> str:
    said = cli(*words)
    assert said.code == 2, said.err
    assert said.err.startswith("Error: ")
    assert str(folder) in said.err
    assert "fault of scissorcal" not in said.err
    assert ": " in said.err.removeprefix("Error: ")
    return said.err


def test_a_folder_below_a_file_is_named(cli: Cli, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    for words in words_that_write(tmp_path / "file"):
        assert "a part of its path is a file" in refused(cli, words, tmp_path / "file")


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="this system has no /proc")
def test_a_folder_that_nobody_may_write_to_is_named(cli: Cli) -> None:
    for words in words_that_write(Path("/proc")):
        refused(cli, words, Path("/proc"))


def test_a_disk_without_space_or_rights_is_named(cli: Cli, small_disk: Path) -> None:
    for words in words_that_write(small_disk):
        sentence = refused(cli, words, small_disk)
        assert "The disk is full" in sentence or "read-only file system" in sentence


@pytest.mark.parametrize("number", [errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EACCES])
def test_a_refused_write_anywhere_names_a_folder(
    number: int, workspace: Path, cli: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    def write() -> Answer:
        open_workspace(None)
        raise OSError(number, os.strerror(number))

    run_instead(write, monkeypatch)
    refused(cli, ("plan",), workspace)
    assert cli("plan", "--json").envelope["result"]["exit_code"] == 2


def test_a_broken_link_of_the_operating_system_is_a_fault(
    cli: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    def write() -> Answer:
        raise OSError(errno.EBADF, "Bad file descriptor")

    run_instead(write, monkeypatch)
    assert cli("plan").code == 1


def test_a_missing_home_is_a_user_error(cli: Cli, monkeypatch: pytest.MonkeyPatch) -> None:
    def look() -> Answer:
        raise RuntimeError("Could not determine home directory.")

    run_instead(look, monkeypatch)
    said = cli("plan")
    assert said.code == 2
    assert "environment variable HOME" in said.err


def test_completion_is_not_installed_into_a_home_that_cannot_be_written(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    program = "from scissorcal.cli import main; main()"
    words = [sys.executable, "-c", program, "--install-completion", "bash"]
    home = os.environ | {"HOME": str(tmp_path / "file"), "SHELL": "/bin/bash"}
    home["_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION"] = "1"
    done = subprocess.run(words, capture_output=True, text=True, env=home)
    assert done.returncode == 2, done.stderr
    assert str(tmp_path / "file") in done.stderr
    assert "Traceback" not in done.stderr


def test_each_command_is_a_line_of_the_log(
    workspace: Path, cli: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    cli("plan")
    cli("fit", "friction", "--seed", "3")

    def fail() -> Answer:
        open_workspace(None)
        raise ZeroDivisionError("division by zero")

    run_instead(fail, monkeypatch)
    cli("plan")
    lines = (workspace / LOG_FILE).read_text(encoding="utf-8").splitlines()
    assert [line.split("  ")[1] for line in lines if not line.startswith(" ")] == [
        "exit 0",
        "exit 0",
        "exit 5",
        "exit 1",
    ]
    assert lines[1].endswith(" s  scissorcal plan")
    assert "scissorcal fit friction --seed 3  # " in lines[2]
    assert "scissorcal plan  # Unexpected failure" in lines[3]
    assert lines[-1] == "    ZeroDivisionError: division by zero"


def test_a_log_that_cannot_be_written_stops_nothing(workspace: Path, cli: Cli) -> None:
    (workspace / LOG_FILE).unlink()
    (workspace / LOG_FILE).mkdir()
    assert cli("plan").code == 0


def test_passed_checks_are_counted_and_shown_on_demand(
    workspace: Path, cli: Cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    verdicts = [
        Verdict("fit.cut", "k-hat", "pass", 0.3, 0.7, "Good."),
        Verdict("fit.cut", "bounds", "fail", 9.0, 4.0, "Far."),
    ]

    def judged() -> Answer:
        open_workspace(None)
        return Answer({}, "What it found.", verdicts)

    run_instead(judged, monkeypatch)
    brief = cli("plan").out.splitlines()
    assert brief[0] == "What it found."
    assert [line[:4] for line in brief if "fit.cut" in line] == ["FAIL"]
    assert "1 of 2 checks passed (-v shows them)" in brief
    assert brief[-1] == "next: scissorcal capture friction --device PORT"
    assert [line[:4] for line in cli("plan", "-v").out.splitlines() if "fit.cut" in line] == [
        "pass",
        "FAIL",
    ]
