"""The errors of scissorcal, each with the exit code its command ends with.

Every message is a whole sentence that names the file or device, the place in it, and the remedy.
"""

from pathlib import Path


class ScissorcalError(Exception):
    """Base of all errors that scissorcal raises deliberately (exit code 1).

    ``kept`` are the files that hold what was done before the error.
    """

    exit_code = 1
    kept: tuple[Path, ...] = ()


class InputError(ScissorcalError):
    """A file, recipe or option is invalid; nothing was changed (exit code 2)."""

    exit_code = 2


class VerdictError(ScissorcalError):
    """A verdict failed, so the result is not handed out (exit code 3)."""

    exit_code = 3


class DeviceError(ScissorcalError):
    """The rig or the link to it failed (exit code 4)."""

    exit_code = 4


class MissingError(ScissorcalError):
    """A previous step is missing: nothing captured, fitted or built yet (exit code 5)."""

    exit_code = 5
