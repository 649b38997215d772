"""Climbing a ladder of laws: each rung judged by strokes that it has not seen."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.layout import Layout
from scissorcal.inference import (
    Optimum,
    Problem,
    find_optimum,
    gradient,
    likelihood_information,
    ljung_box,
    natural_step,
)

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

FOLDS = 4
NEGLIGIBLE = 0.0175
"""Share of the signal below which an error does not matter: a quarter of the 7 % that people
just notice in a force (Jones 2000, Kinesthetic sensing)."""
FALSE_ALARM = 0.05
FEWEST_FOR_RANKS = 6
"""With fewer strokes no ranking can reach 5 %, and the evidence alone decides."""

POSITIVE_EVIDENCE = 3.0
"""Held-out log density, counting independent observations only, that a better rung must gain: a
factor of 20 (Kass and Raftery 1995, doi:10.1080/01621459.1995.10476572, call this strong)."""

SEARCH_REACH = 8.0
"""Half-width of the search, in prior standard deviations."""


@dataclass(frozen=True)
class Likelihood:
    """A law's likelihood before its prior.

    ``residuals`` (u) are measured minus predicted (n,). ``normal`` (u) gives them over each bin's
    standard deviation, with the logarithm of the latter, both (n,).
    """

    residuals: Callable[[Array], Array]
    normal: Callable[[Array], tuple[Array, Array]]

    def standardised(self, u: Array) -> Array:
        """Residuals over their standard deviations (n,)."""
        return self.normal(u)[0]

    def terms(self, u: Array) -> Array:
        """Log-likelihood by bin (n,), up to a constant."""
        z, log_sd = self.normal(u)
        return np.asarray(-0.5 * z**2 - log_sd)


@dataclass(frozen=True)
class Rung:
    """One law of a ladder, ready to be fitted. ``key`` holds its discrete choices."""

    name: str
    key: Mapping[str, Any]
    layout: Layout
    likelihood: Likelihood
    starts: Array
    prior_mean: Array
    prior_precision: Array

    def problem(self, series: Integers, keep: NDArray[np.bool_] | None = None) -> Problem:
        """The posterior of this rung, over the bins that ``keep`` selects."""

        def log_prior(u: Array) -> float:
            away = u - self.prior_mean
            return -0.5 * float(away @ self.prior_precision @ away)

        def terms(u: Array) -> Array:
            every = self.likelihood.terms(u)
            return every if keep is None else every[keep]

        def normal(u: Array) -> tuple[Array, Array]:
            z, log_sd = self.likelihood.normal(u)
            return (z, log_sd) if keep is None else (z[keep], log_sd[keep])

        sd = self.layout.sd
        return Problem(
            names=self.layout.names,
            log_prior=log_prior,
            log_likelihood_terms=terms,
            series=series if keep is None else series[keep],
            prior_sd=sd,
            starts=self.starts,
            lower=self.layout.mean - SEARCH_REACH * sd,
            upper=self.layout.mean + SEARCH_REACH * sd,
            standardised=normal,
        )


@dataclass(frozen=True)
class Climbed:
    """A rung after its fit.

    ``scores`` holds the log density of each stroke by a fit that had not seen it,
    ``held_out_residuals`` (n,) that fit's error at each bin; ``share`` is the share of bins that
    are independent.
    """

    rung: Rung
    optimum: Optimum
    scores: Array
    held_out_residuals: Array
    log_likelihood: float
    share: float
    observations: int

    @property
    def held_out_rms(self) -> float:
        """Root mean square error on unseen strokes, in the unit of the measured effort."""
        return float(np.sqrt(np.nanmean(self.held_out_residuals**2)))


def climb(rung: Rung, series: Integers, strokes: Integers) -> Climbed:
    """Fit one rung to all bins, and judge it on strokes that it has not seen.

    ``series`` and ``strokes`` (n,) label bins. Whole strokes are held out, a quarter at a time,
    never single bins, because neighbours share their errors. The fit without them is reached
    from the full one by a Newton step (the approximate cross-validation of Beirami et al. 2017,
    arXiv:1711.05305).
    """
    problem = rung.problem(series)
    optimum = find_optimum(problem)
    white = ljung_box(rung.likelihood.standardised(optimum.point), series)
    labels = np.unique(strokes)
    folds = [labels[k :: min(FOLDS, len(labels))] for k in range(min(FOLDS, len(labels)))]
    points = _without(rung, problem, optimum.point, [np.isin(strokes, fold) for fold in folds])
    residuals = np.full(len(series), np.nan)
    densities = np.full(len(series), np.nan)
    for fold, point in zip(folds, points, strict=True):
        unseen = np.isin(strokes, fold)
        residuals[unseen] = rung.likelihood.residuals(point)[unseen]
        densities[unseen] = rung.likelihood.terms(point)[unseen]
    labelled = tuple(strokes == label for label in labels)
    return Climbed(
        rung=rung,
        optimum=optimum,
        scores=np.array([densities[here].sum() for here in labelled]),
        held_out_residuals=residuals,
        log_likelihood=problem.log_likelihood(optimum.point),
        share=white.share,
        observations=len(series),
    )


def _without(
    rung: Rung, problem: Problem, point: Array, folds: list[NDArray[np.bool_]]
) -> list[Array]:
    """Optima without each fold's bins, one Newton step away from the full optimum."""
    if len(folds) < 2:
        return [point for _ in folds]
    step = natural_step(problem.log_likelihood, point, 0.1 * problem.prior_sd)
    scores = gradient(problem.log_likelihood_terms, point, step)
    curvature = likelihood_information(problem, point, step)
    slope_prior = -rung.prior_precision @ (point - rung.prior_mean)
    reached = []
    for unseen in folds:
        share = float(np.mean(~unseen))
        precision = share * curvature + rung.prior_precision
        slope = scores[~unseen].sum(axis=0) + slope_prior
        values, vectors = np.linalg.eigh(precision)
        move = vectors @ ((vectors.T @ slope) / np.maximum(values, 1e-8 * values.max()))
        reached.append(_step_uphill(rung.problem(problem.series, ~unseen), point, move))
    return reached


def _step_uphill(problem: Problem, point: Array, move: Array) -> Array:
    """Take as much of a Newton step as raises the log-posterior; none of it if nothing does."""
    start = problem.log_posterior(point)
    for share in (1.0, 0.5, 0.25, 0.1, 0.03):
        reached = point + share * move
        if problem.log_posterior(reached) > start:
            return reached
    return point


def choose(climbed: list[Climbed], signal_rms: float = 0.0) -> Climbed:
    """Take the cheapest rung that is as good as the best on unseen strokes, for all that matters.

    A cheaper rung is kept if the best one does not beat it on unseen strokes consistently (paired
    Wilcoxon signed-rank test over strokes at 5 %, doi:10.2307/3001968), or if the error that it
    adds is below ``NEGLIGIBLE`` of ``signal_rms``: far less than a person can feel. The latter
    needs a ``signal_rms``, and suits rungs that differ in their mean only.
    """
    best = max(climbed, key=lambda candidate: float(candidate.scores.sum()))
    share = common_share(climbed)
    for candidate in climbed:
        added = candidate.held_out_rms**2 - best.held_out_rms**2
        if added <= (NEGLIGIBLE * signal_rms) ** 2 and signal_rms > 0:
            return candidate
        if not _beaten(candidate.scores * share, best.scores * share):
            return candidate
    return best


def _beaten(scores: Array, best: Array) -> bool:
    from scipy.stats import wilcoxon

    gained = best - scores
    if float(gained.sum()) < POSITIVE_EVIDENCE:
        return False
    if len(gained) < FEWEST_FOR_RANKS:
        return True
    return float(wilcoxon(gained, alternative="greater").pvalue) < FALSE_ALARM


def common_share(climbed: list[Climbed]) -> float:
    """Share of independent observations by which rungs are compared: the best rung's own."""
    return max(climbed, key=lambda candidate: float(candidate.scores.sum())).share


def rung_table(climbed: list[Climbed], chosen: Climbed) -> tuple[dict[str, Any], ...]:
    """Rows for the report: name, parameters, bic, held_out_rms, held_out_score, chosen.

    ``bic`` and ``held_out_score`` count only as many observations as are independent, the same
    share for every rung.
    """
    share = common_share(climbed)
    return tuple(
        {
            "name": candidate.rung.name,
            "parameters": len(candidate.optimum.point),
            "bic": -2 * candidate.log_likelihood * share
            + len(candidate.optimum.point) * float(np.log(candidate.observations * share)),
            "held_out_rms": candidate.held_out_rms,
            "held_out_score": float(candidate.scores.sum()) * share,
            "chosen": candidate is chosen,
        }
        for candidate in climbed
    )
