"""Files that are written whole or not at all, and locks on open ones.

A lock is of the process that opened the file, and given back however it ends.
"""

import contextlib
import errno
import os
import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import IO

_PART = re.compile(r"\.(?P<host>[A-Za-z0-9_-]+)\.(?P<pid>\d+)\.[0-9a-f]{8}\.part$")
_LONGEST_NAME = 40
"""Characters of a file's name that its part repeats: a part's name fits where the file's fits."""


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a name to write to; the file takes the place of ``path`` once the block has ended.

    Its bytes are on the disk before that, and its name after it, so that neither an error nor a
    power failure leaves half a file; what was there stays until then, and after an error. An
    OSError names ``path``. Two processes that write the same file do not mix, on one computer or
    on several that share a folder: the last one wins.

    >>> with replacing(Path("a.txt")) as part:
    ...     _ = part.write_text("whole")
    >>> Path("a.txt").read_text()
    'whole'
    """
    part = part_of(path)
    try:
        yield part
        with part.open("rb") as file:
            os.fsync(file.fileno())
        part.replace(path)
        keep_name(path.parent)
    except BaseException as error:
        with contextlib.suppress(OSError):
            part.unlink()
        if isinstance(error, OSError) and error.filename in (None, str(part)):
            error.filename, error.filename2 = str(path), None
        raise


def part_of(path: Path) -> Path:
    """A name beside ``path`` that no other process and no other call uses, to write to first."""
    return path.with_name(
        f"{path.name[:_LONGEST_NAME]}.{_host()}.{os.getpid()}.{os.urandom(4).hex()}.part"
    )


def rename_folder(part: Path, folder: Path) -> None:
    """Give a folder its final name once all files in it are on the disk."""
    for path in part.rglob("*"):
        if path.is_file():
            with path.open("rb") as file:
                os.fsync(file.fileno())
    part.rename(folder)
    keep_name(folder.parent)


def discard_folder(folder: Path) -> None:
    """Remove a folder: at once under its name, its files then or by the next command."""
    part = part_of(folder)
    folder.rename(part)
    shutil.rmtree(part, ignore_errors=True)


def put_beside(source: Path, target: Path) -> None:
    """Have the file ``source`` under the name ``target`` too, in place of what was there.

    Neither name is ever without a whole file. No bytes are copied where the file system has hard
    links; both names are then one file, so that it is replaced and never written to. Of a symbolic
    link it is the file that the link leads to.
    """
    source = source.resolve()
    if target.exists() and target.samefile(source):
        return
    part = part_of(target)
    try:
        try:
            os.link(source, part)
        except OSError as error:
            if error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EACCES):
                raise
            shutil.copy2(source, part)
            with part.open("rb") as file:
                os.fsync(file.fileno())
        part.replace(target)
    except BaseException:
        with contextlib.suppress(OSError):
            part.unlink()
        raise
    keep_name(target.parent)


def left_over(folder: Path) -> tuple[Path, ...]:
    """Parts in ``folder``, files and folders, whose writer was killed.

    Only parts of this computer are judged, as the processes of another cannot be seen from here. A
    folder that is a symbolic link has none.
    """
    if folder.is_symlink():
        return ()
    return tuple(
        part
        for part in sorted(folder.glob("*.part"))
        if (name := _PART.search(part.name))
        and name["host"] == _host()
        and not is_running(int(name["pid"]))
    )


def remove_left_over(folder: Path, *, folders: bool = True) -> tuple[Path, ...]:
    """Remove what :func:`left_over` finds, or the files of it; returns which.

    A read-only folder keeps them.
    """
    removed = []
    for part in left_over(folder):
        with contextlib.suppress(OSError):
            if part.is_symlink() or not part.is_dir():
                part.unlink()
            elif folders:
                shutil.rmtree(part)
            else:
                continue
            removed.append(part)
    return tuple(removed)


def is_running(pid: int) -> bool:
    """Whether a process of this computer has the number ``pid``.

    On Windows, where a signal would end the process, each counts as running: what it left stays.
    """
    if os.name == "nt":
        return True
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:  # it runs, as another user
        return True
    return True


def host_name() -> str:
    """The computer's name; empty where it has none."""
    return os.uname().nodename if hasattr(os, "uname") else os.environ.get("COMPUTERNAME", "")


def _host() -> str:
    return re.sub(r"[^A-Za-z0-9_-]", "-", host_name())[:_LONGEST_NAME] or "unnamed"


def keep_name(folder: Path) -> None:
    """Have the folder's list of names on the disk; some file systems cannot be asked for it."""
    if os.name == "nt":  # no folder is opened there
        return
    handle = os.open(folder, os.O_RDONLY)
    try:
        os.fsync(handle)
    except OSError as error:
        if error.errno not in (errno.EINVAL, errno.ENOTSUP, errno.EBADF, errno.EACCES):
            raise
    finally:
        os.close(handle)


_NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.EINVAL, errno.EBADF)
"""Answers where there are no locks; NFS gives EBADF for a file that may only be read."""


def lock(file: IO[bytes]) -> None:
    """Wait for the lock of an open file, which ends when the file is closed.

    Where the file system or the operating system has no locks, none is held.
    """
    _locked(file, blocking=True)


def try_lock(file: IO[bytes]) -> bool | None:
    """Lock an open file: False where a running process holds its lock, None where none exist.

    Locks do not exist where the file system or the operating system has none.
    """
    return _locked(file, blocking=False)


def unlock(file: IO[bytes]) -> None:
    """Give back the lock of a file that stays open."""
    from filelock import unlock_descriptor  # as in `_locked`

    unlock_descriptor(file.fileno())


def _locked(file: IO[bytes], blocking: bool) -> bool | None:
    from filelock import lock_descriptor  # most commands lock nothing

    try:
        return bool(lock_descriptor(file.fileno(), blocking=blocking))
    except OSError as error:
        if error.errno not in _NO_LOCKS:
            raise
        return None
