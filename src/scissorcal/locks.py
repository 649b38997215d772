"""Locks on open files: of the process that opened them, and given back however it ends."""

import errno
from typing import IO

from filelock import lock_descriptor, unlock_descriptor

NO_LOCKS = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP, errno.EINVAL, errno.EBADF)
"""Answers where there are no locks; NFS gives EBADF for a file that may only be read."""


def lock(file: IO[bytes]) -> None:
    """Wait for the lock of an open file, which ends when the file is closed.

    Raises OSError, one of NO_LOCKS where the file system or the operating system has none.
    """
    lock_descriptor(file.fileno())


def try_lock(file: IO[bytes]) -> bool:
    """Lock an open file; False where a running process holds its lock. Raises as `lock` does."""
    return bool(lock_descriptor(file.fileno(), blocking=False))


def unlock(file: IO[bytes]) -> None:
    """Give back the lock of a file that stays open."""
    unlock_descriptor(file.fileno())
