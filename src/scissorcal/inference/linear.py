"""What is linear and normal is integrated in closed form, and drawn back afterwards."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from scissorcal.inference.infer import infer
from scissorcal.inference.posterior import Effort, Posterior
from scissorcal.inference.problem import Problem

Array = NDArray[np.float64]


@dataclass(frozen=True)
class LinearProblem:
    """Measurements that are linear in some parameters once the others are known.

    measured (n,) = offset + design @ beta + noise, with ``design_at`` (theta) giving offset (n,)
    and design (n, q), ``log_sd_at`` (theta) the logarithm of the noise's standard deviation, a
    number or (n,), and beta normal with ``linear_mean`` (q,) and ``linear_covariance`` (q, q).
    ``names``, ``log_prior``, ``prior_sd``, ``starts``, ``lower`` and ``upper`` are those of the
    nonlinear parameters theta (p,), as in :class:`Problem`.

    The noise must be independent and normal given the parameters. Noise with memory is made so by
    passing ``measured``, the offset and the design through the whitening filter first; a
    likelihood that is to be stretched for autocorrelation is not of this kind, and neither is a
    linear parameter whose prior is not normal (a log-normal one, say).
    """

    names: tuple[str, ...]
    linear_names: tuple[str, ...]
    measured: Array
    design_at: Callable[[Array], tuple[Array, Array]]
    log_sd_at: Callable[[Array], Array | float]
    linear_mean: Array
    linear_covariance: Array
    log_prior: Callable[[Array], float]
    prior_sd: Array
    starts: Array
    lower: Array
    upper: Array


def infer_linear(
    problem: LinearProblem,
    effort: Effort,
    rng: np.random.Generator,
    *,
    count: int = 2000,
) -> Posterior:
    """Infer the nonlinear parameters alone, then draw the linear ones given each draw of those.

    The result is over all parameters, the nonlinear ones first; its ``covariance`` is that of the
    draws, its ``optimum`` and diagnostics are those of the nonlinear ones, which is all that was
    searched and sampled. Where no parameter is nonlinear, pass the noise's size as one.
    """
    found = infer(marginalised(problem), effort, rng, count=count)
    draws = with_linear(problem, found.draws, rng)
    added = np.full(len(problem.linear_names), np.nan)
    return replace(
        found,
        names=(*problem.names, *problem.linear_names),
        draws=draws,
        covariance=np.cov(draws, rowvar=False),
        inflation=np.ones(draws.shape[1]),
        r_hat=np.concatenate([found.r_hat, added]),
        tau=np.concatenate([found.tau, added]),
        log_posterior=lambda u: _log_joint(problem, u),
    )


def marginalised(problem: LinearProblem) -> Problem:
    """The posterior of the nonlinear parameters, its linear ones integrated out.

    With b the mean of beta given theta and the data, p(y | theta) = p(y | b) p(b) / p(b | y), all
    three normal (Lindley and Smith 1972, doi:10.1111/j.2517-6161.1972.tb00885.x). The first factor
    gives one term to each observation, so that residuals and information are what they are in
    other problems; the others are one number and stand with the prior.
    """
    halved = _Conditional(problem)

    def log_prior(theta: Array) -> float:
        prior = float(problem.log_prior(theta))
        return prior + halved.at(theta).log_volume if np.isfinite(prior) else -np.inf

    def standardised(theta: Array) -> tuple[Array, Array]:
        given = halved.at(theta)
        return given.residuals, given.log_sd

    def terms(theta: Array) -> Array:
        given = halved.at(theta)
        return np.asarray(-0.5 * given.residuals**2 - given.log_sd)

    return Problem(
        names=problem.names,
        log_prior=log_prior,
        log_likelihood_terms=terms,
        series=np.zeros(len(problem.measured), dtype=np.int64),
        prior_sd=problem.prior_sd,
        starts=problem.starts,
        lower=problem.lower,
        upper=problem.upper,
        standardised=standardised,
        independent=True,
    )


def with_linear(problem: LinearProblem, draws: Array, rng: np.random.Generator) -> Array:
    """Draws of the nonlinear parameters (k, p) with a draw of the linear ones each, (k, p + q)."""
    halved = _Conditional(problem)
    normal = rng.standard_normal((len(draws), len(problem.linear_names)))
    linear = [halved.at(theta).draw(z) for theta, z in zip(draws, normal, strict=True)]
    return np.column_stack([draws, np.stack(linear)])


def _log_joint(problem: LinearProblem, u: Array) -> float:
    """Log-posterior of all parameters (p + q,), the linear ones not integrated."""
    theta, beta = u[: len(problem.names)], u[len(problem.names) :]
    if np.any(theta < problem.lower) or np.any(theta > problem.upper):
        return -np.inf
    offset, design = problem.design_at(theta)
    log_sd = np.broadcast_to(problem.log_sd_at(theta), problem.measured.shape)
    z = (problem.measured - offset - design @ beta) * np.exp(-log_sd)
    away = beta - problem.linear_mean
    prior = away @ np.linalg.solve(problem.linear_covariance, away)
    total = problem.log_prior(theta) - 0.5 * float(z @ z + prior) - float(log_sd.sum())
    return total if np.isfinite(total) else -np.inf


@dataclass(frozen=True)
class _Given:
    """The linear parameters given the others: normal in z, where beta = mean + root z.

    ``z`` (q,) is the conditional mean and ``precision_root`` (q, q) the Cholesky root of its
    precision, in coordinates in which the prior is standard normal; ``log_sd`` is by observation
    (n,), ``left`` are measured minus offset (n,).
    """

    z: Array
    precision_root: Array
    beta: Array
    root: Array
    left: Array
    design: Array
    log_sd: Array

    @property
    def log_volume(self) -> float:
        """log p(b) - log p(b | y), up to a constant."""
        return float(-0.5 * self.z @ self.z - np.log(np.diag(self.precision_root)).sum())

    @cached_property
    def residuals(self) -> Array:
        """Standardised residuals (n,) at the conditional mean."""
        return np.asarray((self.left - self.design @ self.beta) * np.exp(-self.log_sd))

    def draw(self, normal: Array) -> Array:
        """Linear parameters (q,) from standard normal numbers (q,)."""
        return np.asarray(self.beta + self.root @ np.linalg.solve(self.precision_root.T, normal))


class _Conditional:
    """Works out the conditional of the linear parameters, once for each theta in a row."""

    def __init__(self, problem: LinearProblem) -> None:
        self.problem = problem
        self.root: Array = np.asarray(np.linalg.cholesky(problem.linear_covariance))
        self.last: tuple[bytes, _Given] | None = None

    def at(self, theta: Array) -> _Given:
        key = np.asarray(theta, dtype=np.float64).tobytes()
        if self.last is None or self.last[0] != key:
            self.last = (key, self._worked_out(theta))
        return self.last[1]

    def _worked_out(self, theta: Array) -> _Given:
        problem, root = self.problem, self.root
        offset, design = problem.design_at(theta)
        log_sd = np.asarray(problem.log_sd_at(theta), dtype=np.float64)
        weight = np.exp(-2 * log_sd)
        weighed = design if log_sd.ndim == 0 else design * weight[:, None]
        factor = float(weight) if log_sd.ndim == 0 else 1.0
        left = problem.measured - offset
        gram = np.asarray(factor * (weighed.T @ design), dtype=np.float64)
        pull = factor * (weighed.T @ left) - gram @ problem.linear_mean
        size = len(pull)
        every = np.broadcast_to(log_sd, left.shape)
        if not (np.all(np.isfinite(gram)) and np.all(np.isfinite(pull))):
            nowhere = np.full(size, np.nan)
            return _Given(nowhere, np.eye(size), nowhere, root, left, design, every)
        precision_root: Array = np.asarray(np.linalg.cholesky(np.eye(size) + root.T @ gram @ root))
        z = np.linalg.solve(precision_root.T, np.linalg.solve(precision_root, root.T @ pull))
        beta = problem.linear_mean + root @ z
        return _Given(z, precision_root, beta, root, left, design, every)
