"""Report files that are no files, are damaged or too large: one sentence, and no waiting."""

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from scissorcal.foreign import REPORT
from scissorcal.workday import Workspace

from .conftest import Cli
from .test_signatures import SIGN, day, signed_day

__all__ = ["day", "signed_day"]

REPORT_FILES = ("report/report.html", "report/report.json", "report/signature.json")


def too_large(path: Path) -> None:
    with path.open("r+b") as file:
        file.truncate(REPORT.most_bytes + 1)


INSTEAD: dict[str, Callable[[Path], object]] = {
    "a named pipe": os.mkfifo,
    "a device": lambda path: path.symlink_to("/dev/zero"),
    "a terminal": lambda path: path.symlink_to("/dev/tty"),
    "a folder": Path.mkdir,
    "nothing": lambda path: path.write_bytes(b""),
    "no UTF-8": lambda path: path.write_bytes(b"\xff\xfe<html>\x80"),
    "a deep text": lambda path: path.write_bytes(b"[" * 100_000),
}
COMMANDS = (("plan",), SIGN, ("package", "build"), ("report",), SIGN)


QUICK = {"a named pipe", "no UTF-8"}


@pytest.mark.parametrize("file", REPORT_FILES)
@pytest.mark.parametrize(
    "what",
    [
        one if one in QUICK else pytest.param(one, marks=pytest.mark.slow)
        for one in (*INSTEAD, "too large")
    ],
)
def test_what_stands_in_a_report_files_place_is_a_sentence(
    day: Workspace, cli: Cli, file: str, what: str
) -> None:
    path = day.root / file
    if what == "too large":
        too_large(path)
    else:
        path.unlink()
        INSTEAD[what](path)
    for words in COMMANDS:
        said = cli(*words)
        assert said.code in (0, 2, 3, 5), (words, said.out, said.err)
        assert "Traceback" not in said.err
