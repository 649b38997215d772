"""The fits of a verification: truths drawn from a prior, simulated and fitted again."""

import json
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.calibration.fit_model import Experiment
from scissorcal.calibration.parameters import StatedPrior
from scissorcal.calibration.result import Effort, FitResult
from scissorcal.calibration.verify.result import PriorKind
from scissorcal.calibration.verify.simulator import Simulator
from scissorcal.calibration.verify.statistics import Split, power_sensitivity, rank_among
from scissorcal.errors import MissingError, ScissorcalError
from scissorcal.inference import Posterior, infer, ljung_box

Kind = Literal["simulated", "half", "whole"]
Record = Mapping[str, Any]

LEVELS = 200
"""Possible ranks: central intervals of 50 % and 90 % are whole numbers of them."""

EFFORT = "effort_rms"
"""Name of the predicted effort: its rms over the motion, which depends on all parameters."""

_KINDS: tuple[Kind, ...] = ("simulated", "half", "whole")


@dataclass(frozen=True)
class Task:
    """One fit of a verification: to simulated data, to a half of the data, or to all of them."""

    kind: Kind
    index: int


@dataclass(frozen=True)
class Study:
    """The input of every fit of a verification.

    ``generating`` gives truths, ``simulator`` raw data of them and their whole fit; ``start`` (p,)
    is the fit's posterior mean, ``draws`` the number of draws of the posteriors of halves and
    whole; ``split`` gives the halves (None where there are none). ``between`` (p,) is the fit's
    variance between recordings, if any.
    """

    experiment: Experiment
    simulator: Simulator
    effort: Effort
    seed: int
    generating: "Generating"
    start: Array
    draws: int
    split: Split | None
    between: Array | None = None

    @property
    def law(self) -> str:
        """The fit's law in words."""
        return self.experiment.candidate(self.experiment.observed).name

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

    The result holds plain finite numbers alone, for one line of JSON. A fit
    that fails numerically, or refuses the data with an error of scissorcal, yields ``{"broken":
    sentence}``; other errors are raised.
    """
    key = (_KINDS.index(task.kind), task.index)
    sequence = np.random.SeedSequence(study.seed, spawn_key=key)
    rng = np.random.default_rng(sequence)
    began = time.perf_counter()
    try:
        record = _DO[task.kind](study, task.index, rng)
        json.dumps(record, allow_nan=False)
    except (ArithmeticError, np.linalg.LinAlgError, ValueError, ScissorcalError) as error:
        record = {"broken": f"{type(error).__name__}: {error}"}
    seconds = round(time.perf_counter() - began, 3)
    return {"kind": task.kind, "index": task.index, **record, "seconds": seconds}


def _simulated(study: Study, index: int, rng: np.random.Generator) -> dict[str, Any]:
    """Draw a truth, simulate raw recordings of it, fit them as a whole, and rank it.

    Where the refit chose another law, quantities without the same meaning in it have no rank.
    """
    truth = study.generating.draw(rng)
    data = study.simulator.simulate(truth, rng)
    prior = refit_prior(study.experiment, study.generating)
    fit = study.simulator.refit(data, prior, study.effort, rng)
    chosen = rng.choice(len(fit.draws), LEVELS - 1, replace=len(fit.draws) < LEVELS - 1)
    truths = quantities(study, truth[None, :])[0]
    columns = _shown(study, fit, chosen)
    known = [i for i, column in enumerate(columns) if column is not None]
    drawn = np.stack([column for column in columns if column is not None], axis=1)
    ranks: list[int | None] = [None] * len(truths)
    for i, rank in zip(known, rank_among(drawn, truths[known], rng).tolist(), strict=True):
        ranks[i] = rank
    return {
        "ranks": ranks,
        "truths": truths.tolist(),
        "law": fit.candidate,
        "effective": float(fit.diagnostics["effective_samples"]),
        "effort": fit.diagnostics["effort_reached"],
        "trusted": _passes(fit, "k-hat"),
        "settled": _passes(fit, "optimum"),
    }


def _shown(study: Study, fit: FitResult, chosen: NDArray[np.int64]) -> list[Array | None]:
    """Chosen draws of every quantity, None for those that the fit's law does not have."""
    try:
        u = unconstrained_draws(study.experiment, fit, chosen)
    except MissingError:
        u = None
    candidate = study.experiment.candidate(study.experiment.observed)
    if u is not None and fit.candidate == candidate.name:
        return list(quantities(study, u).T)
    names = [parameter.name for parameter in fit.parameters]
    other = []
    if fit.structure.get("response") != candidate.key.get("response"):
        other = [n for n in names if n.startswith("response_") and n != "response_force"]
    if fit.structure.get("fracture") != candidate.key.get("fracture"):
        other += ["fracture_energy", "toughness"]
    columns: list[Array | None] = [
        fit.column(name)[chosen] if name in names and name not in other else None
        for name in study.quantities[:-1]
    ]
    return [*columns, None]


def unconstrained_draws(
    experiment: Experiment, fit: FitResult, chosen: NDArray[np.int64] | None = None
) -> Array:
    """A fit's draws with those of its nuisance parameters, in unconstrained coordinates (n, p).

    ``chosen`` (n,) picks draws, all if None. Raises MissingError where the fit lacks a parameter.
    """
    columns, layout = fit.columns, experiment.layout
    missing = [name for name in layout.names if name not in columns]
    if missing:
        raise MissingError(
            f"The fit of {fit.what} holds no draws of {', '.join(missing)}: an earlier version "
            f"made it. Run 'scissorcal fit {fit.words} --force' first."
        )
    rows = range(len(fit.draws)) if chosen is None else chosen.tolist()
    return np.stack(
        [layout.unconstrained({n: float(columns[n][row]) for n in layout.names}) for row in rows]
    )


def _half(study: Study, index: int, rng: np.random.Generator) -> dict[str, Any]:
    assert study.split is not None
    experiment = study.experiment
    keep = study.split.first if index == 0 else study.split.second
    candidate = replace(experiment.candidate(experiment.observed), starts=study.start[None, :])
    series = _unbroken(experiment.series, keep)
    posterior = infer(candidate.problem(series, keep), study.effort, rng, count=study.draws)
    residuals = candidate.likelihood.standardised(posterior.optimum.point)
    white = ljung_box(residuals[keep], series[keep])
    return {
        "mean": posterior.draws.mean(axis=0).tolist(),
        "covariance": np.cov(posterior.draws, rowvar=False).tolist(),
        "independent": float(white.share * np.count_nonzero(keep)),
        **_diagnostics(posterior),
    }


def _whole(study: Study, index: int, rng: np.random.Generator) -> dict[str, Any]:
    """Sensitivities of the fit's own posterior to the powers of its prior and likelihood.

    What other measurements told of a parameter (the zero of a sensor, in idle seconds) is no prior
    that a recipe states, and keeps its weight.
    """
    experiment = study.experiment
    candidate = replace(experiment.candidate(experiment.observed), starts=study.start[None, :])
    posterior = infer(candidate.problem(experiment.series), study.effort, rng, count=study.draws)
    shown = quantities(study, posterior.draws)
    stated = [i for i in study.wanted if not experiment.layout.parameters[i].measured_prior]
    away = (posterior.draws - candidate.prior_mean)[:, stated]
    precision = candidate.prior_precision[np.ix_(stated, stated)]
    log_prior = -0.5 * np.einsum("ni,ij,nj->n", away, precision, away)
    from_prior = posterior.draws - candidate.prior_mean
    whole_prior = -0.5 * np.einsum("ni,ij,nj->n", from_prior, candidate.prior_precision, from_prior)
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


def _passes(fit: FitResult, check: str) -> bool:
    return all(verdict.check != check or verdict.status != "fail" for verdict in fit.verdicts)


def _diagnostics(posterior: Posterior) -> dict[str, Any]:
    return {
        "effective": posterior.effective,
        "effort": posterior.effort_reached,
        "trusted": posterior.effort_reached == "draft" or posterior.status.trusted,
        "settled": bool(posterior.optimum.success),
    }


_DO: Mapping[Kind, Callable[[Study, int, np.random.Generator], dict[str, Any]]] = {
    "simulated": _simulated,
    "half": _half,
    "whole": _whole,
}


NOT_SIMULATED = ("noise", "noise_scale", "rest_phase", "rest_spread")
"""Parameters of a likelihood that a simulation does not take from the truth: the size of the noise
of its terms, and where in a tooth's cycle cracks come to rest. A simulated crack walks with other
teeth along the recorded motion, so it turns at any phase."""


@dataclass(frozen=True)
class Generating:
    """A normal distribution of unconstrained parameters, for truths and as the refits' prior.

    ``mean`` (p,), ``precision`` (p, p); see `generating_prior` for ``kind`` and ``spread``.
    """

    kind: PriorKind
    spread: float
    mean: Array
    precision: Array

    @property
    def words(self) -> str:
        """Its description, for people."""
        if self.kind == "recipe":
            return "the recipe's prior"
        return (
            f"a normal distribution around the posterior, {self.spread:g} times as wide and within "
            "the recipe's prior"
        )

    def draw(self, rng: np.random.Generator) -> Array:
        """Draw one point (p,)."""
        root = np.linalg.cholesky(self.precision)
        return np.asarray(self.mean + np.linalg.solve(root.T, rng.standard_normal(len(self.mean))))


def generating_prior(
    experiment: Experiment, draws: Array, kind: PriorKind, spread: float
) -> Generating:
    """The distribution of truths, given the posterior's unconstrained ``draws`` (n, p).

    "local": the recipe's prior times the likelihood raised to 1 / ``spread``^2, as a normal
    distribution. It is ``spread`` times as wide as the posterior where the data are informative and
    never wider than the prior, so that calibration is tested near the posterior: a recipe's prior
    spans factors of 100, and most of its draws are far from any material. The same distribution is
    the refits' prior, so ranks are uniform for a calibrated inference. Posterior calibration
    (Säilynoja et al. 2025, arXiv:2502.03279) conditions on the data in the same way, but with their
    full weight, so that the simulated data add little.

    "recipe": the recipe's own prior, for simulated fits and refits.
    """
    candidate = experiment.candidate(experiment.observed)
    prior = candidate.prior_precision
    if kind == "recipe":
        return Generating(kind, 1.0, candidate.prior_mean, prior)
    scale = experiment.layout.sd
    unit = np.outer(scale, scale)
    posterior = np.linalg.inv(np.cov(draws, rowvar=False) / unit)
    values, vectors = np.linalg.eigh(posterior - prior * unit)
    likelihood = (vectors * np.maximum(values, 0.0)) @ vectors.T / unit
    return Generating(kind, spread, draws.mean(axis=0), prior + likelihood / spread**2)


def refit_prior(experiment: Experiment, generating: Generating) -> StatedPrior:
    """The prior of fits to simulated data: the distribution of their truths.

    What is ``NOT_SIMULATED`` keeps the recipe's prior: simulated data do not come from its truth.
    """
    candidate = experiment.candidate(experiment.observed)
    names = experiment.layout.names
    kept = [i for i, name in enumerate(names) if name not in NOT_SIMULATED]
    mean = generating.mean if generating.kind == "local" else candidate.prior_mean
    covariance: Array = np.asarray(np.linalg.inv(generating.precision))
    return StatedPrior(
        tuple(names[i] for i in kept),
        mean[kept],
        covariance[np.ix_(kept, kept)],
        str(candidate.key.get("response", "")),
    )


def _unbroken(series: NDArray[np.int64], kept: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Labels (n,) of the contiguous stretches where only ``kept`` bins of ``series`` are used.

    >>> _unbroken(np.array([0, 0, 0, 0, 1]), np.array([True, True, False, True, True]))
    array([0, 0, 1, 2, 3])
    """
    turns = (np.diff(series) != 0) | (np.diff(kept.astype(np.int64)) != 0)
    return np.concatenate([[0], np.cumsum(turns)]).astype(np.int64)
