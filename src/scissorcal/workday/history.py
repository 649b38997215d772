"""Earlier versions of results: kept when a new one is written, listed, and restored."""

import re
import shutil
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scissorcal.errors import InputError, MissingError
from scissorcal.identity import file_digest
from scissorcal.workday.engine import Engine
from scissorcal.workday.steps import BY_NAME, steps_of

if TYPE_CHECKING:
    from scissorcal.calibration.result import Result

HASH = 8
"""Digits of the content's digest in a version's name."""

_NAME = re.compile(r"^(?P<what>[a-z]+(-[a-z]+)?)-(?P<stamp>\d{8}T\d{6}Z)-(?P<hash>[0-9a-f]{8})$")


@dataclass(frozen=True)
class Version:
    """One version of a fit. ``name`` identifies it, ``current`` marks the one in use.

    ``label`` is its model and effort, ``failed`` the checks that failed; both are empty for a file
    that cannot be read. ``verified`` says that its trust check was kept with it.
    """

    name: str
    what: str
    time_utc: str
    label: str
    failed: tuple[str, ...]
    verified: bool
    current: bool
    path: Path


def keep(engine: Engine, name: str) -> Path | None:
    """Move the result of a step, its trust check and its pictures to fits/history/<version>/.

    Gives the folder, None where there was no result.
    """
    path = engine.file(name)
    if not path.is_file():
        return None
    stamp = datetime.fromtimestamp(path.stat().st_mtime, UTC).strftime("%Y%m%dT%H%M%SZ")
    folder = _folder(engine) / f"{path.stem}-{stamp}-{engine.index.digest(path)[:HASH]}"
    if folder.exists():
        shutil.rmtree(folder)
    folder.mkdir(parents=True)
    for part in _parts(path):
        if part.exists():
            part.rename(folder / part.name)
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
        folders = _folder(engine).glob(f"{step.what}-*/{file.name}")
        found += [_version(engine, step.name, path, current=False) for path in folders]
    engine.index.save()
    return tuple(sorted(found, key=lambda version: (version.time_utc, version.name), reverse=True))


def restore(engine: Engine, name: str) -> tuple[Version, Path | None]:
    """Put an earlier version of a fit back in use; the one in use is kept as a version.

    Gives the restored version and the folder of the one that was in use. Raises MissingError where
    there is no version of this name, InputError where it is in use already.
    """
    every = versions(engine)
    found = [version for version in every if version.name.startswith(name)]
    if len(found) != 1:
        earlier = ", ".join(version.name for version in every if not version.current) or "none"
        how = "names several versions" if found else "names no version"
        raise MissingError(
            f"{name} {how} of a fit. Earlier versions: {earlier}. 'scissorcal fit log' shows them."
        )
    (version,) = found
    if version.current:
        raise InputError(f"{version.name} is the version in use: nothing was changed.")
    step = f"fit {version.what}"
    before = keep(engine, step)
    target = engine.file(step).parent
    for part in sorted(version.path.parent.iterdir()):
        part.rename(target / part.name)
    version.path.parent.rmdir()
    engine.refresh()
    return version, before


def save_version(engine: Engine, name: str, result: "Result") -> Path:
    """Keep the result that is there, then write the new one. Gives its path.

    Where writing fails the earlier result is put back.
    """
    from scissorcal.calibration.store import save

    path = engine.file(name)
    kept = keep(engine, name)
    try:
        save(result, path)
    except BaseException:
        if kept is not None:
            for part in kept.iterdir():
                part.replace(path.parent / part.name)
            kept.rmdir()
        raise
    if kept is not None and file_digest(path) == file_digest(kept / path.name):
        # The same result again: its trust check stands, and no version is added.
        (kept / path.name).unlink()
        for part in kept.iterdir():
            part.replace(path.parent / part.name)
        kept.rmdir()
    engine.refresh()
    return path


def _version(engine: Engine, name: str, path: Path, current: bool) -> Version:
    step = BY_NAME[name]
    assert step.read is not None
    facts: dict[str, Any] = {"label": "", "failed": ()}
    try:
        facts = engine.index.facts(path, f"{name} {step.version}", step.read)
    except InputError as error:
        facts["failed"] = (str(error),)
    matched = _NAME.match(path.parent.name)
    when = datetime.fromtimestamp(path.stat().st_mtime, UTC).strftime("%Y%m%dT%H%M%SZ")
    digest = engine.index.digest(path)[:HASH]
    own = matched.group(0) if matched else f"{step.what}-{when}-{digest}"
    verified = path.with_suffix(".verify.json").is_file()
    return Version(
        own, step.what, when, facts["label"], tuple(facts["failed"]), verified, current, path
    )


def _folder(engine: Engine) -> Path:
    return engine.workspace.root / "fits" / "history"


def _parts(path: Path) -> tuple[Path, ...]:
    """A result's file, its trust check, the records of that, and its folder of pictures."""
    return (
        path,
        path.with_suffix(".verify.json"),
        path.with_suffix(".verify.partial.jsonl"),
        path.with_suffix(""),
    )
