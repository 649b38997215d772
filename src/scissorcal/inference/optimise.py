"""Multistart search for the posterior's optimum, with an honest word on how it ended."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.inference.curvature import gradient
from scissorcal.inference.problem import Problem

Array = NDArray[np.float64]

WORST = 1e300
"""Stands for a log-posterior of -inf: finite, because BOBYQA calls a NaN or an infinity solved."""

SAME_OPTIMUM = 0.5
"""Two optima whose log-posteriors differ by less than this count as one."""

SETTLED = 1e-3
"""A round of search that gains less log-posterior than this has arrived."""

ROUNDS = 12


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
    parameters then cost no more than independent ones. The best point ever seen is kept, whatever
    code the library returns, since it reports rounding trouble at points that are solved and
    success at points it never could evaluate. Raises ValueError if no start is finite.
    """
    chosen = problem.starts if starts is None else starts
    runs = [_climb(problem, start) for start in np.atleast_2d(chosen)]
    finite = [run for run in runs if np.isfinite(run.value)]
    if not finite:
        raise ValueError("The log-posterior is finite at no start; check the data for NaN.")
    best = max(finite, key=lambda run: run.value)
    agreeing = sum(run.value > best.value - SAME_OPTIMUM for run in finite)
    sentence = best.sentence
    if agreeing < len(runs):
        sentence += f" {agreeing} of {len(runs)} starts ended there, the others lower."
    return Optimum(
        best.point,
        best.value,
        best.success,
        sentence,
        agreeing,
        len(runs),
        sum(run.evaluations for run in runs),
    )


def _climb(problem: Problem, start: Array) -> Optimum:
    point = np.clip(np.array(start, dtype=np.float64), problem.lower, problem.upper)
    value = problem.log_posterior(point)
    evaluations, gained = 1, np.inf
    root = np.diag(0.2 * problem.prior_sd)
    for number in range(ROUNDS):
        if not np.isfinite(value):
            break
        reached, height, used = _round(problem, point, value, root)
        evaluations += used
        gained, point, value = height - value, reached, height
        if gained < SETTLED and number > 0:
            break
        root, used = _rounding(problem, point)
        evaluations += used
    success = bool(np.isfinite(value) and gained < SETTLED)
    sentence = (
        "The search settled."
        if success
        else "The search was still climbing when its rounds were used up: record more varied "
        "motion, or choose a simpler rung."
    )
    return Optimum(point, value, success, sentence, 1, 1, evaluations)


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
    search.set_ftol_abs(0.1 * SETTLED)
    search.set_maxeval(25 * size)
    try:
        search.optimize(np.zeros(size))
    except nlopt.RoundoffLimited:
        return best_point, best_value, evaluations
    return best_point, best_value, evaluations


def _rounding(problem: Problem, point: Array) -> tuple[Array, int]:
    """Root of the covariance that the scores suggest, for rounder coordinates."""
    step = 1e-4 * problem.prior_sd
    scores = gradient(problem.log_likelihood_terms, point, step)
    scaled = scores * problem.prior_sd
    information = scaled.T @ scaled + np.eye(len(point))
    values, vectors = np.linalg.eigh(information)
    return problem.prior_sd[:, None] * vectors / np.sqrt(values), 4 * len(point)
