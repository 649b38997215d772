"""The errors of scissorcal, each with the exit code its command ends with.

Every message is a whole sentence that names the file or device, the place in it, and the remedy.
"""

import errno
import warnings
from collections.abc import Iterable
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


class ModelError(InputError, ValueError):
    """A law or a shape of the model has an unknown name or an impossible number (exit code 2)."""


class UnknownNameError(InputError, KeyError):
    """A name is none of those that there are; the sentence has the nearest (exit code 2).

    It is a KeyError too, as of any mapping.
    """

    def __str__(self) -> str:
        """The sentence as it is: a KeyError by itself would show it in quotes."""
        return str(self.args[0])


class OtherKindError(InputError):
    """A file is of another kind than is needed: not damaged, and not to be removed.

    ``found`` names what it is and ``wanted`` what is needed, each with an article; ``use`` is a
    sentence on what to do with the file.

    >>> print(OtherKindError("cut.nc", "a cut fit", "a camera fit"))
    cut.nc is a cut fit, not a camera fit. Name another file, or put the right one in its place.
    """

    def __init__(self, path: object, found: str, wanted: str, use: str = "") -> None:
        remedy = use or "Name another file, or put the right one in its place."
        super().__init__(f"{path} is {found}, not {wanted}. {remedy}")
        self.found = found


class VerdictError(ScissorcalError):
    """A verdict failed, so the result is not handed out (exit code 3)."""

    exit_code = 3


class DeviceError(ScissorcalError):
    """The rig, a cluster, or the link to one of them failed (exit code 4).

    ``stop`` names the servo's stop (``scissorcal.kernel.StopReason``) where that was one.
    """

    exit_code = 4

    def __init__(self, sentence: str, stop: str = "") -> None:
        super().__init__(sentence)
        self.stop = stop


class MissingError(ScissorcalError):
    """A previous step is missing: nothing captured, fitted or built yet (exit code 5)."""

    exit_code = 5


MOST_LISTED = 8
"""Names that a sentence lists; of more, it has the nearest alone."""


def unknown_name(what: str, given: object, names: Iterable[str]) -> str:
    """The sentence on a name that is none of ``names``: the nearest, and all where they are few.

    >>> print(unknown_name("effort of a fit", "drafty", ("draft", "standard", "thorough")))
    "drafty" is no effort of a fit. Did you mean "draft"? There are: draft, standard, thorough.
    """
    import difflib  # loads three modules, for a message alone

    known = tuple(names)
    listed = f" There are: {', '.join(known)}." if len(known) <= MOST_LISTED else ""
    close = difflib.get_close_matches(str(given)[:100].lower(), known, 1, 0.5)
    hint = f' Did you mean "{close[0]}"?' if close else ""
    return f'"{str(given)[:100]}" is no {what}.{hint}{listed}'


def check_known(what: str, given: object, names: Iterable[str]) -> None:
    """UnknownNameError, naming the nearest, unless ``given`` is one of ``names``."""
    known = tuple(names)
    if not isinstance(given, str) or given not in known:
        raise UnknownNameError(unknown_name(what, given, known))


def needs_unix(what: str) -> DeviceError:
    """The refusal of what takes a Unix terminal or the C loop's port, on a system without them.

    >>> print(needs_unix("A virtual rig"))
    A virtual rig needs a Unix terminal, which this system lacks: use Linux or macOS for it.
    """
    return DeviceError(
        f"{what} needs a Unix terminal, which this system lacks: use Linux or macOS for it."
    )


def needs_extra(what: str, package: str, extra: str, otherwise: str = "") -> InputError:
    """The refusal of what takes a package that a plain install does not bring.

    ``what`` begins the sentence, ``otherwise`` says how to go without.

    >>> print(needs_extra("Parquet", "pyarrow", "parquet", "use CSV"))
    Parquet needs pyarrow, which is not installed: pip install 'scissorcal[parquet]', or use CSV.
    """
    command = f"pip install 'scissorcal[{extra}]'"
    way_out = f", or {otherwise}" if otherwise else ""
    return InputError(f"{what} needs {package}, which is not installed: {command}{way_out}.")


_ELSEWHERE = "choose a folder that you may write to"
_FILE_ERRORS = {
    errno.ENOSPC: f"The disk is full: {{}} could not be written. Free some space, or {_ELSEWHERE}.",
    errno.EDQUOT: "Your disk quota is used up: {} could not be written. Free some space.",
    errno.EIO: "The disk reported a fault (input/output error) at {}: copy what you need to "
    "another disk, and check this one.",
    errno.ESTALE: "{} is on a network folder that was taken away: connect it again.",
    errno.EFBIG: f"{{}} is too large for this file system: {_ELSEWHERE}.",
    errno.EROFS: f"{{}} is on a read-only file system: {_ELSEWHERE}.",
    errno.EACCES: "{} may not be read or written by you (permission denied): change its "
    f"permissions, or {_ELSEWHERE}.",
    errno.EPERM: f"{{}} may not be changed by you (operation not permitted): {_ELSEWHERE}.",
    errno.ENOENT: "{} does not exist, or its folder cannot be made: check the path.",
    errno.ENOTDIR: "{} cannot exist, because a part of its path is a file and not a folder: "
    "correct the path.",
    errno.EEXIST: "{} is a file where a folder is needed: choose another path.",
    errno.EISDIR: "{} is a folder where a file is needed: name a file.",
    errno.ENAMETOOLONG: "{} is too long a name for this file system: choose a shorter one.",
    errno.ELOOP: "{} is a loop of symbolic links: name the file itself.",
}
"""Refusals of the operating system that the user can remedy, and how."""


def file_error(error: OSError, path: Path, kept: str = "") -> InputError | None:
    """Turn a refusal to read or write ``path`` into a sentence with the remedy; None for others.

    ``path`` is used where the error names no file, as a full disk does not. ``kept`` is a sentence
    on what is kept.

    >>> print(file_error(OSError(errno.EISDIR, "a folder"), Path("a.mcap")))
    a.mcap is a folder where a file is needed: name a file.
    """
    sentence = _FILE_ERRORS.get(error.errno or 0)
    if sentence is None or isinstance(error, BlockingIOError):
        return None
    named = error.filename2 or error.filename
    shown = named if isinstance(named, str) else path
    return InputError(f"{sentence.format(shown)} {kept}".rstrip())


OLD_WORDS_UNTIL = "0.2"
"""Version that no longer reads the old words of options, recipe keys and files."""


class OldWordWarning(FutureWarning):
    """An old word was read: the sentence names the new one, and the version that needs it."""


def warn_of_old_word(old: str, new: str, source: str = "") -> None:
    """Warn that ``old`` is now called ``new``; ``source`` is the file that has the old word."""
    where = f"{source}: " if source else ""
    sentence = f"{where}{old} is now called {new}. Version {OLD_WORDS_UNTIL} reads {new} only."
    warnings.warn(sentence, OldWordWarning, stacklevel=3)
