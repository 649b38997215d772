"""One writer of results at a time in a workspace; readers and captures never wait."""

import contextlib
import errno
import fcntl
import json
import os
import time
from collections.abc import Iterator
from typing import TYPE_CHECKING

from scissorcal.errors import InputError
from scissorcal.files import remove_left_over

if TYPE_CHECKING:
    from scissorcal.workday.workspace import Workspace

LOCK_FILE = "lock"
_READ_ONLY = (errno.EROFS, errno.EACCES, errno.EPERM)


@contextlib.contextmanager
def writing(workspace: "Workspace", command: str) -> Iterator[None]:
    """Hold the workspace for a command that writes results; parts of killed ones are removed.

    The system gives the lock back when its process ends, however it ends: none is ever stale. On a
    network folder it may hold for one computer only. A workspace that may only be read needs no
    lock: nothing can be written there. Raises InputError where another command holds the lock, with
    that command and its age.
    """
    path = workspace.root / ".scissorcal" / LOCK_FILE
    try:
        path.parent.mkdir(exist_ok=True)
        opened = path.open("a+", encoding="utf-8")
    except OSError as error:
        if error.errno not in _READ_ONLY:
            raise
        yield
        return
    with opened as file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            file.seek(0)
            raise InputError(_refusal(workspace, file.read())) from None
        holder = {
            "command": command,
            "host": os.uname().nodename,
            "pid": os.getpid(),
            "start_s": time.time(),
        }
        file.truncate(0)
        file.write(json.dumps(holder))
        file.flush()
        for folder in (workspace.root, workspace.fit_path("cut").parent, path.parent):
            remove_left_over(folder)
        yield


def _refusal(workspace: "Workspace", text: str) -> str:
    try:
        holder = json.loads(text)
        age_s = max(0.0, time.time() - float(holder["start_s"]))
        who = (
            f"'{holder['command']}' (process {holder['pid']} on {holder['host']}, for "
            f"{age_s:.0f} s)"
        )
    except (ValueError, KeyError, TypeError):  # it has taken the lock and not yet said who it is
        who = "another command"
    return (
        f"{workspace.root} is being written by {who}: wait until that has ended, or end it, and "
        "run this command again. Nothing was changed."
    )
