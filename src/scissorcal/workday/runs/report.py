"""Write a workspace's report, and tell which fits a report shows."""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scissorcal.errors import InputError
from scissorcal.recipe.load import read_text
from scissorcal.recipe.requirements import requirements
from scissorcal.recipe.schema import Recipe
from scissorcal.verdicts import Verdict
from scissorcal.workday.geometry import expected_package_hash
from scissorcal.workday.recordings import usable_recordings
from scissorcal.workday.reported_geometry import report_geometry
from scissorcal.workday.runs.fit import FIT_ORDER, current_fits
from scissorcal.workday.workspace import FitKind, Workspace

if TYPE_CHECKING:
    from scissorcal.calibration import FitResult
    from scissorcal.calibration.verify.result import VerifyResult
    from scissorcal.report import FactSheet, Geometry


@dataclass(frozen=True)
class Reported:
    """The report's two files, and every verdict that it shows."""

    html: Path
    json: Path
    verdicts: tuple[Verdict, ...]


def write_workspace_report(workspace: Workspace, *, now: datetime | None = None) -> Reported:
    """Write report/report.html and report/report.json from the workspace's fits and package.

    A fit that is not there yet is named as such in the report; one of photographs alone is enough
    for a report. Where nothing that the report says
    has changed, it keeps its time, and with it a signature. Raises MissingError where there is no
    fit at all, or one has fallen behind.
    """
    from scissorcal.report import build_report

    told = _gather(workspace)
    recordings = [
        recording
        for kind in told.fits
        for recording in usable_recordings(workspace, told.recipe, kind).recordings
    ]
    build_report(
        told.recipe,
        list(told.fits.values()),
        recordings,
        workspace.report_html.parent,
        created=now or datetime.now(UTC),
        recipe_text=read_text(workspace.recipe_path),
        sheets=told.sheets,
        checks=told.checks,
        geometry=told.geometry,
    )
    return Reported(workspace.report_html, workspace.report_json, told.verdicts)


def read_workspace_report(workspace: Workspace) -> Reported:
    """The report that lies there, left as it is, with the verdicts on what the workspace holds."""
    return Reported(workspace.report_html, workspace.report_json, _gather(workspace).verdicts)


def reportable_fits(workspace: Workspace, recipe: Recipe) -> "dict[FitKind, FitResult]":
    """Load the fits that a report shows; none where only photographs were fitted so far.

    Raises MissingError where there is nothing to report at all, or a fit has fallen behind.
    """
    fitted = any(workspace.fit_path(what).is_file() for what in FIT_ORDER)
    if not fitted and report_geometry(workspace, recipe).fits:
        return {}
    return current_fits(workspace, recipe, partial=True)


def why_stale(workspace: Workspace, recipe: Recipe, fits: "Mapping[FitKind, FitResult]") -> str:
    """Say what in the workspace is no longer as the report there shows it; empty if nothing is."""
    from scissorcal.recipe.load import parse_recipe
    from scissorcal.report import posterior_sha256

    facts = _facts(workspace)
    provenance = facts.get("provenance", {}) if isinstance(facts, dict) else {}
    shown = {
        row.get("fit"): (row.get("inputs_hash"), row.get("posterior_sha256"))
        for row in provenance.get("fits", [])
    }
    if set(shown) != set(fits) or any(
        shown[what] != (fit.inputs_hash, posterior_sha256(fit)) for what, fit in fits.items()
    ):
        return "it shows other fits than there are now"
    geometry = report_geometry(workspace, recipe)
    seen = {
        row.get("fit"): (row.get("inputs_hash"), row.get("file_sha256"))
        for row in provenance.get("geometry", [])
    }
    there = {what: (fit.inputs_hash, geometry.sha256[what]) for what, fit in geometry.fits.items()}
    if seen != there:
        return "it shows other fits of photographs than there are now"
    try:
        reported = parse_recipe(str(provenance.get("recipe_text", "")), "the reported recipe")
    except InputError:
        return "it shows another recipe than there is now"
    if reported != recipe:
        return "it shows another recipe than there is now"
    checked = {section["what"]: section.get("trust_check") for section in facts.get("fits", [])}
    try:
        checks = _trust_checks(workspace, fits)
    except InputError:
        return "a trust check beside its fits cannot be read"
    for what in fits:
        if checked.get(what) != _as_reported(checks.get(what)):
            return f"it shows another trust check of {what} than there is now"
    return ""


def reported_fits(workspace: Workspace) -> set[str]:
    """Return the inputs hashes of the fits that the report there shows; none if it is damaged."""
    return set(_values(_facts(workspace), "inputs_hash"))


@dataclass(frozen=True)
class _Told:
    """What a workspace has to report."""

    recipe: Recipe
    fits: "dict[FitKind, FitResult]"
    sheets: "list[FactSheet]"
    checks: "dict[str, VerifyResult]"
    geometry: "Geometry"

    @property
    def verdicts(self) -> tuple[Verdict, ...]:
        found = [verdict for fit in self.geometry.fits.values() for verdict in fit.verdicts]
        found += [verdict for fit in self.fits.values() for verdict in fit.verdicts]
        found += [verdict for check in self.checks.values() for verdict in check.verdicts]
        return (*found, *(verdict for sheet in self.sheets for verdict in sheet.verdicts))


def _gather(workspace: Workspace) -> _Told:
    recipe = workspace.recipe()
    fits = reportable_fits(workspace, recipe)
    sheets = _package_sheets(workspace, recipe, fits)
    checks = _trust_checks(workspace, fits)
    return _Told(recipe, fits, sheets, checks, report_geometry(workspace, recipe))


def _package_sheets(
    workspace: Workspace, recipe: Recipe, fits: "dict[FitKind, FitResult]"
) -> "list[FactSheet]":
    """What the workspace's package promises, where there is one that can be opened."""
    from scissorcal.package import REVIEW_CHECK, check_package, open_package
    from scissorcal.report import sheet_from_mapping

    path = workspace.package_path(recipe)
    if not requirements(recipe).tables or not path.is_file():
        return []
    try:
        manifest = open_package(path, warn=False).manifest
    except InputError as error:
        return [sheet_from_mapping("Package", "package", {}, notes=[str(error)])]
    facts = {
        "file": workspace.relative(path),
        "content hash": manifest.content_hash,
        "error bound": manifest.bound.model_dump(),
        "ranges": {key: list(value) for key, value in manifest.ranges.model_dump().items()},
    }
    notes = []
    expected = expected_package_hash(workspace, recipe, fits)
    if manifest.provenance.inputs_hash != expected:
        notes.append(
            "It was built from other fits or another recipe than this report shows: run "
            "`scissorcal package build`."
        )
    verdicts = [verdict for verdict in check_package(path) if verdict.check != REVIEW_CHECK]
    return [sheet_from_mapping("Package", "package", facts, verdicts=verdicts, notes=notes)]


def _trust_checks(
    workspace: Workspace, fits: "Mapping[FitKind, FitResult]"
) -> "dict[str, VerifyResult]":
    """The trust checks there that are of these very fits."""
    from scissorcal.calibration.verify.store import load_verify

    found = {
        what: load_verify(workspace.verify_path(what))
        for what in fits
        if workspace.verify_path(what).is_file()
    }
    return {
        what: check for what, check in found.items() if check.fit_hash == fits[what].inputs_hash
    }


def _as_reported(check: "VerifyResult | None") -> Any:
    """A trust check as the report's twin holds it."""
    from pydantic import TypeAdapter

    from scissorcal.calibration.verify.result import VerifyResult

    return None if check is None else TypeAdapter(VerifyResult).dump_python(check, mode="json")


def _facts(workspace: Workspace) -> Any:
    try:
        return json.loads(workspace.report_json.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}


def _values(facts: Any, key: str) -> list[str]:
    if isinstance(facts, dict):
        here = [facts[key]] if isinstance(facts.get(key), str) else []
        return here + [found for inner in facts.values() for found in _values(inner, key)]
    if isinstance(facts, list):
        return [found for inner in facts for found in _values(inner, key)]
    return []
