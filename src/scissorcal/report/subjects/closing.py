"""What closes a report: what was left out, provenance, the rig as it was probed."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass

import numpy as np

from scissorcal.calibration.result import FitResult
from scissorcal.calibration.verify.result import VerifyResult
from scissorcal.identity import bytes_digest
from scissorcal.recipe.requirements import requirements
from scissorcal.recipe.schema import Recipe
from scissorcal.recording.probe import (
    ESTIMATES,
    FACTS,
    PROBE_KEY,
    Estimate,
    ProbeResult,
    Swing,
    newest_probe,
)
from scissorcal.recording.recording import Recording
from scissorcal.report.inputs import Evidence
from scissorcal.report.numbers import display, scalar
from scissorcal.report.panel import (
    Axis,
    Chart,
    Look,
    Panel,
    Row,
    Series,
    Value,
    count,
    curve,
    number,
    points,
    words,
)
from scissorcal.report.strokes import recording_of, split_source
from scissorcal.report.subjects.candidates import passed_over

LOOKS: tuple[Look, ...] = ("blue", "vermillion", "green", "purple", "orange", "ink")
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
    """A verification that the report shows: of which fit, and the SHA-256 of its content."""

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


def trace(recipe: Recipe | None, fits: Mapping[str, FitResult], evidence: Evidence) -> Provenance:
    """Tie recordings to fits (by part), and name sources whose recording was not handed in."""
    recordings, geometry = evidence.recordings, evidence.geometry
    sources = [
        Source(
            recording.source or "recording without a file",
            recording.content_hash,
            tuple(
                fit.what
                for fit in fits.values()
                if any(recording_of(source, recordings) is recording for source in fit.sources)
            ),
        )
        for recording in recordings
    ]
    for source in dict.fromkeys(source for fit in fits.values() for source in fit.sources):
        if recording_of(source, recordings) is None:
            users = tuple(fit.what for fit in fits.values() if source in fit.sources)
            sources.append(Source(*split_source(source), users))
    text, origin = evidence.recipe_text, "as written"
    if not text and recipe is not None:
        text, origin = recipe.model_dump_json(indent=2), "as read, in JSON"
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
            for what, check in sorted(evidence.checks.items())
        ),
        text,
        origin,
    )  # fmt: skip


def posterior_sha256(fit: FitResult) -> str:
    """SHA-256 of a fit's draws: their bytes as little-endian float64, draw by draw."""
    return bytes_digest(np.ascontiguousarray(fit.draws, dtype="<f8").tobytes())


def trust_check_sha256(check: VerifyResult) -> str:
    """SHA-256 of a verification's content, as JSON with sorted keys."""
    return bytes_digest(json.dumps(asdict(check), sort_keys=True).encode())


def provenance_panel(provenance: Provenance, recordings: Sequence[Recording]) -> Panel:
    """Recordings with their devices, fits with their hashes."""
    known = {recording.source: recording for recording in recordings}
    rows = [_source_row(source, known.get(source.source)) for source in provenance.sources]
    rows += [
        Row(
            f"{fit.fit} fit",
            (words("inputs", fit.inputs_hash or " "), words("posterior", fit.posterior_sha256)),
        )
        for fit in provenance.fits
    ]
    rows += [
        Row(
            f"{fit.fit} fit",
            (
                words("inputs", fit.inputs_hash or " "),
                words("file", fit.file_sha256 or " "),
                words("photographs", ", ".join(fit.sources) or " "),
            ),
        )
        for fit in provenance.geometry
    ]
    return Panel("provenance-sources", "provenance", "Recordings and fits", rows=tuple(rows))


def _source_row(source: Source, recording: Recording | None) -> Row:
    values = [
        words("SHA-256", source.content_hash or "not available"),
        words("used by", ", ".join(source.used_by) or "no fit"),
    ]
    if recording is None:
        note = "The recording was not handed to this report."
        return Row(source.source, tuple(values), note)
    device = ", ".join(
        f"{key} {display(scalar(v))}" for key, v in recording.device.items() if key != PROBE_KEY
    )
    values += [
        words("kind", f"{recording.kind}, {recording.joint.kind} joint"),
        number("length", recording.duration_s, "s", digits=4),
        count("samples", len(recording.samples)),
        count("strokes", len(recording.strokes)),
        words("device", device or " "),
    ]
    return Row(source.source, tuple(values), " ".join(recording.notes))


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


def rig_panels(recordings: Sequence[Recording]) -> tuple[Panel, ...]:
    """What the latest probe in the recordings says; none where none was probed."""
    last = newest_probe(recording.device for recording in recordings)
    return () if last is None else (rig_panel(last),)


def rig_panel(probe: ProbeResult) -> Panel:
    """Estimates with their intervals, the facts that people ask for, pushes beside the model."""
    values = [
        (name, _estimated(estimate, scale, unit))
        for name, key, scale, unit in ESTIMATES
        if (estimate := getattr(probe, key)) is not None
    ]
    values += [
        (name, number("value", scale * probe.facts[key], unit))
        for name, key, scale, unit in FACTS
        if math.isfinite(probe.facts.get(key, math.nan))
    ]
    rows = tuple(Row(name, (value,)) for name, value in values)
    sentence = f"{probe.device}, probed at {probe.made_at}."
    return Panel(
        "provenance-rig", "provenance", "The rig as it was probed", sentence, rows,
        _charts(probe), caption="Estimates: intervals of 90 %.",
    )  # fmt: skip


def _estimated(estimate: Estimate, scale: float, unit: str) -> Value:
    mean, sd, low, high = (scale * v for v in (estimate.mean, estimate.sd, *estimate.interval))
    return number("value", mean, unit, sd=sd, low=low, high=high)


def _charts(probe: ProbeResult) -> tuple[Chart, ...]:
    if not probe.swings:
        return ()
    chart = Chart(
        "provenance-rig-swings",
        "Pushes of the probe",
        Axis("time", "ms"),
        Axis("opening, from where it stood", "mrad"),
        tuple(
            series
            for place, (swing, look) in enumerate(zip(probe.swings, LOOKS, strict=False), start=1)
            for series in _series(place, swing, look)
        ),
        "The strongest pushes of the probe, as the encoder showed them (marks), and as the fitted "
        "joint goes (lines).",
    )
    return (chart,)


def _series(place: int, swing: Swing, look: Look) -> tuple[Series, Series]:
    times = [1e3 * value for value in swing.times_s]
    name = f"{place}: {1e3 * swing.torque_Nm:+.3g} mN m"
    places = [1e3 * value for value in swing.places_rad]
    goes = [1e3 * value for value in swing.model_rad]
    return points(name, times, places, look), curve(f"{name}, model", times, goes, look)
