"""Multistart search for the posterior's optimum, with an honest word on how it ended."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

WORST = 1e300
"""Stands for a log-posterior of -inf: finite, because BOBYQA calls a NaN or an infinity solved."""

SAME_OPTIMUM = 0.5
"""Two optima whose log-posteriors differ by less than this count as one."""


@dataclass(frozen=True)
class Optimum:
    """The best point that any start led to.

    ``success`` is true where the search met its tolerance and the point is better than its start;
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


def find_optimum(
    objective: Callable[[Array], float],
    starts: Array,
    step: Array,
    lower: Array,
    upper: Array,
    *,
    max_evaluations: int = 4000,
) -> Optimum:
    """Maximise ``objective`` from every row of ``starts`` with BOBYQA, polished with Subplex.

    ``starts`` (k, p); ``step``, ``lower`` and ``upper`` (p,). The best point ever seen is kept,
    whatever code the library returns, since it reports rounding trouble at points that are solved
    and success at points it never could evaluate (Powell 2009, BOBYQA, report DAMTP 2009/NA06).
    Raises ValueError if the objective is finite at no start.
    """
    runs = [
        _climb(objective, start, step, lower, upper, max_evaluations)
        for start in np.atleast_2d(starts)
    ]
    finite = [run for run in runs if np.isfinite(run.value)]
    if not finite:
        raise ValueError("The log-posterior is finite at no start; check the data for NaN.")
    best = max(finite, key=lambda run: run.value)
    agreeing = sum(run.value > best.value - SAME_OPTIMUM for run in finite)
    sentence = best.sentence
    if agreeing < len(runs):
        sentence += f" {agreeing} of {len(runs)} starts ended there; the others ended lower."
    return Optimum(
        best.point,
        best.value,
        best.success,
        sentence,
        agreeing,
        len(runs),
        sum(run.evaluations for run in runs),
    )


def _climb(
    objective: Callable[[Array], float],
    start: Array,
    step: Array,
    lower: Array,
    upper: Array,
    max_evaluations: int,
) -> Optimum:
    import nlopt

    best_point, best_value, evaluations = np.array(start, dtype=np.float64), -np.inf, 0

    def seen(point: Array, gradient: Array) -> float:
        nonlocal best_point, best_value, evaluations
        evaluations += 1
        inside = np.clip(point, lower, upper)
        value = objective(inside)
        if value > best_value:
            best_point, best_value = inside.copy(), value
        return -value if np.isfinite(value) else WORST

    first = objective(best_point)
    ended = []
    for algorithm in (nlopt.LN_BOBYQA, nlopt.LN_SBPLX):
        search = nlopt.opt(algorithm, len(start))
        search.set_min_objective(seen)
        search.set_lower_bounds(lower)
        search.set_upper_bounds(upper)
        search.set_initial_step(np.minimum(step, 0.49 * (upper - lower)))
        search.set_ftol_abs(1e-6)
        search.set_xtol_abs(1e-5 * step)
        search.set_maxeval(max_evaluations)
        try:
            search.optimize(np.clip(best_point, lower, upper))
            ended.append(search.last_optimize_result())
        except nlopt.RoundoffLimited:
            ended.append(nlopt.ROUNDOFF_LIMITED)
        step = 0.02 * step
        max_evaluations = min(max_evaluations, 60 * len(start))
    cut_short = ended[0] == nlopt.MAXEVAL_REACHED
    success = np.isfinite(best_value) and (best_value > first or not cut_short) and not cut_short
    sentence = (
        "The search met its tolerance."
        if success
        else "The search used up its evaluations before it met its tolerance: "
        "record more varied motion, or start it nearer by hand."
    )
    return Optimum(best_point, best_value, bool(success), sentence, 1, 1, evaluations)
