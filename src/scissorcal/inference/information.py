"""Information of a likelihood, from slopes of its residuals where it has any."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.inference.curvature import gradient, hessian
from scissorcal.inference.problem import Problem


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
