"""The report as facts: what the page shows and the JSON twin holds."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from typing import Literal

from scissorcal.calibration.result import FitResult
from scissorcal.calibration.verify.result import VerifyResult
from scissorcal.recipe.schema import Recipe
from scissorcal.recording.recording import Recording
from scissorcal.report.inputs import FactSheet, Geometry, RecordingSummary
from scissorcal.report.sections.critic import (
    ProposalRow,
    ReplaySection,
    take_proposals,
    take_replay,
)
from scissorcal.report.sections.diagnostics import Diagnostic, list_diagnostics
from scissorcal.report.sections.edge_force import EdgeForce, force_along_edge
from scissorcal.report.sections.fracture_work import FractureWork, fracture_work
from scissorcal.report.sections.friction_curve import FrictionCurve, trace_friction
from scissorcal.report.sections.friction_map import FrictionMap, map_friction
from scissorcal.report.sections.geometry import GeometrySection, geometry_verdicts, take_geometry
from scissorcal.report.sections.headline import Headline, write_headline
from scissorcal.report.sections.held_out import HeldOutSection, gather_held_out
from scissorcal.report.sections.law import named
from scissorcal.report.sections.left_out import LeftOut, list_left_out
from scissorcal.report.sections.pairs import Correlation, PriorRow, compare_prior, correlate
from scissorcal.report.sections.parameters import ParameterRow, tabulate_parameters
from scissorcal.report.sections.provenance import Provenance, trace
from scissorcal.report.sections.residuals import StrokeResidual, rank_residuals
from scissorcal.report.sections.response_curve import ResponseCurve, trace_response
from scissorcal.report.sections.rungs import RungRow, compare_rungs
from scissorcal.report.sections.scene_torque import SceneTorque, scene_torque
from scissorcal.report.sections.sheets import SheetSection, take_sheet
from scissorcal.report.sections.torque import TorqueSection, compare_torque
from scissorcal.report.sections.verdicts import VerdictSection, gather_verdicts
from scissorcal.report.strokes import StrokeSamples, strokes_of

Format = Literal["scissorcal-report/1"]

FORMAT: Format = "scissorcal-report/1"


@dataclass(frozen=True)
class SceneFacts:
    """What the recipe is about, in what two reports must agree to be compared."""

    joint: str
    cut: bool
    moving: str
    thickness_mm: float
    closure: str
    render_friction: bool


@dataclass(frozen=True)
class FitSection:
    """Everything said about one fit. ``anchor`` is its address on the page.

    What belongs to friction alone is None for a cut, and the other way round.
    """

    anchor: str
    what: str
    rung: str
    effort: str
    inputs_hash: str
    effort_unit: str
    position_unit: str
    headline: Headline
    friction_curve: FrictionCurve | None
    friction_map: FrictionMap | None
    torque: TorqueSection
    residuals: tuple[StrokeResidual, ...]
    response: ResponseCurve | None
    fracture_work: FractureWork | None
    edge_force: EdgeForce | None
    parameters: tuple[ParameterRow, ...]
    correlations: tuple[Correlation, ...]
    prior: tuple[PriorRow, ...]
    selection: str
    rungs: tuple[RungRow, ...]
    proposals: tuple[ProposalRow, ...]
    replay: ReplaySection | None
    trust_check: VerifyResult | None
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
    scene: SceneFacts
    verdicts: VerdictSection
    geometry: GeometrySection
    scene_torque: SceneTorque
    fits: tuple[FitSection, ...]
    sheets: tuple[SheetSection, ...]
    left_out: tuple[LeftOut, ...]
    provenance: Provenance
    inputs_hash: str = ""


@dataclass(frozen=True)
class FitMaterial:
    """A fit with its section and strokes: what figures are drawn from."""

    fit: FitResult
    section: FitSection
    strokes: tuple[StrokeSamples, ...]


@dataclass(frozen=True)
class Evidence:
    """What fits are reported from besides themselves, all of it optional.

    ``recordings`` name strokes, ``raw`` has those whose samples are at hand, ``checks`` the trust
    checks by fit ("friction", "cut"), ``geometry`` what photographs gave.
    """

    recordings: tuple[RecordingSummary, ...] = ()
    raw: tuple[Recording, ...] = ()
    checks: Mapping[str, VerifyResult] = field(default_factory=dict)
    geometry: Geometry = field(default_factory=Geometry)


def compose(
    recipe: Recipe,
    fits: Sequence[FitResult],
    evidence: Evidence,
    sheets: Sequence[FactSheet],
    *,
    recipe_text: str,
    created: datetime,
    version: str,
) -> tuple[ReportDocument, tuple[FitMaterial, ...]]:
    """Gather every section's facts; draws nothing and touches no file."""
    friction = named(fits, "friction")
    materials = tuple(
        compose_fit(fit, anchor, evidence, friction)
        for fit, anchor in zip(fits, _anchors(fits), strict=True)
    )
    geometry = take_geometry(recipe, evidence.geometry)
    verdicts = list(geometry_verdicts(geometry, evidence.geometry))
    verdicts += [v for fit in fits for v in fit.verdicts]
    verdicts += [
        v for m in materials if m.section.trust_check for v in m.section.trust_check.verdicts
    ]
    verdicts += [v for s in sheets for v in s.verdicts]
    document = ReportDocument(
        FORMAT,
        created,
        version,
        recipe.name,
        recipe.description,
        recipe.material.name,
        scene_facts(recipe),
        gather_verdicts(verdicts),
        geometry,
        scene_torque(recipe, fits),
        tuple(material.section for material in materials),
        tuple(take_sheet(sheet) for sheet in sheets),
        list_left_out(recipe, fits, tuple((item.fit, item.why) for item in geometry.missing)),
        trace(recipe, recipe_text, fits, evidence.recordings, evidence.geometry),
    )
    return document, materials


def scene_facts(recipe: Recipe) -> SceneFacts:
    """What of a recipe two reports must agree in."""
    return SceneFacts(
        recipe.rig.joint,
        recipe.scene.cut,
        recipe.rig.moving,
        recipe.material.thickness_mm,
        recipe.scene.closure,
        recipe.scene.render_friction,
    )


def compose_fit(
    fit: FitResult,
    anchor: str,
    evidence: Evidence | None = None,
    friction: FitResult | None = None,
) -> FitMaterial:
    """Gather one fit's facts; ``friction`` is the fit that a cut's torque was freed with."""
    evidence = evidence or Evidence()
    strokes = strokes_of(fit, anchor, evidence.recordings)
    held_out = gather_held_out(fit, [stroke.name for stroke in strokes])
    parameters = tabulate_parameters(fit)
    cut = fit.what == "cut"
    check = evidence.checks.get(fit.what)
    trust = check if check is not None and check.fit_hash == fit.inputs_hash else None
    section = FitSection(
        anchor=anchor,
        what=fit.what,
        rung=fit.rung,
        effort=fit.effort,
        inputs_hash=fit.inputs_hash,
        effort_unit=fit.effort_unit,
        position_unit=fit.position_unit,
        headline=write_headline(fit, held_out, parameters, trust.verdicts if trust else ()),
        friction_curve=trace_friction(fit),
        friction_map=map_friction(fit),
        torque=compare_torque(fit, strokes),
        residuals=rank_residuals(fit, strokes),
        response=trace_response(fit) if cut else None,
        fracture_work=fracture_work(fit, friction, evidence.raw, strokes) if cut else None,
        edge_force=force_along_edge(fit, strokes) if cut else None,
        parameters=parameters,
        correlations=correlate(fit),
        prior=compare_prior(fit),
        selection=fit.selection,
        rungs=compare_rungs(fit),
        proposals=take_proposals(fit),
        replay=take_replay(fit, strokes),
        trust_check=trust,
        held_out=held_out,
        diagnostics=list_diagnostics(fit),
        notes=fit.notes,
    )
    return FitMaterial(fit, section, strokes)


def _anchors(fits: Sequence[FitResult]) -> list[str]:
    """The fit's subject, numbered from the second of its kind."""
    anchors: list[str] = []
    for fit in fits:
        earlier = sum(anchor.split("-")[0] == fit.what for anchor in anchors)
        anchors.append(f"{fit.what}-{earlier + 1}" if earlier else fit.what)
    return anchors
