"""Results that their workspace could not take: kept in another folder, and put in place later."""

import contextlib
import errno
import os
import tempfile
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from scissorcal.errors import InputError, file_error
from scissorcal.workday.engine import Engine
from scissorcal.workday.history import HASH, save_version, take_place
from scissorcal.workday.steps import Step, steps_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from scissorcal.calibration.result import Result


def save_anywhere(
    engine: Engine,
    step: Step,
    result: "Result",
    draw: "Callable[[Path], object] | None",
    folder: Path | None,
) -> None:
    """Write a result into the workspace; where that cannot be written, into another folder.

    That is ``folder``, else the system's folder for temporary files, else the home folder. Raises
    InputError where the workspace did not take it, which names where it is kept (also as ``kept``)
    and the command that puts it in place.
    """
    try:
        save_version(engine, step.name, result, draw)
    except OSError as error:
        refusal = file_error(error, engine.file(step.name))
        if refusal is None:
            raise
        full = error.errno in (errno.ENOSPC, errno.EDQUOT)
        when = "once there is space" if full else "once the workspace can be written"
        raise _kept_elsewhere(str(refusal), when, step, result, folder) from None


def refuse_unwritable(engine: Engine, folder: Path | None) -> None:
    """Raise InputError before a long fit where its workspace may only be read."""
    root = engine.workspace.root
    if folder is None and not os.access(root, os.W_OK):
        raise InputError(
            f"{root} may only be read, so a fit could not be kept there: choose a folder for it "
            "with --save-to FOLDER, or change the permissions. Nothing was fitted."
        )


def put_in_place(engine: Engine, path: Path) -> tuple[Step, Path | None]:
    """Put a result that was kept elsewhere into the workspace; the one in use is kept.

    Gives its step and the folder of the one that was in use. Raises InputError where ``path`` is no
    result of a fit.
    """
    from scissorcal.calibration.store import load

    step = _step_of(path)
    module, _, name = step.holds.partition(":")
    found = load(path, getattr(import_module(module), name))
    if found.what != step.what:
        raise InputError(
            f"{path} holds a fit of {found.what}, and its name begins with {step.what}-: give it "
            f"a name that begins with {found.what}-. Nothing was changed."
        )
    return step, take_place(engine, step.name, path)


def _kept_elsewhere(
    refusal: str, when: str, step: Step, result: "Result", folder: Path | None
) -> InputError:
    from scissorcal.calibration.store import save

    name = f"{step.what}-{result.inputs_hash[:HASH]}-{os.urandom(2).hex()}.nc"
    for place in _places(folder):
        path = place / name
        try:
            save(result, path)
        except OSError:
            continue
        error = InputError(
            f"{refusal} The fit is kept in {path}: {when}, put it in place with "
            f"'scissorcal fit restore {path}'."
        )
        error.kept = (path,)
        return error
    return InputError(f"{refusal} The fit could not be kept in another folder either: it is lost.")


def _places(folder: Path | None) -> Iterator[Path]:
    if folder is not None:
        yield folder.absolute()
    with contextlib.suppress(OSError):  # it tries each folder, and finds none where all are full
        yield Path(tempfile.gettempdir())
    with contextlib.suppress(RuntimeError):  # a user without a home folder
        yield Path.home()


def _step_of(path: Path) -> Step:
    named = [step for step in steps_of("fit") if path.name.startswith(f"{step.what}-")]
    if not named:
        names = ", ".join(f"{step.what}-..." for step in steps_of("fit"))
        raise InputError(
            f"{path} does not tell by its name which fit it holds: it begins with one of {names}."
        )
    return max(named, key=lambda step: len(step.what))
