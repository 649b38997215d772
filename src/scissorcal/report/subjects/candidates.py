"""What else was tried: candidate models, the critic's proposals, replay of one stroke."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from scissorcal.calibration.result import FitResult
from scissorcal.report.numbers import Number, finite, percent, short
from scissorcal.report.panel import (
    Axis,
    Chart,
    Panel,
    Row,
    absent,
    count,
    number,
    percent_of,
    points,
    words,
)
from scissorcal.report.reduce import median
from scissorcal.report.strokes import StrokeSamples

SAME_WITHIN = 1e-3


@dataclass(frozen=True)
class Candidate:
    """A candidate model as it was compared; ``equivalent`` to the best as far as data can say."""

    name: str
    parameters: int | None
    bic: Number
    held_out_rms: Number
    held_out_score: Number
    loo: Number
    loo_se: Number
    equivalent: bool
    chosen: bool

    @property
    def outcome(self) -> str:
        """What became of it."""
        return "✓ used" if self.chosen else "≈ equivalent" if self.equivalent else "✗ worse"


def candidates_of(fit: FitResult) -> tuple[Candidate, ...]:
    """Candidates in the fit's order, the simplest first."""
    return tuple(_candidate(entry) for entry in fit.candidates)


def candidates_panel(fit: FitResult, part: str) -> Panel:
    """Every candidate with its scores."""
    title, id_ = "Candidate models", f"{part}-candidates"
    found = candidates_of(fit)
    if not found:
        return absent(id_, part, title, "No candidates were compared.")
    lowest = min((one.bic for one in found if one.bic is not None), default=None)
    rows = tuple(
        Row(
            one.name,
            (
                count("parameters", one.parameters),
                number("BIC", one.bic, digits=6),
                number("above the lowest BIC", _less(one.bic, lowest), digits=3),
                number("hold-out rms", one.held_out_rms, fit.effort_unit),
                number("hold-out log score", one.held_out_score, digits=6),
                number("PSIS-LOO", one.loo, digits=6, sd=one.loo_se),
                words("outcome", one.outcome),
            ),
            marked=one.chosen,
        )
        for one in found
    )
    caption = (
        "The simplest first. Lower BIC, lower hold-out rms, higher hold-out score and PSIS-LOO "
        "are better. Equivalent candidates do not differ from the best in these data; the "
        "simplest of them is used."
    )
    return Panel(id_, part, title, fit.selection, rows, caption=caption)


def passed_over(fit: FitResult) -> tuple[tuple[str, str], ...]:
    """Candidates that were not chosen, each with what choosing it would change."""
    found = candidates_of(fit)
    chosen = next((one for one in found if one.chosen), None)
    return tuple((one.name, _cost(one, chosen)) for one in found if not one.chosen)


def critic_panel(fit: FitResult, part: str) -> Panel:
    """Each proposal of the critic with how often it was found and what it gains."""
    title, id_ = "Terms that the critic proposes", f"{part}-critic"
    if not fit.critic:
        why = (
            "The critic proposes nothing: no term recurred over strokes and lowered the hold-out "
            f"error, or the fit was made without it. `scissorcal fit {fit.words} --force` runs it "
            "again."
        )
        return absent(id_, part, title, str(fit.diagnostics.get("critic") or why))
    rows = tuple(
        Row(
            p.formula,
            (
                number("coefficient", p.coefficient, p.unit, sd=p.coefficient_sd),
                number("torque, twice the rms", p.size, fit.effort_unit, digits=2),
                percent_of("found without a quarter of the strokes", p.inclusion),
                percent_of("hold-out error falls by", p.held_out_gain),
                number("log density gained", p.held_out_nats),
                words("to adopt it", p.adopted_by or "no candidate has it"),
            ),
        )
        for p in fit.critic
    )
    note = (
        "The critic searches what the law leaves unexplained, over whole strokes. A line in the "
        "recipe adopts a term; drift, waves, hysteresis and bumps over the speed are of the rig or "
        "the day, and no law has them."
    )
    sentence = " ".join(p.sentence for p in fit.critic[:3])
    return Panel(id_, part, title, sentence, rows, notes=(note,))


def replay_panel(fit: FitResult, strokes: Sequence[StrokeSamples], part: str) -> Panel:
    """Errors of replaying one stroke and of the model, by unseen stroke."""
    title, id_ = "Replay of one recorded stroke", f"{part}-replay"
    replay = fit.replay
    if replay is None or not replay.rows:
        why = (
            "This fit holds no comparison with replaying one measured stroke: `scissorcal fit "
            f"{fit.words} --force` makes it where there are strokes to compare."
        )
        return absent(id_, part, title, why)
    names = {(one.name.stroke, one.name.recording): one.name for one in strokes}
    rows = []
    for one in replay.rows:
        name = names.get((one.stroke, one.recording))
        rows.append(
            Row(
                name.label if name else f"stroke {one.stroke}",
                (
                    words("new in it", one.novelty),
                    number("replay", one.replay_rms, fit.effort_unit),
                    number("model", one.model_rms, fit.effort_unit),
                    number("model of that one stroke", one.one_stroke_rms, fit.effort_unit),
                    percent_of("covered by the replay", one.covered),
                ),
                link=name.anchor if name else "",
                marked=(finite(one.model_rms) or 0.0) > (finite(one.replay_rms) or np.inf),
            )
        )
    kinds = list(dict.fromkeys(one.novelty for one in replay.rows))
    series = []
    for label, key, look in (
        ("replay", "replay_rms", "vermillion"),
        ("model", "model_rms", "blue"),
    ):
        up = -0.13 if key == "replay_rms" else 0.13
        x = [getattr(one, key) for one in replay.rows]
        y = [kinds.index(one.novelty) + up for one in replay.rows]
        series.append(points(label, x, y, look, toggle=True))  # type: ignore[arg-type]
        middle = [
            median(np.array([v for v, one in zip(x, replay.rows, strict=True) if one.novelty == k]))
            for k in kinds
        ]
        at = [place + up for place in range(len(kinds))]
        series.append(points(f"median, {label}", middle, at, "ink"))
    chart = Chart(
        f"{id_}-f",
        "Error on unseen strokes: replay and model",
        Axis("rms error", fit.effort_unit, low=0.0),
        Axis(
            "",
            categories=tuple(f"new {k}" if k != "none" else "nothing new" for k in kinds),
            reverse=True,
        ),
        tuple(series),
        "By what is new in the stroke; black marks are medians.",
    )
    recorded = (
        f"stroke {replay.stroke} ({replay.kind} at {short(replay.speed)} {fit.position_unit}/s)"
    )
    note = (
        f"Before there were models, haptic scissors played back one stroke, here {recorded}. "
        "Errors are rms on strokes that neither side had seen; marked rows are those where the "
        "replay is better."
    )
    return Panel(id_, part, title, replay.sentence, tuple(rows), (chart,), notes=(note,))


def _candidate(entry: Mapping[str, Any]) -> Candidate:
    size = finite(entry.get("parameters"))
    chosen = bool(entry.get("chosen", False))
    return Candidate(
        str(entry.get("name", "unnamed")),
        None if size is None else int(size),
        finite(entry.get("bic")),
        finite(entry.get("held_out_rms")),
        finite(entry.get("held_out_score")),
        finite(entry.get("loo")),
        finite(entry.get("loo_se")),
        bool(entry.get("equivalent", chosen)),
        chosen,
    )


def _less(value: Number, other: Number) -> Number:
    return None if value is None or other is None else value - other


def _cost(one: Candidate, chosen: Candidate | None) -> str:
    found = []
    if chosen and one.bic is not None and chosen.bic is not None:
        change = one.bic - chosen.bic
        found.append(f"its BIC is {short(abs(change))} {'higher' if change >= 0 else 'lower'}")
    if chosen and one.held_out_rms is not None and chosen.held_out_rms:
        found.append(
            f"its hold-out error is {_compared(one.held_out_rms / chosen.held_out_rms - 1)}"
        )
    if not found or chosen is None:
        return "It was compared, but without figures."
    better = one.held_out_rms is not None and one.held_out_rms < (chosen.held_out_rms or 0.0)
    reason = " That gain is too small to feel, or not steady over strokes." if better else ""
    if one.equivalent:
        reason = " It is equivalent to the best in these data; the simplest of those is used."
    return f"Against {chosen.name}, {' and '.join(found)}.{reason}"


def _compared(change: float) -> str:
    if abs(change) < SAME_WITHIN:
        return "the same"
    return f"{percent(abs(change))} {'larger' if change > 0 else 'smaller'}"
