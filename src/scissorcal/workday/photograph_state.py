"""What state a step of photographs is in."""

from pathlib import Path

from scissorcal.errors import InputError
from scissorcal.identity import digest
from scissorcal.workday.facts import photographs, refuse_changed
from scissorcal.workday.states import DayStates, StepState, counted
from scissorcal.workday.steps import Step
from scissorcal.workday.workspace import Workspace


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
