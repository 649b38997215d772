"""Questions that another program answers over pipes, and a command that ends with that program."""

import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from scissorcal.cli import questions
from scissorcal.prototype import ENVIRONMENT, QUESTION
from tests.guard import GUARD_S

PROGRAM = (
    f"""
import os, sys, time
import typer
from scissorcal.cli import questions
questions.PATIENCE_s = {GUARD_S}
"""
    + """
from scissorcal.cli.live_view import LiveView
from scissorcal.cli.root import _asking
from scissorcal.cli.terminal import echo
with _asking():
    assert "SCISSORCAL_QUESTIONS" not in os.environ
    echo("A note from a recipe \\x1e Do you agree?", err=True)
    try:
        {body}
    except KeyboardInterrupt:
        echo("interrupted", err=True)
        sys.exit(130)
    except typer.Abort:
        echo("nobody", err=True)
        sys.exit(130)
echo("done", err=True)
"""
)
ASKS = "with LiveView() as view: view.confirm('Clear the blades.\\x1b[2J')"
WORKS = "echo('works', err=True); [time.sleep(0.02) for _ in iter(int, 1)]"
"""It sleeps for moments: a signal that comes just before a sleep begins does not end it."""


@contextmanager
def asking(body: str, *, deaf: bool = False) -> "Iterator[subprocess.Popen[str]]":
    """A command with a question or work in it; ``deaf``: started as a shell starts one with &."""
    pipe = subprocess.PIPE
    words = [sys.executable, "-c", PROGRAM.format(body=body)]
    before = signal.signal(signal.SIGINT, signal.SIG_IGN) if deaf else None
    try:
        process = subprocess.Popen(
            words,
            stdin=pipe,
            stdout=pipe,
            stderr=pipe,
            text=True,
            env={**os.environ, **ENVIRONMENT},
        )
    finally:
        if deaf:
            signal.signal(signal.SIGINT, before)
    with process:
        try:
            yield process
        finally:
            process.kill()


def line_of(process: "subprocess.Popen[str]") -> str:
    assert process.stderr is not None
    return process.stderr.readline().rstrip("\n")


def say(process: "subprocess.Popen[str]", text: str) -> None:
    assert process.stdin is not None
    process.stdin.write(text)
    process.stdin.flush()


def test_both_ends_mean_the_same_sign() -> None:
    assert questions.QUESTION == QUESTION


def test_a_question_is_one_line_that_no_text_can_imitate_and_yes_answers_it() -> None:
    with asking(ASKS) as process:
        assert line_of(process) == "A note from a recipe \\x1e Do you agree?"
        assert line_of(process) == f"{QUESTION}Clear the blades.\\x1b[2J"
        say(process, "no\nYES\n\nyes sir\n")
        assert process.poll() is None
        say(process, "yes\n")
        assert line_of(process) == "done"
        assert process.wait(GUARD_S) == 0


def test_a_yes_that_came_before_the_question_answers_nothing() -> None:
    """It was heard before; after the question nobody answers any more."""
    heard = "[time.sleep(0.01) for _ in iter(questions.answers.empty, False)]"
    with asking(f"{heard}; view = LiveView(); view.confirm('Clear the blades.')") as process:
        assert line_of(process).startswith("A note")
        say(process, "yes\n")
        assert line_of(process) == f"{QUESTION}Clear the blades."
        assert process.stdin is not None
        process.stdin.close()
        assert line_of(process) in ("interrupted", "nobody")
        assert process.wait(GUARD_S) == 130


@pytest.mark.parametrize("body", [ASKS, WORKS])
def test_the_end_of_the_program_that_answers_is_an_interrupt(body: str) -> None:
    with asking(body) as process:
        line_of(process)
        assert line_of(process).strip(QUESTION).split()[0] in ("Clear", "works")
        assert process.stdin is not None
        process.stdin.close()
        assert line_of(process) in ("interrupted", "nobody")
        assert process.wait(GUARD_S) == 130


@pytest.mark.parametrize("body", [ASKS, WORKS])
def test_a_stdin_that_is_closed_is_the_end_of_it(body: str) -> None:
    program = f"import os; os.close(0)\n{PROGRAM.format(body=body)}"
    ran = subprocess.run(
        [sys.executable, "-c", program],
        env={**os.environ, **ENVIRONMENT},
        stderr=subprocess.PIPE,
        text=True,
        timeout=GUARD_S,
        check=False,
    )
    assert ran.returncode in (130, -signal.SIGINT)
    assert "Bad file descriptor" not in ran.stderr


def test_a_command_that_a_shell_started_deaf_to_ctrl_c_hears_it_all_the_same() -> None:
    with asking(WORKS, deaf=True) as process:
        assert line_of(process).startswith("A note")
        assert line_of(process) == "works"
        process.send_signal(signal.SIGINT)
        assert line_of(process) == "interrupted"
