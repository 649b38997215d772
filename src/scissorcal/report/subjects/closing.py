"""What closes a report: package and other sheets, what was left out, provenance."""

from __future__ import annotations

import json
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass

import numpy as np

from scissorcal.calibration.result import FitResult
from scissorcal.calibration.verify.result import VerifyResult
from scissorcal.identity import bytes_digest
from scissorcal.recipe.requirements import requirements
from scissorcal.recipe.schema import Recipe
from scissorcal.recording.probe import PROBE_KEY
from scissorcal.report.inputs import FactSheet, Geometry, RecordingSummary
from scissorcal.report.numbers import display, scalar
from scissorcal.report.panel import Panel, Row, Value, count, number, words
from scissorcal.report.strokes import split_source, summary_of
from scissorcal.report.subjects.candidates import passed_over

PHOTOGRAPHED = ("blade photographs", "plate pose")
"""What photographs would give, as requirements name it where a scene does without."""


@dataclass(frozen=True)
class Source:
    """One recording with its hash, and the fits that used it."""

    source: str
    content_hash: str
    used_by: tuple[str, ...]


@dataclass(frozen=True)
class FitOrigin:
    """A fit's identity: equal ``inputs_hash`` needs no second fit.

    ``part`` is its part of the report. ``posterior_sha256`` (:func:`posterior_sha256`) differs
    between fits of the same inputs.
    """

    fit: str
    part: str
    law: str
    effort: str
    effort_unit: str
    position_unit: str
    inputs_hash: str
    posterior_sha256: str
    sources: tuple[str, ...]


@dataclass(frozen=True)
class GeometryOrigin:
    """A fit of photographs: the hash of its inputs, the SHA-256 of its file, its photographs."""

    fit: str
    inputs_hash: str
    file_sha256: str
    sources: tuple[str, ...]


@dataclass(frozen=True)
class TrustCheckOrigin:
    """A trust check that the report shows: of which fit, and the SHA-256 of its content."""

    fit: str
    fit_hash: str
    sha256: str


@dataclass(frozen=True)
class Provenance:
    """All that the report rests on, and the recipe as text."""

    sources: tuple[Source, ...]
    fits: tuple[FitOrigin, ...]
    geometry: tuple[GeometryOrigin, ...]
    trust_checks: tuple[TrustCheckOrigin, ...]
    recipe_text: str
    recipe_text_origin: str


def trace(
    recipe: Recipe | None,
    recipe_text: str,
    fits: Mapping[str, FitResult],
    recordings: Sequence[RecordingSummary] = (),
    geometry: Geometry | None = None,
    checks: Mapping[str, VerifyResult] | None = None,
) -> Provenance:
    """Tie recordings to fits (by part), and name sources whose recording was not handed in."""
    every = list(fits.values())
    sources = [
        Source(
            one.source or "recording without a file",
            one.content_hash,
            tuple(
                f.what for f in every if any(summary_of(s, recordings) is one for s in f.sources)
            ),
        )
        for one in recordings
    ]
    for source in dict.fromkeys(source for fit in every for source in fit.sources):
        if summary_of(source, recordings) is None:
            users = tuple(fit.what for fit in every if source in fit.sources)
            sources.append(Source(*split_source(source), users))
    text, origin = recipe_text, "as written"
    if not text and recipe is not None:
        text, origin = recipe.model_dump_json(indent=2), "as read, in JSON"
    geometry = geometry or Geometry()
    return Provenance(
        tuple(sources),
        tuple(
            FitOrigin(
                fit.what, part, fit.candidate, fit.effort, fit.effort_unit, fit.position_unit,
                fit.inputs_hash, posterior_sha256(fit), fit.sources,
            )
            for part, fit in fits.items()
        ),
        tuple(
            GeometryOrigin(what, fit.inputs_hash, geometry.sha256.get(what, ""), fit.sources)
            for what, fit in geometry.fits.items()
        ),
        tuple(
            TrustCheckOrigin(what, check.fit_hash, trust_check_sha256(check))
            for what, check in sorted((checks or {}).items())
        ),
        text,
        origin,
    )  # fmt: skip


def posterior_sha256(fit: FitResult) -> str:
    """SHA-256 of a fit's draws: their bytes as little-endian float64, draw by draw."""
    return bytes_digest(np.ascontiguousarray(fit.draws, dtype="<f8").tobytes())


def trust_check_sha256(check: VerifyResult) -> str:
    """SHA-256 of a trust check's content, as JSON with sorted keys."""
    return bytes_digest(json.dumps(asdict(check), sort_keys=True).encode())


def provenance_panel(provenance: Provenance, recordings: Sequence[RecordingSummary]) -> Panel:
    """Recordings with their devices, fits with their hashes."""
    known = {one.source: one for one in recordings}
    rows = [_source_row(source, known.get(source.source)) for source in provenance.sources]
    rows += [
        Row(
            f"{fit.fit} fit",
            (words("inputs", fit.inputs_hash or " "), words("posterior", fit.posterior_sha256)),
        )
        for fit in provenance.fits
    ]
    for one in provenance.geometry:
        rows.append(
            Row(
                f"{one.fit} fit",
                (
                    words("inputs", one.inputs_hash or " "),
                    words("file", one.file_sha256 or " "),
                    words("photographs", ", ".join(one.sources) or " "),
                ),
            )
        )
    return Panel("provenance-sources", "provenance", "Recordings and fits", rows=tuple(rows))


def _source_row(source: Source, summary: RecordingSummary | None) -> Row:
    values = [
        words("SHA-256", source.content_hash or "not available"),
        words("used by", ", ".join(source.used_by) or "no fit"),
    ]
    if summary is None:
        note = "The recording was not handed to this report."
        return Row(source.source, tuple(values), note)
    device = ", ".join(
        f"{key} {display(scalar(v))}" for key, v in summary.device.items() if key != PROBE_KEY
    )
    values += [
        words("kind", f"{summary.kind}, {summary.joint} joint"),
        number("length", summary.duration_s, "s", digits=4),
        count("samples", summary.samples),
        count("strokes", len(summary.strokes)),
        words("device", device or " "),
    ]
    return Row(source.source, tuple(values), " ".join(summary.notes))


def sheet_panel(sheet: FactSheet) -> Panel:
    """Take a sheet of facts over; its part's name holds only letters, digits and hyphens."""
    part = "sheet-" + re.sub(r"[^A-Za-z0-9]+", "-", sheet.anchor).strip("-")
    rows = tuple(Row(fact.label, (_fact(scalar(fact.value), fact.unit),)) for fact in sheet.facts)
    return Panel(f"{part}-facts", part, sheet.title, rows=rows, notes=sheet.notes)


def _fact(value: object, unit: str) -> Value:
    if isinstance(value, str | bool):
        said = display(value)
        return words("value", f"{said} {unit}".strip() or " ")
    if isinstance(value, int):
        return Value("value", value, unit)
    return number("value", value, unit, digits=4)


def left_out_panel(recipe: Recipe, fits: Sequence[FitResult], geometry: Mapping[str, str]) -> Panel:
    """What the scene does not ask for, what is missing, and the candidates not chosen.

    ``geometry`` names fits of photographs that are missing, and says how to have them.
    """
    items = [
        *((f"{what} fit", "not there yet", why) for what, why in geometry.items()),
        *_missing(recipe, fits),
        *_not_needed(recipe),
        *((f"{f.what}: {name}", "not chosen", why) for f in fits for name, why in passed_over(f)),
    ]
    rows = tuple(
        Row(what, (words("because it is", reason), words("why, or what it would change", why)))
        for what, reason, why in items
    )
    sentence = "" if rows else "Nothing was left out."
    return Panel("left-out-list", "left-out", "What was left out", sentence, rows)


def _missing(recipe: Recipe, fits: Sequence[FitResult]) -> Iterable[tuple[str, str, str]]:
    have = {fit.what for fit in fits}
    if "friction" not in have:
        how = "Run `scissorcal capture friction`, then `scissorcal fit friction`."
        yield "friction fit", "not there yet", how
    if "cut" not in have:
        what = "cut fit" if recipe.scene.cut else "press fit"
        yield what, "not there yet", "Run `scissorcal capture cut`, then `scissorcal fit cut`."


def _not_needed(recipe: Recipe) -> Iterable[tuple[str, str, str]]:
    scene = recipe.scene
    if not scene.cut:
        why = "Nothing is cut in this scene (`cut = false`)."
        yield "toughness and fracture", "not needed", why
    if not scene.render_friction:
        why = "The scene says `render_friction = false`."
        yield "friction in what is rendered", "not needed", why
    for item in requirements(recipe).left_out:
        if item.name in PHOTOGRAPHED:
            yield item.name, "not needed", f"The recipe says `{item.why}`."
    for target, what in (
        ("torque", "torque at the pivot"),
        ("handle_force", "force at the handle"),
        ("translation_force", "force along the cut"),
    ):
        if target not in scene.render:
            yield what, "not needed", f"The scene's `render` list does not name `{target}`."
