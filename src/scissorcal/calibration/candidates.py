"""Climbing a ladder of laws: each rung judged by strokes that it has not seen."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.friction.moments import ReducedLaw
from scissorcal.calibration.friction.search import ReducedProblem, search
from scissorcal.calibration.parameters import Layout
from scissorcal.calibration.psis_loo import LeftOut, leave_strokes_out
from scissorcal.inference import (
    Counter,
    Optimum,
    Problem,
    Stop,
    find_optimum,
    gradient,
    likelihood_information,
    ljung_box,
    log_density,
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

RELIABLE_STROKES = 0.8
"""Share of strokes that must have good k-hats for PSIS-LOO to have a say."""

POSITIVE_EVIDENCE = 3.0
"""Held-out log density, counting independent observations only, that a better rung must gain: a
factor of 20 (Kass and Raftery 1995, doi:10.1080/01621459.1995.10476572, call this strong)."""

SEARCH_REACH = 8.0
"""Half-width of the search, in prior standard deviations."""


@dataclass(frozen=True)
class Likelihood:
    """A law's likelihood before its prior.

    ``residuals`` (u) are measured minus predicted (n,). ``normal`` (u) gives them over each bin's
    standard deviation, with the logarithm of the latter, both (n,). ``tails`` are the degrees of
    freedom of a Student-t in the place of the normal, where data have outliers.
    """

    residuals: Callable[[Array], Array]
    normal: Callable[[Array], tuple[Array, Array]]
    tails: float = np.inf

    def standardised(self, u: Array) -> Array:
        """Residuals over their standard deviations (n,)."""
        return self.normal(u)[0]

    def terms(self, u: Array) -> Array:
        """Log-likelihood by bin (n,), up to a constant."""
        z, log_sd = self.normal(u)
        return np.asarray(log_density(z, self.tails) - log_sd)


@dataclass(frozen=True)
class Rung:
    """One law of a ladder, ready to be fitted. ``key`` holds its discrete choices.

    ``blocks`` and ``populations`` (n,) are as in :class:`scissorcal.inference.Problem`. ``reduced``
    is the same law over products of its columns by stroke, where it is linear in them and its noise
    normal: what needs sums over bins only is then taken from there.
    """

    name: str
    key: Mapping[str, Any]
    layout: Layout
    likelihood: Likelihood
    starts: Array
    prior_mean: Array
    prior_precision: Array
    blocks: Integers | None = None
    populations: Integers | None = None
    reduced: ReducedLaw | None = None

    def problem(self, series: Integers, keep: NDArray[np.bool_] | None = None) -> "ReducedProblem":
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

        def kept(labels: Integers | None) -> Integers | None:
            return labels if labels is None or keep is None else labels[keep]

        sd = self.layout.sd
        return ReducedProblem(
            reduced=self.reduced if keep is None else None,
            prior_mean=self.prior_mean,
            prior_precision=self.prior_precision,
            names=self.layout.names,
            log_prior=log_prior,
            log_likelihood_terms=terms,
            series=series if keep is None else series[keep],
            prior_sd=sd,
            starts=self.starts,
            lower=self.layout.mean - SEARCH_REACH * sd,
            upper=self.layout.mean + SEARCH_REACH * sd,
            standardised=normal,
            tails=self.likelihood.tails,
            populations=kept(self.populations),
            blocks=kept(self.blocks),
        )


@dataclass(frozen=True)
class Climbed:
    """A rung after its fit.

    ``scores`` holds the log density of each stroke by a fit that had not seen it,
    ``held_out_residuals`` (n,) that fit's error at each bin. ``information`` (p, p) is the
    likelihood's at the optimum, ``share`` the share of bins that are independent.
    ``series`` and ``strokes`` (n,) label the bins. ``alike`` names the rungs, its own among them,
    that cannot be told from the best one; :func:`choose` fills it in for the rung that it takes.
    ``climbing`` counts the evaluations of :func:`climb`.
    """

    rung: Rung
    optimum: Optimum
    scores: Array
    held_out_residuals: Array
    information: Array
    log_likelihood: float
    share: float
    series: Integers
    strokes: Integers
    alike: tuple[str, ...] = ()
    climbing: int = 0

    @property
    def evaluations(self) -> int:
        """Evaluations of the likelihood so far: search, scores, and strokes left out."""
        left_out = self.__dict__.get("left_out")
        return self.climbing + (left_out.evaluations if left_out is not None else 0)

    @cached_property
    def left_out(self) -> LeftOut:
        """Densities of strokes by the posterior without them, worked out when first asked for."""
        labelled = tuple(self.strokes == label for label in np.unique(self.strokes))
        return leave_strokes_out(
            self.rung.problem(self.series),
            self.optimum.point,
            self.information,
            self.rung.prior_precision,
            labelled,
            self.share,
            self.rung.reduced.by_stroke if self.rung.reduced else None,
        )

    @property
    def observations(self) -> int:
        """Bins that were fitted."""
        return len(self.strokes)

    @property
    def held_out_rms(self) -> float:
        """Root mean square error on unseen strokes, in the unit of the measured effort."""
        return float(np.sqrt(np.nanmean(self.held_out_residuals**2)))


def climb(rung: Rung, series: Integers, strokes: Integers, stop: Stop | None = None) -> Climbed:
    """Fit one rung to all bins, and judge it on strokes that it has not seen.

    ``series`` and ``strokes`` (n,) label bins. Whole strokes are held out, a quarter at a time,
    never single bins, because neighbours share their errors. The fit without them is reached
    from the full one by a Newton step (the approximate cross-validation of Beirami et al. 2017,
    arXiv:1711.05305). ``stop`` says whether the time allowed for the search is used up.
    """
    counter = Counter()
    problem = counter.over(rung.problem(series))
    optimum = optimum_of(rung, series, stop)
    if rung.reduced is not None:
        return _climb_reduced(rung, rung.reduced, rung.problem(series), optimum, strokes)
    point = optimum.point
    white = ljung_box(rung.likelihood.standardised(point), series)
    step = natural_step(problem.log_likelihood, point, 0.1 * problem.prior_sd)
    information = likelihood_information(problem, point, step)
    labels = np.unique(strokes)
    labelled = tuple(strokes == label for label in labels)
    folds = [np.isin(strokes, fold) for fold in split_strokes(labels)]
    points = _without(rung, problem, point, folds, information, step, counter)
    residuals = np.full(len(series), np.nan)
    densities = np.full(len(series), np.nan)
    for unseen, reached in zip(folds, points, strict=True):
        residuals[unseen] = rung.likelihood.residuals(reached)[unseen]
        densities[unseen] = rung.likelihood.terms(reached)[unseen]
    return Climbed(
        rung=rung,
        optimum=optimum,
        scores=np.array([densities[here].sum() for here in labelled]),
        held_out_residuals=residuals,
        information=information,
        log_likelihood=problem.log_likelihood(point),
        share=white.share,
        series=series,
        strokes=strokes,
        climbing=counter.calls + optimum.evaluations,
    )


def optimum_of(rung: Rung, series: Integers, stop: Stop | None = None) -> Optimum:
    """The optimum of a rung over its bins, by the search that fits use for it.

    ``series`` (n,) labels the bins' pieces without a gap.
    """
    problem = rung.problem(series)
    return find_optimum(problem, stop=stop) if rung.reduced is None else search(problem)


def _climb_reduced(
    rung: Rung, law: ReducedLaw, problem: ReducedProblem, optimum: Optimum, strokes: Integers
) -> Climbed:
    """As :func:`climb`, over products by stroke."""
    labels = law.moments.labels
    information = law.information(optimum.point)
    white = ljung_box(rung.likelihood.standardised(optimum.point), problem.series)
    residuals, densities = np.full(len(strokes), np.nan), np.full(len(strokes), np.nan)
    folds = split_strokes(labels)
    for fold in folds:
        reached = optimum.point
        if len(folds) > 1:
            rest = law.without(fold)
            precision = rest.counted / law.counted * information + rung.prior_precision
            slope = rest.slope(reached) - rung.prior_precision @ (reached - rung.prior_mean)
            seen = replace(problem, reduced=rest)
            reached = _step_uphill(seen, reached, _newton(precision, slope))
        unseen = np.isin(strokes, fold)
        left = rung.likelihood.residuals(reached)[unseen]
        residuals[unseen] = left
        densities[unseen] = -0.5 * (left * np.exp(-reached[-1])) ** 2 - reached[-1]
    return Climbed(
        rung=rung,
        optimum=optimum,
        scores=np.array([densities[strokes == label].sum() for label in labels]),
        held_out_residuals=residuals,
        information=information,
        log_likelihood=problem.log_likelihood(optimum.point),
        share=white.share,
        series=problem.series,
        strokes=strokes,
        climbing=optimum.evaluations,
    )


def split_strokes(labels: Integers) -> list[Integers]:
    """The folds in which strokes (k,) are held out: every fourth stroke together."""
    count = min(FOLDS, len(labels))
    return [labels[k::count] for k in range(count)]


def _without(
    rung: Rung,
    problem: Problem,
    point: Array,
    folds: list[NDArray[np.bool_]],
    information: Array,
    step: Array,
    counter: Counter,
) -> list[Array]:
    """Optima without each fold's bins, one Newton step away from the full optimum."""
    if len(folds) < 2:
        return [point for _ in folds]
    scores = gradient(problem.log_likelihood_terms, point, step)
    slope_prior = -rung.prior_precision @ (point - rung.prior_mean)
    reached = []
    for unseen in folds:
        share = float(np.mean(~unseen))
        precision = share * information + rung.prior_precision
        slope = scores[~unseen].sum(axis=0) + slope_prior
        others = counter.over(rung.problem(problem.series, ~unseen))
        reached.append(_step_uphill(others, point, _newton(precision, slope)))
    return reached


def _newton(precision: Array, slope: Array) -> Array:
    values, vectors = np.linalg.eigh(precision)
    return np.asarray(vectors @ ((vectors.T @ slope) / np.maximum(values, 1e-8 * values.max())))


def _step_uphill(problem: Problem, point: Array, move: Array) -> Array:
    """Take as much of a Newton step as raises the log-posterior; none of it if nothing does."""
    start = problem.log_posterior(point)
    for share in (1.0, 0.5, 0.25, 0.1, 0.03):
        reached = point + share * move
        if problem.log_posterior(reached) > start:
            return reached
    return point


def choose(climbed: list[Climbed], signal_rms: float = 0.0) -> Climbed:
    """Take the cheapest rung that cannot be told from the best, and say which those are.

    ``climbed`` stands cheapest first. A rung is told apart where the best one beats it on unseen
    strokes by both accounts: predicted by fits without them, and by the posterior without them
    (PSIS-LOO over whole strokes, as far as its k-hats are good). Rungs whose error is larger by
    less than ``NEGLIGIBLE`` of ``signal_rms`` count as alike too: far less than a person can feel.
    The latter needs a ``signal_rms``, and suits rungs that differ in their mean only. The result
    is the rung that is used, with ``alike`` filled in, not a winner.
    """
    if len(climbed) == 1:
        return replace(climbed[0], alike=(climbed[0].rung.name,))
    best = best_of(climbed)
    share = best.share
    alike = [
        candidate
        for candidate in climbed
        if _negligible(candidate, best, signal_rms) or not _told_apart(candidate, best, share)
    ]
    return replace(alike[0], alike=tuple(candidate.rung.name for candidate in alike))


def best_of(climbed: list[Climbed]) -> Climbed:
    """The rung with the highest log density of unseen strokes, which others are held against.

    Its share of independent bins is the one by which all rungs are compared.
    """
    return max(climbed, key=lambda candidate: float(candidate.scores.sum()))


def _negligible(candidate: Climbed, best: Climbed, signal_rms: float) -> bool:
    added = candidate.held_out_rms**2 - best.held_out_rms**2
    return signal_rms > 0 and added <= (NEGLIGIBLE * signal_rms) ** 2


def _told_apart(candidate: Climbed, best: Climbed, share: float) -> bool:
    if not beaten((best.scores - candidate.scores) * share):
        return False
    both = candidate.left_out.reliable & best.left_out.reliable
    if np.mean(both) < RELIABLE_STROKES:
        return True
    gained = best.left_out.scores - candidate.left_out.scores
    return beaten(gained[both] * share)


def beaten(gained: Array) -> bool:
    """Whether log density gained by stroke (strokes,) is positive evidence, and consistently so.

    Paired over strokes, as their errors are independent: Wilcoxon's signed-rank test
    (doi:10.2307/3001968) where there are strokes enough, the sum of the gains in any case.
    """
    if float(gained.sum()) < POSITIVE_EVIDENCE:
        return False
    if len(gained) < FEWEST_FOR_RANKS:
        return True
    return signed_rank_chance(gained) < FALSE_ALARM


def signed_rank_chance(gained: Array) -> float:
    """Chance that values (n,) without a preferred sign have such a sum of positive ranks, or more.

    Exact, by counting the sums of all choices of signs: gains are real numbers, so that none are
    zero or alike. (scipy.stats has it too; importing that costs half a second.)

    >>> signed_rank_chance(np.array([0.3, 0.1, -0.2, 0.5]))
    0.1875
    """
    ranks = np.argsort(np.argsort(np.abs(gained))) + 1
    chances = np.ones(1)
    for rank in range(1, len(gained) + 1):
        chances = 0.5 * (np.pad(chances, (0, rank)) + np.pad(chances, (rank, 0)))
    return float(chances[int(ranks[gained > 0].sum()) :].sum())
