"""The optimum of a friction law by least squares over products of its columns."""

from itertools import product

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.fit_candidate import CandidateProblem
from scissorcal.calibration.friction.columns import Cell
from scissorcal.calibration.friction.moments import ReducedLaw
from scissorcal.inference.ascent import least_squares
from scissorcal.inference.optimise import Cluster, Optimum, is_rounded
from scissorcal.inference.problem import Problem, SearchStatus, about, picked

MOST_ROUNDS = 20
TINY = 1e-300
ARRIVED = 1e-6
"""Log-posterior that a further round has to gain."""
SAME_HEIGHT = 0.5
AT_BOUND = 1e-6
SILENT = 1e-9
SCAN_REACH, SCAN_STEP = 2.5, 0.6
"""Reach of a scan in prior standard deviations, and its step in the logarithm of a scale."""
SCANNED_STARTS = 2
RIDGE = 1e-10


def search(problem: CandidateProblem) -> Optimum:
    """Maximise the log-posterior of a law from the problem's starts and from scans of its scales.

    What depends on a scale has several optima (a search for Dahl's length without a scan ended up
    to 172 nats below the highest): scales are therefore scanned with all columns free, and the best
    places are starts too.
    """
    starts = [*problem.starts, *_scanned(problem)]
    searched = [search_from(problem, start) for start in starts]
    ended = [end for end, _ in searched]
    best = max(ended, key=lambda end: end.value)
    agreeing = sum(end.value > best.value - SAME_HEIGHT for end in ended)
    optima: list[Cluster] = []
    for end in sorted(ended, key=lambda end: -end.value):
        if all(np.abs((end.point - c.point) / problem.prior_sd).max() > 1e-3 for c in optima):
            optima.append(end)
    optima = [c for i, c in enumerate(optima) if i == 0 or _dips(problem, optima[0], c)]
    status, concerns = _status(problem, best.point)
    sentence = about(status, concerns)
    if agreeing < len(ended):
        sentence += f" {agreeing} of {len(ended)} starts ended there, the others lower."
    return Optimum(
        point=best.point,
        value=best.value,
        success=status.found,
        sentence=sentence,
        agreeing=agreeing,
        starts=len(ended),
        evaluations=sum(evaluations for _, evaluations in searched),
        status=status,
        optima=tuple(optima),
        concerns=concerns,
    )


def search_from(problem: CandidateProblem, start: Array) -> tuple[Cluster, int]:
    """Maximise the log-posterior from one start (p,); with the number of evaluations.

    Least squares over the law's coefficients and the best noise for what they leave follow each
    other until the log-posterior stays.
    """
    point = _with_best_noise(problem, np.clip(start, problem.lower, problem.upper))
    value, evaluations = problem.log_posterior(point), 1
    for _ in range(MOST_ROUNDS):
        coefficients, used = _least_squares(problem, point)
        reached = _with_best_noise(problem, np.append(coefficients, point[-1]))
        height = problem.log_posterior(reached)
        evaluations += used + 1
        gained = height - value
        if gained > 0.0:
            point, value = reached, height
        if not gained > ARRIVED:
            break
    return Cluster(point, value, 1, True), evaluations


def _law(problem: CandidateProblem) -> ReducedLaw:
    """The law over products; TypeError where there is none."""
    if problem.reduced is None:
        raise TypeError("this posterior is one over bins: search it with find_optimum")
    return problem.reduced


def _least_squares(problem: CandidateProblem, point: Array) -> tuple[Array, int]:
    """Coefficients (p - 1,) of the least squares at the noise of ``point`` (p,), and evaluations.

    Squares and slopes come from products of columns. A root of these, p rows however much was
    recorded, has the same squares and slopes as all bins and the prior. Outside the bounds the
    prior alone acts.
    """
    law, count = _law(problem), 0
    mean, precision = problem.prior_mean[:-1], problem.prior_precision[:-1, :-1]
    weight = np.sqrt(problem.share) * np.exp(-point[-1])

    def evaluate(coefficients: Array) -> tuple[Array, Array]:
        nonlocal count
        count += 1
        inside = np.clip(coefficients, problem.lower[:-1], problem.upper[:-1])
        u = np.append(inside, point[-1])
        cell = law.cell_at(u)
        factors, slopes = law.factors_and_slopes(u, cell)
        slopes = np.where(inside == coefficients, slopes, 0.0)
        columns = np.column_stack([slopes, factors]) * weight
        away = np.column_stack([np.eye(len(mean)), coefficients - mean])
        products = columns.T @ law.summed(cell) @ columns + away.T @ precision @ away
        size = np.sqrt(np.maximum(np.diag(products), TINY))
        values, vectors = np.linalg.eigh(products / np.outer(size, size))
        root = np.sqrt(np.maximum(values, 0.0))[:, None] * vectors.T * size
        return root[:, -1], root[:, :-1]

    solution, _ = least_squares(evaluate, point[:-1])
    return np.clip(solution, problem.lower[:-1], problem.upper[:-1]), count


def _with_best_noise(problem: CandidateProblem, point: Array) -> Array:
    """The point (p,) with the noise at its best for the squares that the law leaves there."""
    share, law = problem.share, _law(problem)
    squares, count = share * law.squares(point), share * law.counted
    mean, precision = problem.prior_mean[-1], problem.prior_precision[-1, -1]
    size = 0.5 * np.log(squares / count)
    for _ in range(20):
        left = squares * np.exp(-2.0 * size)
        step = (left - count - precision * (size - mean)) / (2.0 * left + precision)
        size += step
        if abs(step) < 1e-12:
            break
    reached = point.copy()
    reached[-1] = np.clip(size, problem.lower[-1], problem.upper[-1])
    return reached


def _scanned(problem: CandidateProblem) -> list[Array]:
    """Starts at the scales at which the columns, each of them free, leave the fewest squares.

    Only laws with Dahl's length need them.
    """
    law = _law(problem)
    names, basis = law.layout.names, law.moments.basis
    if "presliding_length" not in names:
        return []
    late = names.index("presliding_length")
    slow = names.index("stribeck_rate") if "stribeck_rate" in names else None
    lengths = _scan(problem, late, basis.lag.spacing)
    rates: list[int | None] = [None]
    if slow is not None:
        rates = list(_scan(problem, slow, basis.stribeck.spacing))
    scanned = []
    for rate, length in product(rates, lengths):
        cell: Cell = (() if rate is None else (rate,), (length,))
        scanned.append((_free_squares(law, problem.starts[0], cell), rate, length))
    scanned.sort(key=lambda end: end[0])
    starts: list[Array] = []
    taken: list[int] = []
    for _, rate, length in scanned:
        if any(abs(length - other) * basis.lag.spacing < 1.5 * SCAN_STEP for other in taken):
            continue
        taken.append(length)
        start = problem.starts[0].copy()
        start[late] = length * basis.lag.spacing
        if rate is not None and slow is not None:
            start[slow] = rate * basis.stribeck.spacing
        starts.append(start)
        if len(starts) == SCANNED_STARTS:
            break
    return starts


def _scan(problem: CandidateProblem, place: int, spacing: float) -> list[int]:
    return scan_nodes(problem.prior_mean[place], problem.prior_sd[place], spacing)


def scan_nodes(middle: float, sd: float, spacing: float) -> list[int]:
    """Nodes over the prior of a scale's logarithm, of which mean and standard deviation are given.

    ``spacing`` is the distance of nodes in the logarithm.
    """
    reach = SCAN_REACH * sd
    count = max(2, round(2 * reach / SCAN_STEP) + 1)
    logs = np.linspace(middle - reach, middle + reach, count)
    return list(np.unique(np.round(logs / spacing).astype(int)).tolist())


def _free_squares(law: ReducedLaw, start: Array, cell: Cell) -> float:
    """Squares left by the columns that the law has, each with its own factor."""
    products = law.summed(cell)
    used = np.flatnonzero(np.any(law.slopes(start, cell) != 0.0, axis=1))
    size = np.sqrt(np.diag(products)[used])
    used, size = used[size > 0], size[size > 0]
    inner = products[np.ix_(used, used)] / np.outer(size, size)
    outer = products[used, 0] / size
    solution = np.linalg.solve(inner + RIDGE * np.eye(len(used)), outer)
    return float(products[0, 0] - outer @ solution)


def _dips(problem: Problem, best: Cluster, other: Cluster) -> bool:
    """Whether the log-posterior falls between two optima, so that they are two."""
    away = other.point - best.point
    floor = min(best.value, other.value) - SAME_HEIGHT
    return any(
        problem.log_posterior(best.point + share * away) <= floor for share in (0.25, 0.5, 0.75)
    )


def _status(problem: CandidateProblem, point: Array) -> tuple[SearchStatus, tuple[str, ...]]:
    """How the search ended, and the names of the parameters that it concerns."""
    scale = problem.prior_sd
    bound = np.minimum(point - problem.lower, problem.upper - point) < AT_BOUND * scale
    if np.any(bound):
        return SearchStatus.AT_BOUNDS, picked(problem.names, bound)
    law = _law(problem)
    height = law.log_likelihood(point)
    if is_rounded(height):
        return SearchStatus.ROUNDED, ()
    silent = np.array(
        [
            all(
                abs(law.log_likelihood(point + sign * reach) - height) <= SILENT * (1 + abs(height))
                for sign in (-1, 1)
            )
            for reach in np.diag(0.1 * scale)
        ]
    )
    if np.any(silent):
        return SearchStatus.AT_START, picked(problem.names, silent)
    return SearchStatus.SETTLED, ()
