"""Derivatives by differences, and the information of a likelihood."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.inference.problem import Problem


def gradient(function: Callable[[Array], Array], point: Array, step: Array) -> Array:
    """Derivatives of a vector function by each parameter, shape (n, p).

    Central differences at ``step`` and ``step`` / 2, extrapolated to fourth order
    (Richardson 1911, doi:10.1098/rsta.1911.0009). ``step`` has shape (p,).
    """
    columns = []
    for index in range(len(point)):
        reach = np.zeros_like(point)
        reach[index] = step[index]
        wide = (function(point + reach) - function(point - reach)) / (2 * step[index])
        near = (function(point + reach / 2) - function(point - reach / 2)) / step[index]
        columns.append((4 * near - wide) / 3)
    return np.moveaxis(np.stack(columns), 0, -1)


def hessian(
    function: Callable[[Array], float],
    point: Array,
    step: Array,
    many: Callable[[Array], Array] | None = None,
) -> Array:
    """Second derivatives of a scalar function, shape (p, p), of fourth order in ``step`` (p,).

    ``many`` gives the function at points (k, p) at once, shape (k,), where that is cheaper.
    """
    every = many or (lambda points: np.array([function(u) for u in points]))
    wide = _hessian_once(every, point, step)
    near = _hessian_once(every, point, step / 2)
    return (4 * near - wide) / 3


def natural_step(
    function: Callable[[Array], float], point: Array, first: Array, fall: float = 0.3
) -> Array:
    """Steps (p,) over which ``function`` falls by about ``fall`` from its optimum at ``point``.

    Differences at this step rise well above rounding and stay well within the quadratic
    neighbourhood. A parameter on which the function does not depend keeps its ``first`` step.
    """
    value = function(point)
    steps = np.array(first, dtype=np.float64)
    for index in range(len(point)):
        for _ in range(12):
            reach = np.zeros_like(point)
            reach[index] = steps[index]
            lost = value - 0.5 * (function(point + reach) + function(point - reach))
            if not np.isfinite(lost):
                steps[index] *= 0.1
                continue
            if 0.2 * fall < lost < 5 * fall:
                break
            factor = np.sqrt(fall / lost) if lost > 0 else 4.0
            steps[index] = min(steps[index] * float(np.clip(factor, 0.02, 4.0)), first[index])
            if steps[index] == first[index] and lost < fall:
                break
    return steps


def _hessian_once(many: Callable[[Array], Array], point: Array, step: Array) -> Array:
    size = len(point)
    reach = np.diag(step)
    pairs = [(i, j) for i in range(size) for j in range(i)]
    both = [reach[i] + reach[j] for i, j in pairs]
    away = np.vstack([np.zeros((1, size)), reach, *([both] if both else [])])
    values = many(np.vstack([point + away, point - away[1:]]))
    centre, sums = values[0], values[1 : len(away)] + values[len(away) :]
    single = sums[:size]
    result = np.diag((single - 2 * centre) / step**2)
    for (i, j), sum_both in zip(pairs, sums[size:], strict=True):
        mixed = sum_both - single[i] - single[j] + 2 * centre
        result[i, j] = result[j, i] = mixed / (2 * step[i] * step[j])
    return result


@dataclass(frozen=True)
class Slopes:
    """How terms with residuals z and sizes s depend on the parameters, at one point.

    ``pull`` (n,) is minus the derivative of a term's logarithm by z. ``by_mean`` (n, p) are the
    slopes of the residuals over their sizes, the sizes held; ``by_size`` (n, p) those of log s. A
    score is -pull * by_mean + (z * pull - 1) * by_size, times the ``share`` of independent terms.
    """

    z: Array
    pull: Array
    by_mean: Array
    by_size: Array
    share: float = 1.0

    def where(self, keep: NDArray[np.bool_]) -> "Slopes":
        """Those of the terms that ``keep`` (n,) selects."""
        z, pull = self.z[keep], self.pull[keep]
        return Slopes(z, pull, self.by_mean[keep], self.by_size[keep], self.share)

    @property
    def scores(self) -> Array:
        """Derivatives of each term's logarithm, shape (n, p)."""
        size_pull = self.z * self.pull - 1.0
        scores = size_pull[:, None] * self.by_size - self.pull[:, None] * self.by_mean
        return np.asarray(self.share * scores)


def slopes_at(problem: Problem, point: Array, step: Array) -> Slopes | None:
    """Slopes of a problem's residuals; None where it gives none."""
    if problem.standardised is None:
        return None
    normal = problem.standardised
    z, _ = normal(point)
    both = gradient(lambda u: np.concatenate(normal(u)), point, step)
    by_size = both[len(z) :]
    nu = problem.tails
    pull = z if np.isinf(nu) else (nu + 1.0) * z / (nu + z**2)
    return Slopes(z, pull, both[: len(z)] + z[:, None] * by_size, by_size, problem.share)


def likelihood_information(
    problem: Problem, point: Array, step: Array, slopes: Slopes | None = None
) -> Array:
    """Information of the likelihood at a point, shape (p, p), positive semi-definite.

    For normal terms Fisher's own: the sum of dm dm' + 2 dlog(s) dlog(s)', m the means over their
    standard deviations; for Student-t terms of nu degrees of freedom the same with the weights (nu
    + 1) / (nu + 3) and 2 nu / (nu + 3) (Lange, Little and Taylor 1989,
    doi:10.1080/01621459.1989.10478852). Otherwise minus the Hessian, as far as it is positive.
    ``slopes`` spares working them out again.
    """
    slopes, nu = slopes or slopes_at(problem, point, step), problem.tails
    if slopes is None:
        many = problem.log_likelihoods if problem.log_posterior_many else None
        return _positive(-hessian(problem.log_likelihood, point, step, many), problem.prior_sd)
    of_mean = 1.0 if np.isinf(nu) else (nu + 1.0) / (nu + 3.0)
    of_size = 2.0 if np.isinf(nu) else 2.0 * nu / (nu + 3.0)
    by_mean, by_size = slopes.by_mean.T @ slopes.by_mean, slopes.by_size.T @ slopes.by_size
    return np.asarray(slopes.share * (of_mean * by_mean + of_size * by_size))


def _positive(matrix: Array, scale: Array) -> Array:
    """Nearest positive semi-definite matrix, judged in units of the prior."""
    values, vectors = np.linalg.eigh(matrix * np.outer(scale, scale))
    return np.asarray((vectors * np.maximum(values, 0.0)) @ vectors.T / np.outer(scale, scale))
