"""The recordings of a workspace: which a fit uses, which it does not, and why."""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, get_args

from scissorcal.errors import InputError, MissingError, file_error
from scissorcal.files import replacing
from scissorcal.foreign import read_json
from scissorcal.foreign.formats import STATE
from scissorcal.identity import digest
from scissorcal.recipe.requirements import CaptureKind, capture_facts
from scissorcal.recipe.schema import Recipe
from scissorcal.workday.index import FileIndex
from scissorcal.workday.workspace import Workspace

if TYPE_CHECKING:
    from scissorcal.recording import Recording

Use = Literal["used", "excluded", "other recipe", "repeated", "unreadable"]


@dataclass(frozen=True)
class RecordingRow:
    """One recording: whether a fit uses it, ``why`` not where it does not, and what it holds.

    ``facts`` are empty for a file that cannot be read.
    """

    path: Path
    kind: str
    use: Use
    why: str
    facts: Mapping[str, Any]

    @property
    def seconds(self) -> float:
        return float(self.facts.get("seconds", 0.0))


def list_recordings(
    workspace: Workspace, recipe: Recipe, kind: CaptureKind, index: FileIndex
) -> tuple[RecordingRow, ...]:
    """List the recordings of one kind, oldest first, with the use that fits make of them.

    A recording is not used where a person excluded it, where it cannot be read, or where the
    recipe at its capture names another rig, material or scene (`capture_facts`), and where one
    before it has the same content. An import carries no recipe and counts as of this one.
    """
    excluded = _exclusions(workspace)
    first: dict[str, str] = {}
    rows = []
    for path in workspace.recordings(kind):
        out = excluded.get(path.name)
        try:
            facts = index.facts(path, f"recording {kind}", lambda file: _facts(file, kind))
        except InputError as error:
            broken: Use = "excluded" if out else "unreadable"
            rows.append(RecordingRow(path, kind, broken, out["why"] if out else str(error), {}))
            continue
        content = str(facts["content"])
        use, why = _use(facts, recipe, kind, out, first.get(content, ""))
        if use == "used":
            first[content] = path.name
        rows.append(RecordingRow(path, kind, use, why, facts))
    return tuple(rows)


def _use(
    facts: Mapping[str, Any],
    recipe: Recipe,
    kind: CaptureKind,
    excluded: Mapping[str, str] | None,
    same_as: str,
) -> tuple[Use, str]:
    """The use of a recording that can be read, and why it is not used."""
    if excluded:
        return "excluded", excluded["why"]
    changed = _changed(facts, recipe, kind)
    if changed:
        return "other recipe", changed
    if same_as:
        return "repeated", f"it has the same content as {same_as}"
    return "used", ""


def used_recordings(
    workspace: Workspace, recipe: Recipe, kind: CaptureKind, index: FileIndex | None = None
) -> "tuple[Recording, ...]":
    """Read the recordings of one kind that fits use, oldest first.

    Their ``source`` is their name in the workspace, so that results tell nothing of this disk.
    Raises InputError where a file cannot be read or rotary and linear joints are mixed.
    """
    rows = list_recordings(workspace, recipe, kind, index or FileIndex(workspace.root))
    for row in rows:
        if row.use == "unreadable":
            raise InputError(f"{row.why} {_exclude_hint(row.path)}")
    used = [row.path for row in rows if row.use == "used"]
    found = tuple(
        replace(
            _read(path, path.stat().st_mtime_ns, path.stat().st_size),
            source=workspace.relative(path),
        )
        for path in used
    )
    refuse_mixed_joints(rows)
    return found


def refuse_mixed_joints(rows: tuple[RecordingRow, ...]) -> None:
    """Raise InputError where recordings of a rotary and of a linear joint are used together."""
    joints = {row.facts["joint"]: row.path for row in rows if row.use == "used"}
    if len(joints) > 1:
        raise InputError(
            f"One fit cannot use recordings of a rotary joint ({joints['rotary'].name}) and of a "
            f"linear joint ({joints['linear'].name}). {_exclude_hint(joints['linear'])}"
        )


def counts_of(
    row: RecordingRow, recipe: Recipe, kind: CaptureKind, index: FileIndex
) -> Mapping[str, Any]:
    """Count what one recording holds of the recipe's plan; nothing where no plan made it.

    See `device.counting`. ``unplanned`` says why its device cannot follow the recipe's plan.
    """

    def count(path: Path) -> dict[str, Any]:
        from scissorcal.device.counting import count_recorded
        from scissorcal.recording import read_recording

        try:
            return count_recorded(read_recording(path), recipe, kind)
        except InputError as error:
            return {"unplanned": str(error)}

    return index.facts(row.path, f"recorded {kind}", count, given=_planning(recipe))


def counts_used(
    row: RecordingRow, recipe: Recipe, kind: CaptureKind, fit: Path, index: FileIndex
) -> Mapping[str, Any]:
    """Count what the fit in the file ``fit`` uses of one recording, as :func:`counts_of` does.

    Nothing where the fit does not say what it uses.
    """

    def count(path: Path) -> dict[str, Any]:
        from scissorcal.calibration.store import load_fit
        from scissorcal.device.counting import count_used

        recording = _read(path, path.stat().st_mtime_ns, path.stat().st_size)
        found = load_fit(fit)
        for source, spans in zip(found.sources, found.used, strict=False):
            if source.endswith(recording.content_hash):
                return count_used(recording, recipe, kind, spans)
        return {}

    given = f"{_planning(recipe)} {index.digest(fit)[:16]}"
    return index.facts(row.path, f"used {kind}", count, given=given)


def _planning(recipe: Recipe) -> str:
    """Identity of what a capture is planned from."""
    return digest(recipe.model_dump(include={"capture", "scene", "rig", "material", "fit"}))[:16]


def exclude_recording(workspace: Workspace, name: str, why: str) -> Path:
    """Note that fits do not use a recording; the file stays as it is.

    Raises MissingError where there is no recording of this name, InputError without a reason.
    """
    path = _named(workspace, name)
    if not why.strip():
        raise InputError("State the reason with --why: it is shown wherever the data are listed.")
    noted = dict(_exclusions(workspace))
    noted[path.name] = {
        "why": why.strip(),
        "time_utc": datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ"),
    }
    _note(workspace, noted)
    return path


def include_recording(workspace: Workspace, name: str) -> Path:
    """Let fits use a recording again. Raises MissingError where it was not excluded."""
    noted = dict(_exclusions(workspace))
    key = Path(name).name
    if key not in noted:
        listed = ", ".join(noted) or "none"
        raise MissingError(f"{key} is not excluded. Excluded recordings: {listed}.")
    del noted[key]
    _note(workspace, noted)
    return workspace.captures_dir / key


def _exclusions(workspace: Workspace) -> Mapping[str, Mapping[str, str]]:
    """Reason and time of each excluded recording, by file name. InputError where damaged."""
    path = workspace.exclusions_path
    if not path.is_file():
        return {}
    try:
        found = read_json(path, STATE)
        return {str(name): {**row, "why": str(row["why"])} for name, row in found.items()}
    except (InputError, ValueError, TypeError, KeyError, AttributeError):
        raise InputError(
            f"{path} is not a list of exclusions. It lists the excluded recordings: correct it, or "
            "remove it to use every recording."
        ) from None


def _exclude_hint(path: Path) -> str:
    """The command that goes on without a recording."""
    return f"Exclude one with 'scissorcal recording exclude {path.name} --why REASON'."


def why_unused(workspace: Workspace, row: RecordingRow) -> str:
    """Say why fits do not use a recording."""
    if row.use == "unreadable":
        return f"{row.why} {_exclude_hint(row.path)}"
    reason = "recorded otherwise" if row.use == "other recipe" else row.use
    return f"{workspace.relative(row.path)} is not used ({reason}): {row.why}."


def notes_of(workspace: Workspace, recipe: Recipe, used: Sequence[RecordingRow]) -> tuple[str, ...]:
    """What the recordings that fits use say of themselves, and a joint that the recipe lacks."""
    notes = []
    for row in used:
        name = workspace.relative(row.path)
        if row.facts["joint"] != recipe.rig.joint:
            notes.append(
                f"{name} is of a {row.facts['joint']} joint and the recipe states another: set "
                f'joint = "{row.facts["joint"]}" in its [rig].'
            )
        notes += [f"{name}: {sentence}" for sentence in row.facts["notes"]]
    return tuple(notes)


def recover_recordings(workspace: Workspace) -> tuple[str, ...]:
    """Finish captures that were interrupted; return a sentence for each.

    Where the workspace cannot be written they wait, and the sentence is why.
    """
    if not any(workspace.captures_dir.glob("*.part")):
        return ()
    from scissorcal.recording import recover
    from scissorcal.workday.photographs import recover_photographs

    try:
        recovered = recover(workspace.captures_dir)
        return (
            *(one.sentence for one in recovered),
            *recover_photographs(workspace.captures_dir),
        )
    except (OSError, InputError) as error:
        known = file_error(error, workspace.captures_dir) if isinstance(error, OSError) else error
        if known is None:
            raise
        return (f"A capture that was interrupted could not be recovered yet: {known}",)


def _facts(path: Path, kind: CaptureKind) -> dict[str, Any]:
    recording = _read(path, path.stat().st_mtime_ns, path.stat().st_size)
    return {
        "content": recording.content_hash,
        "joint": recording.joint.kind,
        "seconds": recording.duration_s,
        "samples": len(recording.samples),
        "device": " ".join(str(recording.device.get(key, "")) for key in ("name", "serial")),
        "notes": list(recording.notes),
        "captured": _captured(recording, kind),
    }


def _captured(recording: "Recording", kind: CaptureKind) -> dict[str, object] | str | None:
    """What the recipe at the capture says of it; a sentence where that recipe cannot be read."""
    from scissorcal.recipe.load import parse_recipe

    if not recording.recipe_toml:
        return None
    try:
        return dict(capture_facts(parse_recipe(recording.recipe_toml, judged=False), kind))
    except InputError:
        return "the recipe at its capture cannot be read by this version"


def _changed(facts: Mapping[str, Any], recipe: Recipe, kind: CaptureKind) -> str:
    """Say what the recipe names differently now; empty where nothing is."""
    before = facts["captured"]
    if before is None or isinstance(before, str):
        return before or ""
    now = capture_facts(recipe, kind)
    changes = [
        f"{key} was {before.get(key)} and is now {now[key]}"
        for key in now
        if before.get(key) != now[key]
    ]
    return "; ".join(changes)


def _named(workspace: Workspace, name: str) -> Path:
    there = {p.name: p for kind in get_args(CaptureKind) for p in workspace.recordings(kind)}
    if Path(name).name not in there:
        raise MissingError(
            f"{workspace.captures_dir} has no recording of friction or a cut called "
            f"{Path(name).name}. It has: {', '.join(there) or 'none'}."
        )
    return there[Path(name).name]


def _note(workspace: Workspace, noted: Mapping[str, Mapping[str, str]]) -> None:
    with replacing(workspace.exclusions_path) as part:
        part.write_text(json.dumps(noted, indent=1) + "\n", encoding="utf-8")


@lru_cache(maxsize=64)
def _read(path: Path, _modified_ns: int, _size: int) -> "Recording":
    from scissorcal.recording import read_recording

    return read_recording(path)
