"""What only a fit of cuts says: checks, cracks that waited too long, samples that are used."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from scissorcal.aliases import Array, Mask
from scissorcal.calibration.cut.model import CutExperiment
from scissorcal.calibration.cut.path_motion import PathMotion, find_runs
from scissorcal.calibration.cut.path_work import Material
from scissorcal.calibration.cut.scout import Scouted
from scissorcal.calibration.cut.segments import Segments
from scissorcal.calibration.cut.teeth import COHERENT
from scissorcal.calibration.cut.widening import Budget
from scissorcal.calibration.result import FitResult
from scissorcal.calibration.signals.sensors import Sensors
from scissorcal.calibration.signals.usage import GAP, INVALID, Usage, count_usage
from scissorcal.recipe.priors import LogNormalPrior
from scissorcal.recording.recording import Recording
from scissorcal.verdicts import STATED, Check, Verdict, failed

SCATTER_SDS = 3.0
"""Prior standard deviations of the noise's scale beyond which it is no noise that grew."""
FOUNDATIONS = Check(
    "fit.cut foundations", "what the fit builds on: failed verdicts there", at_most=0.0
)
SCATTER = Check(
    "fit.cut scatter at rest",
    "response: scatter of cracks at rest over what noise, encoder and friction explain",
    at_most=STATED,
)
TEETH = Check(
    "fit.cut teeth",
    "kappa, which a harmonic puts off by tens of percent: power at a half or a third of the "
    "line's frequency over its own",
    at_most=0.3,
)
"""Limit of the power at a half or a third of the line's frequency, relative to the line's."""


def cut_verdicts(
    friction: FitResult,
    edge_verdicts: tuple[Verdict, ...],
    scouted: Scouted,
    sensors: Sensors,
    recordings: tuple[Recording, ...],
) -> tuple[Verdict, ...]:
    """Judge what the fit builds on, its sensors, its sheets and its line."""
    return (
        _foundations(friction, edge_verdicts),
        sensors.verdict.of("fit.cut"),
        stale_verdict(count_empty(scouted.segments.motions, scouted.materials, recordings)),
        *_line(scouted),
    )


def scatter_verdict(design: CutExperiment, point: Array, prior: LogNormalPrior) -> Verdict:
    """Judge the scatter of cracks at rest against all that is known to make it."""
    scale = float(design.layout.natural(point)["noise_scale"])
    mean, sd = prior.normal()
    limit = math.exp(mean + SCATTER_SDS * sd)
    segments = design.likelihood.segments
    said = (
        f"Mean torques of cracks at rest scatter {scale:.2g} times as much as the torque's noise, "
        "the encoder's steps and the doubt in friction explain"
    )
    bad = (
        f"{said}: another cause is at work, and what is fitted follows it. The encoder shows "
        f"{segments.steps:.3g} steps of a loading. Check rig.edge and the sheet's place, look at "
        "'near rest' of the friction fit, and use a finer encoder or faster strokes."
    )
    return SCATTER.judge(scale, f"{said}.", bad, threshold=limit)


def cut_diagnostics(scouted: Scouted, design: CutExperiment) -> dict[str, Any]:
    """What a cut's calibration is known to depend on: the encoder and the line of the teeth.

    ``counts_per_sample`` is the median over the running cracks, or over the loadings where nothing
    runs.
    """
    segments = design.likelihood.segments
    parts = [(run.motion, run.ends) for run in segments.stretches]
    if not parts:
        parts = [(p.motion, p.ends) for p in segments.pieces if p.kind != "unloading"]
    counts = [
        np.abs(np.diff(segments.motions[index].opening[ends]))
        / np.diff(ends)
        / segments.motions[index].resolution
        for index, ends in parts
    ]
    return {
        "counts_per_sample": float(np.median(np.concatenate(counts))) if counts else None,
        "teeth_line": design.likelihood.line is not None,
    }


def line_notes(scouted: Scouted, design: CutExperiment, budget: Budget | None) -> tuple[str, ...]:
    """Notes on the line of the teeth, unresolved strokes, and the budget of lack of fit."""
    notes = []
    line = scouted.accepted_line
    if line is not None:
        speeds = ", ".join(f"{speed:.2g}" for speed, _, gain in line.speeds if gain > COHERENT)
        notes.append(
            f"{line.sd:.2%} is the standard deviation of the period of the running crack's "
            f"teeth, a spectral line at stroke speeds of {speeds} rad/s. Without it kappa would "
            f"be {scouted.without:.2g}, with a large uncertainty."
        )
    elif design.law.fracture == "rippled":
        notes.append(f"Kappa is poorly determined: {scouted.reason}")
    runs = scouted.segments.stretches
    if unseen := sum(not run.resolved for run in runs):
        notes.append(
            f"In {unseen} of {len(runs)} running strokes the blades nearly stop at each tooth, and "
            "the encoder is too coarse to show whether they move back. The fit uses the teeth of "
            "these strokes, not their mean torque. Use faster strokes or a finer encoder."
        )
    if budget is None:
        return tuple(notes)
    names = design.layout.names
    shown = [
        f"{name} {sd:.2%}"
        for name, sd in zip(names, budget.sd, strict=True)
        if name in ("response_force", "response_exponent", "fracture_energy")
    ]
    allowed = max(budget.shares.values(), default=0.0)
    if allowed > 0 and shown:
        notes.append(
            f"The budget of lack of fit is {allowed:.2%} in each kind of segment. It alone gives "
            f"the standard deviations {', '.join(shown)}."
        )
    return tuple(notes)


def _foundations(friction: FitResult, edge_verdicts: tuple[Verdict, ...]) -> Verdict:
    """Whether the fits that this one uses passed their verdicts."""
    wrong = [*friction.rejected, *failed(edge_verdicts)]
    said = "; ".join(f"{verdict.scope}, {verdict.check}" for verdict in wrong)
    good = "The fits that this one uses passed their verdicts."
    bad = f"A fit that this one uses failed a verdict ({said}): correct that fit first."
    return FOUNDATIONS.judge(len(wrong), good, bad)


def _line(scouted: Scouted) -> tuple[Verdict, ...]:
    """A line at a multiple of the teeth's frequency would bias kappa by tens of percent."""
    line = scouted.accepted_line
    if line is None:
        return ()
    worst = max(line.half, line.third)
    good = (
        f"{worst:.1%} of the line's power is at a half or a third of its frequency (limit "
        f"{TEETH.threshold:.0%}): the line is the teeth's fundamental."
    )
    bad = (
        f"{worst:.0%} of the line's power is at a half or a third of its frequency (limit "
        f"{TEETH.threshold:.0%}): it may be a harmonic of the teeth, and kappa would be wrong. "
        "Capture slower strokes."
    )
    return (TEETH.judge(worst, good, bad),)


EMPTY = 0.1
"""A closing stroke cuts nothing where the material's mean torque is below this share of what
strokes through material show (their 90 % quantile)."""
THROUGH = 0.9
STALE_SHEETS = Check(
    "fit.cut stale sheets",
    "response and fracture energy, which strokes through cut material pull down: largest "
    "share of a sheet's closing strokes that cut nothing",
    at_most=0.5,
)
"""A sheet is stale where more than this share of its closing strokes cut nothing."""


@dataclass(frozen=True)
class SheetStrokes:
    """Closing strokes on one sheet of a recording, and how many of them cut nothing."""

    recording: str
    sheet: int
    strokes: int
    empty: int

    @property
    def share(self) -> float:
        """Share of the closing strokes that cut nothing."""
        return self.empty / self.strokes


def count_empty(
    motions: tuple[PathMotion, ...],
    materials: tuple[Material, ...],
    recordings: tuple[Recording, ...],
) -> tuple[SheetStrokes, ...]:
    """Count by sheet the closing strokes, and those in which the material's torque is missing.

    The torque of a stroke is the material's work over its path.
    """
    work: dict[tuple[int, int, int], float] = {}
    path: dict[tuple[int, int, int], float] = {}
    for run in find_runs(motions):
        motion = motions[run.motion]
        if not run.closing(motion):
            continue
        labels = motion.stroke[run.low : run.high]
        label = int(np.bincount(labels[labels >= 0]).argmax()) if np.any(labels >= 0) else -1
        key = (motion.recording, run.sheet, label)
        done = materials[run.motion].work
        gone = float(motion.opening[run.low] - motion.opening[run.high])
        work[key] = work.get(key, 0.0) + float(done[run.low] - done[run.high])
        path[key] = path.get(key, 0.0) + gone
    torque = {key: work[key] / path[key] for key in work}
    if not torque:
        return ()
    least = EMPTY * float(np.quantile(list(torque.values()), THROUGH))
    rows = []
    for recording, sheet in dict.fromkeys(key[:2] for key in torque):
        levels = [value for key, value in torque.items() if key[:2] == (recording, sheet)]
        name = Path(recordings[recording].source or "the recording").name
        rows.append(SheetStrokes(name, sheet, len(levels), sum(value < least for value in levels)))
    return tuple(rows)


def stale_verdict(rows: tuple[SheetStrokes, ...]) -> Verdict:
    """Judge whether every sheet was there, and fresh, for most of its strokes."""
    most = STALE_SHEETS.threshold
    stale = [row for row in rows if row.share > most]
    worst = max((row.share for row in rows), default=0.0)
    good = f"At most {worst:.0%} of a sheet's closing strokes cut nothing (limit {most:.0%})."
    named = "; ".join(
        f"sheet {row.sheet} of {row.recording}: {row.empty} of {row.strokes}" for row in stale
    )
    bad = (
        f"Closing strokes that cut nothing: {named}. The sheet was cut before, or had ended, and "
        "the fit takes the gap for weak material. Insert fresh material with its near edge at "
        "advance 0, and capture again."
    )
    return STALE_SHEETS.judge(worst, good, bad)


STARTING = "crack about to start"
FREE = "blades free of the material"


def usage_of_segments(recordings: tuple[Recording, ...], segments: Segments) -> Usage:
    """Count the samples that elastic and running segments span.

    Between the end of loading and the first running segment the crack starts at an unknown sample.
    In the rest of a stroke the blades are free of the material, or turn.
    """
    sizes = [len(recording.samples) for recording in recordings]
    masks = {
        name: tuple(np.zeros(size, dtype=bool) for size in sizes)
        for name in ("used", "inside", INVALID, STARTING)
    }
    for motion in segments.motions:
        masks["inside"][motion.recording][motion.source] = True
        masks[INVALID][motion.recording][motion.source[~motion.usable]] = True
    loaded: dict[int, list[int]] = {}
    for piece in segments.pieces:
        _mark(masks["used"], segments, piece.motion, int(piece.ends[0]), int(piece.ends[-1]))
        if piece.kind != "unloading":
            loaded.setdefault(piece.motion, []).append(int(piece.ends[-1]))
    for run in segments.stretches:
        low = int(run.ends[0])
        _mark(masks["used"], segments, run.motion, low, int(run.ends[-1]))
        motion = segments.motions[run.motion]
        before = max((end for end in loaded.get(run.motion, []) if end <= low), default=low)
        if motion.stroke[before] == motion.stroke[low]:
            _mark(masks[STARTING], segments, run.motion, before, low)
    reasons = {
        GAP: tuple(~inside for inside in masks["inside"]),
        INVALID: masks[INVALID],
        STARTING: masks[STARTING],
        FREE: masks["inside"],
    }
    return count_usage(recordings, masks["used"], reasons)


def usage_sentence(recordings: tuple[Recording, ...], usage: Usage) -> str:
    """How much of the closing strokes is used, and of which speed least."""
    kinds = [stroke.kind for recording in recordings for stroke in recording.strokes]
    closing = [row for row in usage.rows if row.stroke >= 0 and kinds[row.stroke] != "opening"]
    if not closing:
        return usage.sentence
    return Usage(tuple(closing)).sentence.replace("in strokes", "in closing strokes", 1)


def _mark(masks: tuple[Mask, ...], segments: Segments, index: int, low: int, high: int) -> None:
    motion = segments.motions[index]
    masks[motion.recording][motion.source[low : high + 1]] = True


def counted(
    recordings: tuple[Recording, ...], usable: tuple[Mask, ...], motions: Sequence[PathMotion]
) -> str:
    """What is left of the recordings after each filter of a fit of cuts, in seconds."""
    ticks = [recording.duration_s / max(len(recording.samples) - 1, 1) for recording in recordings]
    recorded = sum(tick * len(good) for tick, good in zip(ticks, usable, strict=True))
    sound = sum(tick * np.count_nonzero(good) for tick, good in zip(ticks, usable, strict=True))
    kept = under = moving = 0.0
    for motion in motions:
        counts = motion.usable & (np.diff(motion.source, prepend=-1) > 0)
        below = counts & (motion.sheet >= 0)
        kept += motion.tick_s * np.count_nonzero(counts)
        under += motion.tick_s * np.count_nonzero(below)
        moving += motion.tick_s * np.count_nonzero(below & ~motion.standing)
    return (
        f"Of {recorded:.3g} s recorded, {sound:.3g} s are sound, {kept:.3g} s of these lie in "
        f"stretches long enough, {under:.3g} s of these have a sheet in place, and in {moving:.3g} "
        "s of these the blades move."
    )
