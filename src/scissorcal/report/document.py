"""The report as facts: what the page shows and the JSON twin holds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Literal

from scissorcal.calibration.result import FitResult
from scissorcal.recipe.schema import Recipe
from scissorcal.report.inputs import FactSheet, RecordingSummary
from scissorcal.report.sections.diagnostics import Diagnostic, list_diagnostics
from scissorcal.report.sections.friction_curve import FrictionCurve, trace_friction
from scissorcal.report.sections.headline import Headline, write_headline
from scissorcal.report.sections.held_out import HeldOutSection, gather_held_out
from scissorcal.report.sections.left_out import LeftOut, list_left_out
from scissorcal.report.sections.parameters import ParameterRow, tabulate_parameters
from scissorcal.report.sections.provenance import Provenance, trace
from scissorcal.report.sections.residuals import StrokeResidual, rank_residuals
from scissorcal.report.sections.rungs import RungRow, compare_rungs
from scissorcal.report.sections.sheets import SheetSection, take_sheet
from scissorcal.report.sections.torque import TorqueSection, compare_torque
from scissorcal.report.sections.verdicts import VerdictSection, gather_verdicts
from scissorcal.report.strokes import StrokeSamples, strokes_of

Format = Literal["scissorcal-report/1"]

FORMAT: Format = "scissorcal-report/1"


@dataclass(frozen=True)
class FitSection:
    """Everything said about one fit. ``anchor`` is its address on the page."""

    anchor: str
    what: str
    rung: str
    effort: str
    effort_unit: str
    position_unit: str
    headline: Headline
    friction_curve: FrictionCurve | None
    torque: TorqueSection
    residuals: tuple[StrokeResidual, ...]
    parameters: tuple[ParameterRow, ...]
    rungs: tuple[RungRow, ...]
    held_out: HeldOutSection
    diagnostics: tuple[Diagnostic, ...]
    notes: tuple[str, ...]


@dataclass(frozen=True)
class ReportDocument:
    """A whole report. ``created`` carries its time zone."""

    format: Format
    created: datetime
    scissorcal_version: str
    recipe_name: str
    recipe_description: str
    material: str
    verdicts: VerdictSection
    fits: tuple[FitSection, ...]
    sheets: tuple[SheetSection, ...]
    left_out: tuple[LeftOut, ...]
    provenance: Provenance


@dataclass(frozen=True)
class FitMaterial:
    """A fit with its section and strokes: what figures are drawn from."""

    fit: FitResult
    section: FitSection
    strokes: tuple[StrokeSamples, ...]


def compose(
    recipe: Recipe,
    fits: Sequence[FitResult],
    recordings: Sequence[RecordingSummary],
    sheets: Sequence[FactSheet],
    *,
    recipe_text: str,
    created: datetime,
    version: str,
) -> tuple[ReportDocument, tuple[FitMaterial, ...]]:
    """Gather every section's facts; draws nothing and touches no file."""
    materials = tuple(
        compose_fit(fit, anchor, recordings)
        for fit, anchor in zip(fits, _anchors(fits), strict=True)
    )
    verdicts = [v for fit in fits for v in fit.verdicts] + [v for s in sheets for v in s.verdicts]
    document = ReportDocument(
        FORMAT,
        created,
        version,
        recipe.name,
        recipe.description,
        recipe.material.name,
        gather_verdicts(verdicts),
        tuple(material.section for material in materials),
        tuple(take_sheet(sheet) for sheet in sheets),
        list_left_out(recipe, fits),
        trace(recipe, recipe_text, fits, recordings),
    )
    return document, materials


def compose_fit(fit: FitResult, anchor: str, recordings: Sequence[RecordingSummary]) -> FitMaterial:
    """Gather one fit's facts."""
    strokes = strokes_of(fit, anchor, recordings)
    held_out = gather_held_out(fit, [stroke.name for stroke in strokes])
    parameters = tabulate_parameters(fit)
    section = FitSection(
        anchor,
        fit.what,
        fit.rung,
        fit.effort,
        fit.effort_unit,
        fit.position_unit,
        write_headline(fit, held_out, parameters),
        trace_friction(fit),
        compare_torque(fit, strokes),
        rank_residuals(fit, strokes),
        parameters,
        compare_rungs(fit),
        held_out,
        list_diagnostics(fit),
        fit.notes,
    )
    return FitMaterial(fit, section, strokes)


def _anchors(fits: Sequence[FitResult]) -> list[str]:
    """The fit's subject, numbered from the second of its kind."""
    anchors: list[str] = []
    for fit in fits:
        earlier = sum(anchor.split("-")[0] == fit.what for anchor in anchors)
        anchors.append(f"{fit.what}-{earlier + 1}" if earlier else fit.what)
    return anchors
