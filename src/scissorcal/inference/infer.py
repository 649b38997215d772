"""One posterior, inferred at a chosen effort: draft (Laplace) or standard (PSIS)."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from scissorcal.inference.curvature import gradient, hessian, natural_step
from scissorcal.inference.importance import sample_by_importance
from scissorcal.inference.information import likelihood_information, slopes_at
from scissorcal.inference.long_run import long_run_covariance
from scissorcal.inference.optimise import Optimum, find_optimum
from scissorcal.inference.problem import Problem

Array = NDArray[np.float64]
Progress = Callable[[float, str], None]

RIDGE = 1e-3
"""Information, in units of the prior's, that keeps directions without data well defined."""

LEAST_INFORMATION = 0.1
"""Information along any direction, in units of the prior's, that a covariance is built from."""


@dataclass(frozen=True)
class Posterior:
    """What inference returns: equally weighted draws (n, p) and how they came about.

    ``k_hat`` is NaN at draft effort, where nothing is sampled against the posterior. ``null``
    names, for each direction the data leave to the prior, its parameters with their weights.
    ``inflation`` (p,) is the factor by which autocorrelation widens each standard deviation;
    ``noise_orders`` are those of the autoregressions that the data chose, ``dispersion`` what
    strokes vary beyond them.
    """

    names: tuple[str, ...]
    optimum: Optimum
    draws: Array
    covariance: Array
    k_hat: float
    effective: float
    inflation: Array
    null: tuple[str, ...]
    noise_orders: tuple[int, ...] = ()
    dispersion: float = 1.0


def infer(
    problem: Problem,
    effort: Literal["draft", "standard"],
    rng: np.random.Generator,
    *,
    count: int = 2000,
    optimum: Optimum | None = None,
    progress: Progress | None = None,
) -> Posterior:
    """Infer a posterior whose likelihood terms may be autocorrelated.

    The optimum is that of the posterior as given. Its curvature H treats all terms as
    independent; the scores' long-run covariance J tells what they are really worth. The
    likelihood is therefore stretched about its optimum so that its curvature becomes
    H J^-1 H, which gives intervals their stated coverage although the noise is coloured or the
    model not quite true (Chandler and Bate 2007, doi:10.1093/biomet/asm015). ``optimum`` may be
    passed if it is known already.
    """
    tell = progress or (lambda done, sentence: None)
    tell(0.0, "searching the optimum")
    best = optimum or find_optimum(problem)
    tell(0.4, "measuring the curvature")
    scale, terms = problem.prior_sd, problem.log_likelihood_terms
    step = natural_step(problem.log_likelihood, best.point, 0.1 * scale)
    slopes = slopes_at(problem, best.point, step)
    information = likelihood_information(problem, best.point, step, slopes)
    scores = slopes.scores if slopes else gradient(terms, best.point, step)
    spread = long_run_covariance(problem, scores, slopes)
    stretch, robust = _stretch(information, spread.covariance, scale)
    slope_prior, curvature_prior = _prior_shape(problem, best.point, step)
    precision = robust + curvature_prior
    covariance = _inverse(precision, scale)
    reach = 3 * np.sqrt(np.diag(covariance))
    slope = slope_prior + stretch.T @ scores.sum(axis=0)
    centre = best.point + np.clip(covariance @ slope, -reach, reach)
    naive = _inverse(information + curvature_prior, scale)
    inflation = np.sqrt(np.diag(covariance) / np.diag(naive))
    null = _null_directions(robust, scale, problem.names)

    def adjusted(point: Array) -> float:
        if np.any(point < problem.lower) or np.any(point > problem.upper):
            return -np.inf
        return float(problem.log_prior(point)) + problem.log_likelihood(
            best.point + stretch @ (point - best.point)
        )

    if effort == "draft":
        draws = rng.multivariate_normal(centre, covariance, size=count, method="cholesky")
        draws = np.clip(draws, problem.lower, problem.upper)
        return Posterior(
            problem.names,
            best,
            draws,
            covariance,
            np.nan,
            float(count),
            inflation,
            null,
            spread.orders,
            spread.dispersion,
        )
    tell(0.5, "sampling")
    sampled = sample_by_importance(adjusted, centre, covariance, count, rng)
    tell(1.0, f"k-hat {sampled.k_hat:.2f}")
    return Posterior(
        problem.names,
        best,
        sampled.resample(count, rng),
        covariance,
        sampled.k_hat,
        sampled.effective,
        inflation,
        null,
        spread.orders,
        spread.dispersion,
    )


def _inverse(precision: Array, scale: Array) -> Array:
    """Covariance from a precision, taken in units of the prior and positive definite for sure."""
    unit = np.outer(scale, scale)
    scaled = precision * unit
    values, vectors = np.linalg.eigh(0.5 * (scaled + scaled.T))
    return np.asarray((vectors / np.maximum(values, LEAST_INFORMATION)) @ vectors.T * unit)


def _stretch(information: Array, spread: Array, scale: Array) -> tuple[Array, Array]:
    """The map C of Chandler and Bate and the robust information H J^-1 H, both (p, p).

    Along directions where the scores vary less than their information says, which negative
    autocorrelation can bring about, the information is kept: robustness only widens.
    """
    unit = np.outer(scale, scale)
    H = information * unit + RIDGE * np.eye(len(scale))
    root = _root(H)
    inverse = np.linalg.inv(root)
    values, vectors = np.linalg.eigh(inverse @ (spread * unit) @ inverse)
    widened = np.maximum(values, 1.0)
    robust = root @ (vectors / widened) @ vectors.T @ root
    inner = inverse @ (vectors / np.sqrt(widened)) @ vectors.T @ root
    return inner * scale[:, None] / scale[None, :], 0.5 * (robust + robust.T) / unit


def _root(matrix: Array) -> Array:
    values, vectors = np.linalg.eigh(matrix)
    return np.asarray((vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T)


def _prior_shape(problem: Problem, point: Array, step: Array) -> tuple[Array, Array]:
    reach = np.maximum(step, 1e-3 * problem.prior_sd)
    slope = gradient(lambda u: np.array([problem.log_prior(u)]), point, reach)[0]
    curvature = -hessian(lambda u: float(problem.log_prior(u)), point, reach)
    return slope, 0.5 * (curvature + curvature.T)


def _null_directions(information: Array, scale: Array, names: tuple[str, ...]) -> tuple[str, ...]:
    values, vectors = np.linalg.eigh(information * np.outer(scale, scale))
    found = []
    for value, vector in zip(values, vectors.T, strict=True):
        if value < 1.0:
            share = vector**2
            largest = [i for i in np.argsort(-share) if share[i] > 0.1]
            found.append(" + ".join(f"{names[i]} ({share[i]:.0%})" for i in largest))
    return tuple(found)
