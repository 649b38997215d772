"""Write a workspace's report from what its steps gave, and compare two runs."""

from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from scissorcal.calibration import load_fit
from scissorcal.calibration.result import FitResult
from scissorcal.calibration.store import load
from scissorcal.calibration.verify.result import VerifyResult
from scissorcal.errors import InputError, MissingError
from scissorcal.foreign import read_foreign, reading
from scissorcal.foreign.formats import REPORT
from scissorcal.identity import VERSION
from scissorcal.package.simplest.choice import SceneChoice
from scissorcal.recipe.load import read_text
from scissorcal.recipe.plate_layers import plate_pieces
from scissorcal.recipe.requirements import CaptureKind
from scissorcal.report import (
    Cell,
    Comparison,
    Evidence,
    Geometry,
    Side,
    build_report,
    compare,
    document_of,
    document_of_fit,
    read_twin,
    write_comparison,
)
from scissorcal.report.build import ReportFiles
from scissorcal.verdicts import Verdict
from scissorcal.workday.engine import Engine
from scissorcal.workday.next_step import next_after_report
from scissorcal.workday.recordings import used_recordings
from scissorcal.workday.runs.fit import available, load_result, pictures_beside
from scissorcal.workday.steps import steps_of
from scissorcal.workday.workspace import RECIPE_FILE, Workspace, find_workspace

RIG: tuple[CaptureKind, ...] = ("friction", "friction-advance", "cut")


@dataclass(frozen=True)
class Reported:
    """The report's two files, the fits that it shows, and every verdict in it.

    ``written`` is false where the files were left as they are.
    """

    html: Path
    json: Path
    fits: tuple[str, ...]
    verdicts: tuple[Verdict, ...]
    written: bool = True


def write_workspace_report(
    engine: Engine, *, anew: bool = False, now: datetime | None = None
) -> Reported:
    """Write report/report.html and report/report.json from the workspace's fits.

    A fit that is missing is named in the report; fits of photographs alone are enough. A report
    that is signed and current is left as it is, unless ``anew`` or its page is missing. Where
    nothing that it says has changed, it keeps its time, and with it a signature, which the page
    shows. Raises MissingError where there is no fit, or one is stale.
    """
    _refuse_stale(engine)
    fits = _rig_fits(engine)
    geometry = _geometry(engine)
    if not fits and not geometry.fits:
        raise MissingError("There is nothing to report yet: run 'scissorcal fit' first.")
    checks = _verifications(engine, fits)
    workspace = engine.workspace
    signed = engine.state("report sign").state in ("done", "failed")
    written = anew or not signed or not workspace.report_html.is_file()
    if written:
        build_report(
            engine.recipe,
            list(fits.values()),
            Evidence(
                tuple(
                    recording
                    for what in RIG
                    if what in fits
                    for recording in used_recordings(workspace, engine.recipe, what, engine.index)
                ),
                checks,
                geometry,
                tuple(cell for what in RIG if what in fits for cell in _cells(engine, what)),
                _choice(engine),
                plate_pieces(engine.recipe.plate, workspace.root),
                recipe_text=read_text(workspace.recipe_path),
                inputs_hash=engine.identity("report"),
                next_command=next_after_report(engine),
            ),
            workspace.report_html.parent,
            created=now or datetime.now(UTC),
        )
        engine.refresh()
    verdicts = [v for found in geometry.fits.values() for v in found.verdicts]
    verdicts += [v for found in fits.values() for v in found.verdicts]
    verdicts += [v for found in checks.values() for v in found.verdicts]
    names = (*geometry.fits, *fits)
    return Reported(workspace.report_html, workspace.report_json, names, tuple(verdicts), written)


def _refuse_stale(engine: Engine) -> None:
    for step in steps_of("fit"):
        state = engine.state(step.name)
        if state.state == "stale" and engine.needed(step.name):
            raise MissingError(
                f"The {step.name.replace('fit', 'fit of')} is stale ({state.found}): run "
                f"'{engine.leads_to(step.name)}' first."
            )
        if state.state == "damaged":
            raise InputError(f"{state.found}.")


def _rig_fits(engine: Engine) -> dict[str, FitResult]:
    return {what: load_result(engine, what) for what in available(engine, RIG)}


def _cells(engine: Engine, what: CaptureKind) -> list[Cell]:
    return [
        Cell(what, row.name, row.planned, row.recorded, row.used, row.unit, row.motion)
        for row in engine.completeness(what).summary
    ]


def _choice(engine: Engine) -> SceneChoice | None:
    """What the scene needs of the fits; None where their law makes no tables."""
    from scissorcal.workday.runs.simplest import workspace_scene_choice

    try:
        return workspace_scene_choice(engine)
    except InputError:
        return None  # 'package build' says why; the report is of the fits all the same


def _verifications(engine: Engine, fits: dict[str, FitResult]) -> dict[str, VerifyResult]:
    """The verifications of these very fits."""
    current = [w for w in fits if engine.state(f"verify {w}").state in ("done", "failed")]
    return {what: load(engine.file(f"verify {what}"), VerifyResult) for what in current}


def _geometry(engine: Engine) -> Geometry:
    """The fits of photographs that are current; one that is missing is named with its command."""
    kinds = ("camera", "blade", "plate")
    there = available(engine, kinds)
    missing = {}
    for kind in kinds:
        state = engine.state(f"fit {kind}")
        if engine.needed(f"fit {kind}") and kind not in there:
            capture = engine.state(f"capture {kind}")
            first = f"`{capture.command}`, then " if capture.state == "missing" else ""
            missing[kind] = f"The scene requires it: {state.found}. Run {first}`{state.command}`."
    files = {kind: engine.file(f"fit {kind}") for kind in there}
    found = {kind: load_result(engine, kind) for kind in there}
    return Geometry(
        camera=found.get("camera"),
        blade=found.get("blade"),
        plate=found.get("plate"),
        pictures={kind: pictures_beside(path) for kind, path in files.items()},  # type: ignore[misc]
        sha256={kind: engine.index.digest(path) for kind, path in files.items()},  # type: ignore[misc]
        missing=missing,  # type: ignore[arg-type]
    )


def compare_runs(
    first: Path, second: Path, folder: Path, *, now: datetime | None = None
) -> tuple[Comparison, ReportFiles]:
    """Write comparison.html and comparison.json into ``folder``; gives the comparison and both.

    Each side is a workspace, a report.json, or a fit (.nc). Raises MissingError where there is
    nothing, InputError where a file is none of these or the two cannot be compared.
    """
    sides = [load_side(path) for path in (first, second)]
    found = compare(*sides, created=now or datetime.now(UTC), version=VERSION)
    return found, write_comparison(found, folder)


def load_side(path: Path) -> Side:
    """Read one side of a comparison from wherever it lies."""
    if path.is_dir():
        if not (path / RECIPE_FILE).is_file():
            raise MissingError(
                f"{path} has no {RECIPE_FILE}, so it is no workspace: name a workspace, a "
                "report.json or a fit (.nc)."
            )
        source = shown_path(path) if path.name not in ("", "..") else path.resolve().name
        return _side_of_workspace(Workspace(path.absolute()), source)
    if not path.is_file():
        raise MissingError(
            f"{path} does not exist: name a workspace, a report.json or a fit (.nc)."
        )
    if path.suffix == ".nc":
        return _side_of_fit(path)
    remedy = "Run 'scissorcal report' again, or name a workspace or a fit (.nc)."
    with reading(path, REPORT, remedy):
        return Side(shown_path(path), read_twin(read_foreign(path, REPORT)))


def shown_path(path: Path) -> str:
    """The name of a side on a page that goes to others, without the folders above its workspace."""
    if not path.is_absolute():
        return str(path)
    try:
        root = find_workspace(path.parent if path.is_file() else path).root
    except MissingError:
        return path.name
    return str(path.relative_to(root.parent)) if path.is_relative_to(root) else path.name


def _side_of_workspace(workspace: Workspace, source: str) -> Side:
    engine = Engine.of(workspace)
    fits = [
        load_result(engine, what)
        for what in available(engine, ("friction", "friction-advance", "cut"))
    ]
    if not fits:
        raise MissingError(f"{source} has no current fit: run 'scissorcal fit' there first.")
    return Side(source, document_of(engine.recipe, fits))


def _side_of_fit(path: Path) -> Side:
    """A fit alone: what it is of, its workspace says if it lies in one."""
    fit = load_fit(path)
    try:
        recipe = find_workspace(path.parent).recipe()
    except MissingError:
        recipe = None
    return Side(shown_path(path), document_of_fit(fit, recipe))
