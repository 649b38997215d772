"""Diagnostics of the inference, each with what it tells."""

from dataclasses import dataclass

from scissorcal.calibration.checks import K_HAT_LIMIT
from scissorcal.calibration.result import FitResult
from scissorcal.report.numbers import Scalar, scalar

MEANINGS = {
    "k_hat": f"Tail of the importance weights: below {K_HAT_LIMIT} the draws can be used.",
    "effective_samples": "What the posterior draws are worth as independent ones.",
    "evaluations": "Times the model was evaluated.",
    "observations": "Bins of data that entered the likelihood.",
    "independent_share": "Share of these that are worth an independent one.",
    "whiteness_p": "Chance of residuals at least this correlated if they were white.",
    "first_lag_autocorrelation": "Correlation of a residual with its neighbour.",
    "largest_inflation": "Factor by which correlated residuals widened the widest interval.",
    "residual_rms": "Root mean square of measured minus model.",
    "relative_error": "The same over the root mean square of what was measured.",
    "r_squared": "Share of the data's variance that the law explains.",
    "starts_agreeing": "Starts of the search that ended at the same place.",
    "search": "How the search ended.",
    "rate_floor": "Slower samples were left out: the sign of their rate is noise.",
    "bin_s": "Length of a bin, in seconds.",
    "noise": "Standard deviation of the residuals.",
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
