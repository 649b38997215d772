"""What the critic proposes, and how the model does against replaying one measured stroke."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scissorcal.calibration.result import FitResult, ReplayComparison
from scissorcal.report.numbers import Number, finite, percent, short, significant, unit_text
from scissorcal.report.panel import Panel, Row, Table, absent, columns
from scissorcal.report.reduce import median
from scissorcal.report.strokes import StrokeSamples
from scissorcal.report.svg import BLUE, INK, PANEL, VERMILLION, Svg, finish, new_axes


@dataclass(frozen=True)
class ProposalRow:
    """A term that the critic found; shares of one, the coefficient in ``unit``."""

    name: str
    formula: str
    coefficient: Number
    coefficient_sd: Number
    unit: str
    inclusion: Number
    held_out_gain: Number
    held_out_nats: Number
    adopted_by: str
    sentence: str


@dataclass(frozen=True)
class ReplayStroke:
    """One unseen stroke: rms errors in the effort unit; ``anchor`` is empty without a figure."""

    anchor: str
    label: str
    novelty: str
    speed: Number
    covered: Number
    measured_rms: Number
    replay_rms: Number
    model_rms: Number
    one_stroke_rms: Number


@dataclass(frozen=True)
class ReplaySection:
    """Record-and-replay of one stroke against the model, on strokes that neither had seen."""

    recorded: str
    sentence: str
    rows: tuple[ReplayStroke, ...]


def take_proposals(fit: FitResult) -> tuple[ProposalRow, ...]:
    """The critic's proposals in its own order."""
    return tuple(
        ProposalRow(
            p.name,
            p.formula,
            finite(p.coefficient),
            finite(p.coefficient_sd),
            p.unit,
            finite(p.inclusion),
            finite(p.held_out_gain),
            finite(p.held_out_nats),
            p.adopted_by,
            p.sentence,
        )
        for p in fit.critic
    )


def show_proposals(fit: FitResult, section: tuple[ProposalRow, ...], anchor: str) -> Panel:
    """The panel: each proposal with how often it was found and what it gains."""
    title, where = "What the critic proposes", f"{anchor}-critic"
    if not section:
        why = (
            "The critic proposes nothing: either no term recurred over resampled strokes and "
            f"lowered the error on unseen ones, or this fit was made without it. `scissorcal fit "
            f"{fit.what} --force` asks it again."
        )
        return absent(where, title, why)
    found = tuple(
        Row(
            (
                row.formula,
                f"{significant(row.coefficient)} ± {significant(row.coefficient_sd, 2)} "
                f"{unit_text(row.unit)}".rstrip(),
                percent(row.inclusion),
                percent(row.held_out_gain),
                short(row.held_out_nats),
                row.adopted_by or "no rung has it",
            )
        )
        for row in section
    )
    heads = columns(
        "Term",
        "Coefficient",
        "Found in resamples",
        "Held-out error falls by",
        "Log density gained",
        "=To adopt it",
    )
    lead = (
        "It searches what the law leaves unexplained, over resamples of whole strokes. It "
        "proposes; a line in the recipe decides.",
    )
    finding = " ".join(row.sentence for row in section[:3])
    return Panel(where, title, lead, finding, (), Table("Most often found first.", heads, found))


def take_replay(fit: FitResult, strokes: tuple[StrokeSamples, ...]) -> ReplaySection | None:
    """The comparison with record-and-replay, tied to the strokes on the page."""
    replay = fit.replay
    if replay is None:
        return None
    names = {(s.name.stroke, s.name.recording): s.name for s in strokes}
    rows = []
    for row in replay.rows:
        name = names.get((row.stroke, row.recording))
        rows.append(
            ReplayStroke(
                name.anchor if name else "",
                name.label if name else f"stroke {row.stroke}",
                row.novelty,
                finite(row.speed),
                finite(row.covered),
                finite(row.measured_rms),
                finite(row.replay_rms),
                finite(row.model_rms),
                finite(row.one_stroke_rms),
            )
        )
    return ReplaySection(_recorded(fit, replay), replay.sentence, tuple(rows))


def show_replay(fit: FitResult, section: ReplaySection | None, anchor: str) -> Panel:
    """The panel: both errors by stroke, in a figure and a table."""
    title, where = "Against record-and-replay", f"{anchor}-replay"
    if section is None or not section.rows:
        why = (
            "This fit holds no comparison with replaying one measured stroke: `scissorcal fit "
            f"{fit.what} --force` makes it where there are strokes to compare."
        )
        return absent(where, title, why)
    unit = unit_text(fit.effort_unit)
    found = tuple(
        Row(
            (
                row.label,
                row.novelty,
                significant(row.replay_rms),
                significant(row.model_rms),
                significant(row.one_stroke_rms),
                percent(row.covered),
            ),
            anchor=row.anchor,
            marked=(row.model_rms or 0.0) > (row.replay_rms or np.inf),
        )
        for row in section.rows
    )
    heads = columns(
        "Stroke",
        "=New in it",
        f"Replay [{unit}]",
        f"Model [{unit}]",
        f"Model of that one stroke [{unit}]",
        "Within reach",
    )
    lead = (
        f"What haptic scissors did before there were models: play back {section.recorded}. Errors "
        "are rms on strokes that neither side had seen.",
    )
    table = Table("Rows stand out where the replay does better.", heads, found)
    return Panel(where, title, lead, section.sentence, (_draw_replay(fit, section, where),), table)


def _recorded(fit: FitResult, replay: ReplayComparison) -> str:
    return f"stroke {replay.stroke} ({replay.kind} at {short(replay.speed)} {fit.position_unit}/s)"


def _draw_replay(fit: FitResult, section: ReplaySection, anchor: str) -> Svg:
    kinds = list(dict.fromkeys(row.novelty for row in section.rows))
    figure, axes = new_axes((PANEL[0], max(1.5, 0.8 + 0.42 * len(kinds))))
    for place, kind in enumerate(kinds):
        rows = [row for row in section.rows if row.novelty == kind]
        for errors, colour, marker, up in (
            ([row.replay_rms for row in rows], VERMILLION, "^", 0.13),
            ([row.model_rms for row in rows], BLUE, "o", -0.13),
        ):
            known = np.array(errors, dtype=np.float64)
            where = np.full(len(known), place + up)
            axes.plot(known, where, marker, color=colour, ms=4, mew=0, alpha=0.55)
            axes.plot(median(known), place + up, "|", color=INK, ms=11, mew=1.6)
    axes.set_yticks(
        range(len(kinds)),
        labels=[f"new {kind}" if kind != "none" else "nothing new" for kind in kinds],
    )
    axes.tick_params(axis="y", length=0)
    axes.set_ylim(len(kinds) - 0.5, -0.5)
    axes.set_xlim(left=0)
    axes.set_xlabel(f"rms error [{unit_text(fit.effort_unit)}]")
    caption = "Triangles are the replay, dots the model, ticks their medians, by what was new."
    title = "Error on unseen strokes: replay and model"
    return finish(figure, f"{anchor}-f", title, caption, f"{section.sentence} {caption}")
