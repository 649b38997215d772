"""How a search or a sampling ended: whole sentences that say what happened and what to do."""

from enum import Enum

import numpy as np
from numpy.typing import NDArray

from scissorcal.errors import InputError


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
