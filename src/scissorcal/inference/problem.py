"""What a fit hands to inference, a log-prior and a log-likelihood over R^p; how a search ended."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.errors import InputError

MOST_CURVED = 3
"""Parameters along which a lattice of 400 nodes still reaches as far as draws do."""


@dataclass(frozen=True)
class Problem:
    """A posterior over unconstrained parameters, shape (p,).

    ``log_prior`` gives one number. ``log_likelihood_terms`` gives one number per observation,
    shape (n,), in order of time; ``series`` (n,) names the uninterrupted series that each
    observation belongs to, so that autocorrelation is never taken across a gap. ``prior_sd`` (p,)
    is the size of each parameter before data. ``starts`` (k, p) are where the search begins; each
    must have a finite posterior. ``lower`` and ``upper`` (p,) bound the search.

    Where the terms are normal, ``standardised`` gives the residuals over their standard deviations
    and the logarithms of the latter, both (n,). The information then comes from first derivatives,
    which a likelihood that is rough on a small scale still has. ``tails`` are the degrees of
    freedom of a Student-t in the place of the normal; infinity is the normal. ``populations`` (n,)
    tells terms apart whose noise has its own memory, ``blocks`` (n,) names the stretches
    (strokes) whose scores are compared as wholes; where missing, all terms are one population and
    the series are the blocks.

    ``share`` is the share of the terms that count as independent: the likelihood is taken to that
    power, so that a prior is weighed against what the data are worth and not against their number.

    ``independent`` says that the terms are independent given the parameters and that the model is
    taken as true: the posterior is then used exactly as written, and its likelihood is not
    stretched for autocorrelation.

    ``log_posterior_many`` gives, where the model can work out many points at once, the sum of
    prior and likelihood at points (k, p), shape (k,); what is not finite counts as -inf. Bounds
    need not be looked at. It is then used for single points too, and knows of no share.

    ``smooth`` says that the log-posterior has continuous second derivatives, so that a search may
    go by differences where there are no squares.

    ``curved`` are the places of parameters along which a posterior bends, three at most: it is then
    sampled by a proposal that follows it along these.

    ``tally`` is called before likelihoods that a subclass works out without their terms, with their
    number if they are several, so that counters see them too.
    """

    names: tuple[str, ...]
    log_prior: Callable[[Array], float]
    log_likelihood_terms: Callable[[Array], Array]
    series: NDArray[np.int64]
    prior_sd: Array
    starts: Array
    lower: Array
    upper: Array
    standardised: Callable[[Array], tuple[Array, Array]] | None = None
    tails: float = np.inf
    populations: NDArray[np.int64] | None = None
    blocks: NDArray[np.int64] | None = None
    share: float = 1.0
    independent: bool = False
    log_posterior_many: Callable[[Array], Array] | None = None
    smooth: bool = False
    curved: tuple[int, ...] = ()
    tally: Callable[..., None] | None = None

    def __post_init__(self) -> None:
        if len(self.curved) > MOST_CURVED:
            raise ValueError(f"a posterior is followed along {MOST_CURVED} parameters at most")
        if self.log_posterior_many is not None and self.share != 1.0:
            raise ValueError("a posterior of many points at once counts all of its terms")

    def log_likelihood(self, point: Array) -> float:
        """Sum of the likelihood's terms; -inf where any of them is not finite."""
        if self.log_posterior_many is not None:
            return float(self.log_likelihoods(point[None])[0])
        total = self.share * float(np.sum(self.log_likelihood_terms(point)))
        return total if np.isfinite(total) else -np.inf

    def log_posterior(self, point: Array) -> float:
        """Log-posterior up to a constant; -inf outside the bounds or where it is not finite."""
        if np.any(point < self.lower) or np.any(point > self.upper):
            return -np.inf
        if self.log_posterior_many is not None:
            return float(self.log_posteriors(point[None])[0])
        prior = float(self.log_prior(point))
        return prior + self.log_likelihood(point) if np.isfinite(prior) else -np.inf

    def log_posteriors(self, points: Array) -> Array:
        """Log-posteriors of points (k, p), shape (k,), at once where the problem can."""
        many = self.log_posterior_many
        if many is None:
            return np.array([self.log_posterior(point) for point in points])
        heights = np.full(len(points), -np.inf)
        inside = np.all((points >= self.lower) & (points <= self.upper), axis=1)
        if np.any(inside):
            heights[inside] = many(points[inside])
        return np.where(np.isfinite(heights), heights, -np.inf)

    def log_priors(self, points: Array) -> Array:
        """Log-priors of points (k, p), shape (k,)."""
        return np.array([float(self.log_prior(point)) for point in points])

    def log_likelihoods(self, points: Array) -> Array:
        """Sums of the likelihood's terms at points (k, p), shape (k,); bounds do not matter."""
        if self.log_posterior_many is None:
            return np.array([self.log_likelihood(point) for point in points])
        prior = self.log_priors(points)
        if not np.all(np.isfinite(prior)):
            sums = np.array([float(np.sum(self.log_likelihood_terms(u))) for u in points])
            return np.where(np.isfinite(sums), sums, -np.inf)
        heights = np.asarray(self.log_posterior_many(points)) - prior
        return np.where(np.isfinite(heights), heights, -np.inf)


Stop = Callable[[], bool]
"""Says whether the time allowed is used up; the clock is the caller's."""


class TimeUsedUpError(Exception):
    """An evaluation was asked for after the time allowed; the caller keeps what it has."""


class Counter:
    """Counts evaluations of a problem's likelihood, point by point."""

    def __init__(self) -> None:
        self.calls = 0

    def over(self, problem: Problem, stop: Stop | None = None) -> Problem:
        """The same problem, counted.

        Where ``stop`` is given, an evaluation raises TimeUsedUpError once it returns true.
        """

        def one_more(count: int = 1) -> None:
            if stop is not None and stop():
                raise TimeUsedUpError
            self.calls += count

        def terms(u: Array) -> Array:
            one_more()
            return problem.log_likelihood_terms(u)

        normal, many = problem.standardised, problem.log_posterior_many

        def standardised(u: Array) -> tuple[Array, Array]:
            one_more()
            assert normal is not None
            return normal(u)

        def log_posterior_many(points: Array) -> Array:
            one_more(len(points))
            assert many is not None
            return many(points)

        return replace(
            problem,
            log_likelihood_terms=terms,
            standardised=None if normal is None else standardised,
            log_posterior_many=None if many is None else log_posterior_many,
            tally=one_more,
        )


class NotFiniteError(InputError, ValueError):
    """A log-posterior that is not a number where one is needed."""


class SearchStatus(Enum):
    """How the search for the optimum ended."""

    SETTLED = "The search settled."
    ROUNDS_USED_UP = (
        "The search was still rising when its rounds were used up: record more varied "
        "motion, or choose a simpler candidate model."
    )
    AT_BOUNDS = (
        "The search ended at a bound, so no value was found there: check units and signs of the "
        "data, or widen the bounds if the value is plausible."
    )
    AT_START = (
        "A parameter stands where its start or its prior put it because the data do not respond to "
        "it: record what excites it, or choose a candidate model without it."
    )
    PLATEAU = (
        "The log-posterior hardly falls beside the point where the search ended, so far other "
        "values would do as well and this one means nothing: record what excites the parameters, "
        "start elsewhere, or give them priors."
    )
    TIME_USED_UP = (
        "The time allowed was used up before the search settled, so the optimum is not known: "
        "allow more time, or choose a simpler candidate model."
    )
    ROUNDED = (
        "The log-posterior is so large a number that rounding hides the differences that an "
        "estimate rests on: check the data for extreme values, and the units and size of the noise."
    )
    NOT_FINITE = (
        "The log-posterior is not a finite number right beside the optimum, so the optimum may lie "
        "on the edge of what the model can evaluate: check the data for gaps and extreme values."
    )

    @property
    def found(self) -> bool:
        """Whether the point may be used as an estimate."""
        return self is SearchStatus.SETTLED


class SamplingStatus(Enum):
    """How far the draws of a posterior may be trusted."""

    APPROXIMATED = (
        "The draws come from the normal approximation at the optimum, which nothing was compared "
        "with: use standard effort for intervals that others rely on."
    )
    FLAT = (
        "The data leave a direction to the prior, so the draws along it are the prior's: record "
        "what excites it, or choose a candidate model without it."
    )
    WEIGHED = "The importance weights are well behaved, so the draws are the posterior's."
    HEAVY_WEIGHTS = (
        "A few draws carry most of the importance weight, so the intervals cannot be trusted: "
        "use thorough effort, record more varied data, or choose a simpler candidate model."
    )
    TOO_FEW = (
        "The mixture gave fewer effective draws than were asked for, so the intervals cannot be "
        "trusted: use thorough effort, record more varied data, or choose a simpler candidate "
        "model."
    )
    CONVERGED = (
        "The ensembles agree and are long against their autocorrelation, so the draws are the "
        "posterior's."
    )
    DISAGREEING = (
        "The ensembles disagree with one another, so there may be several optima that none of "
        "them leaves: look at the list of optima, and give priors that tell them apart."
    )
    BUDGET_USED_UP = (
        "The budget of evaluations or of time was used up before the draws could be relied on, so "
        "the intervals cannot be trusted: allow more, record more varied data, or choose a simpler "
        "candidate model. Ensembles go on from the checkpoint, where one was kept."
    )
    STUCK = (
        "A parameter never moved in the ensembles, so nothing is known of its spread: check that "
        "its bounds leave room and that the posterior is finite around the optimum."
    )

    @property
    def trusted(self) -> bool:
        """Whether the draws were compared with the posterior and found to be its own."""
        return self in (SamplingStatus.WEIGHED, SamplingStatus.CONVERGED)


def picked(names: tuple[str, ...], which: NDArray[np.bool_]) -> tuple[str, ...]:
    """Names of the parameters that ``which`` (p,) picks."""
    return tuple(name for name, chosen in zip(names, which, strict=True) if chosen)


def about(status: SearchStatus | SamplingStatus, concerns: tuple[str, ...]) -> str:
    """The sentence of a status, with the names of the parameters that it concerns.

    >>> about(SearchStatus.SETTLED, ())
    'The search settled.'
    """
    return str(status.value) + (f" It concerns {', '.join(concerns)}." if concerns else "")
