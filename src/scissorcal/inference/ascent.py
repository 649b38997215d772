"""Local searches: ascent by gradients, and least squares."""

from collections.abc import Callable

import numpy as np

from scissorcal.aliases import Array
from scissorcal.inference.problem import Problem, Stop
from scissorcal.inference.squares import Descent

STEP = 0.02
"""Step of the central differences, in standard deviations by the scores' outer product."""
ROUNDS = 3
STEPS = 40
ARRIVED = 1e-4
"""Log-posterior that a step has to promise to be worth taking."""
ARMIJO, HALVINGS = 1e-4, 12
LONGEST = 30.0
"""Longest step, in standard deviations by the scores' outer product."""


def ascend(
    problem: Problem,
    start: Array,
    rounding: Callable[[Problem, Array], Array],
    stop: Stop | None = None,
) -> Descent:
    """Maximise a smooth log-posterior from one start (p,) by BFGS with central differences.

    Each round works in coordinates that ``rounding`` makes round, a root (p, p) of a covariance at
    a point, so that the first step is a Newton step already (Nocedal and Wright 2006, chapter 6).
    Rounds end where one gains nothing.
    """
    point = np.clip(np.array(start, dtype=np.float64), problem.lower, problem.upper)
    value = problem.log_posterior(point)
    root, promised = np.diag(problem.prior_sd), np.inf
    for _ in range(ROUNDS):
        if not np.isfinite(value) or (stop is not None and stop()):
            break
        before = value
        surface = _Surface(problem, point, rounding(problem, point))
        z, value, slope, inverse = _bfgs(surface, value, stop)
        point, promised = surface.at(z), 0.5 * float(slope @ inverse @ slope)
        root = surface.root @ _root_of(inverse)
        if value - before < ARRIVED or promised < ARRIVED:
            break
    return Descent(point, value, promised, root)


class _Surface:
    """A log-posterior in round coordinates about a centre."""

    def __init__(self, problem: Problem, centre: Array, root: Array) -> None:
        self.problem, self.centre, self.root = problem, centre, root

    def at(self, z: Array) -> Array:
        wanted = self.centre + self.root @ z
        return np.asarray(np.clip(wanted, self.problem.lower, self.problem.upper))

    def height(self, z: Array) -> float:
        return self.problem.log_posterior(self.at(z))

    def slope(self, z: Array) -> Array:
        steps = STEP * np.eye(len(z))
        points = [self.at(z + step) for step in steps] + [self.at(z - step) for step in steps]
        heights = self.problem.log_posteriors(np.array(points))
        ahead, behind = heights[: len(z)], heights[len(z) :]
        known = np.isfinite(ahead) & np.isfinite(behind)
        with np.errstate(invalid="ignore"):
            return np.where(known, (ahead - behind) / (2 * STEP), 0.0)


def _bfgs(surface: _Surface, value: float, stop: Stop | None) -> tuple[Array, float, Array, Array]:
    """Ascend with one gradient a step: place, height, slope, and the inverse curvature learnt."""
    size = len(surface.centre)
    z, inverse = np.zeros(size), np.eye(size)
    slope = surface.slope(z)
    for _ in range(STEPS):
        move = inverse @ slope
        promised = float(slope @ move)
        if promised < 2 * ARRIVED or (stop is not None and stop()):
            break
        reach = min(1.0, LONGEST / float(np.linalg.norm(move)))
        for _ in range(HALVINGS):
            height = surface.height(z + reach * move)
            if height > value + ARMIJO * reach * promised:
                break
            reach *= 0.4
        else:
            break
        step, value = reach * move, height
        z = z + step
        after = surface.slope(z)
        change = slope - after
        slope = after
        turned = float(step @ change)
        if turned > 1e-3 * float(np.linalg.norm(step) * np.linalg.norm(change)):
            left = np.eye(size) - np.outer(step, change) / turned
            inverse = left @ inverse @ left.T + np.outer(step, step) / turned
    return z, value, slope, inverse


def _root_of(covariance: Array) -> Array:
    values, vectors = np.linalg.eigh(0.5 * (covariance + covariance.T))
    return np.asarray(vectors * np.sqrt(np.maximum(values, 1e-12)))


MOST_EVALUATIONS = 200
WORST = 1e75
"""Stands for a residual that is not finite; its square still is."""


def least_squares(
    evaluate: Callable[[Array], tuple[Array, Array]], start: Array, *, precision: float = 1e-10
) -> tuple[Array, bool]:
    """Minimise a sum of squared residuals from ``start`` (p,); return the point and convergence.

    ``evaluate`` gives residuals (n,) and their slopes (n, p) at a point: models that come with
    both (OpenCV's projection, products of columns) are evaluated once per step. The search is
    Levenberg and Marquardt's as MINPACK has it (More 1978, doi:10.1007/BFb0067700), each parameter
    scaled by its slopes; its overhead is a fifth of that of scipy's trust-region method. It has
    converged where a step changes the sum or the point by less than ``precision`` of it. There must
    be as many residuals as parameters at least, else ValueError. It has not converged where
    residuals or slopes are not finite at the end, or beyond ``WORST``. Residuals of different
    points are compared by their sum of squares alone, so that they may be rotated from point to
    point.
    """
    from scipy.optimize import least_squares as search

    last: list[tuple[bytes, Array, Array, bool]] = []

    def at(x: Array) -> tuple[Array, Array, bool]:
        if not last or last[0][0] != x.tobytes():
            with np.errstate(all="ignore"):
                rows, slopes = evaluate(x)
                known = all(bool(np.all(np.abs(a) < WORST)) for a in (rows, slopes))
                if not known:
                    rows, slopes = _bounded(rows), _bounded(slopes)
            last[:] = [(x.tobytes(), rows, slopes, known)]
        return last[0][1:]

    if len(at(np.asarray(start))[0]) < len(start):
        raise ValueError("least squares need at least as many residuals as parameters")

    def residuals(x: Array) -> Array:
        return at(x)[0]

    def jacobian(x: Array) -> Array:
        return at(x)[1]

    found = search(
        residuals,
        start,
        jac=jacobian,
        method="lm",
        x_scale="jac",
        ftol=precision,
        xtol=precision,
        gtol=1e-15,
        max_nfev=MOST_EVALUATIONS,
    )
    return np.asarray(found.x), bool(found.success) and at(found.x)[2]


def _bounded(values: Array) -> Array:
    """Values without what is not finite, within ``WORST``."""
    return np.asarray(np.clip(np.nan_to_num(values), -WORST, WORST))
