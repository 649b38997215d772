"""Local searches for the posterior's optima from several starts, and how they ended."""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from scissorcal.aliases import Array
from scissorcal.inference.ascent import ascend
from scissorcal.inference.problem import (
    Counter,
    NotFiniteError,
    Problem,
    SearchStatus,
    Stop,
    about,
    picked,
)
from scissorcal.inference.squares import Descent, descend, has_squares

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

ROUGH = 0.05
"""Rise promised by differences a standard deviation long from which a likelihood counts as rough,
where short differences promise none; skewness of a smooth one stays below."""

RESTARTS = 3
"""Searches begun anew from a higher point that was seen beside a supposed optimum."""

FARTHEST_LOOK = 10.0
"""Distance, in prior widths, at which the fall beside an optimum is looked at where neither data
nor prior say how wide it is."""

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

    ``status`` says how the search ended and what to do, ``concerns`` names the parameters that it
    is said of, ``sentence`` has both; ``success`` is true where the point may be used. ``optima``
    are the distinct optima, highest first. ``agreeing`` counts the starts that ended at the same
    height, ``starts`` all of them; ``evaluations`` counts calls of the objective.
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
    concerns: tuple[str, ...] = ()


def find_optimum(
    problem: Problem, starts: Array | None = None, stop: Stop | None = None
) -> Optimum:
    """Maximise a log-posterior from every row of ``starts`` (default: the problem's own).

    Where residuals are normal, each start is followed by least squares and Fisher scoring
    (:func:`~scissorcal.inference.squares.descend`), where the posterior is smooth by BFGS
    (:func:`~scissorcal.inference.ascent.ascend`). What then still promises a rise, and every
    start of other problems, is followed by rounds of NLopt's BOBYQA, a local search without
    derivatives (Powell 2009, report DAMTP 2009/NA06), in coordinates that the scores' outer product
    makes round, until a round gains nothing: strongly correlated parameters then cost no more than
    independent ones. A start whose first rounds end far below another's is given up. The best point
    is kept, whatever NLopt returns: it reports rounding trouble at points that are solved and
    success at points it never could evaluate. Ends without a dip between them are one optimum.

    An end counts as settled only where the log-posterior falls on both sides along each axis of
    its covariance; where it rises instead, the search goes on from there. ``stop`` says whether the
    time allowed is used up; the search then ends with the best point so far.

    Raises NotFiniteError (a ValueError) if the log-posterior is finite at no start.
    """
    counter = Counter()
    problem = counter.over(problem)
    chosen = np.atleast_2d(problem.starts if starts is None else starts)
    begun = [
        _climb(problem, _begin(problem, start, stop), ROUNDS_BEFORE_CHOICE, stop)
        for start in chosen
    ]
    top = max(climb.value for climb in begun)
    if not np.isfinite(top):
        raise NotFiniteError(
            "The log-posterior is finite at no start; check the data for NaN and the starts for "
            "values that the priors rule out."
        )
    ended = [
        _climb(problem, climb, ROUNDS, stop) if climb.value > top - HOPELESS else climb
        for climb in begun
    ]
    first = max(range(len(ended)), key=lambda index: ended[index].value)
    ended[first], around = _confirmed(problem, ended[first], stop)
    best = ended[first]
    agreeing = sum(climb.value >= best.value - SAME_HEIGHT for climb in ended)
    optima = _clusters(problem, ended)
    status, concerns = _status(problem, best, around, stop)
    sentence = about(status, concerns)
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
        evaluations=counter.calls,
        status=status,
        optima=optima,
        concerns=concerns,
    )


def move_optimum(optimum: Optimum, point: Array, value: float) -> Optimum:
    """The same optimum after polishing: its best cluster moves along."""
    first = replace(optimum.optima[0], point=point, value=value) if optimum.optima else None
    return replace(
        optimum,
        point=point,
        value=value,
        optima=(first, *optimum.optima[1:]) if first else (),
    )


def _begin(problem: Problem, start: Array, stop: Stop | None) -> Descent:
    point = np.clip(np.array(start, dtype=np.float64), problem.lower, problem.upper)
    value = problem.log_posterior(point)
    unknown = np.diag(problem.prior_sd)
    if not np.isfinite(value) or (stop is not None and stop()):
        return Descent(point, value, np.inf, unknown)
    if has_squares(problem):
        return descend(problem, point, stop)
    if problem.smooth:
        return ascend(problem, point, _rounding, stop)
    return Descent(point, value, np.inf, _rounding(problem, point))


def _climb(problem: Problem, climb: Descent, rounds: int, stop: Stop | None) -> Descent:
    point, value, gained, root = climb.point, climb.value, climb.promised, climb.root
    for _ in range(rounds):
        if not np.isfinite(value) or gained < SETTLED or (stop is not None and stop()):
            break
        reached, height = _round(problem, point, value, root, stop)
        gained, point, value = height - value, reached, height
        if gained >= SETTLED:
            root = _rounding(problem, point)
    return Descent(point, value, gained, root)


def _confirmed(problem: Problem, climb: Descent, stop: Stop | None) -> tuple[Descent, Array]:
    """Look beside an end along the axes of its covariance, and go on from what is higher there.

    Returns the end that was reached and what the log-posterior loses on both sides, (axes, 2).
    Without squares there is no gradient to go by, and in a bent valley a round may gain nothing far
    from its end: such an end counts only where a search from a point beside it comes no higher.
    """
    lost, polished = np.zeros((0, 2)), False
    for _ in range(RESTARTS + 1):
        lost, higher = _beside_axes(problem, climb)
        used_up = stop is not None and stop()
        if higher is not None and not used_up:
            climb = _climb(problem, _begin(problem, higher, stop), ROUNDS, stop)
            continue
        if used_up or climb.promised >= SETTLED:
            break
        if has_squares(problem) or problem.smooth:
            if polished or _promised_from_afar(lost) < ROUGH:
                break
            polished = True
            rough = replace(climb, promised=np.inf, root=_rounding(problem, climb.point))
            climb = _climb(problem, rough, ROUNDS, stop)
            continue
        again = _climb(problem, _begin(problem, _perturbed(problem, climb), stop), 1, stop)
        if again.value < climb.value + SETTLED:
            break
        climb = _climb(problem, again, ROUNDS, stop)
        if climb.promised < SETTLED:
            climb = replace(climb, promised=np.inf)
    return climb, lost


def _promised_from_afar(lost: Array) -> float:
    """Rise that a Newton step promises by what is lost a standard deviation beside, (axes, 2)."""
    known = lost[np.all(np.isfinite(lost), axis=1)]
    slope = 0.5 * (known[:, 0] - known[:, 1])
    curvature = np.maximum(known.sum(axis=1), 1.0)
    return float(0.5 * np.sum(slope**2 / curvature))


def _perturbed(problem: Problem, climb: Descent) -> Array:
    """A point half a standard deviation along every axis away, where it can be evaluated."""
    signs = np.where(np.arange(len(climb.point)) % 2 == 0, 1.0, -1.0)
    for share in (0.5, -0.5, 0.05, -0.05):
        point = _inside(problem, climb.point + share * (climb.root @ signs))
        if np.isfinite(problem.log_posterior(point)):
            return point
    return climb.point


def _beside_axes(problem: Problem, climb: Descent) -> tuple[Array, Array | None]:
    """What is lost a standard deviation beside an end, (axes, 2), and the best point if higher.

    Where rounding hides a fall, farther away counts, up to ``FARTHEST_LOOK`` prior widths.
    """
    axes = climb.root.T
    length = np.linalg.norm(axes / problem.prior_sd, axis=1)
    axes = axes * np.minimum(1.0, FARTHEST_LOOK / np.maximum(length, 1e-300))[:, None]
    points = np.concatenate([_inside(problem, climb.point + sign * axes) for sign in (-1, 1)])
    heights = problem.log_posteriors(points)
    top = int(np.argmax(heights))
    lost = climb.value - heights.reshape(2, -1).T
    for axis, side in np.argwhere(np.abs(lost) < SETTLED):
        reach = axes[axis] * (2 * side - 1)
        while np.abs(lost[axis, side]) < SETTLED and (
            np.linalg.norm(reach / problem.prior_sd) < FARTHEST_LOOK
        ):
            reach = reach * 10.0
            there = problem.log_posterior(_inside(problem, climb.point + reach))
            lost[axis, side] = climb.value - there
    return lost, points[top] if heights[top] > climb.value + SETTLED else None


def _round(
    problem: Problem, centre: Array, value: float, root: Array, stop: Stop | None
) -> tuple[Array, float]:
    import nlopt

    best_point, best_value = centre, value

    def cost(z: Array, gradient: Array) -> float:
        nonlocal best_point, best_value
        if stop is not None and stop():
            search.force_stop()
            return WORST
        wanted = centre + root @ z
        inside = np.clip(wanted, problem.lower, problem.upper)
        height = problem.log_posterior(inside)
        if height > best_value:
            best_point, best_value = inside, height
        outside = float(np.sum(((wanted - inside) / problem.prior_sd) ** 2))
        return -height + 1e4 * outside if np.isfinite(height) else WORST

    size = len(centre)
    search = nlopt.opt(nlopt.LN_BOBYQA, size)
    search.set_min_objective(cost)
    search.set_lower_bounds(np.full(size, -1e3))
    search.set_upper_bounds(np.full(size, 1e3))
    search.set_initial_step(np.ones(size))
    search.set_ftol_abs(1e-3 * SETTLED)
    search.set_maxeval(25 * size)
    try:
        search.optimize(np.zeros(size))
    except (nlopt.RoundoffLimited, nlopt.ForcedStop):
        return best_point, best_value
    return best_point, best_value


def _rounding(problem: Problem, point: Array) -> Array:
    """Root of the covariance that the scores suggest, for rounder coordinates."""
    terms = problem.log_likelihood_terms
    step = 1e-4 * problem.prior_sd
    columns = [
        0.5 * (terms(point + reach) - terms(point - reach)) / 1e-4 for reach in np.diag(step)
    ]
    scaled = np.stack(columns, axis=-1)
    scaled = np.where(np.abs(scaled) < HUGE, scaled, 0.0)
    information = problem.share * scaled.T @ scaled + np.eye(len(point))
    values, vectors = np.linalg.eigh(information)
    values = np.maximum(values, 1.0)  # exact ones are; rounding of large ones leaves some below 0
    return np.asarray(problem.prior_sd[:, None] * vectors / np.sqrt(values))


def _clusters(problem: Problem, ended: list[Descent]) -> tuple[Cluster, ...]:
    """Distinct optima, highest first."""
    clusters: list[Cluster] = []
    for climb in sorted(ended, key=lambda climb: -climb.value):
        if not np.isfinite(climb.value):
            continue
        for index, known in enumerate(clusters):
            if _same(problem, climb, known):
                settled = known.settled or climb.promised < SETTLED
                clusters[index] = replace(known, starts=known.starts + 1, settled=settled)
                break
        else:
            clusters.append(Cluster(climb.point, climb.value, 1, climb.promised < SETTLED))
    return tuple(clusters)


def _same(problem: Problem, climb: Descent, known: Cluster) -> bool:
    """Whether two ends are near one another, or joined by a straight ridge without a dip."""
    away = climb.point - known.point
    if float(np.linalg.norm(np.linalg.solve(climb.root, away))) < 0.1:
        return True
    floor = min(climb.value, known.value) - SAME_HEIGHT
    return all(
        problem.log_posterior(known.point + share * away) > floor for share in (0.25, 0.5, 0.75)
    )


def _status(
    problem: Problem, best: Descent, lost: Array, stop: Stop | None
) -> tuple[SearchStatus, tuple[str, ...]]:
    """How the best ascent ended, and the names of the parameters that it concerns.

    ``lost`` (axes, 2) is what the log-posterior loses beside the end.
    """
    scale = problem.prior_sd
    if is_rounded(best.value):
        return SearchStatus.ROUNDED, ()
    at_bound = np.minimum(best.point - problem.lower, problem.upper - best.point) < AT_BOUND * scale
    if np.any(at_bound):
        return SearchStatus.AT_BOUNDS, picked(problem.names, at_bound)
    settled = best.promised < SETTLED and bool(np.all(lost > -SETTLED))
    if not settled and stop is not None and stop():
        return SearchStatus.TIME_USED_UP, ()
    width = np.sqrt(np.diag(best.root @ best.root.T))
    around = _beside(problem.log_posterior, problem, best.point, (1e-3 if settled else 2.0) * width)
    if np.any(edges := np.asarray(np.any(~np.isfinite(around), axis=1))):
        return SearchStatus.NOT_FINITE, picked(problem.names, edges)
    if not settled:
        return SearchStatus.ROUNDS_USED_UP, ()
    height = problem.log_likelihood(best.point)
    away = np.abs(_beside(problem.log_likelihood, problem, best.point, 0.1 * scale) - height)
    silent = np.all(away <= 1e-9 * (1 + abs(height)), axis=1)
    if np.any(silent):
        return SearchStatus.AT_START, picked(problem.names, silent)
    if np.any(level := np.asarray(np.any(lost < SETTLED, axis=1))):
        share = np.square(best.root / problem.prior_sd[:, None])[:, level]
        concerned = np.any(share > 0.1 * share.sum(axis=0), axis=1)
        return SearchStatus.PLATEAU, picked(problem.names, np.asarray(concerned))
    return SearchStatus.SETTLED, ()


def is_rounded(value: float) -> bool:
    """Whether rounding of a log-posterior hides differences by which a search settles.

    >>> is_rounded(-1e9), is_rounded(-1e17)
    (False, True)
    """
    return bool(np.spacing(abs(value)) > SETTLED)


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
