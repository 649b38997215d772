"""What is said of an error, with which exit code; files that cannot be written are user errors."""

import contextlib
import shutil
import tempfile
from pathlib import Path

from scissorcal.errors import InputError, ScissorcalError, file_error

UNEXPECTED = 1
INTERRUPTED = 130

_ENOUGH_BYTES = 1 << 20


def user_error(error: BaseException, workspace: Path | None = None) -> ScissorcalError | None:
    """Turn an error that the user can remedy into one of scissorcal's; None for a fault.

    ``workspace`` is that of the running command.
    """
    if isinstance(error, ScissorcalError):
        return error
    if isinstance(error, OSError):
        return file_error(error, _fullest_folder(workspace))
    if isinstance(error, RuntimeError) and "home directory" in str(error):
        return InputError(
            "Your home folder is not known: set the environment variable HOME to a folder."
        )
    return None


def unexpected(error: BaseException) -> str:
    """Describe a fault of scissorcal in one line, and ask for a report of it."""
    words = str(error).strip().splitlines()
    what = f"{type(error).__name__}: {words[0]}" if words else type(error).__name__
    return (
        f"Unexpected failure ({what}). This is a fault of scissorcal, not of your input: run the "
        "same command with --traceback and report what it prints."
    )


def _fullest_folder(workspace: Path | None) -> Path:
    """The folder that ran out of space: workspace, current folder, or that for temporary files.

    The first of them where none did.
    """
    folders = [workspace] if workspace else []
    folders.append(Path())
    with contextlib.suppress(OSError):  # it tries each folder, and finds none where all are full
        folders.append(Path(tempfile.gettempdir()))
    full = (folder for folder in folders if shutil.disk_usage(folder).free < _ENOUGH_BYTES)
    return next(full, folders[0]).absolute()
