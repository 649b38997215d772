"""What a scene requires of the day: done, missing or stale, in order, and what comes next."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from scissorcal.errors import InputError
from scissorcal.recipe.requirements import (
    CaptureKind,
    GeometryKind,
    Requirement,
    requirements,
)
from scissorcal.recipe.schema import Recipe
from scissorcal.verdicts import failed
from scissorcal.workday.geometry import expected_package_hash
from scissorcal.workday.recordings import UnreadableError, usable_recordings
from scissorcal.workday.runs.fit import is_current, is_verified
from scissorcal.workday.runs.report import why_stale
from scissorcal.workday.runs.sign import review_state
from scissorcal.workday.workspace import FitKind, Workspace

if TYPE_CHECKING:
    from scissorcal.calibration import FitResult

Status = Literal["done", "missing", "stale"]


@dataclass(frozen=True)
class Step:
    """One step of the day: its state, the reason for that state, and the command that does it.

    ``why`` says what the scene needs it for; ``state`` what was found.
    """

    name: str
    status: Status
    state: str
    why: str
    command: str
    files: tuple[str, ...] = ()


@dataclass(frozen=True)
class Plan:
    """All steps in the order of the day. ``next_command`` is None where nothing is left to do."""

    recipe: str
    steps: tuple[Step, ...]
    tables: tuple[Requirement, ...]
    left_out: tuple[Requirement, ...]
    notes: tuple[str, ...]

    @property
    def next_command(self) -> str | None:
        """The command of the first step that is not done."""
        return next((step.command for step in self.steps if step.status != "done"), None)


def make_plan(workspace: Workspace) -> Plan:
    """Compare what the recipe requires with what the workspace holds.

    A fit is stale where its inputs (recordings, settings, fits that it builds on) no longer have
    the hash it was made from; a report and a package where a fit that they show is another now. A
    recording is stale where the recipe now names another rig, material or scene. Raises
    InputError where the recipe is wrong.
    """
    recipe = workspace.recipe()
    needs = requirements(recipe)
    notes: list[str] = []
    steps: list[Step] = []
    for item in needs.captures:
        kind: CaptureKind = "friction" if item.name == "friction" else "cut"
        steps.append(_capture_step(workspace, recipe, kind, item.why, notes))
    steps += [_photograph_step(workspace, item) for item in needs.photographs]
    for item in needs.geometry:
        captured = next(step for step in steps if step.name == f"capture {item.name}")
        steps.append(_geometry_step(workspace, recipe, item, captured))
    fits: dict[FitKind, FitResult] = {}
    for item in needs.fits:
        what: FitKind = "friction" if item.name == "friction" else "cut"
        captured = next(step for step in steps if step.name == f"capture {what}")
        steps.append(_fit_step(workspace, recipe, what, item.why, captured, fits))
    fitted = all(step.status == "done" for step in steps)
    if fitted and not all(is_verified(workspace, fit) for fit in fits.values()):
        notes.append(
            "Unverified: whether the intervals of the fits hold was not checked. 'scissorcal "
            "verify' does so, and the report shows it."
        )
    report = _report_step(workspace, recipe, fits, fitted)
    steps += [report, _review_step(workspace, recipe, fits, report, notes)]
    if needs.tables:
        steps.append(_package_step(workspace, recipe, fits, fitted))
    return Plan(recipe.name, tuple(steps), needs.tables, needs.left_out, tuple(notes))


def _photograph_step(workspace: Workspace, item: Requirement) -> Step:
    from scissorcal.workday.geometry import photograph_state

    command = f"scissorcal capture {item.name} --image {_PHOTOGRAPHS[item.name]}"
    name = f"capture {item.name}"
    found = photograph_state(workspace, _geometry(item.name))
    files = tuple(workspace.relative(path) for path in found.files)
    return Step(name, found.status, found.state, item.why, command, files)


def _geometry_step(workspace: Workspace, recipe: Recipe, item: Requirement, captured: Step) -> Step:
    from scissorcal.workday.geometry import fit_state

    name, command = f"fit {item.name}", f"scissorcal fit {item.name}"
    found = fit_state(workspace, recipe, _geometry(item.name))
    if found.damaged:
        return Step(name, found.status, found.state, item.why, f"{command} --force")
    if captured.status != "done" and found.status != "missing":
        state = f"its photographs are {captured.status}"
        return Step(name, "stale", state, item.why, command)
    files = tuple(workspace.relative(path) for path in found.files)
    return Step(name, found.status, found.state, item.why, command, files)


def _geometry(name: str) -> GeometryKind:
    kinds: dict[str, GeometryKind] = {"camera": "camera", "blade": "blade", "plate": "plate"}
    return kinds[name]


_PHOTOGRAPHS = {"camera": "board-*.jpg", "blade": "blade-*.jpg", "plate": "plate-*.jpg"}


def _capture_step(
    workspace: Workspace, recipe: Recipe, kind: CaptureKind, why: str, notes: list[str]
) -> Step:
    command = f"scissorcal capture {kind} --device PORT"
    name = f"capture {kind}"
    try:
        usable = usable_recordings(workspace, recipe, kind)
    except UnreadableError as error:
        notes.append(str(error))
        file = workspace.relative(error.path)
        return Step(name, "stale", f"{file} cannot be read", why, f"mv {file} {file}.unreadable")
    except InputError as error:
        notes.append(str(error))
        return Step(name, "stale", "the recordings do not go together", why, command)
    notes.extend(usable.left_out)
    if not usable.recordings:
        if usable.left_out:
            return Step(name, "stale", "recorded with another recipe", why, command)
        return Step(name, "missing", "nothing recorded yet", why, command)
    files = [workspace.relative(Path(recording.source)) for recording in usable.recordings]
    for file, recording in zip(files, usable.recordings, strict=True):
        joint = recording.joint.kind
        if joint != recipe.rig.joint:
            notes.append(
                f"{file} is of a {joint} joint, and the recipe says otherwise: set "
                f'joint = "{joint}" in its [rig].'
            )
        notes.extend(f"{file}: {sentence}" for sentence in recording.notes)
    seconds = sum(recording.duration_s for recording in usable.recordings)
    count = len(usable.recordings)
    state = f"{count} recording{'s' if count > 1 else ''}, {seconds:.0f} s"
    return Step(name, "done", state, why, command, tuple(files))


def _fit_step(
    workspace: Workspace,
    recipe: Recipe,
    what: FitKind,
    why: str,
    captured: Step,
    fits: "dict[FitKind, FitResult]",
) -> Step:
    """State of one fit; a fit that can be read is added to ``fits``."""
    from scissorcal.calibration import load_fit

    name, command, path = f"fit {what}", f"scissorcal fit {what}", workspace.fit_path(what)
    if not path.is_file():
        return Step(name, "missing", "not fitted yet", why, command)
    try:
        fit = fits[what] = load_fit(path)
    except InputError:
        state = f"{workspace.relative(path)} is damaged"
        return Step(name, "stale", state, why, f"scissorcal fit {what} --force")
    if captured.status != "done":
        return Step(name, "stale", f"its recordings are {captured.status}", why, command)
    if not is_current(workspace, recipe, fit, fits.get("friction")):
        return Step(name, "stale", "its inputs changed since", why, command)
    state = f"{fit.rung} ({fit.effort})"
    wrong = [verdict.check for verdict in failed(fit.verdicts)]
    if wrong:
        state += f"; failed: {', '.join(wrong)}"
    elif not is_verified(workspace, fit):
        state += "; unverified"
    return Step(name, "done", state, why, command, (workspace.relative(path),))


def _report_step(
    workspace: Workspace, recipe: Recipe, fits: "dict[FitKind, FitResult]", fitted: bool
) -> Step:
    name, why, command = "report", "what to review before use", "scissorcal report"
    path = workspace.report_json
    if not path.is_file() or not workspace.report_html.is_file():
        return Step(name, "missing", "not written yet", why, command)
    stale = why_stale(workspace, recipe, fits) if fitted else "a fit is not as it should be"
    if stale:
        return Step(name, "stale", stale, why, command)
    files = (workspace.relative(workspace.report_html), workspace.relative(path))
    return Step(name, "done", "shows the fits as they are now", why, command, files)


def _review_step(
    workspace: Workspace,
    recipe: Recipe,
    fits: "dict[FitKind, FitResult]",
    report: Step,
    notes: list[str],
) -> Step:
    name, why = "report sign", "who answers for it"
    command = "scissorcal report sign --name NAME --decision accept"
    state = review_state(workspace, recipe, fits)
    file = workspace.relative(workspace.signature_path)
    if state.why:
        void = f"void: {state.why}"
        if state.review:
            notes.append(f"The signature is void ({state.review.words}): {state.why}.")
        return Step(name, "stale", void, why, command)
    if state.review is None:
        return Step(name, "missing", "not signed yet", why, command)
    if report.status != "done":
        return Step(name, "stale", f"the report is {report.status}", why, command)
    if state.review.decision == "reject":
        notes.append(
            f"The report was {state.review.words}. Mend that, fit and report again before a "
            "package of it is rendered."
        )
    return Step(name, "done", state.review.words, why, command, (file,))


def _package_step(
    workspace: Workspace, recipe: Recipe, fits: "dict[FitKind, FitResult]", fitted: bool
) -> Step:
    from scissorcal.package import open_package

    name, why, command = "package build", "what the loop renders", "scissorcal package build"
    path = workspace.package_path(recipe)
    if not path.is_file():
        return Step(name, "missing", "not built yet", why, command)
    try:
        manifest = open_package(path, warn=False).manifest
    except InputError:
        return Step(name, "stale", f"{workspace.relative(path)} is damaged", why, command)
    expected = expected_package_hash(workspace, recipe, fits)
    if not fitted or manifest.provenance.inputs_hash != expected:
        return Step(name, "stale", "built from other fits or another recipe", why, command)
    if manifest.review != review_state(workspace, recipe, fits).valid:
        return Step(name, "stale", "it carries another review than there is now", why, command)
    state = f"error bound {manifest.bound.stated_Nm:.2g} N m"
    return Step(name, "done", state, why, command, (workspace.relative(path),))
