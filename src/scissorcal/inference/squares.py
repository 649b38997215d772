"""Search for an optimum where residuals are normal: least squares, then Fisher scoring."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.inference.curvature import gradient, hessian
from scissorcal.inference.problem import Problem, Stop, TimeUsedUpError

ALTERNATIONS = 8
"""Rounds of least squares with the standard deviations held, each followed by scoring."""

SCORING_STEPS = 8
ARRIVED = 1e-4
"""Log-posterior that a scoring step has to promise to be worth taking."""

WIDEST_STEP = 1e-5
"""Longest step of a difference, in units of the prior's width."""

SHARE_OF_SD = 0.01
"""Step of a difference, in conditional standard deviations of a parameter."""

ROUNDING = 1e-13
"""Relative rounding of residuals; slopes below what it makes of a difference are none."""

SMALLEST_STEP = 1e-8
PRIOR_STEP = 0.1
"""Step of the prior's differences, in units of its width: normal priors have no error at any."""

PRECISE = 1e-10
MOST_STEPS = 1000
"""Steps of least squares; curved valleys of public test problems take up to 1,300."""

BLOWN = 1e75
"""Stands for a residual that is not finite; its square still is."""

OUTSIDE = 1e2
"""Residual for leaving the bounds by one prior width."""


@dataclass(frozen=True)
class Descent:
    """Where least squares ended: point (p,), log-posterior, and what it knows of the surroundings.

    ``promised`` is the log-posterior that a further scoring step promises, half the squared
    gradient in posterior standard deviations; infinite where it could not be worked out. ``root``
    (p, p) is a root of the covariance there, its columns the principal axes in prior widths.
    """

    point: Array
    value: float
    promised: float
    root: Array


def has_squares(problem: Problem) -> bool:
    """Whether a problem's likelihood is a sum of squares but for the standard deviations."""
    return problem.standardised is not None and bool(np.isinf(problem.tails))


def descend(problem: Problem, start: Array, stop: Stop | None = None) -> Descent:
    """Maximise a log-posterior with normal residuals from one start (p,).

    In turn: residuals over standard deviations that are held, with a row for each direction in
    which the prior is curved, go to scipy.optimize.least_squares, a trust-region method (Branch,
    Coleman and Li 1999, doi:10.1137/S1064827595289108); the common factor of the standard
    deviations is set to what the residuals show; steps of Fisher scoring then move everything
    together. What is kept is judged by the log-posterior itself at every stage, so that standard
    deviations that depend on the parameters cost rounds, never correctness. ``stop`` ends the
    search between two stages. Bounds are kept by clipping, with a residual for what lies outside.
    """
    begin = np.clip(np.asarray(start, dtype=np.float64), problem.lower, problem.upper)
    search = _Search(problem, begin, stop or (lambda: False))
    for _ in range(ALTERNATIONS):
        if not np.isfinite(search.value) or search.stop():
            break
        before = search.value
        search.fit_means()
        search.fit_scale()
        promised = search.score()
        if promised < ARRIVED or search.value - before < ARRIVED:
            break
    return search.ended()


class _Search:
    """The state of one descent: the best point so far and what has been spent."""

    def __init__(self, problem: Problem, start: Array, stop: Stop) -> None:
        self.problem = problem
        self.stop = stop
        self.scale = problem.prior_sd
        self.point = start
        self.promised = np.inf
        self.root = np.diag(self.scale)
        self.reach = WIDEST_STEP * self.scale
        self.prior = _PriorRows(problem)
        self.value = self.height(start)

    def ended(self) -> Descent:
        return Descent(self.point, self.value, self.promised, self.root)

    def normal(self, point: Array) -> tuple[Array, Array]:
        assert self.problem.standardised is not None
        with np.errstate(all="ignore"):
            return self.problem.standardised(self.clipped(point))

    def clipped(self, point: Array) -> Array:
        return np.asarray(np.clip(point, self.problem.lower, self.problem.upper))

    def height(self, point: Array) -> float:
        return self.problem.log_posterior(self.clipped(point))

    def better(self, point: Array) -> bool:
        """Move to a point where the log-posterior is higher there."""
        inside = self.clipped(point)
        height = self.height(inside)
        if not height > self.value:
            return False
        self.point, self.value = inside, height
        return True

    def slopes(self, log_sd: Array | None = None) -> tuple[Array, Array, Array, Array]:
        """Residuals (n,), log sds (n,) and their slopes (n, p) in units of the prior's width.

        With ``log_sd`` given, residuals are over those standard deviations.
        """
        return _slopes(self, self.point, log_sd)

    def fit_means(self) -> None:
        """Least squares over the parameters that residuals depend on, standard deviations held."""
        from scipy.optimize import least_squares

        held = self.normal(self.point)[1]
        z, _, by_mean, _ = self.slopes(held)
        moving = np.flatnonzero(_moves(by_mean, z))
        if len(moving) == 0:
            return
        begin, scale = self.point, self.scale
        rows_of_prior, weight = self.prior.at(begin), np.sqrt(self.problem.share)

        def moved(x: Array) -> Array:
            point = begin.copy()
            point[moving] = scale[moving] * x
            return point

        lowest, best = np.inf, begin

        def rows(x: Array) -> Array:
            nonlocal lowest, best
            if self.stop():
                raise TimeUsedUpError
            point = moved(x)
            z, log_sd = self.normal(point)
            with np.errstate(all="ignore"):
                data = weight * z * np.exp(log_sd - held)
            out = OUTSIDE * (point - self.clipped(point)) / scale
            every = _finite(np.concatenate([data, rows_of_prior(point), out]))
            if (cost := float(every @ every)) < lowest:
                lowest, best = cost, point
            return every

        def jacobian(x: Array) -> Array:
            centre = rows(x)
            columns = []
            for index, parameter in enumerate(moving):
                step = self.reach[parameter] / scale[parameter]
                there = x.copy()
                there[index] += step
                columns.append((rows(there) - centre) / step)
            matrix = np.stack(columns, axis=-1)
            self.adapt(moving, matrix)
            return np.asarray(np.clip(matrix, -BLOWN, BLOWN))

        try:
            least_squares(
                rows,
                begin[moving] / scale[moving],
                jac=jacobian,
                method="trf",
                x_scale="jac",
                ftol=PRECISE,
                xtol=PRECISE,
                gtol=None,
                max_nfev=MOST_STEPS,
            )
        except TimeUsedUpError:
            self.stop = lambda: True
        reached = best
        if self.better(reached):
            return
        # Standard deviations that depend on the means can make a better fit the less likely one,
        # until they are set anew.
        before = self.point, self.value
        self.point, self.value = self.clipped(reached), self.height(reached)
        if np.isfinite(self.value):
            self.fit_scale()
        if not self.value > before[1]:
            self.point, self.value = before

    def adapt(self, parameters: NDArray[np.int64], matrix: Array) -> None:
        """Steps of later differences, from the slopes (n, k) of rows in prior widths."""
        size = np.sqrt(np.sum(np.square(np.clip(matrix, -1e100, 1e100)), axis=0))
        steps = SHARE_OF_SD / np.maximum(size, SHARE_OF_SD / WIDEST_STEP)
        self.reach[parameters] = np.maximum(steps, SMALLEST_STEP) * self.scale[parameters]

    def fit_scale(self) -> None:
        """Multiply all standard deviations by what residuals call for, where parameters can."""
        z, _, by_mean, by_size = self.slopes()
        if len(z) == 0:
            return
        free = np.flatnonzero(~_moves(by_mean, z) & np.any(by_size != 0.0, axis=0))
        spread = float(np.sqrt(np.mean(z**2)))
        if len(free) == 0 or not 0.0 < spread < np.inf:
            return
        direction, *_ = np.linalg.lstsq(by_size[:, free], np.ones(len(z)), rcond=None)
        move = np.zeros(len(self.scale))
        move[free] = direction * self.scale[free]
        for share in (1.0, 0.5, 0.25):
            if self.better(self.point + share * np.log(spread) * move):
                return

    def score(self) -> float:
        """Fisher scoring on everything together, damped where a step lowers the log-posterior."""
        damping = 0.0
        for _ in range(SCORING_STEPS):
            z, _, by_mean, by_size = self.slopes()
            curvature, slope = self.prior.shape(self.point)
            share = self.problem.share
            gradient_ = slope + share * ((z**2 - 1.0) @ by_size - z @ by_mean)
            information = by_mean.T @ by_mean + 2.0 * by_size.T @ by_size
            precision = share * information + curvature
            if not (np.all(np.isfinite(precision)) and np.all(np.isfinite(gradient_))):
                self.promised = np.inf
                break
            values, vectors = np.linalg.eigh(precision)
            values = np.maximum(values, max(1e-14 * values[-1], 1e-12))
            along = vectors.T @ gradient_
            self.root = self.scale[:, None] * vectors / np.sqrt(values)
            self.promised = float(0.5 * np.sum(along**2 / values))
            if self.promised < ARRIVED:
                break
            climbed = False
            for _ in range(6):
                step = vectors @ (along / (values * (1.0 + damping)))
                if self.better(self.point + self.scale * step):
                    damping, climbed = 0.3 * damping if damping > 1e-2 else 0.0, True
                    break
                damping = max(4.0 * damping, 1.0)
            if not climbed:
                break
        return self.promised


def _slopes(
    search: _Search, point: Array, log_sd: Array | None = None
) -> tuple[Array, Array, Array, Array]:
    z, own = search.normal(point)
    held = own if log_sd is None else log_sd
    factor = np.exp(own - held)
    by_mean, by_size = [], []
    for index, reach in enumerate(search.reach):
        there = point.copy()
        there[index] += reach if point[index] + reach <= search.problem.upper[index] else -reach
        step = (there[index] - point[index]) / search.scale[index]
        z_there, own_there = search.normal(there)
        with np.errstate(all="ignore"):
            by_mean.append((z_there * np.exp(own_there - held) - z * factor) / step)
        by_size.append((own_there - own) / step)
    return z * factor, own, np.stack(by_mean, axis=-1), np.stack(by_size, axis=-1)


class _PriorRows:
    """A log-prior as rows of residuals: exact for a normal one, local for others."""

    def __init__(self, problem: Problem) -> None:
        self.problem = problem

    def shape(self, point: Array) -> tuple[Array, Array]:
        """Precision (p, p) and gradient (p,) in units of the prior's width; zero where flat."""
        step, scale = PRIOR_STEP * self.problem.prior_sd, self.problem.prior_sd
        log_prior = self.problem.log_prior
        slope = gradient(lambda u: np.array([log_prior(u)]), point, step)[0] * scale
        curvature = -hessian(lambda u: float(log_prior(u)), point, step) * np.outer(scale, scale)
        if not (np.all(np.isfinite(slope)) and np.all(np.isfinite(curvature))):
            return np.zeros((len(point), len(point))), np.zeros(len(point))
        values, vectors = np.linalg.eigh(0.5 * (curvature + curvature.T))
        return np.asarray((vectors * np.maximum(values, 0.0)) @ vectors.T), slope

    def at(self, point: Array) -> Callable[[Array], Array]:
        """Rows over points whose squares are, but for a constant, -2 log-prior near ``point``."""
        curvature, slope = self.shape(point)
        values, vectors = np.linalg.eigh(curvature)
        kept = values > 1e-9
        root = np.sqrt(values[kept])
        axes = vectors[:, kept]
        offset = (axes.T @ slope) / root

        def rows(u: Array) -> Array:
            away = (u - point) / self.problem.prior_sd
            return np.asarray(root * (axes.T @ away) - offset)

        return rows


def _moves(by_mean: Array, z: Array) -> NDArray[np.bool_]:
    """Which parameters (p,) residuals depend on, beyond what rounding makes of a difference."""
    noise = ROUNDING / WIDEST_STEP * np.max(np.abs(z), initial=0.0)
    return np.asarray(np.max(np.abs(by_mean), axis=0, initial=0.0) > noise)


def _finite(rows: Array) -> Array:
    return np.asarray(np.where(np.abs(rows) < BLOWN, rows, BLOWN))
