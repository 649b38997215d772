"""Write a workspace's report, and tell which fits a report shows."""

import json
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scissorcal.errors import InputError
from scissorcal.recipe.load import read_text
from scissorcal.recipe.requirements import requirements
from scissorcal.recipe.schema import Recipe
from scissorcal.verdicts import Verdict
from scissorcal.workday.fits import current_fits
from scissorcal.workday.recordings import usable_recordings
from scissorcal.workday.workspace import FitKind, Workspace

if TYPE_CHECKING:
    from scissorcal.calibration import FitResult
    from scissorcal.report import FactSheet


@dataclass(frozen=True)
class Reported:
    """The report's two files, and every verdict that it shows."""

    html: Path
    json: Path
    verdicts: tuple[Verdict, ...]


def write_workspace_report(workspace: Workspace, *, now: datetime | None = None) -> Reported:
    """Write report/report.html and report/report.json from the workspace's fits and package.

    A fit that is not there yet is named as such in the report. Raises MissingError where there is
    none at all, or one has fallen behind.
    """
    from scissorcal.report import build_report

    recipe = workspace.recipe()
    fits = current_fits(workspace, recipe, partial=True)
    kinds: list[FitKind] = list(fits)
    recordings = [
        recording
        for kind in kinds
        for recording in usable_recordings(workspace, recipe, kind).recordings
    ]
    sheets = _package_sheets(workspace, recipe, fits)
    files = build_report(
        recipe,
        list(fits.values()),
        recordings,
        workspace.report_html.parent,
        created=now or datetime.now(UTC),
        recipe_text=read_text(workspace.recipe_path),
        sheets=sheets,
    )
    verdicts = [verdict for fit in fits.values() for verdict in fit.verdicts]
    verdicts += [verdict for sheet in sheets for verdict in sheet.verdicts]
    return Reported(files.html, files.json, tuple(verdicts))


def reported_fits(workspace: Workspace) -> set[str]:
    """Return the inputs hashes of the fits that the report there shows; none if it is damaged."""
    try:
        facts = json.loads(workspace.report_json.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return set()
    return set(_values(facts, "inputs_hash"))


def _package_sheets(
    workspace: Workspace, recipe: Recipe, fits: "dict[FitKind, FitResult]"
) -> "list[FactSheet]":
    """What the workspace's package promises, where there is one that can be opened."""
    from scissorcal.package import check_package, open_package, package_inputs_hash
    from scissorcal.report import sheet_from_mapping

    path = workspace.package_path(recipe)
    if not requirements(recipe).tables or not path.is_file():
        return []
    try:
        manifest = open_package(path).manifest
    except InputError as error:
        return [sheet_from_mapping("Package", "package", {}, notes=[str(error)])]
    facts = {
        "file": workspace.relative(path),
        "content hash": manifest.content_hash,
        "error bound": manifest.bound.model_dump(),
        "ranges": {key: list(value) for key, value in manifest.ranges.model_dump().items()},
    }
    notes = []
    expected = package_inputs_hash(recipe, fits.get("friction"), fits.get("cut"))
    if manifest.provenance.inputs_hash != expected:
        notes.append(
            "It was built from other fits or another recipe than this report shows: run "
            "`scissorcal package build`."
        )
    verdicts = check_package(path)
    return [sheet_from_mapping("Package", "package", facts, verdicts=verdicts, notes=notes)]


def _values(facts: Any, key: str) -> list[str]:
    if isinstance(facts, dict):
        here = [facts[key]] if isinstance(facts.get(key), str) else []
        return here + [found for inner in facts.values() for found in _values(inner, key)]
    if isinstance(facts, list):
        return [found for inner in facts for found in _values(inner, key)]
    return []
