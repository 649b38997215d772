"""The errors scissorcal raises on purpose, each with the exit code its command ends with.

Every message is a whole sentence that names the file or device, the place in it, and the mend.
"""

from pathlib import Path


class ScissorcalError(Exception):
    """Base of all errors that scissorcal raises on purpose (exit code 1).

    ``kept`` are the files that hold what was done before it.
    """

    exit_code = 1
    kept: tuple[Path, ...] = ()


class InputError(ScissorcalError):
    """A file, recipe or option is invalid; nothing was changed (exit code 2)."""

    exit_code = 2


class VerdictError(ScissorcalError):
    """A verdict failed, so what was asked for is not handed out (exit code 3)."""

    exit_code = 3


class DeviceError(ScissorcalError):
    """The rig or the link to it failed (exit code 4)."""

    exit_code = 4


class MissingError(ScissorcalError):
    """Something that must come first is not there yet: nothing captured or fitted (exit code 5)."""

    exit_code = 5
