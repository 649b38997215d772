"""Multistart search for the posterior's optima, with an honest word on how it ended."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scissorcal.inference.problem import Problem
from scissorcal.inference.squares import descend, has_squares
from scissorcal.inference.status import NotFiniteError, SearchStatus, named

Array = NDArray[np.float64]

WORST = 1e300
"""Stands for a log-posterior of -inf: finite, because BOBYQA calls a NaN or an infinity solved."""

HUGE = 1e100
"""Slopes beyond this are those of an overflow, and say nothing."""

SAME_HEIGHT = 0.5
"""Two points whose log-posteriors differ by less than this count as equally high."""

SETTLED = 1e-3
"""A round of search that gains less log-posterior than this has arrived."""

ROUNDS = 12
ROUNDS_BEFORE_CHOICE = 2
HOPELESS = 20.0
"""A start this much log-posterior below the best one after its first rounds is given up."""

AT_BOUND = 1e-6
"""Distance from a bound, in units of the prior's, that counts as lying on it."""


@dataclass(frozen=True)
class Cluster:
    """A distinct optimum: where it is (p,), how high, and how many starts ended there.

    ``settled`` is false where the search was given up far below another optimum, or ran out of
    rounds.
    """

    point: Array
    value: float
    starts: int
    settled: bool


@dataclass(frozen=True)
class Optimum:
    """The best point that any start led to.

    ``status`` says how the search ended and what to do, ``sentence`` the same with the names of
    the parameters it concerns; ``success`` is true where the point may be used. ``optima`` are the
    distinct optima, highest first. ``agreeing`` counts the starts that ended at the same height,
    ``starts`` all of them; ``evaluations`` counts calls of the objective.
    """

    point: Array
    value: float
    success: bool
    sentence: str
    agreeing: int
    starts: int
    evaluations: int
    status: SearchStatus = SearchStatus.SETTLED
    optima: tuple[Cluster, ...] = ()


def find_optimum(problem: Problem, starts: Array | None = None) -> Optimum:
    """Maximise a log-posterior from every row of ``starts`` (default: the problem's own).

    Each start is followed by rounds of BOBYQA (Powell 2009, report DAMTP 2009/NA06) in coordinates
    that the scores' outer product makes round, until a round gains nothing: strongly correlated
    parameters then cost no more than independent ones. A start whose first rounds end far below
    another's is given up. The best point ever seen is kept, whatever code the library returns,
    since it reports rounding trouble at points that are solved and success at points it never
    could evaluate. Ends between which the log-posterior does not dip are one optimum.

    Raises NotFiniteError (a ValueError) if the log-posterior is finite at no start.
    """
    chosen = np.atleast_2d(problem.starts if starts is None else starts)
    begun = [_climb(problem, _begin(problem, start), ROUNDS_BEFORE_CHOICE) for start in chosen]
    top = max(climb.value for climb in begun)
    if not np.isfinite(top):
        raise NotFiniteError(
            "The log-posterior is finite at no start; check the data for NaN and the starts for "
            "values that the priors rule out."
        )
    ended = [
        _climb(problem, climb, ROUNDS) if climb.value > top - HOPELESS else climb for climb in begun
    ]
    best = max(ended, key=lambda climb: climb.value)
    agreeing = sum(climb.value > best.value - SAME_HEIGHT for climb in ended)
    optima = _clusters(problem, ended)
    status, concerned = _status(problem, best)
    sentence = status.value + (f" It concerns {concerned}." if concerned else "")
    if agreeing < len(ended):
        sentence += f" {agreeing} of {len(ended)} starts ended there, the others lower."
    if rivals := [c for c in optima[1:] if c.settled and c.value > best.value - SAME_HEIGHT * 6]:
        sentence += f" {len(rivals)} other optima are about as high."
    return Optimum(
        point=best.point,
        value=best.value,
        success=status.found,
        sentence=sentence,
        agreeing=agreeing,
        starts=len(ended),
        evaluations=sum(climb.evaluations for climb in ended) + 4 * len(best.point),
        status=status,
        optima=optima,
    )


def scattered_starts(problem: Problem, count: int) -> Array:
    """The problem's starts and ``count`` more around the first one, (k + count, p).

    They are spread as a normal of the prior's width by a Sobol sequence, the same every time, for
    posteriors whose optimum hides behind a plateau or a lower one.
    """
    from scipy.stats import norm, qmc

    size = problem.starts.shape[1]
    uniform = qmc.Sobol(size, scramble=False).random_base2(int(np.ceil(np.log2(count + 1))))
    away = norm.ppf(uniform[1 : count + 1]) * problem.prior_sd
    return np.vstack([problem.starts, _inside(problem, problem.starts[0] + away)])


def move_optimum(optimum: Optimum, point: Array, value: float) -> Optimum:
    """The same optimum after polishing: its best cluster moves along."""
    first = replace(optimum.optima[0], point=point, value=value) if optimum.optima else None
    return replace(
        optimum,
        point=point,
        value=value,
        optima=(first, *optimum.optima[1:]) if first else (),
    )


@dataclass(frozen=True)
class _Climb:
    point: Array
    value: float
    gained: float
    root: Array
    evaluations: int


def _begin(problem: Problem, start: Array) -> _Climb:
    point = np.clip(np.array(start, dtype=np.float64), problem.lower, problem.upper)
    value = problem.log_posterior(point)
    if np.isfinite(value) and has_squares(problem):
        descent = descend(problem, point)
        used = descent.evaluations + 1
        return _Climb(descent.point, descent.value, descent.promised, descent.root, used)
    root = _rounding(problem, point) if np.isfinite(value) else np.diag(problem.prior_sd)
    return _Climb(point, value, np.inf, root, 1 + 2 * len(point))


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
    columns = [
        0.5 * (terms(point + reach) - terms(point - reach)) / 1e-4 for reach in np.diag(step)
    ]
    scaled = np.stack(columns, axis=-1)
    scaled = np.where(np.abs(scaled) < HUGE, scaled, 0.0)
    information = scaled.T @ scaled + np.eye(len(point))
    values, vectors = np.linalg.eigh(information)
    return np.asarray(problem.prior_sd[:, None] * vectors / np.sqrt(values))


def _clusters(problem: Problem, ended: list[_Climb]) -> tuple[Cluster, ...]:
    """Distinct optima, highest first."""
    found: list[Cluster] = []
    for climb in sorted(ended, key=lambda climb: -climb.value):
        if not np.isfinite(climb.value):
            continue
        for index, known in enumerate(found):
            if _same(problem, climb, known):
                settled = known.settled or climb.gained < SETTLED
                found[index] = replace(known, starts=known.starts + 1, settled=settled)
                break
        else:
            found.append(Cluster(climb.point, climb.value, 1, climb.gained < SETTLED))
    return tuple(found)


def _same(problem: Problem, climb: _Climb, known: Cluster) -> bool:
    """Whether two ends are near one another, or joined by a straight ridge without a dip."""
    away = climb.point - known.point
    if float(np.linalg.norm(np.linalg.solve(climb.root, away))) < 0.1:
        return True
    floor = min(climb.value, known.value) - SAME_HEIGHT
    return all(
        problem.log_posterior(known.point + share * away) > floor for share in (0.25, 0.5, 0.75)
    )


def _status(problem: Problem, best: _Climb) -> tuple[SearchStatus, str]:
    """How the best climb ended, and the names of the parameters that it concerns."""
    scale = problem.prior_sd
    at_bound = np.minimum(best.point - problem.lower, problem.upper - best.point) < AT_BOUND * scale
    if np.any(at_bound):
        return SearchStatus.AT_BOUNDS, named(problem.names, at_bound)
    settled = best.gained < SETTLED
    width = np.sqrt(np.diag(best.root @ best.root.T))
    around = _beside(problem.log_posterior, problem, best.point, (1e-3 if settled else 2.0) * width)
    if np.any(edges := np.asarray(np.any(~np.isfinite(around), axis=1))):
        return SearchStatus.NOT_FINITE, named(problem.names, edges)
    if not settled:
        return SearchStatus.ROUNDS_USED_UP, ""
    height = problem.log_likelihood(best.point)
    away = np.abs(_beside(problem.log_likelihood, problem, best.point, 0.1 * scale) - height)
    silent = np.all(away <= 1e-9 * (1 + abs(height)), axis=1)
    if np.any(silent):
        return SearchStatus.AT_START, named(problem.names, silent)
    return SearchStatus.SETTLED, ""


def _beside(
    function: Callable[[Array], float], problem: Problem, point: Array, reach: Array
) -> Array:
    """Values on both sides of a point along each parameter, within the bounds, (p, 2)."""
    return np.array(
        [
            [function(_inside(problem, point + sign * step)) for sign in (-1, 1)]
            for step in np.diag(reach)
        ]
    )


def _inside(problem: Problem, point: Array) -> Array:
    return np.asarray(np.clip(point, problem.lower, problem.upper))
