"""Half-written files: their creation under a lock, their sealing, and what a full disk means."""

import contextlib
import fcntl
import os
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from scissorcal.errors import InputError, file_error


def create_locked(path: Path, part: Path) -> IO[bytes]:
    """Create ``part``, which will become ``path``, and hold its lock until it is closed.

    The lock goes with the process, however it ends. Raises InputError if either name is taken
    or the folder cannot be written.
    """
    while True:
        if path.exists():
            raise InputError(f"{path} stands already and is not overwritten. Choose another name.")
        try:
            stream = part.open("xb")
        except FileExistsError:
            raise InputError(
                f"{part} is in the way: a capture of that name is running or was interrupted. "
                "Wait for it, or recover it first."
            ) from None
        except OSError as error:
            raise InputError(
                f"{part} cannot be created: {error.strerror}. Make the folder {path.parent} "
                "first, or choose one that you may write to."
            ) from error
        fcntl.flock(stream.fileno(), fcntl.LOCK_EX)
        # A recovery may have taken the empty file away between its creation and the lock.
        if is_same_file(part, stream):
            return stream
        stream.close()


def try_lock(stream: IO[bytes]) -> bool:
    """Take the writer's lock on an open file; False if a live process holds it."""
    try:
        fcntl.flock(stream.fileno(), fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True


def is_same_file(path: Path, stream: IO[bytes]) -> bool:
    """Tell whether ``path`` still names the open file."""
    try:
        return os.path.samestat(path.stat(), os.fstat(stream.fileno()))
    except FileNotFoundError:
        return False


def seal(stream: IO[bytes], part: Path, path: Path) -> None:
    """Force the file to disk, give it its final name, and only then let go of the lock."""
    if path.exists():
        raise InputError(
            f"{path} appeared while its capture ran and is not overwritten: the capture is kept "
            f"as {part.name}. The next command recovers it under another name."
        )
    stream.flush()
    os.fsync(stream.fileno())
    part.rename(path)
    folder = os.open(path.parent, os.O_RDONLY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)
    stream.close()


@contextlib.contextmanager
def explained(part: Path) -> Iterator[None]:
    """Turn a refusal of the disk into a sentence that says what is kept."""
    try:
        yield
    except OSError as error:
        kept = f"Samples until then are kept in {part}; the next command recovers them."
        raise file_error(error, part, kept) or error from None
