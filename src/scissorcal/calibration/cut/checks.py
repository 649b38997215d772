"""Verdicts and notes that only a cut's fit has."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.cut.lack_of_fit import Budget
from scissorcal.calibration.cut.model import CutExperiment
from scissorcal.calibration.cut.scout import Scouted
from scissorcal.calibration.cut.stale import count_empty, stale_verdict
from scissorcal.calibration.cut.teeth import COHERENT
from scissorcal.calibration.result import FitResult
from scissorcal.calibration.signals.sensors import Sensors
from scissorcal.recording.recording import Recording
from scissorcal.verdicts import Verdict, failed, judge

Array = NDArray[np.float64]

SUBHARMONIC = 0.3
"""Power at a half or a third of the line's frequency over its own; a harmonic has more than 1."""


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
        replace(sensors.verdict, scope="fit.cut"),
        stale_verdict(count_empty(scouted.segments.motions, scouted.materials, recordings)),
        *_line(scouted),
    )


def cut_diagnostics(scouted: Scouted, design: CutExperiment) -> dict[str, Any]:
    """What is known to matter for a cut's calibration: encoder, line, fresh sheets.

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


def line_notes(scouted: Scouted, design: CutExperiment, budget: Budget) -> tuple[str, ...]:
    """What the teeth say, what each sheet's toughness was, and what lack of fit was allowed for."""
    notes = []
    if scouted.believed and scouted.line is not None:
        speeds = ", ".join(
            f"{speed:.2g}" for speed, _, gain in scouted.line.speeds if gain > COHERENT
        )
        notes.append(
            f"The teeth of the running crack show as a line whose period is known to "
            f"{scouted.line.sd:.2%}, at stroke speeds of {speeds} rad/s; without it kappa would be "
            f"{scouted.without:.2g}, weakly known."
        )
    elif design.law.fracture == "rippled":
        notes.append(f"kappa is open: {scouted.reason}")
    runs = scouted.segments.stretches
    if unseen := sum(not run.resolved for run in runs):
        notes.append(
            f"In {unseen} of {len(runs)} running strokes the blades nearly stop at each tooth, and "
            "the encoder is too coarse to show whether they swing back: only the teeth of these "
            "strokes count, not their mean torque. Faster strokes or a finer encoder would help."
        )
    names = design.layout.names
    shown = [
        f"{name} {sd:.2%}"
        for name, sd in zip(names, budget.sd, strict=True)
        if name in ("response_force", "response_exponent", "fracture_energy")
    ]
    allowed = max(budget.shares.values(), default=0.0)
    if allowed > 0 and shown:
        notes.append(
            f"A lack of fit of up to {allowed:.2%} in each kind of segment was allowed for: by "
            f"itself it is worth a standard deviation of {', '.join(shown)}."
        )
    return tuple(notes)


def _foundations(friction: FitResult, edge_verdicts: tuple[Verdict, ...]) -> Verdict:
    """Whether what the fit builds on may be used at all."""
    wrong = [*friction.rejected, *failed(edge_verdicts)]
    said = "; ".join(f"{verdict.scope}, {verdict.check}" for verdict in wrong)
    good = "The fits that this one builds on passed their verdicts."
    bad = f"A fit that this one builds on failed a verdict ({said}): correct and refit it first."
    return judge("fit.cut", "foundations", len(wrong), 0.0, good, bad)


def _line(scouted: Scouted) -> tuple[Verdict, ...]:
    """A line at a multiple of the teeth's frequency would put kappa off by tens of percent."""
    line = scouted.line
    if line is None or not scouted.believed:
        return ()
    worst = max(line.half, line.third)
    good = (
        f"At a half and a third of the teeth's frequency there is {worst:.1%} of the line's "
        "power at most, so the line is the teeth's own."
    )
    bad = (
        f"There is {worst:.0%} of the line's power at a half or a third of its frequency: it may "
        "be a multiple of the teeth's, and kappa is then wrong. Capture slower strokes."
    )
    return (judge("fit.cut", "teeth", worst, SUBHARMONIC, good, bad),)
