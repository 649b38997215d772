"""Locks on open files: of the process that opened them, and given back however it ends."""

import errno
from typing import IO

from filelock import lock_descriptor, unlock_descriptor

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
    unlock_descriptor(file.fileno())


def _locked(file: IO[bytes], blocking: bool) -> bool | None:
    try:
        return bool(lock_descriptor(file.fileno(), blocking=blocking))
    except OSError as error:
        if error.errno not in _NO_LOCKS:
            raise
        return None
