"""The workspace's log: one line for each command, with the traceback of a fault below it."""

import contextlib
import os
import shlex
from collections.abc import Sequence
from datetime import UTC, datetime
from pathlib import Path

from scissorcal.cli.terminal import printable

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
