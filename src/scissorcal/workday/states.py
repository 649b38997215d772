"""The states of a step of the day, that of photographs among them, and what clears a failed one."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, Protocol

from scissorcal.errors import InputError
from scissorcal.identity import digest
from scissorcal.workday.facts import photographs, refuse_changed
from scissorcal.workday.steps import BY_EFFORT, BY_NAME, Step
from scissorcal.workday.workspace import Workspace

if TYPE_CHECKING:
    from pathlib import Path

    from scissorcal.recipe.schema import Recipe
    from scissorcal.workday.index import FileIndex
    from scissorcal.workday.workspace import Workspace

State = Literal[
    "missing", "damaged", "stale", "incomplete", "failed", "unverified", "done", "excluded"
]
"""What a step may be in, in the order in which it is decided.

missing: there is no result. damaged: its file cannot be read; its command makes it again. stale: it
was made from other inputs than there are now, or an input is missing, damaged or stale. incomplete:
a capture lacks what the recipe plans, a fit ran out of time, or a verification counted no coverage.
failed: a check of it or of a fit below it failed, a recording cannot be read, or a person rejected
it. unverified: no complete verification of this very fit is there. done: none of these. excluded:
the scene does not need it.
"""

WAITING: frozenset[State] = frozenset({"missing", "damaged", "stale"})
"""States of an input in which what builds on it is stale."""

CHANGED = {
    "verify": "of an earlier fit",
    "report": "it shows other fits, verifications or settings than there are now",
    "package": "built from other fits or settings than there are now",
}
"""Why a result of this kind is stale, where its inputs are all there."""


@dataclass(frozen=True)
class StepState:
    """The state of one step, what was found, and the command that comes next for it.

    ``why`` says what the scene needs it for. ``command`` is empty where nothing is to be done.
    ``content`` is the digest of its result, empty where there is none.
    """

    name: str
    state: State
    found: str
    why: str = ""
    command: str = ""
    files: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    content: str = ""
    failed: tuple[str, ...] = ()
    optional: bool = False


class DayStates(Protocol):
    """The states of all steps of a day, as one step's state is worked out from those of others."""

    workspace: Workspace
    recipe: Recipe
    index: FileIndex

    def state(self, name: str) -> StepState: ...

    def shown(self, name: str) -> bool: ...

    def file(self, name: str) -> Path: ...

    def facts(self, name: str) -> dict[str, Any]: ...


def counted(number: int, thing: str) -> str:
    """A number of things in words.

    >>> counted(1, "photograph"), counted(2, "photograph")
    ('1 photograph', '2 photographs')
    """
    return f"{number} {thing}{'' if number == 1 else 's'}"


def remedy(
    step: Step, failed: Sequence[str], effort: str, state: Callable[[str], StepState]
) -> str:
    """The command that may clear the failed checks of a step's result.

    A check of what the fit builds on leads to that step; one of the search to a longer search,
    unless it was the longest; every other to new data.
    """
    if step.kind == "sign":
        return "scissorcal report --anew"  # after what was rejected is corrected
    if step.kind != "fit":
        return step.command
    if "foundations" in failed:
        for item in step.inputs:
            below = state(item.rstrip("?"))
            if below.state in ("failed", "incomplete", "stale"):
                return below.command
    if set(failed) <= BY_EFFORT and effort != "thorough":
        return f"{step.command} --effort thorough"
    return BY_NAME[step.inputs[0]].command


def photographs_state(day: DayStates, step: Step, why: str) -> StepState:
    """The state of a step whose inputs are photographs."""
    paths = photograph_indexes(day.workspace, step)
    try:
        read = [day.index.facts(path, "photographs", photographs) for path in paths]
        for path, facts in zip(paths, read, strict=True):
            refuse_changed(path.parent, facts["sha256"], day.index.digest)
    except InputError as error:
        return StepState(step.name, "failed", str(error), why, step.command)
    first = [path for path in paths if path.parent.name.startswith(f"{step.photographs[0]}-")]
    if not first:
        return _without_photographs(day, step, why)
    count = sum(int(facts["photographs"]) for facts in read)
    return StepState(
        step.name,
        "done",
        counted(count, "photograph"),
        why,
        files=tuple(day.workspace.relative(path.parent) for path in paths),
        content=digest([facts["content"] for facts in read]),
    )


def photograph_indexes(workspace: Workspace, step: Step) -> list[Path]:
    """Index files of the folders of photographs that count for a step."""
    paths: list[Path] = []
    for kind in step.photographs:
        own = workspace.photograph_indexes(kind)
        paths += own[-1:] if step.newest_only else own
    return paths


def _without_photographs(day: DayStates, step: Step, why: str) -> StepState:
    """A camera may come from a file, which then takes the place of photographs."""
    fit = f"fit {step.what}"
    path = day.file(fit)
    if step.what == "camera" and path.is_file():
        try:
            imported = day.facts(fit)["imported"]
        except InputError:
            imported = False
        if imported:
            files = (day.workspace.relative(path),)
            return StepState(step.name, "done", "imported from a file", why, files=files)
    return StepState(step.name, "missing", "no photographs yet", why, step.command)
