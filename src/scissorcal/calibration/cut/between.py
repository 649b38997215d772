"""What differs between recordings of a cut: each fitted by itself, each predicted by the rest."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.between import BetweenRecordings, FitsApart, gather_recordings
from scissorcal.calibration.cut.model import CutExperiment
from scissorcal.inference import Posterior, find_optimum, infer
from scissorcal.recording.recording import Recording

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

NOT_KNOWN = (
    "There is one recording: how much the material and the rig vary from recording to recording is "
    "not known, and the intervals do not include it. Cut the same material again, after setting up "
    "anew or on another day."
)


def compare_cuts(
    design: CutExperiment,
    point: Array,
    recordings: tuple[Recording, ...],
    rng: np.random.Generator,
) -> BetweenRecordings | None:
    """Fit every recording by itself and by the others; None where fewer than two can be.

    ``design`` is the law over all recordings, ``point`` (p,) its optimum, from which each search
    begins. No two recordings share a sheet, so that segments belong to one each. The line of the
    teeth is left out: it is one number for all recordings, and what it says of kappa is not
    compared.
    """
    # One line is read off all recordings together, so it says nothing of their differences.
    design = replace(design, likelihood=replace(design.likelihood, line=None), _last={})
    rung = replace(design.candidate(design.observed), starts=point[None, :])

    def own(here: Mask) -> Posterior:
        problem = rung.problem(design.series, here)
        return infer(problem, "draft", rng, optimum=find_optimum(problem))

    def others(here: Mask) -> Array:
        return find_optimum(rung.problem(design.series, ~here)).point

    return gather_recordings(
        design, design.bins.recording, point, recordings, FitsApart(own, others), rng
    )


def between_notes(between: BetweenRecordings | None, nuisance: tuple[str, ...]) -> tuple[str, ...]:
    """What recordings differ in, or that it is not known."""
    return between.notes(nuisance) if between else (NOT_KNOWN,)
