"""The law that is used: chosen among candidates, fitted with the noise that its residuals have."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.comparison import NEGLIGIBLE, choose
from scissorcal.calibration.fit_candidate import FittedCandidate, fit_candidate
from scissorcal.calibration.friction.model import FrictionExperiment
from scissorcal.inference import Stop, tails_of

Progress = Callable[[float, str], None]

OUTLIERS = 4.0
"""Student-t noise of at most this many degrees of freedom, whose kurtosis is infinite, takes the
place of normal noise; milder tails are left to the widening by the scores."""


def choose_law(
    laws: list[FrictionExperiment], lack_of_fit: float, stop: Stop | None, tell: Progress
) -> tuple[list[FittedCandidate], FittedCandidate, FrictionExperiment]:
    """Fit every candidate law and choose one.

    The fits of all laws, that of the chosen one, and its design. The chosen law is fitted again
    with a Student-t noise where its residuals have outliers; that fit takes the place of the first.
    A share ``lack_of_fit`` of the drive that is stated as the law's error is what makes laws
    differ, and residuals below it have no outliers.
    """
    compared: list[FittedCandidate] = []
    for index, law in enumerate(laws):
        tell(0.6 * index / len(laws), f"friction: trying {law.name}")
        compared.append(fit_candidate(law.candidate(law.observed), law.series, law.strokes, stop))
    drive = _rms(laws[0].observed)
    chosen = choose(compared, drive, lack_of_fit or NEGLIGIBLE)
    place = next(i for i, one in enumerate(compared) if one.candidate is chosen.candidate)
    law = replace(laws[place], share=chosen.candidate.share)
    likelihood, point = chosen.candidate.likelihood, chosen.optimum.point
    if _rms(likelihood.residuals(point)) < lack_of_fit * drive:
        return compared, chosen, law
    tails = tails_of(likelihood.standardised(point), chosen.share)
    if tails > OUTLIERS:
        return compared, chosen, law
    robust = replace(law, tails=tails).candidate(law.observed)
    again = fit_candidate(replace(robust, starts=point[None, :]), law.series, law.strokes)
    compared[place] = replace(again, equivalent=chosen.equivalent)
    return compared, compared[place], law


def _rms(values: NDArray[np.float64]) -> float:
    return float(np.sqrt(np.mean(values**2)))
