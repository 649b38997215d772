"""Multistart search for the posterior's optimum, with an honest word on how it ended."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.inference.problem import Problem

Array = NDArray[np.float64]

WORST = 1e300
"""Stands for a log-posterior of -inf: finite, because BOBYQA calls a NaN or an infinity solved."""

SAME_OPTIMUM = 0.5
"""Two optima whose log-posteriors differ by less than this count as one."""

SETTLED = 1e-3
"""A round of search that gains less log-posterior than this has arrived."""

ROUNDS = 12
ROUNDS_BEFORE_CHOICE = 2
HOPELESS = 20.0
"""A start this much log-posterior below the best one after its first rounds is given up."""


@dataclass(frozen=True)
class Optimum:
    """The best point that any start led to.

    ``success`` is true where the last round of search gained nothing that matters.
    ``sentence`` says how it ended and what to do. ``agreeing`` counts the starts that ended at
    the same height, ``starts`` all of them; ``evaluations`` counts calls of the objective.
    """

    point: Array
    value: float
    success: bool
    sentence: str
    agreeing: int
    starts: int
    evaluations: int


def find_optimum(problem: Problem, starts: Array | None = None) -> Optimum:
    """Maximise a log-posterior from every row of ``starts`` (default: the problem's own).

    Each start is followed by rounds of BOBYQA (Powell 2009, report DAMTP 2009/NA06) in coordinates
    that the scores' outer product makes round, until a round gains nothing: strongly correlated
    parameters then cost no more than independent ones. A start whose first rounds end far below
    another's is given up. The best point ever seen is kept, whatever code the library returns,
    since it reports rounding trouble at points that are solved and success at points it never
    could evaluate. Raises ValueError if no start is finite.
    """
    chosen = np.atleast_2d(problem.starts if starts is None else starts)
    begun = [_climb(problem, _begin(problem, start), ROUNDS_BEFORE_CHOICE) for start in chosen]
    top = max(climb.value for climb in begun)
    if not np.isfinite(top):
        raise ValueError("The log-posterior is finite at no start; check the data for NaN.")
    ended = [
        _climb(problem, climb, ROUNDS) if climb.value > top - HOPELESS else climb for climb in begun
    ]
    best = max(ended, key=lambda climb: climb.value)
    agreeing = sum(climb.value > best.value - SAME_OPTIMUM for climb in ended)
    success = best.gained < SETTLED
    sentence = (
        "The search settled."
        if success
        else "The search was still climbing when its rounds were used up: record more varied "
        "motion, or choose a simpler rung."
    )
    if agreeing < len(ended):
        sentence += f" {agreeing} of {len(ended)} starts ended there, the others lower."
    evaluations = sum(climb.evaluations for climb in ended)
    return Optimum(best.point, best.value, success, sentence, agreeing, len(ended), evaluations)


@dataclass(frozen=True)
class _Climb:
    point: Array
    value: float
    gained: float
    root: Array
    evaluations: int


def _begin(problem: Problem, start: Array) -> _Climb:
    point = np.clip(np.array(start, dtype=np.float64), problem.lower, problem.upper)
    return _Climb(point, problem.log_posterior(point), np.inf, _rounding(problem, point), 1)


def _climb(problem: Problem, climb: _Climb, rounds: int) -> _Climb:
    point, value, gained = climb.point, climb.value, climb.gained
    root, evaluations = climb.root, climb.evaluations
    for _ in range(rounds):
        if not np.isfinite(value) or gained < SETTLED:
            break
        reached, height, used = _round(problem, point, value, root)
        gained, point, value = height - value, reached, height
        evaluations += used
        if gained >= SETTLED:
            root = _rounding(problem, point)
            evaluations += 2 * len(point)
    return _Climb(point, value, gained, root, evaluations)


def _round(problem: Problem, centre: Array, value: float, root: Array) -> tuple[Array, float, int]:
    import nlopt

    best_point, best_value, evaluations = centre, value, 0

    def seen(z: Array, gradient: Array) -> float:
        nonlocal best_point, best_value, evaluations
        evaluations += 1
        wanted = centre + root @ z
        inside = np.clip(wanted, problem.lower, problem.upper)
        height = problem.log_posterior(inside)
        if height > best_value:
            best_point, best_value = inside, height
        outside = float(np.sum(((wanted - inside) / problem.prior_sd) ** 2))
        return -height + 1e4 * outside if np.isfinite(height) else WORST

    size = len(centre)
    search = nlopt.opt(nlopt.LN_BOBYQA, size)
    search.set_min_objective(seen)
    search.set_lower_bounds(np.full(size, -1e3))
    search.set_upper_bounds(np.full(size, 1e3))
    search.set_initial_step(np.ones(size))
    search.set_ftol_abs(1e-3 * SETTLED)
    search.set_maxeval(25 * size)
    try:
        search.optimize(np.zeros(size))
    except nlopt.RoundoffLimited:
        return best_point, best_value, evaluations
    return best_point, best_value, evaluations


def _rounding(problem: Problem, point: Array) -> Array:
    """Root of the covariance that the scores suggest, for rounder coordinates."""
    terms = problem.log_likelihood_terms
    step = 1e-4 * problem.prior_sd
    reaches = np.diag(step)
    scaled = np.stack(
        [0.5 * (terms(point + reach) - terms(point - reach)) / 1e-4 for reach in reaches], axis=-1
    )
    information = scaled.T @ scaled + np.eye(len(point))
    values, vectors = np.linalg.eigh(information)
    return np.asarray(problem.prior_sd[:, None] * vectors / np.sqrt(values))
