"""Fit one candidate model, and judge it on strokes that it has not seen."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array, Integers
from scissorcal.calibration.candidates import LeftOut, leave_strokes_out
from scissorcal.calibration.friction.moments import ReducedLaw
from scissorcal.calibration.parameters import Layout
from scissorcal.calibration.signals.segments import by_label
from scissorcal.inference.autocorrelation import ljung_box
from scissorcal.inference.curvature import gradient, likelihood_information, natural_step
from scissorcal.inference.noise import log_density
from scissorcal.inference.optimise import Optimum, find_optimum
from scissorcal.inference.problem import Counter, Problem, Stop

FOLDS = 4
SEARCH_REACH = 8.0
"""Half-width of the search, in prior standard deviations."""


@dataclass(frozen=True)
class Likelihood:
    """A model's likelihood before its prior.

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
class CandidateProblem(Problem):
    """A posterior with a normal prior, whose sums come by stroke where the candidate has them.

    The prior has ``prior_mean`` (p,) and ``prior_precision`` (p, p).
    """

    prior_mean: Array = field(default_factory=lambda: np.zeros(0))
    prior_precision: Array = field(default_factory=lambda: np.zeros((0, 0)))
    reduced: ReducedLaw | None = None

    def log_priors(self, points: Array) -> Array:
        """Log-priors of points (k, p), shape (k,)."""
        away = points - self.prior_mean
        return np.asarray(-0.5 * np.einsum("ki,ij,kj->k", away, self.prior_precision, away))

    def log_likelihood(self, point: Array) -> float:
        """Sum of the likelihood's terms; -inf where it is not finite."""
        if self.reduced is None:
            return super().log_likelihood(point)
        if self.tally is not None:
            self.tally()
        total = self.share * self.reduced.log_likelihood(point)
        return total if np.isfinite(total) else -np.inf

    def log_likelihoods(self, points: Array) -> Array:
        """Those of points (k, p), shape (k,)."""
        if self.reduced is None:
            return super().log_likelihoods(points)
        if self.tally is not None:
            self.tally(len(points))
        totals = self.share * self.reduced.log_likelihoods(points)
        return np.where(np.isfinite(totals), totals, -np.inf)


@dataclass(frozen=True)
class Candidate:
    """One candidate model, ready to be fitted. ``key`` holds its discrete choices.

    ``blocks``, ``populations`` (n,) and ``curved`` are as in
    :class:`scissorcal.inference.problem.Problem`.
    ``reduced`` is the same model over sums by stroke, where it has them. ``search`` finds the
    optimum where the model has a quicker way than :func:`~.optimise.find_optimum`. ``share`` is
    the share of bins that count as independent, where it is known.
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
    search: Callable[[CandidateProblem], Optimum] | None = None
    share: float | None = None
    curved: tuple[int, ...] = ()

    def problem(self, series: Integers, keep: NDArray[np.bool_] | None = None) -> CandidateProblem:
        """The posterior of this candidate, over the bins that ``keep`` selects."""

        def log_prior(u: Array) -> float:
            away = u - self.prior_mean
            return -0.5 * float(away @ self.prior_precision @ away)

        def terms(u: Array) -> Array:
            all_terms = self.likelihood.terms(u)
            return all_terms if keep is None else all_terms[keep]

        def normal(u: Array) -> tuple[Array, Array]:
            z, log_sd = self.likelihood.normal(u)
            return (z, log_sd) if keep is None else (z[keep], log_sd[keep])

        def kept(labels: Integers | None) -> Integers | None:
            return labels if labels is None or keep is None else labels[keep]

        sd = self.layout.sd
        return CandidateProblem(
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
            share=1.0 if self.share is None else self.share,
            curved=self.curved,
        )

    def optimum(self, series: Integers, stop: Stop | None = None) -> Optimum:
        """The optimum over all bins; ``series`` (n,) labels their pieces without a gap."""
        problem = self.problem(series)
        return find_optimum(problem, stop=stop) if self.search is None else self.search(problem)


@dataclass(frozen=True)
class FittedCandidate:
    """A candidate after its fit.

    ``scores`` holds the log density of each stroke by a fit that had not seen it,
    ``held_out_residuals`` (n,) that fit's error at each bin. ``information`` (p, p) is the
    likelihood's at the optimum, ``share`` the share of bins that are independent.
    ``series`` and ``strokes`` (n,) label the bins. ``equivalent`` names the candidates, its own
    among them, that are not distinguishable from the best one; the comparison fills it in for the
    candidate that is used. ``fitting`` counts the evaluations of :func:`fit_candidate`.
    """

    candidate: Candidate
    optimum: Optimum
    scores: Array
    held_out_residuals: Array
    information: Array
    log_likelihood: float
    share: float
    series: Integers
    strokes: Integers
    equivalent: tuple[str, ...] = ()
    fitting: int = 0

    @property
    def name(self) -> str:
        """The candidate's name."""
        return self.candidate.name

    @property
    def evaluations(self) -> int:
        """Evaluations of the likelihood so far: search, scores, and strokes left out."""
        left_out = self.__dict__.get("left_out")
        return self.fitting + (left_out.evaluations if left_out is not None else 0)

    @cached_property
    def left_out(self) -> LeftOut:
        """Densities of strokes by the posterior without them, worked out when first asked for."""
        labelled = tuple(by_label(self.strokes).values())
        return leave_strokes_out(
            self.candidate.problem(self.series),
            self.optimum.point,
            self.share * self.information + self.candidate.prior_precision,
            labelled,
            self.share,
            self.candidate.reduced.by_stroke if self.candidate.reduced else None,
        )

    @property
    def observations(self) -> int:
        """Bins that were fitted."""
        return len(self.strokes)

    @property
    def held_out_rms(self) -> float:
        """Root mean square error on unseen strokes, in the unit of the measured effort."""
        return float(np.sqrt(np.nanmean(self.held_out_residuals**2)))


def fit_candidate(
    candidate: Candidate, series: Integers, strokes: Integers, stop: Stop | None = None
) -> FittedCandidate:
    """Fit one candidate to all bins, and judge it on strokes that it has not seen.

    ``series`` and ``strokes`` (n,) label bins. Whole strokes are held out, a quarter at a time,
    never single bins, because neighbours share their errors. The fit without them is reached
    from the full one by a Newton step (the approximate cross-validation of Beirami et al. 2017,
    arXiv:1711.05305). ``stop`` says whether the time allowed for the search is used up.
    """
    counter = Counter()
    candidate, optimum, before = _searched(candidate, series, stop)
    problem = counter.over(candidate.problem(series))
    point, likelihood = optimum.point, candidate.likelihood
    white = ljung_box(likelihood.standardised(point), series)
    labels = np.unique(strokes)
    without = _Refits(candidate, problem, point, strokes, counter)
    residuals, densities = np.full(len(series), np.nan), np.full(len(series), np.nan)
    folds = split_strokes(labels)
    for fold in folds:
        reached = without(fold) if len(folds) > 1 else point
        unseen = np.isin(strokes, fold)
        residuals[unseen] = likelihood.residuals(reached)[unseen]
        densities[unseen] = likelihood.terms(reached)[unseen]
    return FittedCandidate(
        candidate=candidate,
        optimum=optimum,
        scores=np.array([densities[here].sum() for here in by_label(strokes).values()]),
        held_out_residuals=residuals,
        information=without.information,
        log_likelihood=problem.log_likelihood(point) / problem.share,
        share=white.share if candidate.share is None else candidate.share,
        series=series,
        strokes=strokes,
        fitting=counter.calls + before + optimum.evaluations,
    )


def _searched(
    candidate: Candidate, series: Integers, stop: Stop | None
) -> tuple[Candidate, Optimum, int]:
    """The candidate with the share of its bins that are independent, and its optimum with that.

    The last number are evaluations of a search before that one.

    Only sums by stroke are dense enough for it to matter, and cheap enough to be searched again:
    windows overlap, and 46,000 of them moved an offset by 8 standard deviations of its prior.
    """
    optimum = candidate.optimum(series, stop)
    if candidate.reduced is None or candidate.share is not None:
        return candidate, optimum, 0
    white = ljung_box(candidate.likelihood.standardised(optimum.point), series)
    weighed = replace(candidate, share=white.share)
    return weighed, weighed.optimum(series, stop), optimum.evaluations


def split_strokes(labels: Integers) -> list[Integers]:
    """The folds in which strokes (k,) are held out: every fourth stroke together."""
    count = min(FOLDS, len(labels))
    return [labels[k::count] for k in range(count)]


class _Refits:
    """Optima without a fold's strokes, one Newton step away from the full optimum."""

    def __init__(
        self,
        candidate: Candidate,
        problem: Problem,
        point: Array,
        strokes: Integers,
        counter: Counter,
    ) -> None:
        self.candidate, self.problem, self.point = candidate, problem, point
        self.strokes, self.counter = strokes, counter
        if candidate.reduced is not None:
            self.information = candidate.reduced.information(point)
            return
        step = natural_step(problem.log_likelihood, point, 0.1 * problem.prior_sd)
        self.information = likelihood_information(replace(problem, share=1.0), point, step)
        self._scores = gradient(problem.log_likelihood_terms, point, step)

    def __call__(self, fold: Integers) -> Array:
        """The optimum (p,) without the strokes of ``fold``."""
        candidate, point = self.candidate, self.point
        if candidate.reduced is not None:
            rest = candidate.reduced.without(fold)
            share, slope = rest.counted / candidate.reduced.counted, rest.slope(point)
            others: Problem = replace(candidate.problem(self.problem.series), reduced=rest)
        else:
            kept = ~np.isin(self.strokes, fold)
            share, slope = float(np.mean(kept)), self._scores[kept].sum(axis=0)
            others = self.counter.over(candidate.problem(self.problem.series, kept))
        slope = self.problem.share * slope
        slope = slope - candidate.prior_precision @ (point - candidate.prior_mean)
        precision = share * self.problem.share * self.information + candidate.prior_precision
        return _step_uphill(others, point, _newton(precision, slope))


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
