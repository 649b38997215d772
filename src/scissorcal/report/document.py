"""A whole report as panels: what the page, the terminal and the JSON twin are made of."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Literal

from scissorcal.calibration.result import FitResult
from scissorcal.errors import MissingError
from scissorcal.identity import VERSION
from scissorcal.package.scene_torque import SceneTorque, scene_torque
from scissorcal.recipe.requirements import GeometryKind, requirements
from scissorcal.recipe.schema import Recipe
from scissorcal.report.inputs import Evidence, Geometry
from scissorcal.report.panel import Panel, absent, clean
from scissorcal.report.strokes import FittedStroke, strokes_of
from scissorcal.report.subjects import (
    candidates,
    closing,
    cut,
    decision,
    overview,
    posterior,
    torque,
)
from scissorcal.report.subjects.blade import blade_panels
from scissorcal.report.subjects.camera import camera_panels
from scissorcal.report.subjects.closing import Provenance, rig_panels
from scissorcal.report.subjects.friction import friction_panel
from scissorcal.report.subjects.plate_pose import plate_panels
from scissorcal.report.subjects.scene import scene_panels
from scissorcal.report.subjects.stated import layers_panel, simplest_panel, stated_edge_panel
from scissorcal.report.subjects.trust import (
    Headline,
    geometry_headline,
    trust_panels,
    write_headline,
)
from scissorcal.verdicts import Verdict

Format = Literal["scissorcal-report/2"]

FORMAT: Format = "scissorcal-report/2"

KINDS: tuple[GeometryKind, ...] = ("camera", "blade", "plate")
PHOTOGRAPHS: dict[GeometryKind, str] = {
    "camera": "board-*.jpg",
    "blade": "blade-*.jpg",
    "plate": "plate-*.jpg",
}
ORDER = ("fail", "not_evaluated", "pass")


@dataclass(frozen=True)
class SceneFacts:
    """What the recipe is about, in what two reports must agree to be compared."""

    joint: str
    cut: bool
    moving: str
    thickness_mm: float
    closure: str
    render_friction: bool
    tolerance_percent: float


@dataclass(frozen=True)
class Part:
    """A part of the report below the decision page; its panels name it by ``id``."""

    id: str
    title: str
    sentence: str = ""


@dataclass(frozen=True)
class ReportDocument:
    """A whole report. ``created`` carries its time zone; ``scene`` is None for a fit alone."""

    format: Format
    created: datetime
    scissorcal_version: str
    recipe_name: str
    recipe_description: str
    material: str
    origin: decision.Origin
    scene: SceneFacts | None
    parts: tuple[Part, ...]
    panels: tuple[Panel, ...]
    provenance: Provenance
    inputs_hash: str = ""

    def panel(self, id_: str) -> Panel | None:
        """The panel of this address; None where there is none."""
        return next((panel for panel in self.panels if panel.id == id_), None)

    def panels_of(self, part: str) -> tuple[Panel, ...]:
        """The panels of one part, in order."""
        return tuple(panel for panel in self.panels if panel.part == part)


def compose(
    recipe: Recipe,
    fits: Sequence[FitResult],
    evidence: Evidence,
    created: datetime,
) -> ReportDocument:
    """Gather all panels; draws nothing and touches no file."""
    named: dict[str, FitResult] = {}
    for fit in fits:
        named.setdefault(fit.what, fit)
    geometry, missing = _required(recipe, evidence.geometry)
    checks = {w: evidence.checks[w] for w, fit in named.items() if _is_of(evidence, fit)}
    keyed = dict(zip(_anchors(fits), fits, strict=True))
    strokes = {part: strokes_of(fit, part, evidence.recordings) for part, fit in keyed.items()}
    headlines = [geometry_headline(kind, fit.verdicts) for kind, fit in geometry.fits.items()]
    headlines += [
        Headline(kind, "care", f"The {kind} fit is not there yet.", "not there yet", (why,))
        for kind, why in missing.items()
    ]
    fit_parts: list[Panel] = []
    for part, fit in keyed.items():
        check = checks.get(fit.what) if named[fit.what] is fit else None
        headlines.append(write_headline(fit, check.verdicts if check else ()))
        fit_parts.append(_outcome(headlines[-1], part))
        fit_parts += fit_panels(fit, strokes[part], part, evidence, named.get("friction"))
        fit_parts += trust_panels(fit, check, part)
    rendered, why = _scene(recipe, named)
    opens = (fit.position_unit == "m" for fit in fits if fit.what != "friction-advance")
    sliding = recipe.rig.joint == "linear" or any(opens)
    if sliding:
        rendered, why = None, "A sliding joint carries no blades, so nothing is felt."
    scene = [] if sliding or not fits else scene_panels(rendered, why, recipe, named.get("cut"))
    if evidence.choice is not None:
        scene = [*scene, simplest_panel(evidence.choice, list(named.values()))]
    if recipe.rig.edge.points_mm is not None and not sliding:
        scene = [*scene, stated_edge_panel(recipe)]
    if evidence.pieces:
        scene = [*scene, layers_panel(recipe, evidence.pieces)]
    provenance = closing.trace(recipe, keyed, replace(evidence, geometry=geometry, checks=checks))
    photographed = _geometry_panels(geometry, evidence.geometry, missing)
    cells = decision.cells_of(
        [(fit, strokes[part]) for part, fit in keyed.items()], replace(evidence, geometry=geometry)
    )
    totals, every_cell = decision.data_panels(cells)
    verdicts = [v for kind in geometry.fits.values() for v in kind.verdicts]
    verdicts += [v for fit in fits for v in fit.verdicts]
    verdicts += [v for check in checks.values() for v in check.verdicts]
    verdicts += [v for panel in evidence.panels for v in panel.verdicts]
    origin = decision.origin_of(evidence.recordings)
    panels = (
        decision.origin_panel(origin, evidence.recordings),
        decision.trust_panel(headlines, list(named), evidence.next_command),
        overview.overview_panel(
            keyed, strokes, photographed, f"{decision.PART}-picture", decision.PART
        ),
        totals,
        decision.checked_panel(list(named.values()), checks),
        decision.felt_panel(rendered, why, fits, recipe),
        decision.weaknesses_panel(fits, rendered, verdicts, cells),
        _verdict_panel(verdicts),
        every_cell,
        *scene,
        *photographed,
        *fit_parts,
        *evidence.panels,
        closing.left_out_panel(recipe, fits, dict(missing.items())),
        closing.provenance_panel(provenance, evidence.recordings),
        *rig_panels(evidence.recordings),
    )
    return ReportDocument(
        FORMAT, created, VERSION, recipe.name, recipe.description, recipe.material.name, origin,
        _scene_facts(recipe), _parts(panels, headlines, keyed), panels, provenance,
        evidence.inputs_hash,
    )  # fmt: skip


def compose_fit(fit: FitResult, recipe: Recipe | None, created: datetime) -> ReportDocument:
    """A fit alone; ``recipe`` says what it is of, if that is known."""
    part = fit.what
    panels = (
        _verdict_panel(fit.verdicts),
        *fit_panels(fit, strokes_of(fit, part, ()), part, Evidence(), None),
    )
    return ReportDocument(
        FORMAT,
        created,
        VERSION,
        recipe.name if recipe else "",
        recipe.description if recipe else "",
        recipe.material.name if recipe else "",
        "unknown",
        _scene_facts(recipe) if recipe else None,
        (),
        panels,
        closing.trace(recipe, {part: fit}, Evidence()),
    )


def fit_panels(
    fit: FitResult,
    strokes: tuple[FittedStroke, ...],
    part: str,
    evidence: Evidence,
    friction: FitResult | None,
) -> tuple[Panel, ...]:
    """All panels on one fit; ``friction`` is what a cut's torque was freed from."""
    physics: list[Panel | None] = [friction_panel(fit, strokes, part)]
    if fit.what == "cut":
        physics += [
            cut.response_panel(fit, part),
            cut.work_panel(fit, friction, evidence.recordings, strokes, part),
            cut.edge_panel(fit, strokes, part),
        ]
    return (
        torque.torque_panel(fit, strokes, part),
        *(panel for panel in physics if panel is not None),
        posterior.parameters_panel(fit, part),
        torque.strokes_panel(fit, strokes, part),
        torque.held_out_panel(fit, strokes, part),
        candidates.candidates_panel(fit, part),
        posterior.prior_panel(fit, part),
        posterior.correlations_panel(fit, part),
        candidates.critic_panel(fit, part),
        candidates.replay_panel(fit, strokes, part),
        posterior.diagnostics_panel(fit, part),
    )


def _verdict_panel(verdicts: Sequence[Verdict]) -> Panel:
    """Every verdict, failures first; within an outcome they keep their order."""
    ordered = sorted(map(clean, verdicts), key=lambda verdict: ORDER.index(verdict.status))
    counts = {status: sum(v.status == status for v in ordered) for status in ORDER}
    sentence = (
        f"{counts['fail']} failed, {counts['not_evaluated']} not evaluated, "
        f"{counts['pass']} passed."
        if ordered
        else "No check was made."
    )
    return Panel("verdicts-all", "verdicts", "Every check", sentence, verdicts=tuple(ordered))


def _scene_facts(recipe: Recipe) -> SceneFacts:
    """What of a recipe two reports must agree in."""
    return SceneFacts(
        recipe.rig.joint,
        recipe.scene.cut,
        recipe.rig.moving,
        recipe.material.thickness_mm,
        recipe.scene.closure,
        recipe.scene.render_friction,
        recipe.scene.tolerance_percent,
    )


def _is_of(evidence: Evidence, fit: FitResult) -> bool:
    check = evidence.checks.get(fit.what)
    return check is not None and check.fit_hash == fit.inputs_hash


def _anchors(fits: Sequence[FitResult]) -> list[str]:
    """The fit's subject, numbered from the second of its kind."""
    names = [fit.what for fit in fits]
    earlier = [names[:place].count(name) for place, name in enumerate(names)]
    return [f"{name}-{n + 1}" if n else name for name, n in zip(names, earlier, strict=True)]


def _required(recipe: Recipe, geometry: Geometry) -> tuple[Geometry, dict[GeometryKind, str]]:
    """The fits of photographs that the scene requires, and how to have those that are missing."""
    needs = requirements(recipe)
    wanted = [kind for kind in KINDS if needs.needs_geometry(kind)]
    missing = {
        kind: geometry.missing.get(kind)
        or f"The scene requires it: run `scissorcal capture {kind} --image {PHOTOGRAPHS[kind]}`, "
        f"then `scissorcal fit {kind}`."
        for kind in wanted
        if kind not in geometry.fits
    }
    kept = Geometry(
        camera=geometry.camera if "camera" in wanted else None,
        blade=geometry.blade if "blade" in wanted else None,
        plate=geometry.plate if "plate" in wanted else None,
        pictures={k: files for k, files in geometry.pictures.items() if k in wanted},
        sha256=geometry.sha256,
    )
    return kept, missing


def _geometry_panels(
    shown: Geometry, given: Geometry, missing: Mapping[GeometryKind, str]
) -> list[Panel]:
    panels: list[Panel] = []
    pictures = {kind: given.pictures.get(kind, ()) for kind in KINDS}
    if shown.camera is not None:
        panels += camera_panels(shown.camera, pictures["camera"])
    if shown.blade is not None:
        panels += blade_panels(shown.blade, pictures["blade"])
    if shown.plate is not None:
        panels += plate_panels(shown.plate, pictures["plate"])
    panels += [absent(f"{k}-missing", k, "Not there yet", why) for k, why in missing.items()]
    return sorted(panels, key=lambda panel: KINDS.index(panel.part))


def _scene(recipe: Recipe, fits: Mapping[str, FitResult]) -> tuple[SceneTorque | None, str]:
    try:
        return scene_torque(recipe, fits.get("cut"), fits.get("friction")), ""
    except MissingError as error:
        return None, str(error)


def _outcome(headline: Headline, part: str) -> Panel:
    steps = tuple(f"Next: {step}" for step in headline.next_steps)
    return Panel(f"{part}-outcome", part, "Outcome", headline.sentence, notes=steps)


def _parts(
    panels: Sequence[Panel], headlines: Sequence[Headline], fits: Mapping[str, FitResult]
) -> tuple[Part, ...]:
    """The parts below the decision page in the order of their panels, each with a sentence."""
    said = {headline.fit: headline.sentence for headline in headlines}
    titles = {
        "verdicts": "Verdicts",
        "data": "Data",
        "scene": "Rendered torque",
        "left-out": "Left out",
        "provenance": "Provenance",
    }
    titles.update({kind: kind.capitalize() for kind in KINDS})
    for part, fit in fits.items():
        again = f" {part.rpartition('-')[2]}" if part != fit.what else ""
        titles[part] = f"{fit.what.capitalize()} fit{again}: {fit.candidate}, {fit.effort} effort"
    parts = []
    for part in dict.fromkeys(p.part for p in panels if p.part != decision.PART):
        first = next(panel for panel in panels if panel.part == part)
        sentence = said.get(part) or first.sentence
        parts.append(Part(part, titles.get(part, first.title), sentence))
    return tuple(parts)
