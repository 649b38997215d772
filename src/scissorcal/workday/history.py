"""Earlier versions of results: kept when a new one is written, listed, and restored.

A result that its workspace could not take is kept in another folder, and put in place later.
"""

import contextlib
import errno
import os
import re
import shutil
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from datetime import UTC, datetime
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scissorcal.calibration.caveats import NEXT_RECORDING, ON_RECORD, STEP_VERSION
from scissorcal.calibration.result import Result
from scissorcal.calibration.store import load, load_fit, save
from scissorcal.errors import InputError, MissingError, file_error
from scissorcal.files import discard_folder, part_of, put_beside, rename_folder
from scissorcal.identity import file_digest
from scissorcal.workday.engine import Engine
from scissorcal.workday.steps import BY_NAME, Step, steps_of

if TYPE_CHECKING:
    from collections.abc import Callable

HASH = 8
"""Digits of the content's digest in a version's name."""

STAMP = "%Y%m%dT%H%M%SZ"

_NAME = re.compile(r"^(?P<what>[a-z]+(-[a-z]+)?)-(?P<stamp>\d{8}T\d{6}Z)-(?P<hash>[0-9a-f]{8})$")


@dataclass(frozen=True)
class Version:
    """One version of a fit. ``name`` identifies it, ``current`` marks the one in use.

    The name is of the fit's content alone, so a copy of the workspace has the same names.
    ``time_utc`` is the time of the file in use; for an earlier version, that of its file when it
    was kept, which stands in its folder's name.
    ``label`` is its model and effort, ``failed`` the checks that failed; both are empty for a file
    that cannot be read. ``verified`` says that its verification was kept with it.
    """

    name: str
    what: str
    time_utc: str
    label: str
    failed: tuple[str, ...]
    verified: bool
    current: bool
    path: Path

    @property
    def written(self) -> str:
        """``time_utc`` to the minute, as people read it."""
        return datetime.strptime(self.time_utc, STAMP).strftime("%Y-%m-%d %H:%M")


def keep(engine: Engine, name: str) -> Path | None:
    """Have the result of a step, its verification and its pictures in fits/history/<version>/ too.

    Gives the folder, None where there was no result. A kill leaves the whole folder or none. A
    folder that is there, as after a killed restore, loses nothing.
    """
    path = engine.file(name)
    if not path.is_file():
        return None
    folder = _version_folder(engine, path)
    if folder.is_dir():
        _put_all(path, folder / path.name)
        return folder
    folder.parent.mkdir(exist_ok=True)
    part = part_of(folder)
    try:
        _put_all(path, part / path.name)
        rename_folder(part, folder)
    except BaseException:
        shutil.rmtree(part, ignore_errors=True)
        raise
    return folder


def versions(engine: Engine, what: str = "") -> tuple[Version, ...]:
    """All versions of all fits, or of one, the newest first."""
    found: list[Version] = []
    for step in steps_of("fit"):
        if what and step.what != what:
            continue
        file = engine.file(step.name)
        if file.is_file():
            found.append(_version(engine, step.name, file, current=True))
        in_use = {version.name for version in found}
        folders = sorted(_folder(engine).glob(f"{step.what}-*/{file.name}"))
        # the newest folder of each content: earlier releases kept one for each time of a file
        kept = {
            version.name: version
            for path in folders
            if _NAME.match(path.parent.name)
            for version in (_version(engine, step.name, path, current=False),)
        }
        # A restore that was killed leaves its version in both places.
        found += [version for version in kept.values() if version.name not in in_use]
    engine.index.save()
    return tuple(sorted(found, key=lambda version: (version.time_utc, version.name), reverse=True))


def scatter_on_record(engine: Engine, step: Step) -> dict[str, float]:
    """The sd between recordings by parameter, as the newest version of a law's fit has it.

    Only fits by the present version of the step count: another judged recordings in another way.
    Empty where none of them had several recordings that could be compared.
    """
    for version in versions(engine, step.what):
        with contextlib.suppress(InputError):  # a version that is damaged shows nothing
            known = load_fit(version.path).diagnostics
            found = known.get(NEXT_RECORDING) or known.get(ON_RECORD)
            if found and known.get(STEP_VERSION) == step.version:
                return {str(name): float(value) for name, value in found.items()}
    return {}


def restore(engine: Engine, name: str) -> tuple[Version, Path | None]:
    """Put an earlier version of a fit back in use; the one in use is kept as a version.

    Gives the restored version and the folder of the one that was in use. Raises MissingError where
    there is no version of this name, InputError where it is in use already.
    """
    every = versions(engine)
    asked = _named(name)
    found = [version for version in every if asked and version.name.startswith(asked)]
    if len(found) != 1:
        earlier = ", ".join(version.name for version in every if not version.current) or "none"
        how = "names several versions" if found else "names no version"
        raise MissingError(
            f"{name} {how} of a fit. Earlier versions: {earlier}. 'scissorcal fit log' shows them."
        )
    (version,) = found
    if not version.current:
        before = _take_place(engine, f"fit {version.what}", version.path)
        discard_folder(version.path.parent)
        return version, before
    folder = _version_folder(engine, version.path)
    if not folder.exists():
        raise InputError(f"{version.name} is the version in use: nothing was changed.")
    # A restore was killed once its fit was in use: what stands beside it is still to come.
    _put_all(folder / version.path.name, version.path)
    discard_folder(folder)
    engine.refresh()
    return version, None


def _take_place(engine: Engine, name: str, source: Path) -> Path | None:
    """Put the result ``source``, with what stands beside it, in use; the one in use is kept.

    Gives the folder of the one that was in use. Killed, or without space, it leaves one of the two
    results in use, whole, and nothing beside it that belongs to the other.
    """
    before = _replace(engine, name, lambda path: put_beside(source, path))
    _put_all(source, engine.file(name))
    engine.refresh()
    return before


def save_version(
    engine: Engine, name: str, result: Result, draw: Callable[[Path], object] | None = None
) -> Path:
    """Keep the result that is there, then write the new one. Gives its path.

    ``draw`` draws the pictures that stand beside it, into the folder it is given. Where writing
    fails, or is killed, the earlier result stays in use. Pictures and verifications are never those
    of another result; after a kill they may stand in the result's version alone.
    """
    path = engine.file(name)
    drawn = part_of(path.with_suffix(""))
    try:
        if draw is not None:
            draw(drawn)
        kept = _replace(engine, name, lambda target: save(result, target))
        if drawn.exists():
            rename_folder(drawn, path.with_suffix(""))
    finally:
        shutil.rmtree(drawn, ignore_errors=True)
    if kept is not None and file_digest(path) == file_digest(kept / path.name):
        # The same result again: its verification stands, and no version is added.
        for check in _checks_beside(kept / path.name):
            _put(check, path.parent / check.name)
        discard_folder(kept)
    engine.refresh()
    return path


def _replace(engine: Engine, name: str, write: Callable[[Path], object]) -> Path | None:
    """Have ``write`` replace a result; what stood beside the earlier one stays in its version.

    Gives the version's folder, None where there was no result. Where writing fails, the earlier
    result stands as before.
    """
    path = engine.file(name)
    is_new = not (path.is_file() and _version_folder(engine, path).exists())
    kept = keep(engine, name)
    for part in _beside(path):
        _remove(part)
    try:
        write(path)
    except BaseException:
        if kept is not None:
            with contextlib.suppress(OSError):  # what could not be written is told instead
                _put_all(kept / path.name, path)
                if is_new:
                    discard_folder(kept)
        raise
    return kept


def _put_all(source: Path, target: Path) -> None:
    """Put a result and what stands beside it under another name, the result itself first."""
    target.parent.mkdir(parents=True, exist_ok=True)
    _put(source, target)
    for one, other in zip(_beside(source), _beside(target), strict=True):
        _put(one, other)


def _put(source: Path, target: Path) -> None:
    """Put a file, or the files of a folder, under another name; nothing where there is none.

    Folders within it are other programs' (thumbnails, for example) and stay behind.
    """
    if source.is_dir():
        target.mkdir(exist_ok=True)
        for file in source.iterdir():
            if file.is_file():
                put_beside(file, target / file.name)
    elif source.exists():
        put_beside(source, target)


def _remove(path: Path) -> None:
    if path.is_dir():
        discard_folder(path)
    else:
        path.unlink(missing_ok=True)


def _version(engine: Engine, name: str, path: Path, current: bool) -> Version:
    step = BY_NAME[name]
    assert step.read is not None
    facts: dict[str, Any] = {"label": "", "failed": ()}
    try:
        facts = engine.index.facts(path, f"{name} {step.version}", step.read)
    except InputError as error:
        facts["failed"] = (str(error),)
    matched = None if current else _NAME.match(path.parent.name)
    when = matched["stamp"] if matched else _time_of(path)
    own = f"{step.what}-{engine.index.digest(path)[:HASH]}"
    verified = path.with_suffix(".verify.json").is_file()
    return Version(
        own, step.what, when, facts["label"], tuple(facts["failed"]), verified, current, path
    )


def _version_folder(engine: Engine, path: Path) -> Path:
    """The folder of the version that the result ``path`` is, whether or not it is there."""
    digest = engine.index.digest(path)[:HASH]
    there = sorted(_folder(engine).glob(f"{path.stem}-*-{digest}"))
    kept = [folder for folder in there if _of_step(folder.name, path.stem)]
    return kept[-1] if kept else _folder(engine) / f"{path.stem}-{_time_of(path)}-{digest}"


def _of_step(folder: str, what: str) -> bool:
    matched = _NAME.match(folder)
    return matched is not None and matched["what"] == what


def _named(name: str) -> str:
    """The version that a user asks for; a folder of fits/history may be named, too."""
    matched = _NAME.match(name)
    return f"{matched['what']}-{matched['hash']}" if matched else name


def _time_of(path: Path) -> str:
    return datetime.fromtimestamp(path.stat().st_mtime, UTC).strftime(STAMP)


def _folder(engine: Engine) -> Path:
    return engine.workspace.root / "fits" / "history"


def _beside(path: Path) -> tuple[Path, ...]:
    """What stands beside a result: its verification, the records of that, its pictures."""
    return (*_checks_beside(path), path.with_suffix(""))


def _checks_beside(path: Path) -> tuple[Path, ...]:
    return (path.with_suffix(".verify.json"), path.with_suffix(".verify.partial.jsonl"))


def save_anywhere(
    engine: Engine,
    step: Step,
    result: Result,
    draw: Callable[[Path], object] | None,
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
    step = _step_of(path)
    module, _, name = step.holds.partition(":")
    found = load(path, getattr(import_module(module), name))
    if found.what != step.what:
        raise InputError(
            f"{path} holds a fit of {found.what}, and its name begins with {step.what}-: give it "
            f"a name that begins with {found.what}-. Nothing was changed."
        )
    return step, _take_place(engine, step.name, path)


def _kept_elsewhere(
    refusal: str, when: str, step: Step, result: Result, folder: Path | None
) -> InputError:
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
