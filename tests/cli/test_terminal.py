"""What is printed commands no terminal, and a reader who leaves is no fault."""

import json
import subprocess
import sys
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scissorcal.cli.output import table, verdict_lines
from scissorcal.cli.terminal import drawn, echo, printable, printable_json, style
from scissorcal.verdicts import Verdict
from tests.guard import GUARD_S

from .conftest import Cli

HOSTILE = "paper\x1b]0;title\x07\x1b[2J\x9b31m\u202etxt.exe\r"
CONTROLS = "\x1b\x07\x9b\u202e\r"


def hostile_verdict() -> Verdict:
    return Verdict("fit", HOSTILE, "fail", 1.0, 2.0, HOSTILE)


@given(st.text())
def test_no_control_character_is_left(text: str) -> None:
    said = printable(text)
    assert all(one.isprintable() or one.isspace() or ord(one) >= 0xA0 for one in said)
    assert not set(CONTROLS) & set(said)


@given(st.text())
def test_json_keeps_the_value(text: str) -> None:
    written = printable_json(json.dumps({"name": text}, ensure_ascii=False))
    assert json.loads(written) == {"name": text}
    assert not set(CONTROLS) & set(written)


def test_our_own_colour_stays_and_theirs_does_not() -> None:
    said = drawn(f"{style('Error:', fg='red')} {HOSTILE}")
    assert said.startswith("\x1b[31mError:\x1b[0m paper\\x1b]0;")
    assert said.count("\x1b") == 2


def test_names_in_verdicts_and_tables_are_spelled_out(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    for terminal in (False, True):
        monkeypatch.setattr(sys.stdout, "isatty", lambda terminal=terminal: terminal)
        echo(verdict_lines([hostile_verdict()]))
        echo(table([["name", "value"], [HOSTILE, "1"]]))
        said = capsys.readouterr().out
        assert "\\x1b]0;title" in said
        assert not set("\x07\x9b\u202e\r") & set(said)
        assert "\x1b]" not in said
        assert "\x1b[2J" not in said


def test_errors_and_the_log_are_spelled_out(cli: Cli, workspace: Path) -> None:
    said = cli("recording", "show", f"captures/{HOSTILE}.mcap")
    assert said.code in (2, 5)
    assert not set(CONTROLS) & set(said.err)
    assert not set(CONTROLS) & set((workspace / "scissorcal.log").read_text(encoding="utf-8"))


@pytest.mark.parametrize(
    ("words", "code"),
    [(["--help"], 0), (["recipe", "show", "--help"], 0), (["no-such-command"], 2)],
    ids=["help", "help of a command", "an error"],
)
def test_a_reader_who_leaves_changes_no_exit_code(words: list[str], code: int) -> None:
    command = [sys.executable, "-m", "scissorcal", *words]
    running = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    assert running.stdout is not None
    running.stdout.close()
    assert running.wait(timeout=GUARD_S) == code


def test_nothing_is_said_of_a_reader_who_left() -> None:
    command = [sys.executable, "-m", "scissorcal", "--help"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as running:
        assert running.stdout is not None
        assert running.stderr is not None
        running.stdout.close()
        assert running.stderr.read() == b""
        assert running.wait(timeout=GUARD_S) == 0


def test_the_log_is_not_written_through_a_link(cli: Cli, workspace: Path, tmp_path: Path) -> None:
    precious = tmp_path / "precious.txt"
    precious.write_text("precious")
    (workspace / "scissorcal.log").unlink(missing_ok=True)
    (workspace / "scissorcal.log").symlink_to(precious)
    assert cli("plan").code == 0
    assert precious.read_text() == "precious"
