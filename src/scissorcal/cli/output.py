"""What a command says, in one place: its answer, verdicts, errors, exit codes and ``--json``.

A command's function returns an `Answer`. People read its text on stdout; with ``--json`` stdout has
one object alone, and the text goes to stderr with everything else that people read.
"""

import contextlib
import functools
import inspect
import json
import os
import shlex
import sys
import time
import traceback
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from scissorcal.cli.failures import INTERRUPTED, UNEXPECTED, unexpected, user_error
from scissorcal.cli.options import gathered, parameters_of
from scissorcal.cli.terminal import drawn, echo, kept, printable, printable_json, style
from scissorcal.errors import OldWordWarning
from scissorcal.verdicts import Verdict, failed
from scissorcal.workday.envelope import Envelope, plain

if TYPE_CHECKING:
    from scissorcal.workday.workspace import Workspace

VERDICT_FAILED = 3
_MARKS = {"pass": ("pass", "green"), "fail": ("FAIL", "red"), "not_evaluated": ("----", "yellow")}

_SHARED_OPTIONS = {
    "verbose": typer.Option("--verbose", "-v", help="Show the checks that passed, too."),
    "as_json": typer.Option("--json", help="Print one JSON object on stdout."),
    "show_traceback": typer.Option("--traceback", help="Show where an error arose."),
}


@dataclass(frozen=True)
class Answer:
    """What a command found or did.

    ``result`` is what ``--json`` prints, ``text`` what people read, ``files`` what was written.
    A failed verdict ends the command with exit code 3.
    """

    result: Mapping[str, Any]
    text: str = ""
    verdicts: Sequence[Verdict] = ()
    files: Sequence[Path] = field(default=())


@dataclass
class _Running:
    """The running command: its options for output, the workspace that it opened, its end."""

    as_json: bool
    verbose: bool
    show_traceback: bool
    workspace: "Workspace | None" = None
    trace: str = ""
    code: int = 0
    answer: Answer = field(default_factory=lambda: Answer({}))

    @contextmanager
    def watched(self) -> Iterator[None]:
        """Run a command's function: afterwards its exit code and answer stand, of an error too."""
        try:
            yield
        except (typer.Abort, typer.Exit, typer.TyperException):
            raise
        except KeyboardInterrupt:
            self._refuse("Interrupted.", INTERRUPTED)
        except Exception as error:  # noqa: BLE001 - the last line of defence: a sentence, a code
            known = user_error(error, self.workspace.root if self.workspace else None)
            if self.show_traceback:
                note(traceback.format_exc())
            if known:
                self._refuse(str(known), known.exit_code, known.kept)
            else:
                self.trace = traceback.format_exc()
                self._refuse(unexpected(error), UNEXPECTED)
        else:
            self.code = VERDICT_FAILED if failed(tuple(self.answer.verdicts)) else 0

    def _refuse(self, sentence: str, code: int, kept: Sequence[Path] = ()) -> None:
        echo(f"{style('Error:', fg='red')} {sentence}", err=True)
        self.code, self.answer = code, Answer({"error": sentence, "exit_code": code}, files=kept)


@contextmanager
def _old_words_noted() -> Iterator[None]:
    """Print warnings of old words as notes, each once, however often a file is read."""
    with warnings.catch_warnings():
        warnings.simplefilter("always", OldWordWarning)
        others = warnings.showwarning
        noted: set[str] = set()

        def show(message: Warning | str, category: type[Warning], *place: Any, **more: Any) -> None:
            if issubclass(category, OldWordWarning):
                if str(message) not in noted:
                    noted.add(str(message))
                    note(f"note: {message}")
            else:
                others(message, category, *place, **more)

        warnings.showwarning = show
        yield


_running: ContextVar[_Running | None] = ContextVar("running", default=None)


def command(function: Callable[..., Answer]) -> Callable[..., None]:
    """Make a command of a function that returns an `Answer`.

    Adds ``--verbose``, ``--json`` and ``--traceback``, prints the answer and the next command of
    the plan, logs the command in the workspace, and ends with its exit code. An error that
    scissorcal raises on purpose, or that the user can remedy, is a sentence and an exit code. On a
    group it is what the group does without a subcommand.
    """

    @functools.wraps(function)
    def callback(
        context: typer.Context, verbose: bool, as_json: bool, show_traceback: bool, **options: Any
    ) -> None:
        if context.invoked_subcommand is not None:
            return
        with _old_words_noted():
            _run(context, _Running(as_json, verbose, show_traceback), options)

    def _run(context: typer.Context, running: _Running, options: dict[str, Any]) -> None:
        began = time.perf_counter()
        token = _running.set(running)
        try:
            with running.watched():
                running.answer = function(**gathered(function, options))
        finally:
            _running.reset(token)
        code, answer = running.code, running.answer
        seconds = time.perf_counter() - began
        if running.workspace:
            words = context.find_root().obj or context.command_path.split()[1:]
            error = str(answer.result.get("error", "")) if code else ""
            log_command(running.workspace.root, words, code, seconds, error, running.trace)
        _say(answer, running)
        if running.as_json:
            print_envelope(context.command_path.partition(" ")[2], answer, code, seconds)
        raise typer.Exit(code)

    return _with_shared_options(callback, function)


def _with_shared_options(
    callback: Callable[..., None], function: Callable[..., Answer]
) -> Callable[..., None]:
    """Give ``callback`` the parameters of ``function`` and those that every command has."""
    kind = inspect.Parameter.KEYWORD_ONLY
    parameters = [inspect.Parameter("context", kind, annotation=typer.Context)]
    parameters += [item.replace(kind=kind) for item in parameters_of(function)]
    parameters += [
        inspect.Parameter(name, kind, default=False, annotation=Annotated[bool, option])
        for name, option in _SHARED_OPTIONS.items()
    ]
    callback.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    callback.__annotations__ = {item.name: item.annotation for item in parameters}
    return callback


def print_envelope(name: str, answer: Answer, code: int, seconds: float) -> None:
    """Print the one object of ``--json`` on stdout."""
    envelope = Envelope(
        command=name,
        ok=code == 0,
        result=dict(answer.result),
        verdicts=list(answer.verdicts),
        files=[str(path) for path in answer.files],
        seconds=round(seconds, 3),
    )
    echo(printable_json(json.dumps(plain(envelope), allow_nan=False, ensure_ascii=False)))


def note(sentence: str) -> None:
    """Tell people something on the side, on stderr."""
    echo(sentence, err=True)


def stdout_is_for_json() -> bool:
    """Whether the running command was given ``--json``, so that stdout is the object's alone."""
    running = _running.get()
    return running is not None and running.as_json


def works_in(workspace: "Workspace") -> None:
    """Note the workspace that the running command opened."""
    running = _running.get()
    if running is not None:
        running.workspace = workspace


def is_interactive() -> bool:
    """Whether a person sits at both ends: stdin to answer, stderr to read."""
    return all(stream is not None and stream.isatty() for stream in (sys.stdin, sys.stderr))


def table(rows: Sequence[Sequence[str]], right: Sequence[int] = ()) -> str:
    """Lay out rows of words in columns; columns named in ``right`` are set flush right.

    The first row is the head. On a terminal, rich sets the table to its width.

    >>> print(table([["name", "mean"], ["kappa", "0.4"]], right=[1]))
    name   mean
    kappa   0.4
    """
    if sys.stdout.isatty():
        return _rich_table(rows[0], rows[1:], right)
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    lines = []
    for row in rows:
        cells = [
            cell.rjust(width) if column in right else cell.ljust(width)
            for column, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append("  ".join(cells).rstrip())
    return "\n".join(lines)


def _rich_table(
    head: Sequence[str] | None, rows: Sequence[Sequence[str]], right: Sequence[int] = ()
) -> str:
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    laid = Table(box=None, show_header=head is not None, header_style="bold", pad_edge=False)
    for column in range(len(head or rows[0])):
        laid.add_column(
            head[column] if head else "", justify="right" if column in right else "left"
        )
    for row in rows:
        laid.add_row(*(Text.from_ansi(drawn(cell)) for cell in row))
    console = Console(force_terminal=True)
    with console.capture() as captured:
        console.print(laid)
    return kept("\n".join(line.rstrip() for line in captured.get().splitlines()))


def verdict_lines(verdicts: Sequence[Verdict]) -> str:
    """Set out verdicts for people, one line each: outcome, scope, check, value and limit, why."""
    if not verdicts:
        return ""
    rows = [
        [
            style(_MARKS[verdict.status][0], fg=_MARKS[verdict.status][1]),
            verdict.scope,
            verdict.check,
            verdict.limited,
            verdict.why,
        ]
        for verdict in verdicts
    ]
    return _rich_table(None, rows) if sys.stdout.isatty() else table(rows)


def _say(answer: Answer, running: _Running) -> None:
    shown = [v for v in answer.verdicts if running.verbose or v.status != "pass"]
    hidden = len(answer.verdicts) - len(shown)
    checks = verdict_lines(shown)
    if hidden:
        checks += f"\n{hidden} of {len(answer.verdicts)} checks passed (-v shows them)"
    parts = [answer.text.rstrip(), checks.strip(), _next_line(answer, running)]
    text = "\n\n".join(part for part in parts if part)
    if text:
        echo(text, err=running.as_json)


def _next_line(answer: Answer, running: _Running) -> str:
    """Name the next command of the plan, unless the answer did, or only a program reads it."""
    if running.workspace is None or running.as_json or not answer.text or "next: " in answer.text:
        return ""
    from scissorcal.workday.plan import make_plan

    try:
        following = make_plan(running.workspace).next_command
    except Exception:  # noqa: BLE001 - the command's own answer stands; 'plan' tells what is wrong
        following = "scissorcal plan"
    return f"next: {following or 'nothing is left to do'}"


LOG_FILE = "scissorcal.log"


def log_command(
    workspace: Path, words: Sequence[str], code: int, seconds: float, error: str, trace: str
) -> None:
    """Append a line to scissorcal.log: UTC time, exit code, seconds, command, and its error.

    ``trace`` (of a fault) follows, indented. A log that cannot be written stops no command.

    >>> log_command(Path("/nowhere"), ["fit", "cut"], 0, 12.5, "", "")
    """
    now = datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
    line = f"{now}  exit {code}  {seconds:.1f} s  scissorcal {shlex.join(words)}"
    if error:
        line += f"  # {' '.join(error.split())}"
    lines = [line, *(f"    {row}" for row in trace.splitlines())]
    with (
        contextlib.suppress(OSError),  # a full disk, a folder of somebody else, a symbolic link
        open(workspace / LOG_FILE, "a", encoding="utf-8", opener=_own) as file,
    ):
        file.write(printable("\n".join(lines)) + "\n")


def _own(path: str, flags: int) -> int:
    """Open the log itself, and nothing that a symbolic link or a pipe of its name leads to."""
    guards = getattr(os, "O_NOFOLLOW", 0) | getattr(os, "O_NONBLOCK", 0)  # Windows has neither
    return os.open(path, flags | guards, 0o666)
