"""Unfinished files: created under a lock, renamed when complete, and what a full disk means."""

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path
from typing import IO

from scissorcal.errors import InputError, file_error
from scissorcal.files import keep_name


def create_locked(path: Path, part: Path) -> IO[bytes]:
    """Create ``part``, which will become ``path``, and hold its lock until it is closed.

    The lock ends with the process; where there are no locks, none is held. Raises InputError if
    either name is taken or the folder cannot be written.
    """
    from scissorcal.locks import lock  # commands that write nothing need it not

    while True:
        if path.exists():
            raise InputError(f"{path} exists and is not overwritten. Choose another name.")
        try:
            stream = part.open("xb")
        except FileExistsError:
            raise InputError(
                f"{part} exists: a capture of that name is running or was interrupted. Wait "
                "until it ends; the next command recovers an interrupted one."
            ) from None
        except OSError as error:
            raise InputError(
                f"{part} cannot be created: {error.strerror}. Make the folder {path.parent} "
                "first, or choose one that you may write to."
            ) from error
        lock(stream)
        # A recovery may have renamed the empty file between its creation and the lock.
        if is_same_file(part, stream):
            return stream
        stream.close()


def is_same_file(path: Path, stream: IO[bytes]) -> bool:
    """Whether ``path`` still names the open file."""
    try:
        return os.path.samestat(path.stat(), os.fstat(stream.fileno()))
    except FileNotFoundError:
        return False


def seal(stream: IO[bytes], part: Path, path: Path) -> None:
    """Flush the file to disk, rename it, and only then release the lock."""
    if path.exists():
        raise InputError(
            f"{path} was created by another program during the capture and is not overwritten: "
            f"the capture is kept as {part.name}. The next command recovers it under another name."
        )
    stream.flush()
    os.fsync(stream.fileno())
    if os.name == "nt":  # Windows renames no file that is open
        stream.close()
    part.rename(path)
    keep_name(path.parent)
    stream.close()


@contextlib.contextmanager
def explained(part: Path) -> Iterator[None]:
    """Turn a write error into one that says what is kept."""
    try:
        yield
    except OSError as error:
        kept = f"Samples until then are kept in {part}; the next command recovers them."
        raise file_error(error, part, kept) or error from None
