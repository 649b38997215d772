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
from scissorcal.report.strokes import FittedStroke, median

SAME_WITHIN = 1e-3


@dataclass(frozen=True)
class Candidate:
    """A candidate model as it was compared; ``equivalent`` to the best as far as data can say."""

    name: str
    parameters: int | None
    bic: Number
    held_out_rms: Number
    held_out_elpd: Number
    loo: Number
    loo_se: Number
    equivalent: bool
    chosen: bool

    @property
    def outcome(self) -> str:
        """What became of it."""
        return "✓ used" if self.chosen else "≈ equivalent" if self.equivalent else "✗ worse"


def _candidates_of(fit: FitResult) -> tuple[Candidate, ...]:
    """Candidates in the fit's order, the simplest first."""
    return tuple(_candidate(entry) for entry in fit.candidates)


def candidates_panel(fit: FitResult, part: str) -> Panel:
    """Every candidate with its scores."""
    title, id_ = "Candidate models", f"{part}-candidates"
    candidates = _candidates_of(fit)
    if not candidates:
        return absent(id_, part, title, "No candidates were compared.")
    lowest = min(
        (candidate.bic for candidate in candidates if candidate.bic is not None), default=None
    )
    rows = tuple(
        Row(
            candidate.name,
            (
                count("parameters", candidate.parameters),
                number("BIC", candidate.bic, digits=6),
                number("above the lowest BIC", _less(candidate.bic, lowest), digits=3),
                number("hold-out rms", candidate.held_out_rms, fit.effort_unit),
                number("hold-out ELPD", candidate.held_out_elpd, digits=6),
                number("PSIS-LOO", candidate.loo, digits=6, sd=candidate.loo_se),
                words("outcome", candidate.outcome),
            ),
            marked=candidate.chosen,
        )
        for candidate in candidates
    )
    caption = (
        "The simplest first. Lower BIC, lower hold-out rms, higher ELPD (expected log predictive "
        "density, of hold-out strokes and by PSIS-LOO) are better. Equivalent candidates do not "
        "differ from the best in these data; the simplest of them is used."
    )
    return Panel(id_, part, title, fit.selection, rows, caption=caption)


def passed_over(fit: FitResult) -> tuple[tuple[str, str], ...]:
    """Candidates that were not chosen, each with what choosing it would change."""
    candidates = _candidates_of(fit)
    chosen = next((candidate for candidate in candidates if candidate.chosen), None)
    return tuple(
        (candidate.name, _cost(candidate, chosen))
        for candidate in candidates
        if not candidate.chosen
    )


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


def replay_panel(fit: FitResult, strokes: Sequence[FittedStroke], part: str) -> Panel:
    """Errors of replaying one stroke and of the model, by unseen stroke."""
    title, id_ = "Replay of one recorded stroke", f"{part}-replay"
    replay = fit.replay
    if replay is None or not replay.rows:
        why = (
            "This fit holds no comparison with replaying one measured stroke: `scissorcal fit "
            f"{fit.words} --force` makes it where there are strokes to compare."
        )
        return absent(id_, part, title, why)
    names = {(stroke.stroke, stroke.recording): stroke for stroke in strokes}
    rows = []
    for error in replay.rows:
        name = names.get((error.stroke, error.recording))
        rows.append(
            Row(
                name.label if name else f"stroke {error.stroke}",
                (
                    words("new in it", error.novelty),
                    number("replay", error.replay_rms, fit.effort_unit),
                    number("model", error.model_rms, fit.effort_unit),
                    number("model of that one stroke", error.one_stroke_rms, fit.effort_unit),
                    percent_of("covered by the replay", error.covered),
                ),
                link=name.anchor if name else "",
                marked=(finite(error.model_rms) or 0.0) > (finite(error.replay_rms) or np.inf),
            )
        )
    kinds = list(dict.fromkeys(error.novelty for error in replay.rows))
    series = []
    for label, key, look in (
        ("replay", "replay_rms", "vermillion"),
        ("model", "model_rms", "blue"),
    ):
        up = -0.13 if key == "replay_rms" else 0.13
        x = [getattr(error, key) for error in replay.rows]
        y = [kinds.index(error.novelty) + up for error in replay.rows]
        series.append(points(label, x, y, look, toggle=True))  # type: ignore[arg-type]
        middle = [
            median(
                np.array([v for v, error in zip(x, replay.rows, strict=True) if error.novelty == k])
            )
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
        finite(entry.get("held_out_elpd", entry.get("held_out_score"))),  # as earlier files name it
        finite(entry.get("loo")),
        finite(entry.get("loo_se")),
        bool(entry.get("equivalent", chosen)),
        chosen,
    )


def _less(value: Number, other: Number) -> Number:
    return None if value is None or other is None else value - other


def _cost(candidate: Candidate, chosen: Candidate | None) -> str:
    changes = []
    if chosen and candidate.bic is not None and chosen.bic is not None:
        change = candidate.bic - chosen.bic
        changes.append(f"its BIC is {short(abs(change))} {'higher' if change >= 0 else 'lower'}")
    if chosen and candidate.held_out_rms is not None and chosen.held_out_rms:
        changes.append(
            f"its hold-out error is {_compared(candidate.held_out_rms / chosen.held_out_rms - 1)}"
        )
    if not changes or chosen is None:
        return "It was compared, but without figures."
    better = candidate.held_out_rms is not None and candidate.held_out_rms < (
        chosen.held_out_rms or 0.0
    )
    reason = " That gain is too small to feel, or not steady over strokes." if better else ""
    if candidate.equivalent:
        reason = " It is equivalent to the best in these data; the simplest of those is used."
    return f"Against {chosen.name}, {' and '.join(changes)}.{reason}"


def _compared(change: float) -> str:
    if abs(change) < SAME_WITHIN:
        return "the same"
    return f"{percent(abs(change))} {'larger' if change > 0 else 'smaller'}"
