"""Run a parser that is written in C in a child process, which may crash or run out of anything.

A child is started with the first file that needs one, serves one file at a time, and is used again
by later ones, so that sixty photographs start one interpreter. One that dies, or does not answer in
time, is replaced. Each thread that reads at the same time has a separate child. Worker processes
have children of their process alone: what a fork inherits is closed unused.

Nothing is pickled: a request names a function of scissorcal, an answer is numbers, text and bytes
(:mod:`scissorcal.foreign.plain`).
"""

import atexit
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scissorcal.errors import InputError, MissingError, ScissorcalError
from scissorcal.foreign.formats import Format

if TYPE_CHECKING:
    from scissorcal.foreign.child import Child


def parse_isolated(
    function: str, data: bytes, path: Path | str, kind: Format, /, **options: Any
) -> Any:
    """What ``function`` of scissorcal makes of a file's bytes, in a child process with limits.

    ``function`` is "module:name" and takes the bytes and ``options`` (plain values, by name); it
    returns a plain value and imports what it needs. An InputError that it raises is raised here.
    Everything else that happens to it - another error, a crash, more than the format's memory or
    time - is an InputError that names ``path`` and the format's remedy.

    Raises ScissorcalError where no child process can be started, which is not the file's fault.
    """
    from scissorcal.foreign.child import Child, DiedError

    child = _waiting() or Child()
    try:
        answer = child.ask(function, data, options, kind)
    except DiedError as death:
        raise InputError(f"{path} is damaged: {death} {kind.remedy}") from None
    finally:
        if child.alive:
            _idle.append(child)
    if "value" in answer:
        return answer["value"]
    raise _reported(answer, path, kind)


def idle_children() -> "tuple[Child, ...]":
    """The children that wait for a file."""
    return tuple(_idle)


def close_children() -> None:
    """End all children that wait for a file; the next file starts one anew."""
    while _idle:
        _idle.pop().close()


def _waiting() -> "Child | None":
    """A child that waits for a file; None where there is none, or all have ended meanwhile."""
    while _idle:
        try:
            child = _idle.pop()
        except IndexError:  # another thread took the last one
            return None
        if child.runs:
            return child
        child.close()
    return None


def _reported(answer: dict[str, Any], path: Path | str, kind: Format) -> ScissorcalError:
    said = str(answer.get("said", ""))[:500]
    what = answer.get("error")
    if what == "input":
        return InputError(said)
    if what == "missing":
        return MissingError(said)
    if what == "memory":
        return InputError(f"{path} is damaged: it takes {kind.memory} to read. {kind.remedy}")
    return InputError(f"{path} is not {kind.name}, or it is damaged ({said}). {kind.remedy}")


_idle: "list[Child]" = []


def _forget_all() -> None:
    while _idle:
        _idle.pop().forget()


atexit.register(close_children)
if hasattr(os, "register_at_fork"):
    os.register_at_fork(after_in_child=_forget_all)
