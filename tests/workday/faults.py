"""Commands that are killed, or that a full or read-only disk refuses, at any step of writing.

A command runs in a process of its own, forked from this one. An audit hook counts the events with
which it changes files below its folder, and lets the fault begin at a stated one of them.
"""

import errno
import os
import signal
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, NoReturn

from scissorcal.cli.root import run as run_command

_CREATES = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND
_TAKES_SPACE = ("open", "os.mkdir", "os.link")
_CHANGES = (*_TAKES_SPACE, "os.rename", "os.remove", "os.rmdir")


@dataclass(frozen=True)
class Fault:
    """What happens at the event ``at`` (from 0): the process is killed, or writing is refused.

    A full disk refuses what takes space, a read-only one every change, from that event on.
    """

    kind: Literal["kill", "full", "read-only"]
    at: int


@dataclass(frozen=True)
class Outcome:
    """How a command ended: its exit code, or -9 for a killed one; its words; its events."""

    code: int
    out: str
    err: str
    events: int


def run(
    words: Sequence[str],
    folder: Path,
    fault: Fault | None = None,
    *,
    kill_after_s: float | None = None,
) -> Outcome:
    """Run ``scissorcal`` with ``words`` in ``folder``; ``kill_after_s`` kills it at a moment."""
    with (
        tempfile.TemporaryFile() as out,
        tempfile.TemporaryFile() as err,
        tempfile.TemporaryFile() as counted,
    ):
        process = os.fork()
        if process == 0:
            _be_the_command(words, folder, fault, out.fileno(), err.fileno(), counted.fileno())
        if kill_after_s is not None:
            time.sleep(kill_after_s)  # not waited for until then: its number stays its own
            os.kill(process, signal.SIGKILL)
        _, status = os.waitpid(process, 0)
        said = [_text(file) for file in (out, err, counted)]
    return Outcome(os.waitstatus_to_exitcode(status), said[0], said[1], len(said[2]))


def _be_the_command(
    words: Sequence[str], folder: Path, fault: Fault | None, out: int, err: int, counted: int
) -> NoReturn:
    code = 70  # of this harness, of no command
    try:
        os.dup2(out, 1)
        os.dup2(err, 2)
        sys.stdout = open(1, "w", encoding="utf-8", closefd=False)  # noqa: SIM115
        sys.stderr = open(2, "w", encoding="utf-8", closefd=False)  # noqa: SIM115
        os.chdir(folder)
        sys.addaudithook(_Hook(folder, fault, counted))
        try:
            run_command(list(words))
        except SystemExit as ended:
            code = int(ended.code or 0)
        sys.stdout.flush()
        sys.stderr.flush()
    finally:
        os._exit(code)


class _Hook:
    """Counts events below a folder, one byte each in the file ``counted``; makes the fault."""

    def __init__(self, folder: Path, fault: Fault | None, counted: int) -> None:
        self.root, self.fault, self.counted, self.seen = folder, fault, counted, 0

    def __call__(self, event: str, arguments: tuple[Any, ...]) -> None:
        if event not in _CHANGES or not self._is_below(event, arguments):
            return
        if event == "open" and not int(arguments[2] or 0) & _CREATES:
            return
        here, self.seen = self.seen, self.seen + 1
        os.write(self.counted, b".")
        if self.fault is None or here < self.fault.at:
            return
        if self.fault.kind == "kill":
            os.kill(os.getpid(), signal.SIGKILL)
        elif self.fault.kind == "read-only":
            raise OSError(errno.EROFS, os.strerror(errno.EROFS), str(arguments[0]))
        elif event in _TAKES_SPACE:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(arguments[0]))

    def _is_below(self, event: str, arguments: tuple[Any, ...]) -> bool:
        named = arguments[:2] if event in ("os.rename", "os.link") else arguments[:1]
        paths = [Path(one) for one in named if isinstance(one, str | os.PathLike)]
        return any(one.absolute().is_relative_to(self.root) for one in paths)


def _text(file: Any) -> str:
    file.seek(0)
    return str(file.read().decode())
