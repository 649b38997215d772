"""The recordings of a workspace: recovered where they were cut off, and which of them count."""

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

from scissorcal.errors import InputError
from scissorcal.recipe.requirements import CaptureKind, capture_facts
from scissorcal.recipe.schema import Recipe
from scissorcal.workday.workspace import Workspace

if TYPE_CHECKING:
    from scissorcal.recording import Recording


class UnreadableError(InputError):
    """A file among the recordings, ``path``, that is none or holds nothing."""

    def __init__(self, sentence: str, path: Path) -> None:
        super().__init__(sentence)
        self.path = path


@dataclass(frozen=True)
class Usable:
    """Recordings of one kind that belong to the recipe as it is now, and those that do not.

    ``left_out`` has one sentence for each recording that is not used: which, and why.
    """

    recordings: "tuple[Recording, ...]"
    left_out: tuple[str, ...]


def usable_recordings(workspace: Workspace, recipe: Recipe, kind: CaptureKind) -> Usable:
    """Read the recordings of one kind, and set aside those that are of something else.

    A recording is set aside where the recipe at its capture names another rig, material or scene
    (`capture_facts`); an import carries no recipe and is always used. Raises UnreadableError where
    a file cannot be read as a recording, InputError where turning and sliding joints are mixed.
    """
    used, left_out = [], []
    for path in workspace.recordings(kind):
        recording = _read_or_refuse(path)
        changed = _changed(recording, recipe, kind)
        if changed:
            left_out.append(f"{workspace.relative(path)} is not used: {changed}.")
        else:
            used.append(recording)
    joints = {recording.joint.kind: recording.source for recording in used}
    if len(joints) > 1:
        raise InputError(
            f"{workspace.captures_dir} has {kind} recordings of a rotary joint "
            f"({joints['rotary']}) and of a linear one ({joints['linear']}), which no fit can "
            "take together: move one of them away."
        )
    return Usable(tuple(used), tuple(left_out))


def recover_recordings(workspace: Workspace) -> tuple[str, ...]:
    """Finish captures that were interrupted; return a sentence for each."""
    if not any(workspace.captures_dir.glob("*.part")):
        return ()
    from scissorcal.recording import recover

    return tuple(recovered.sentence for recovered in recover(workspace.captures_dir))


def _read_or_refuse(path: Path) -> "Recording":
    try:
        return _read(path, path.stat().st_mtime_ns, path.stat().st_size)
    except InputError as error:
        raise UnreadableError(
            f"{error} To go on without it, move it out of {path.parent}.", path
        ) from error


@lru_cache(maxsize=64)
def _read(path: Path, _modified_ns: int, _size: int) -> "Recording":
    from scissorcal.recording import read_recording

    return read_recording(path)


def _changed(recording: "Recording", recipe: Recipe, kind: CaptureKind) -> str:
    """Say what the recipe names differently now; empty where nothing is."""
    if not recording.recipe_toml:
        return ""
    from scissorcal.recipe.load import parse_recipe

    try:
        before = capture_facts(parse_recipe(recording.recipe_toml), kind)
    except InputError:
        return "the recipe it was recorded with cannot be read by this version"
    now = capture_facts(recipe, kind)
    changes = [
        f"{key} was {before[key]} and is now {now[key]}" for key in now if before[key] != now[key]
    ]
    return "; ".join(changes)
