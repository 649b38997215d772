"""The decision page: simulated or real, trust, data, verification, felt error, weaknesses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np

from scissorcal.calibration.caveats import caveats_of
from scissorcal.calibration.result import FitResult
from scissorcal.calibration.verify.result import VerifyResult
from scissorcal.package.scene_torque import SceneTorque
from scissorcal.recipe.schema import Recipe
from scissorcal.recording.recording import Recording
from scissorcal.report.inputs import Cell, Evidence, Geometry
from scissorcal.report.numbers import finite, percent
from scissorcal.report.panel import Panel, Row, Value, count, percent_of, words
from scissorcal.report.strokes import FittedStroke, kind_word, stroke_label
from scissorcal.report.subjects.overview import budget_chart, not_in_band_sentence
from scissorcal.report.subjects.torque import held_out_summary
from scissorcal.report.subjects.trust import ASSESSMENTS, SAID, Assessment, Headline, coverage_found
from scissorcal.verdicts import Verdict, failed

PART = "decision"
SIMULATOR = 0x8000
"""The capability of a device that is a simulator, as in docs/protocol.md."""
MOST_CELLS = 3
NO_WEAKNESS = (
    "No check failed, no recorded stroke, range or photograph is known to be unused, and the data "
    "are of no kind that is known to give poor intervals."
)

Origin = Literal["simulated", "real", "mixed", "unknown"]
TITLES: dict[Origin, str] = {
    "simulated": "Simulated",
    "real": "Real rig",
    "mixed": "Simulated and real",
    "unknown": "Origin not stated",
}
OUTCOMES: dict[Assessment, str] = {
    "trust": "Trust",
    "unverified": "Not verified",
    "care": "Use with care",
    "reject": "Do not use",
}
PHOTOGRAPHS_PASSED = "✓ checks passed"
"""Of a fit of photographs, for which there is no verification that could be missing."""


def origin_of(recordings: Sequence[Recording]) -> Origin:
    """Whether recordings come from a simulator, as their devices state it."""
    flags = {_simulated(recording) for recording in recordings} - {None}
    if len(flags) != 1:
        return "mixed" if flags else "unknown"
    return "simulated" if flags.pop() else "real"


def origin_panel(origin: Origin, recordings: Sequence[Recording]) -> Panel:
    """Simulated or real, as far as it is stated."""
    said = {
        "simulated": "All recordings that state their device come from a virtual rig: no value of "
        "theirs is of a real specimen.",
        "real": "All recordings that state their device come from a real rig.",
        "mixed": "Some recordings come from a virtual rig and some from a real one.",
        "unknown": "No recording states the device that it comes from.",
    }[origin]
    silent = sum(_simulated(recording) is None for recording in recordings)
    if silent and origin != "unknown":
        said += f" {silent} of {len(recordings)} recordings do not state it."
    names = sorted({str(r.device["serial"]) for r in recordings if r.device.get("serial")})
    device = f" Device: {', '.join(names)}." if names else ""
    return Panel(f"{PART}-origin", PART, TITLES[origin], said + device)


def _simulated(recording: Recording) -> bool | None:
    """Whether the device states that it is a simulator; None where it states neither."""
    stated = recording.device.get("capabilities") if recording.device else None
    return bool(stated & SIMULATOR) if isinstance(stated, int) else None


def trust_panel(headlines: Sequence[Headline], rig: Sequence[str], next_command: str = "") -> Panel:
    """The overall outcome, and one row per fit; ``rig`` names the fits of recordings.

    ``next_command`` is what comes next in the workspace; without it the worst fit's headline says.
    """
    rows = tuple(
        Row(
            headline.fit,
            (words("decision", _decision(headline, rig)), words("why", headline.brief)),
            link=headline.fit,
            marked=headline.assessment in {"reject", "care"},
        )
        for headline in headlines
    )
    overall = _overall_assessment(headlines, rig)
    worst = [headline for headline in headlines if headline.assessment == overall]
    first = next(
        (headline for headline in worst if headline.fit in rig), worst[0] if worst else None
    )
    steps = first.next_steps[:1] if first else ()
    sentence = f"Next: {steps[0]}" if steps else ""
    notes: tuple[str, ...] = ()
    if next_command:
        sentence = f"Next: `{next_command}`."
        notes = steps if overall in ("reject", "care") else ()
    title = "Checks passed" if first and _photographs_passed(first, rig) else OUTCOMES[overall]
    return Panel(f"{PART}-trust", PART, title, sentence, rows, notes=notes)


def _decision(headline: Headline, rig: Sequence[str]) -> str:
    return PHOTOGRAPHS_PASSED if _photographs_passed(headline, rig) else SAID[headline.assessment]


def _photographs_passed(headline: Headline, rig: Sequence[str]) -> bool:
    return headline.fit not in rig and headline.assessment == "unverified"


def _overall_assessment(headlines: Sequence[Headline], rig: Sequence[str]) -> Assessment:
    """The worst assessment; photographs that passed their checks do not lower that of the rig."""
    counted = [h.assessment for h in headlines if not (rig and _photographs_passed(h, rig))]
    return min(counted or ["unverified"], key=ASSESSMENTS.index)


def cells_of(
    fits: Sequence[tuple[FitResult, Sequence[FittedStroke]]], evidence: Evidence
) -> tuple[Cell, ...]:
    """What was counted by cells of motion, where it was; else strokes; and photographs by fit.

    Of strokes, planned are those that a recording lists, recorded those with samples (where these
    are at hand), used those of which the fit's series has any sample: the share is not known here.
    Return strokes of a cut are not counted: a cut is fitted to closing strokes and what unloads.
    """
    cells = list(evidence.completeness)
    counted = {cell.capture for cell in cells}
    for fit, strokes in fits:
        if fit.what in counted:
            continue
        used = {stroke.stroke for stroke in strokes if len(stroke.places)}
        planned: dict[str, list[int]] = {}
        recorded: set[int] = set()
        number = 0
        captures = [r for r in evidence.recordings if r.kind == fit.what]
        for recording in captures:
            sampled = np.unique(recording.samples["stroke"])
            recorded.update(int(n) + number for n in sampled if n >= 0)
            for stroke in recording.strokes:
                label = stroke_label(stroke, 0, fit.position_unit).partition(", ")[2]
                planned.setdefault(label, []).append(number)
                number += 1
        known = bool(captures) and all(len(recording.samples) for recording in captures)
        for name, numbers in planned.items():
            kept = sum(n in used for n in numbers)
            returns = name.startswith(kind_word("opening", fit.position_unit))
            if fit.what == "cut" and returns:
                continue
            there = sum(n in recorded for n in numbers) if known else None
            cells.append(Cell(fit.what, name, len(numbers), there, kept))
    return (*cells, *_photographs(evidence.geometry))


def _photographs(geometry: Geometry) -> list[Cell]:
    cells = []
    for what, fit in geometry.fits.items():
        views = getattr(fit, "views", None)
        if views is None:
            views = {view.source for blade in fit.blades for view in blade.photographs}  # type: ignore[union-attr]
        if fit.sources:
            cells.append(Cell(what, "all", None, len(fit.sources), len(views), "photographs"))
    return cells


def data_panels(cells: Sequence[Cell]) -> tuple[Panel, Panel]:
    """Totals per capture with the incomplete cells, for the decision page; and every cell."""
    rows = []
    for capture, unit in dict.fromkeys((cell.capture, cell.unit) for cell in cells):
        counted = [cell for cell in cells if (cell.capture, cell.unit) == (capture, unit)]
        rows.append(Row(f"{capture} {unit}", _counts(counted), link="data"))
    said = []
    for head, odd in (
        ("Incomplete", [cell for cell in cells if cell.incomplete]),
        ("Not used", [cell for cell in cells if cell.unused]),
    ):
        said += [f"{head}: {_named(head, odd)}."] if odd else []
    sentence = " ".join(said) or "All that was planned is recorded and used."
    if not cells:
        sentence = "Nothing is known of the data."
    every = tuple(
        Row(
            f"{c.capture}, {c.name}: {c.unit}",
            _counts([c]),
            note=c.remark,
            marked=c.incomplete or c.unused,
        )
        for c in cells
    )
    full = Panel("data-cells", "data", "Data planned, recorded and used", sentence, every)
    return Panel(f"{PART}-data", PART, "Data", sentence, tuple(rows)), full


def _counts(cells: Sequence[Cell]) -> tuple[Value, ...]:
    values = []
    for name in ("planned", "recorded", "used"):
        known = [getattr(cell, name) for cell in cells]
        values.append(words(name, "–") if None in known or not known else count(name, sum(known)))
    return tuple(values)


def _named(head: str, odd: Sequence[Cell]) -> str:
    named = "; ".join(f"{c.capture}, {c.name}: {_lack(head, c)}" for c in odd[:MOST_CELLS])
    return f"{named}; {len(odd) - MOST_CELLS} more" if len(odd) > MOST_CELLS else named


def _lack(head: str, cell: Cell) -> str:
    if head == "Incomplete":
        return f"{cell.recorded} of {cell.planned} {cell.unit} recorded"
    of = cell.planned if cell.recorded is None else cell.recorded
    return f"{cell.used} of {of} {cell.unit} used"


def checked_panel(fits: Sequence[FitResult], checks: Mapping[str, VerifyResult]) -> Panel:
    """Whether the verification was made, with the coverage that it found."""
    rows = []
    for fit in fits:
        check = checks.get(fit.what)
        if check is None:
            said = f"not done: `scissorcal verify {fit.words}`"
        else:
            outcome = _outcome(check)
            said = "; ".join(part for part in (outcome, coverage_found(check)) if part)
        rows.append(Row(fit.what, (words("trust check", said),), marked=check is None))
    return Panel(f"{PART}-checked", PART, "Verification", rows=tuple(rows))


def _outcome(check: VerifyResult) -> str:
    """What a verification ended in."""
    for status, word in (("fail", "failed"), ("not_evaluated", "not evaluated")):
        named = [verdict.check for verdict in check.verdicts if verdict.status == status]
        if named:
            return f"{word}: {', '.join(named)}"
    return "passed"


def felt_panel(
    torque: SceneTorque | None, why: str, fits: Sequence[FitResult], recipe: Recipe
) -> Panel:
    """What is uncertain of the torque that is felt, as a share of it, against the tolerance."""
    tolerance = f"tolerance {percent(recipe.scene.tolerance_percent / 100)}"
    rows: list[Row] = []
    sentence, chart = why, None
    if torque is not None:
        share = torque.share[np.isfinite(torque.share)]
        middle, worst = (
            (float(np.median(share)), float(share.max())) if len(share) else (None, None)
        )
        sentence = (
            f"± {percent(middle)} of the scene's torque (median place; worst ± {percent(worst)}) "
            f"is in the band, {tolerance}: {percent(finite(torque.within_tolerance))} of the "
            f"places are within it. {not_in_band_sentence(torque)}"
        )
        chart = budget_chart(torque, f"{PART}-budget")
    for fit in fits:
        middle, worst = held_out_summary(fit)
        if middle is not None:
            name = f"hold-out error, {fit.what}"
            rows.append(Row(name, (percent_of("median ±", middle), percent_of("worst ±", worst))))
    charts = (chart,) if chart else ()
    return Panel(f"{PART}-felt", PART, "Felt error", sentence, tuple(rows), charts)


def weaknesses_panel(
    fits: Sequence[FitResult],
    torque: SceneTorque | None,
    verdicts: Sequence[Verdict] = (),
    cells: Sequence[Cell] = (),
) -> Panel:
    """What is known to be poor: failed checks, unused data, and kinds of data with poor intervals.

    The last are those of the table in docs/uncertainty.md.
    """
    wrong = [f"{verdict.scope} {verdict.check}" for verdict in failed(tuple(verdicts))]
    unused = [cell for cell in cells if cell.unused]
    notes = [f"Failed checks: {', '.join(wrong)}."] if wrong else []
    notes += [f"Not used: {_named('Not used', unused)}."] if unused else []
    notes += [
        f"{fit.what}, {', '.join(caveat.parameters)}: {caveat.sentence}"
        for fit in fits
        for caveat in caveats_of(fit)
    ]
    if torque is not None and torque.not_in_band:
        notes.append("Part of the felt error was not measured: see its bar.")
    sentence = "" if notes else NO_WEAKNESS
    title = "Known weaknesses of this fit"
    return Panel(f"{PART}-weaknesses", PART, title, sentence, notes=tuple(notes))
