"""Verdicts and notes that only a cut's fit has."""

import math
from typing import Any

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.cut.lack_of_fit import Budget
from scissorcal.calibration.cut.model import CutExperiment
from scissorcal.calibration.cut.scout import Scouted
from scissorcal.calibration.cut.stale import count_empty, stale_verdict
from scissorcal.calibration.cut.teeth import COHERENT
from scissorcal.calibration.result import FitResult
from scissorcal.calibration.signals.sensors import Sensors
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
