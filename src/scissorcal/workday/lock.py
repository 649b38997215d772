"""One writer of results at a time in a workspace; readers and captures never wait."""

import contextlib
import errno
import json
import os
import stat
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import IO, TYPE_CHECKING, NamedTuple

from scissorcal.errors import InputError
from scissorcal.files import host_name, try_lock

if TYPE_CHECKING:
    from scissorcal.workday.workspace import Workspace

LOCK_FILE = "lock"
_LONGEST = 4096
_READ_ONLY = (errno.EROFS, errno.EACCES, errno.EPERM)


@contextlib.contextmanager
def writing(
    workspace: "Workspace", command: str, tell: Callable[[str], None] = lambda sentence: None
) -> Iterator[None]:
    """Hold the workspace for a command that writes results.

    The system gives the lock back when its process ends, however it ends: none is ever stale. A
    network folder may not carry it from one computer to another: the holder's name stands in the
    file until it ends, and ``tell`` hears of one on another computer that has not ended or was
    killed; it also hears where the file system has no locks at all. A workspace that may only be
    read needs none: nothing can be written there. Raises InputError where another command holds the
    lock, with that command and its age, and where the lock is no plain file.
    """
    path = workspace.root / ".scissorcal" / LOCK_FILE
    try:
        path.parent.mkdir(exist_ok=True)
        opened = _open(path)
    except OSError as error:
        if error.errno not in _READ_ONLY:
            raise
        yield
        return
    with opened as file:
        held = try_lock(file)
        if held is None:
            tell(
                f"{path} cannot be locked on its file system: of two commands that write at once "
                "each file is whole, and the last one written stays."
            )
            yield
            return
        if not held:
            raise InputError(_refusal(workspace, _holder(file)))
        before = _holder(file)
        if before is not None and before.host != host_name():
            tell(_not_seen(workspace, before))
        holder = _Holder(command, host_name(), os.getpid(), time.time())
        # A full disk, or a lock that another user made: the lock itself is held all the same.
        with contextlib.suppress(OSError):
            file.truncate(0)
            file.write(json.dumps(holder._asdict()).encode())
        try:
            yield
        finally:
            with contextlib.suppress(OSError):
                file.truncate(0)


def _open(path: Path) -> IO[bytes]:
    """Open the lock's own file and no other; to read alone where another user made it."""
    for one in (path.parent, path):
        if one.is_symlink():
            raise InputError(
                f"{one} is a symbolic link, and what it leads to is not the workspace's: remove "
                "the link."
            )
    names = ("O_NOFOLLOW", "O_NONBLOCK", "O_CLOEXEC")  # Windows has none of them
    how = sum(getattr(os, name, 0) for name in names)
    try:
        handle, mode = os.open(path, os.O_RDWR | os.O_APPEND | os.O_CREAT | how, 0o666), "ab+"
    except PermissionError:
        handle, mode = os.open(path, os.O_RDONLY | how), "rb"
    found = os.fstat(handle)
    if not stat.S_ISREG(found.st_mode) or found.st_nlink != 1:
        os.close(handle)
        raise InputError(f"{path} is not the workspace's own plain file: remove it.")
    return os.fdopen(handle, mode, buffering=0)


class _Holder(NamedTuple):
    command: str
    host: str
    pid: int
    start_s: float

    @property
    def words(self) -> str:
        age_s = max(0.0, time.time() - self.start_s)
        return f"'{self.command}' (process {self.pid} on {self.host}, for {age_s:.0f} s)"


def _holder(file: IO[bytes]) -> _Holder | None:
    """Who holds the lock, or held it and was killed; None where nobody is named."""
    file.seek(0)
    try:
        found = json.loads(file.read(_LONGEST))
        return _Holder(
            str(found["command"]), str(found["host"]), int(found["pid"]), float(found["start_s"])
        )
    except (OSError, ValueError, KeyError, TypeError, OverflowError, RecursionError):
        return None


def _refusal(workspace: "Workspace", holder: _Holder | None) -> str:
    who = holder.words if holder else "another command"
    return (
        f"{workspace.root} is being written by {who}: wait until that has ended, or end it, and "
        "run this command again. Nothing was changed."
    )


def _not_seen(workspace: "Workspace", holder: _Holder) -> str:
    return (
        f"{holder.words} wrote in {workspace.root} and has not ended, or was killed. Where a "
        "network folder does not carry locks to other computers, both write: each file is then "
        "whole, and the last one written stays."
    )
