"""What a command says, in one place: its answer, verdicts, errors, exit codes and ``--json``.

A command's function returns an `Answer`. People read its text on stdout; with ``--json`` stdout has
one object alone, and the text goes to stderr with everything else that people read.
"""

import functools
import inspect
import json
import sys
import time
import traceback
from collections.abc import Callable, Mapping, Sequence
from contextvars import ContextVar
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from scissorcal.errors import ScissorcalError
from scissorcal.verdicts import Verdict, failed
from scissorcal.workday.envelope import Envelope, plain

if TYPE_CHECKING:
    from scissorcal.workday.workspace import Workspace

VERDICT_FAILED = 3
UNEXPECTED = 1
INTERRUPTED = 130
_MARKS = {"pass": ("pass", "green"), "fail": ("FAIL", "red"), "not_evaluated": ("----", "yellow")}


_JSON = Annotated[bool, typer.Option("--json", help="Print one JSON object on stdout.")]
_TRACEBACK = Annotated[bool, typer.Option("--traceback", help="Show where an error arose.")]


@dataclass
class _Running:
    """The running command: what it was given, and the workspace that it opened."""

    as_json: bool = False
    workspace: "Workspace | None" = None


_running: ContextVar[_Running | None] = ContextVar("running", default=None)


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


def command(function: Callable[..., Answer]) -> Callable[..., None]:
    """Make a command of a function that returns an `Answer`.

    Adds ``--json`` and ``--traceback``, prints the answer, and ends with the exit code that belongs
    to it. An error that scissorcal raises on purpose is its sentence and its exit code. On a group
    it is what the group does without a subcommand.
    """

    @functools.wraps(function)
    def callback(
        context: typer.Context, as_json: bool, show_traceback: bool, **options: Any
    ) -> None:
        if context.invoked_subcommand is not None:
            return
        name = context.command_path.partition(" ")[2]
        began = time.perf_counter()
        running = _Running(as_json)
        token = _running.set(running)
        try:
            answer = function(**options)
        except ScissorcalError as error:
            code, answer = error.exit_code, _refusal(error, error.exit_code, show_traceback)
        except (typer.Abort, typer.Exit, typer.TyperException):
            raise
        except KeyboardInterrupt:
            code, answer = INTERRUPTED, _refusal("Interrupted.", INTERRUPTED, False)
        except Exception as error:  # noqa: BLE001 - the last line of defence: a sentence, exit code 1
            code, answer = UNEXPECTED, _unexpected(error, show_traceback)
        else:
            code = VERDICT_FAILED if failed(tuple(answer.verdicts)) else 0
            _say(answer, as_json)
        finally:
            _running.reset(token)
        if as_json:
            print_envelope(name, answer, code, time.perf_counter() - began)
        raise typer.Exit(code)

    return _with_shared_options(callback, function)


def _with_shared_options(
    callback: Callable[..., None], function: Callable[..., Answer]
) -> Callable[..., None]:
    """Give ``callback`` the parameters of ``function`` and those that every command has."""
    kind = inspect.Parameter.KEYWORD_ONLY
    own = inspect.signature(function, eval_str=True).parameters.values()
    parameters = [
        inspect.Parameter("context", kind, annotation=typer.Context),
        *(parameter.replace(kind=kind) for parameter in own),
        inspect.Parameter("as_json", kind, default=False, annotation=_JSON),
        inspect.Parameter("show_traceback", kind, default=False, annotation=_TRACEBACK),
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
    typer.echo(json.dumps(plain(envelope), allow_nan=False, ensure_ascii=False))


def note(sentence: str) -> None:
    """Tell people something on the side, on stderr."""
    typer.echo(sentence, err=True)


def stdout_is_for_json() -> bool:
    """Whether the running command was given ``--json``, so that stdout is the object's alone."""
    running = _running.get()
    return running is not None and running.as_json


def works_in(workspace: "Workspace") -> None:
    """Note the workspace that the running command opened."""
    running = _running.get()
    if running is not None:
        running.workspace = workspace


def table(rows: Sequence[Sequence[str]], right: Sequence[int] = ()) -> str:
    """Lay out rows of words in columns; columns named in ``right`` are set flush right.

    >>> print(table([["name", "mean"], ["kappa", "0.4"]], right=[1]))
    name   mean
    kappa   0.4
    """
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))]
    lines = []
    for row in rows:
        cells = [
            cell.rjust(width) if column in right else cell.ljust(width)
            for column, (cell, width) in enumerate(zip(row, widths, strict=True))
        ]
        lines.append("  ".join(cells).rstrip())
    return "\n".join(lines)


def verdict_lines(verdicts: Sequence[Verdict]) -> str:
    """Set out verdicts for people, one line each: outcome, scope, check, value and limit, why."""
    rows = []
    for verdict in verdicts:
        word, _ = _MARKS[verdict.status]
        rows.append([word, verdict.scope, verdict.check, verdict.limited, verdict.why])
    if not rows:
        return ""
    lines = table(rows).splitlines()
    return "\n".join(
        typer.style(line[:4], fg=_MARKS[verdict.status][1]) + line[4:]
        for line, verdict in zip(lines, verdicts, strict=True)
    )


def _say(answer: Answer, as_json: bool) -> None:
    parts = [answer.text.rstrip(), verdict_lines(answer.verdicts)]
    text = "\n\n".join(part for part in parts if part)
    if text:
        typer.echo(text, err=as_json)


def _refusal(error: ScissorcalError | str, code: int, show_traceback: bool) -> Answer:
    if show_traceback:
        note(traceback.format_exc())
    typer.echo(f"{typer.style('Error:', fg='red')} {error}", err=True)
    kept = error.kept if isinstance(error, ScissorcalError) else ()
    return Answer({"error": str(error), "exit_code": code}, files=kept)


def _unexpected(error: Exception, show_traceback: bool) -> Answer:
    if show_traceback:
        note(traceback.format_exc())
    words = str(error).strip().splitlines()
    what = f"{type(error).__name__}: {words[0]}" if words else type(error).__name__
    sentence = (
        f"Unexpected failure ({what}). This is a fault of scissorcal, not of your input: run the "
        "same command with --traceback and report what it prints."
    )
    return _refusal(sentence, UNEXPECTED, False)


def is_interactive() -> bool:
    """Whether a person sits at both ends: stdin to answer, stderr to read."""
    return all(stream is not None and stream.isatty() for stream in (sys.stdin, sys.stderr))
