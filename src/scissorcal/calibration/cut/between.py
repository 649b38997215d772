"""Differences between recordings of a cut: each fitted alone, each predicted from the others."""

from dataclasses import replace

import numpy as np

from scissorcal.aliases import Array, Mask
from scissorcal.calibration.between import BetweenRecordings, FitsApart, gather_recordings
from scissorcal.calibration.cut.model import CutExperiment
from scissorcal.inference import Posterior, find_optimum, infer
from scissorcal.recording.recording import Recording

NOT_KNOWN = (
    "One recording: the variation of material and rig between recordings is unknown, and the "
    "intervals do not include it. Record the same material again, after a new set-up or on another "
    "day."
)


def compare_cuts(
    design: CutExperiment,
    point: Array,
    recordings: tuple[Recording, ...],
    usual: float,
    rng: np.random.Generator,
) -> BetweenRecordings | None:
    """Fit every recording alone, and from the others; None where fewer than two can be fitted.

    ``design`` is the law over all recordings, ``point`` (p,) its optimum, from which each search
    begins, ``usual`` the share by which recordings usually differ. No two recordings share a sheet,
    so that segments belong to one each. The line of the teeth is left out, since it is one number
    for all recordings.
    """
    design = replace(design, likelihood=replace(design.likelihood, line=None), _last={})
    rung = replace(design.candidate(design.observed), starts=point[None, :])

    def own(here: Mask) -> Posterior:
        problem = rung.problem(design.series, here)
        return infer(problem, "draft", rng, optimum=find_optimum(problem))

    def others(here: Mask) -> Array:
        return find_optimum(rung.problem(design.series, ~here)).point

    return gather_recordings(design, point, recordings, FitsApart(own, others), usual, rng)


def between_notes(between: BetweenRecordings | None, nuisance: tuple[str, ...]) -> tuple[str, ...]:
    """Notes on the differences between recordings, or that they are unknown."""
    return between.notes(nuisance) if between else (NOT_KNOWN,)
