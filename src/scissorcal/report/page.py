"""The page: facts and figures through the templates into one HTML file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from importlib import resources
from typing import TYPE_CHECKING

from scissorcal.calibration.checks import PRIOR_ONLY
from scissorcal.calibration.result import FitResult
from scissorcal.recipe.schema import Recipe
from scissorcal.report import numbers
from scissorcal.report.document import FitMaterial, FitSection, ReportDocument
from scissorcal.report.inputs import Geometry
from scissorcal.report.panel import Panel
from scissorcal.report.pictures import PAGE_BYTES, PICTURE_BYTES, place_pictures
from scissorcal.report.sections.critic import show_proposals, show_replay
from scissorcal.report.sections.edge_force import show_edge_force
from scissorcal.report.sections.fracture_work import show_work
from scissorcal.report.sections.friction_curve import draw_friction
from scissorcal.report.sections.friction_map import show_friction_map
from scissorcal.report.sections.geometry import GeometryView, geometry_pictures, show_geometry
from scissorcal.report.sections.held_out import draw_held_out
from scissorcal.report.sections.pairs import show_pairs, show_prior
from scissorcal.report.sections.residuals import StrokeResidual, draw_residuals
from scissorcal.report.sections.response_curve import show_response
from scissorcal.report.sections.scene_figures import show_scene
from scissorcal.report.sections.torque import along
from scissorcal.report.sections.torque_figures import draw_stroke, draw_torque
from scissorcal.report.sections.trust_check import show_trust_check
from scissorcal.report.strokes import kind_word
from scissorcal.report.svg import CARD, Svg, drawing_style

if TYPE_CHECKING:
    from jinja2 import Environment
    from markupsafe import Markup

MOST_CARDS = 12
KEY_MARKS = {"closing": "●", "opening": "▲", "excitation": "■", "press": "◆"}


@dataclass(frozen=True)
class KeyEntry:
    """A kind of stroke, the mark that its samples have, and its name."""

    kind: str
    mark: str
    word: str


@dataclass(frozen=True)
class StrokeCard:
    """A stroke that has its own figure on the page."""

    row: StrokeResidual
    figure: Svg


@dataclass(frozen=True)
class FitView:
    """A fit's facts with its figures; ``cards`` are its worst strokes, worst first.

    ``physics``, ``posterior`` and ``doubts`` are panels on the law, its parameters, and what may
    be wrong with either.
    """

    section: FitSection
    torque: tuple[Svg, ...]
    residuals: tuple[Svg, ...]
    held_out: tuple[Svg, ...]
    cards: tuple[StrokeCard, ...]
    physics: tuple[Panel, ...]
    posterior: tuple[Panel, ...]
    doubts: tuple[Panel, ...]

    @property
    def key(self) -> tuple[KeyEntry, ...]:
        """What the figures' marks stand for."""
        kinds = sorted({row.name.kind for row in self.section.residuals})
        unit = self.section.position_unit
        return tuple(KeyEntry(kind, KEY_MARKS[kind], kind_word(kind, unit)) for kind in kinds)

    @property
    def carded(self) -> frozenset[str]:
        """Anchors of the strokes that have a card."""
        return frozenset(card.row.name.anchor for card in self.cards)


def draw_fit(material: FitMaterial) -> FitView:
    """Draw all figures of one fit."""
    fit, section, strokes = material.fit, material.section, material.strokes
    by_anchor = {stroke.name.anchor: stroke for stroke in strokes}
    with drawing_style():
        return FitView(
            section,
            draw_friction(fit, strokes, section.friction_curve, section.anchor)
            + draw_torque(fit, strokes, section.torque, section.anchor),
            draw_residuals(fit, strokes, section.residuals, section.anchor),
            draw_held_out(fit, section.held_out, section.anchor),
            tuple(
                StrokeCard(
                    row,
                    draw_stroke(
                        fit,
                        by_anchor[row.name.anchor],
                        CARD,
                        along(row.name),
                        f"{row.name.anchor}-f",
                    ),
                )
                for row in section.residuals[:MOST_CARDS]
            ),
            _physics(material),
            (
                show_pairs(fit, section.correlations, section.anchor),
                show_prior(fit, section.prior, section.anchor),
            ),
            (
                show_proposals(fit, section.proposals, section.anchor),
                show_replay(fit, section.replay, section.anchor),
                *show_trust_check(fit, section.trust_check, section.anchor),
            ),
        )


def _physics(material: FitMaterial) -> tuple[Panel, ...]:
    fit, section = material.fit, material.section
    anchor = section.anchor
    panels = [show_friction_map(fit, section.friction_map, material.strokes, anchor)]
    if section.response is not None:
        panels.append(show_response(fit, section.response, anchor))
    if section.fracture_work is not None:
        panels.append(show_work(section.fracture_work, anchor))
    if section.edge_force is not None:
        panels.append(show_edge_force(section.edge_force, anchor))
    return tuple(panel for panel in panels if panel is not None)


def draw_scene(document: ReportDocument, recipe: Recipe, fits: Sequence[FitResult]) -> Panel | None:
    """Draw the rendered torque over the scene; None for what slides, which renders none."""
    if recipe.rig.joint == "linear" or all(fit.position_unit == "m" for fit in fits):
        return None
    with drawing_style():
        return show_scene(document.scene_torque, recipe, fits)


def whole_page(
    document: ReportDocument, views: Sequence[FitView], scene: Panel | None, geometry: Geometry
) -> str:
    """Write the page with as many pictures as it can carry and stay below `PAGE_BYTES`."""
    section = document.geometry
    files = geometry_pictures(section, geometry)
    with drawing_style():
        without = show_geometry(section, {})
        if not any(files.values()):
            return page_text(document, views, scene, without)
        bare = page_text(document, views, scene, without)
        # the words around pictures take room too: some hundred bytes each
        words = 1000 * sum(len(own) for own in files.values())
        room = min(PAGE_BYTES - len(bare.encode()) - words, PICTURE_BYTES)
        return page_text(
            document, views, scene, show_geometry(section, place_pictures(files, room))
        )


def page_text(
    document: ReportDocument,
    views: Sequence[FitView],
    scene: Panel | None,
    geometry: Sequence[GeometryView] = (),
) -> str:
    """Write the page; every value from outside is escaped."""
    template = environment().get_template("report.html.j2")
    return template.render(
        document=document, views=views, scene=scene, geometry=geometry, style=style_sheet()
    )


def style_sheet() -> str:
    """The style that every page carries within it."""
    style = resources.files("scissorcal.report").joinpath("templates/style.css")
    return style.read_text(encoding="utf-8")


def prose(sentence: str) -> Markup:
    """Escape a sentence; what stands between backticks becomes code."""
    from markupsafe import Markup, escape

    parts = sentence.split("`")
    if len(parts) % 2 == 0:
        return escape(sentence)
    return Markup("").join(
        Markup("<code>{}</code>").format(part) if place % 2 else escape(part)
        for place, part in enumerate(parts)
    )


def environment() -> Environment:
    """The templates with their filters; everything is escaped unless it says otherwise."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    made = Environment(
        loader=PackageLoader("scissorcal.report", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    made.filters.update(
        significant=numbers.significant,
        display=numbers.display,
        short=numbers.short,
        percent=numbers.percent,
        unit=numbers.unit_text,
        with_unit=numbers.with_unit,
        with_decimals=numbers.with_decimals,
        prose=prose,
    )
    made.globals.update(
        decimals_for=numbers.decimals_for,
        prior_only=PRIOR_ONLY,
    )
    return made
