"""The firmware builds without warnings; its C tests and its fuzzing pass under the sanitizers."""

import os
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
BUILD = ROOT / "build" / "firmware"

pytestmark = pytest.mark.skipif(
    not (shutil.which("make") and shutil.which("cc")), reason="no make or C compiler here"
)


def make(target: str) -> str:
    """What a target of firmware/Makefile prints; what is compiled already is not compiled again."""
    words = ["make", "--no-print-directory", f"--jobs={os.cpu_count()}", "-C", "firmware"]
    ran = subprocess.run(
        [*words, f"BUILD={BUILD}", target],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
        timeout=600,
    )
    assert ran.returncode == 0, ran.stdout[-4000:] + ran.stderr[-4000:]
    return ran.stdout


def test_the_core_keeps_the_protocol_and_its_limits() -> None:
    printed = make("check")
    assert printed.count(", 0 failed") == 3
    assert "fuzz: " in printed


def test_the_firmware_for_this_computer_builds() -> None:
    make("all")
    assert (BUILD / "posix").is_file()


def test_the_tables_of_the_boards_are_possible_and_an_impossible_one_is_named(
    tmp_path: Path,
) -> None:
    make("check-tables")
    text = (ROOT / "firmware" / "boards" / "teensy41_table.h").read_text(encoding="utf-8")
    mine = tmp_path / "mine_table.h"
    mine.write_text(text.replace(".torque_limit = 0.25f", ".torque_limit = 2.5f"))
    ran = subprocess.run(
        ["make", "-C", "firmware", f"BUILD={BUILD}", "check-tables", f"TABLES={mine}"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
    )
    assert ran.returncode != 0
    assert f"{mine}: torque_limit is above torque_per_A * supply_min / resistance" in ran.stdout
