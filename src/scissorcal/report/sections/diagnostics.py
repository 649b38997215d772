"""Diagnostics of the inference, each with what it tells."""

from dataclasses import dataclass

from scissorcal.calibration.result import FitResult
from scissorcal.report.numbers import Scalar, scalar

MEANINGS = {
    "k_hat": "Tail of the importance weights: below 0.7 the draws can be used.",
    "ess": "Effective number of posterior draws.",
    "effective": "Effective number of posterior draws.",
    "evaluations": "Times the model was evaluated.",
    "whiteness_p": "Chance of residuals at least this correlated if they were white.",
    "residual_rms": "Root mean square of measured minus model.",
    "noise_sd": "Standard deviation of the noise the likelihood assumes.",
    "inflation": "Factor by which correlated noise widens the intervals.",
    "null": "Directions that the data leave to the prior, by parameter.",
    "samples": "Samples that entered the likelihood.",
    "seconds": "Time the fit took.",
}


@dataclass(frozen=True)
class Diagnostic:
    """One diagnostic; ``meaning`` is empty where the report knows no words for it."""

    name: str
    value: Scalar
    meaning: str


def list_diagnostics(fit: FitResult) -> tuple[Diagnostic, ...]:
    """The fit's diagnostics in its own order."""
    return tuple(
        Diagnostic(str(name), scalar(value), MEANINGS.get(str(name), ""))
        for name, value in fit.diagnostics.items()
    )
