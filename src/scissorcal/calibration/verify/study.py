"""The fits of a trust check, each one by itself: picklable in, plain numbers out."""

import json
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.experiment import Experiment
from scissorcal.calibration.result import Effort
from scissorcal.calibration.verify.generating import (
    Generating,
    refit_prior,
    simulate,
    unbroken,
)
from scissorcal.calibration.verify.halves import Split
from scissorcal.calibration.verify.power import power_sensitivity
from scissorcal.calibration.verify.uniformity import rank_among
from scissorcal.inference import ArNoise, Posterior, infer, ljung_box

Array = NDArray[np.float64]
Kind = Literal["simulated", "half", "whole"]
Record = Mapping[str, Any]

LEVELS = 200
"""Possible ranks: central intervals of 50 % and 90 % are whole numbers of them."""

EFFORT = "effort_rms"
"""Name of what all parameters predict together: the rms of the expected effort over the motion."""

_KINDS: tuple[Kind, ...] = ("simulated", "half", "whole")


@dataclass(frozen=True)
class Task:
    """One fit of a trust check: to simulated data, to a half of the data, or to all of them."""

    kind: Kind
    index: int


@dataclass(frozen=True)
class Study:
    """All that any fit of a trust check needs.

    ``generating`` and ``noise`` make simulated data; ``start`` (p,) is where the fit ended,
    ``draws`` how many are taken of each posterior; ``split`` parts the data (None where it cannot
    be parted). ``between`` (p,) is the variance between recordings that the fit claims, if any.
    """

    experiment: Experiment
    effort: Effort
    seed: int
    generating: Generating
    noise: ArNoise
    start: Array
    draws: int
    split: Split | None
    between: Array | None = None

    @property
    def wanted(self) -> list[int]:
        """Columns of the parameters that are reported."""
        layout = self.experiment.layout
        return [i for i, n in enumerate(layout.names) if n not in self.experiment.nuisance]

    @property
    def quantities(self) -> tuple[str, ...]:
        """Names of what is ranked and scaled: reported parameters, and the predicted effort."""
        return (*(self.experiment.layout.names[i] for i in self.wanted), EFFORT)


def run(study: Study, task: Task) -> Record:
    """Do one fit; the same numbers for the same study and task, wherever it runs.

    The result holds plain finite numbers alone, so that it can stand as one line of JSON. A fit
    that breaks on its numbers yields ``{"broken": sentence}``; other errors are raised.
    """
    key = (_KINDS.index(task.kind), task.index)
    sequence = np.random.SeedSequence(study.seed, spawn_key=key)
    rng = np.random.default_rng(sequence)
    began = time.perf_counter()
    try:
        found = _DO[task.kind](study, task.index, rng)
        json.dumps(found, allow_nan=False)
    except (ArithmeticError, np.linalg.LinAlgError, ValueError) as error:
        found = {"broken": f"{type(error).__name__}: {error}"}
    seconds = round(time.perf_counter() - began, 3)
    return {"kind": task.kind, "index": task.index, **found, "seconds": seconds}


def _simulated(study: Study, index: int, rng: np.random.Generator) -> dict[str, Any]:
    experiment, generating = study.experiment, study.generating
    truth = generating.draw(rng)
    measured = simulate(experiment, study.noise, generating.mean, truth, rng)
    rung = experiment.rung(measured)
    if generating.kind == "local":
        mean, precision = refit_prior(experiment, generating)
        rung = replace(
            rung,
            prior_mean=mean,
            prior_precision=precision,
            starts=generating.mean[None, :],
        )
    posterior = infer(rung.problem(experiment.series), study.effort, rng, count=study.draws)
    chosen = posterior.draws[rng.choice(len(posterior.draws), LEVELS - 1, replace=False)]
    truths = quantities(study, truth[None, :])
    ranks = rank_among(quantities(study, chosen), truths[0], rng)
    return {"ranks": ranks.tolist(), "truths": truths[0].tolist(), **_diagnostics(posterior)}


def _half(study: Study, index: int, rng: np.random.Generator) -> dict[str, Any]:
    assert study.split is not None
    experiment = study.experiment
    keep = study.split.first if index == 0 else study.split.second
    rung = replace(experiment.rung(experiment.observed), starts=study.start[None, :])
    series = unbroken(experiment.series, keep)
    posterior = infer(rung.problem(series, keep), study.effort, rng, count=study.draws)
    residuals = rung.likelihood.standardised(posterior.optimum.point)
    white = ljung_box(residuals[keep], series[keep])
    return {
        "mean": posterior.draws.mean(axis=0).tolist(),
        "covariance": np.cov(posterior.draws, rowvar=False).tolist(),
        "independent": float(white.share * np.count_nonzero(keep)),
        **_diagnostics(posterior),
    }


def _whole(study: Study, index: int, rng: np.random.Generator) -> dict[str, Any]:
    """Sensitivities of the fit's own posterior to the powers of its prior and likelihood."""
    experiment = study.experiment
    rung = replace(experiment.rung(experiment.observed), starts=study.start[None, :])
    posterior = infer(rung.problem(experiment.series), study.effort, rng, count=study.draws)
    shown = quantities(study, posterior.draws)
    wanted = study.wanted
    away = (posterior.draws - rung.prior_mean)[:, wanted]
    own = rung.prior_precision[np.ix_(wanted, wanted)]
    log_prior = -0.5 * np.einsum("ni,ij,nj->n", away, own, away)
    every = posterior.draws - rung.prior_mean
    whole_prior = -0.5 * np.einsum("ni,ij,nj->n", every, rung.prior_precision, every)
    log_likelihood = np.array([posterior.log_posterior(u) for u in posterior.draws]) - whole_prior
    return {
        "prior": power_sensitivity(shown, log_prior).tolist(),
        "likelihood": power_sensitivity(shown, log_likelihood).tolist(),
        **_diagnostics(posterior),
    }


def quantities(study: Study, points: Array) -> Array:
    """Reported parameters in their units, and the rms effort they predict: (n, quantities)."""
    natural = study.experiment.layout.columns(points)[:, study.wanted]
    effort = [float(np.sqrt(np.mean(study.experiment.mean(u) ** 2))) for u in points]
    return np.column_stack([natural, effort])


def _diagnostics(posterior: Posterior) -> dict[str, Any]:
    k = posterior.k_hat
    return {
        "k_hat": k if np.isfinite(k) else None,
        "effective": posterior.effective,
        "effort": posterior.effort_reached,
        "settled": bool(posterior.optimum.success),
    }


_DO: Mapping[Kind, Callable[[Study, int, np.random.Generator], dict[str, Any]]] = {
    "simulated": _simulated,
    "half": _half,
    "whole": _whole,
}
