"""The study of a finished fit from what it was made of, and its check without a workspace."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from scissorcal.aliases import Progress
from scissorcal.calibration.assemble import MOST_POINTS
from scissorcal.calibration.cut.fit import cut_experiment
from scissorcal.calibration.cut.own_law import as_law_fit, of_own_law
from scissorcal.calibration.fit_model import Experiment
from scissorcal.calibration.friction.fit import friction_experiment
from scissorcal.calibration.result import FitResult
from scissorcal.calibration.verify.check import StudySettings, assess, make_study, tasks_of
from scissorcal.calibration.verify.result import CHECKS, VerifyResult
from scissorcal.calibration.verify.simulator import Simulator, cut_simulator, friction_simulator
from scissorcal.calibration.verify.study import Study, run
from scissorcal.errors import InputError
from scissorcal.model import EdgeDistribution, ResponseLaw
from scissorcal.recipe.schema import FitFriction, Recipe
from scissorcal.recording.recording import Recording


@dataclass(frozen=True)
class Known:
    """A fit in the parameters that it is checked in, its design and its simulator.

    ``sheets`` has the sheet of each stroke, where there are several.
    """

    fit: FitResult
    experiment: Experiment
    simulator: Simulator
    sheets: dict[int, int]

    def __post_init__(self) -> None:
        """Refuse data that the fit was not made of: their checks would be of something else."""
        measured, fitted = self.experiment.observed, self.fit.series.measured
        kept = measured[:: max(1, -(-len(measured) // MOST_POINTS))]
        if kept.shape != fitted.shape or not np.allclose(kept, fitted, rtol=1e-9, atol=1e-12):
            raise InputError(
                f"This fit of {self.fit.what} was not made of these recordings with this recipe: "
                "give those that it was made of, all of them and unchanged."
            )

    def study(self, settings: StudySettings) -> Study:
        """All that the fits of a check depend on."""
        return make_study(self.experiment, self.fit, self.simulator, settings, self.sheets)


def known_friction(
    recordings: tuple[Recording, ...], settings: FitFriction, fit: FitResult
) -> Known:
    """What checks a fit of friction; recordings and settings are those that it was made of."""
    design = friction_experiment(recordings, settings, fit)
    return Known(fit, design, friction_simulator(recordings, settings, fit, design.layout), {})


def known_cut(
    recordings: tuple[Recording, ...],
    recipe: Recipe,
    friction: FitResult,
    fit: FitResult,
    edge: EdgeDistribution | None = None,
    law: ResponseLaw | None = None,
) -> Known:
    """What checks a fit of a cut; ``law`` is the law of one's own that it was fitted with.

    Raises InputError where such a fit comes without its law, or with another.
    """
    name = of_own_law(fit)
    if name and law is None:
        raise InputError(
            f"This fit is of a law of your own, {name}, whose code no file holds: give it "
            "(law=...) to scissorcal.verify_fit()."
        )
    if law is not None:
        fit = as_law_fit(fit, law)
    design = cut_experiment(recordings, recipe, friction, fit, edge)
    simulator = cut_simulator(recordings, recipe, friction, fit, design.layout, edge)
    return Known(fit, design, simulator, _sheets(recordings))


def check_fit(
    known: Known, settings: StudySettings, fits: int, progress: Progress | None = None
) -> VerifyResult:
    """Make all checks of a fit in this process, one fit after another."""
    study = known.study(settings)
    tasks = tasks_of(study, CHECKS, fits)
    records = []
    for done, task in enumerate(tasks):
        if progress is not None:
            stage = f"{known.fit.what}: checking intervals"
            progress(done / len(tasks), f"{stage} ({done} of {len(tasks)} fits)")
        records.append(run(study, task))
    return assess(study, known.fit, CHECKS, records)


def _sheets(recordings: Sequence[Recording]) -> dict[int, int]:
    """Number the sheets of all recordings, by the stroke labels that a fit gives."""
    found: dict[int, int] = {}
    numbers: dict[tuple[int, int], int] = {}
    offset = 0
    for index, recording in enumerate(recordings):
        for stroke in recording.strokes:
            if stroke.sheet >= 0:
                sheet = numbers.setdefault((index, stroke.sheet), len(numbers))
                found[offset + stroke.index] = sheet
        offset += len(recording.strokes)
    return found
