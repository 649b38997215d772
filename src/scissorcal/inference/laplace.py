"""A posterior's shape around its optimum: information, stretch for autocorrelation, covariance."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from scissorcal.aliases import Array
from scissorcal.inference.curvature import (
    Slopes,
    gradient,
    hessian,
    likelihood_information,
    natural_step,
    slopes_at,
)
from scissorcal.inference.optimise import Optimum, move_optimum
from scissorcal.inference.problem import NotFiniteError, Problem, picked

RIDGE = 1e-3
"""Information, in units of the prior's, that keeps directions without data well defined. As the
data's it is of independent terms: of terms that count a share, it counts the share."""

LEAST_INFORMATION = 0.1
"""Information along any direction, in units of the prior's, that a covariance is built from."""

REACH = 3.0
"""Standard deviations that a Newton step from the optimum may lead without being tried."""

POLISHED = 1e-8
"""Log-posterior that a further Newton step would have to promise for it to be taken."""

POLISHING_ROUNDS = 6
NEAR = 0.1
"""Standard deviations within which a posterior's shape is taken as known."""
FINE_FALL = 1e-3
"""Fall of the log-posterior over a step of the last, fine derivatives."""


@dataclass(frozen=True)
class Shape:
    """Derivatives at a point: of the likelihood's terms (n, p), its information, the prior's.

    ``slopes`` are those of the residuals, where the problem gives any.
    """

    point: Array
    slopes: Slopes | None
    scores: Array
    information: Array
    slope_prior: Array
    curvature_prior: Array

    @property
    def slope(self) -> Array:
        """Gradient of the log-posterior, shape (p,)."""
        return np.asarray(self.scores.sum(axis=0) + self.slope_prior)


@dataclass(frozen=True)
class Laplace:
    """The normal approximation of a posterior, and the posterior it approximates.

    ``log_posterior`` is the posterior that is to be sampled: as written for independent terms,
    else stretched about ``pivot`` by the map ``stretch`` (p, p). ``inflation`` (p,) is the factor
    by which autocorrelation widens each standard deviation; ``null`` names, for each direction the
    data leave to the prior, its parameters with their weights. ``log_posteriors`` is the same
    posterior over points (k, p), shape (k,). ``step`` (p,) is Newton's from the optimum.
    """

    pivot: Array
    stretch: Array
    step: Array
    covariance: Array
    inflation: Array
    null: tuple[str, ...]
    log_posterior: Callable[[Array], float]
    log_posteriors: Callable[[Array], Array]

    @cached_property
    def centre(self) -> Array:
        """Where a Newton step of at most `REACH` sds leads, or the whole step if that is higher.

        A prior far from the data pulls a stretched posterior that far: there the step is exact
        where both are normal, and a proposal that stayed behind would never see its mass.
        """
        reach = REACH * np.sqrt(np.diag(self.covariance))
        near, far = self.pivot + np.clip(self.step, -reach, reach), self.pivot + self.step
        if np.array_equal(near, far):
            return near
        return far if self.log_posterior(far) > self.log_posterior(near) else near

    def stretched(self, points: Array) -> Array:
        """Where the posterior that is sampled has what the written one has at ``points``."""
        return np.asarray(self.pivot + np.linalg.solve(self.stretch, (points - self.pivot).T).T)

    def written(self, points: Array) -> Array:
        """Where the written posterior has what the one that is sampled has at ``points``."""
        return np.asarray(self.pivot + (points - self.pivot) @ self.stretch.T)


def shape_at(problem: Problem, point: Array, fall: float = 0.3) -> Shape:
    """Measure derivatives at an optimum over steps along which the likelihood falls by ``fall``.

    Raises NotFiniteError (a ValueError) where they are not finite numbers.
    """
    scale = problem.prior_sd
    step = natural_step(problem.log_likelihood, point, 0.1 * scale, fall)
    slopes = slopes_at(problem, point, step)
    scores = slopes.scores if slopes else _scores(problem, point, step)
    slope_prior, curvature_prior = _prior_shape(problem, point, step)
    columns = np.vstack([scores, curvature_prior, slope_prior])
    finite = np.asarray(np.all(np.isfinite(columns), axis=0))
    information = None
    if np.all(finite):
        try:
            information = likelihood_information(problem, point, step, slopes)
        except np.linalg.LinAlgError:
            finite = np.zeros(len(point), dtype=np.bool_)
    if information is None:
        raise NotFiniteError(
            "The log-posterior is not a finite number right beside its optimum along "
            f"{', '.join(picked(problem.names, ~finite))}, so its curvature cannot be measured: "
            "check the data for gaps and extreme values, or narrow the priors to where the model "
            "holds."
        )
    return Shape(point, slopes, scores, information, slope_prior, curvature_prior)


def polish(problem: Problem, optimum: Optimum) -> tuple[Optimum, Shape]:
    """Newton steps from where the search settled to the optimum; those that rise are kept.

    The last ones use fine differences, so that smooth problems reach their optimum to rounding
    while rough ones keep what the search found. Where a Hessian costs p^2 evaluations (a smooth
    posterior without squares), the one before a full step of less than a tenth of a standard
    deviation is taken as that after it.
    """
    point, value = optimum.point, optimum.value
    shape = shape_at(problem, point)
    if problem.smooth and problem.standardised is None:
        return _polish_by_one_hessian(problem, optimum, shape)
    fall = None
    for _ in range(POLISHING_ROUNDS):
        local = shape if fall is None else shape_at(problem, point, fall)
        precision = local.information + local.curvature_prior
        move = _inverse(precision, problem.prior_sd, least=0.0) @ local.slope
        reached = _uphill(problem, point, value, move) if local.slope @ move > POLISHED else None
        if reached is None:
            if fall is not None:
                break
            fall = FINE_FALL
            continue
        point, value = reached
        shape = shape_at(problem, point) if fall is None else shape
    if not np.array_equal(point, shape.point):
        shape = shape_at(problem, point)
    return move_optimum(optimum, point, value), shape


def _polish_by_one_hessian(
    problem: Problem, optimum: Optimum, shape: Shape
) -> tuple[Optimum, Shape]:
    point, value = optimum.point, optimum.value
    for _ in range(POLISHING_ROUNDS):
        precision = shape.information + shape.curvature_prior
        move = _inverse(precision, problem.prior_sd, least=0.0) @ shape.slope
        reached = _uphill(problem, point, value, move) if shape.slope @ move > POLISHED else None
        if reached is None:
            break
        away = reached[0] - point
        point, value = reached
        if np.allclose(away, move) and 0.0 <= away @ precision @ away < NEAR**2:
            break
        shape = shape_at(problem, point)
    return move_optimum(optimum, point, value), shape


def laplace(problem: Problem, shape: Shape, spread: Array | None) -> Laplace:
    """Approximate a posterior at its optimum by a normal distribution.

    ``spread`` (p, p) is the covariance of the sum of scores as autocorrelation makes it; None
    where the terms are independent. The information H counts their share as independent; the
    likelihood is stretched about its optimum so that its curvature becomes H J^-1 H, with J the
    ``spread`` (Chandler and Bate 2007, doi:10.1093/biomet/asm015), or that of independent terms
    where that is less.
    """
    scale, point = problem.prior_sd, shape.point
    stretch, robust = (
        (np.eye(len(point)), shape.information)
        if spread is None
        else _stretch(shape.information, spread, scale, problem.share)
    )
    covariance = _inverse(robust + shape.curvature_prior, scale)
    slope = shape.slope_prior + stretch.T @ shape.scores.sum(axis=0)
    naive = _inverse(shape.information / problem.share + shape.curvature_prior, scale)

    def log_posterior(u: Array) -> float:
        if np.any(u < problem.lower) or np.any(u > problem.upper):
            return -np.inf
        prior = float(problem.log_prior(u))
        total = prior + problem.log_likelihood(point + stretch @ (u - point))
        return total if np.isfinite(total) else -np.inf

    def log_posteriors(points: Array) -> Array:
        inside = np.all((points >= problem.lower) & (points <= problem.upper), axis=1)
        heights = np.full(len(points), -np.inf)
        if np.any(inside):
            kept = points[inside]
            written = point + (kept - point) @ stretch.T
            heights[inside] = problem.log_priors(kept) + problem.log_likelihoods(written)
        return np.where(np.isfinite(heights), heights, -np.inf)

    return Laplace(
        pivot=point,
        stretch=stretch,
        step=covariance @ slope,
        covariance=covariance,
        inflation=np.sqrt(np.diag(covariance) / np.diag(naive)),
        null=_null_directions(robust, scale, problem.names),
        log_posterior=problem.log_posterior if spread is None else log_posterior,
        log_posteriors=problem.log_posteriors if spread is None else log_posteriors,
    )


def local_covariance(problem: Problem, point: Array, local: Laplace) -> Array | None:
    """Covariance around another optimum, stretched as the first one's; None on a ridge's edge."""
    try:
        shape = shape_at(problem, point)
    except NotFiniteError:
        return None
    covariance = _inverse(shape.information + shape.curvature_prior, problem.prior_sd)
    wider = np.linalg.inv(local.stretch)
    return np.asarray(wider @ covariance @ wider.T)


def _uphill(
    problem: Problem, point: Array, value: float, move: Array
) -> tuple[Array, float] | None:
    for share in (1.0, 0.5, 0.2):
        reached = np.clip(point + share * move, problem.lower, problem.upper)
        height = problem.log_posterior(reached)
        if height > value:
            return reached, height
    return None


def _inverse(precision: Array, scale: Array, least: float = LEAST_INFORMATION) -> Array:
    """Covariance from a precision, taken in units of the prior and positive definite for sure."""
    unit = np.outer(scale, scale)
    scaled = precision * unit
    values, vectors = np.linalg.eigh(0.5 * (scaled + scaled.T))
    floor = max(least, 1e-14 * float(np.abs(values).max()), 1e-300)
    return np.asarray((vectors / np.maximum(values, floor)) @ vectors.T * unit)


def _stretch(information: Array, spread: Array, scale: Array, share: float) -> tuple[Array, Array]:
    """The map C of Chandler and Bate and the robust information H J^-1 H, both (p, p).

    The information counts a ``share`` of the terms. Directions that change faster than the noise's
    memory are worth more than that, but at most what independent terms are.
    """
    unit = np.outer(scale, scale)
    H = information * unit + share * RIDGE * np.eye(len(scale))
    root = _root(H)
    inverse = np.linalg.inv(root)
    values, vectors = np.linalg.eigh(inverse @ (spread * unit) @ inverse)
    widened = np.maximum(values, share)
    robust = root @ (vectors / widened) @ vectors.T @ root
    inner = inverse @ (vectors / np.sqrt(widened)) @ vectors.T @ root
    return inner * scale[:, None] / scale[None, :], 0.5 * (robust + robust.T) / unit


def _root(matrix: Array) -> Array:
    values, vectors = np.linalg.eigh(matrix)
    return np.asarray((vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T)


def _scores(problem: Problem, point: Array, step: Array) -> Array:
    """Derivatives of each term's logarithm (n, p), by differences."""
    return np.asarray(problem.share * gradient(problem.log_likelihood_terms, point, step))


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
