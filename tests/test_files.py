"""A file takes its place whole, or the one that was there stays."""

import multiprocessing
import subprocess
import sys
from pathlib import Path

import pytest

from scissorcal.files import remove_left_over, replacing


def test_what_was_written_takes_the_place_of_the_file(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("before")
    with replacing(path) as part:
        part.write_text("after")
        assert path.read_text() == "before"
    assert path.read_text() == "after"
    assert list(tmp_path.iterdir()) == [path]


def test_an_error_keeps_the_file_and_leaves_nothing_else(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("before")

    def fail_half_way() -> None:
        with replacing(path) as part:
            part.write_text("aft")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        fail_half_way()
    assert path.read_text() == "before"
    assert list(tmp_path.iterdir()) == [path]


def test_an_error_of_the_file_system_names_the_file(tmp_path: Path) -> None:
    path = tmp_path / "missing" / "a.txt"
    with pytest.raises(FileNotFoundError) as refused, replacing(path) as part:
        part.write_text("after")
    assert refused.value.filename == str(path)


SAVES, LOADS, WRITERS = 20, 1000, 20


def save_often(path: Path, letter: str) -> None:
    """One of the writers of the next test: a file of one letter, which shows any mixture."""
    for _ in range(SAVES):
        with replacing(path) as part:
            part.write_text(letter * 100_000)


def test_no_load_beside_many_saves_is_damaged(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    save_often(path, "z")
    spawn = multiprocessing.get_context("fork")
    letters = [chr(ord("a") + index) for index in range(WRITERS)]
    writers = [spawn.Process(target=save_often, args=(path, letter)) for letter in letters]
    for writer in writers:
        writer.start()
    loads, damaged = 0, 0
    while loads < LOADS or any(writer.is_alive() for writer in writers):
        text = path.read_text()
        loads += 1
        damaged += len(text) != 100_000 or len(set(text)) != 1
    for writer in writers:
        writer.join()
    assert [writer.exitcode for writer in writers] == [0] * WRITERS
    assert damaged == 0, f"{damaged} of {loads} loads"
    assert list(tmp_path.iterdir()) == [path]


def test_the_part_of_a_killed_writer_is_removed_and_that_of_a_running_one_stays(
    tmp_path: Path,
) -> None:
    killed = (
        "import os, pathlib, signal, sys\n"
        "from scissorcal.files import replacing\n"
        "with replacing(pathlib.Path(sys.argv[1])) as part:\n"
        "    part.write_text('half')\n"
        "    os.kill(os.getpid(), signal.SIGKILL)\n"
    )
    subprocess.run([sys.executable, "-c", killed, str(tmp_path / "a.txt")], check=False)
    (left,) = tmp_path.iterdir()
    capture = tmp_path / "cut-001.mcap.part"
    capture.write_bytes(b"recovery owns it")
    with replacing(tmp_path / "b.txt") as part:
        part.write_text("whole")
        assert remove_left_over(tmp_path) == (left,)
    assert {path.name for path in tmp_path.iterdir()} == {"b.txt", capture.name}


def test_a_full_disk_is_said_with_the_file_that_was_not_written(tmp_path: Path) -> None:
    full = Path("/dev/full")
    if not full.exists():
        pytest.skip("this system has no /dev/full")
    path = tmp_path / "a.txt"

    def fill() -> None:
        with replacing(path) as part:
            part.symlink_to(full)
            part.write_text("lost")

    with pytest.raises(OSError, match="No space left") as refused:
        fill()
    assert refused.value.filename == str(path)
    assert list(tmp_path.iterdir()) == []
