"""How much groups of data differ beyond what each of them leaves open: a normal hierarchy."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array

CHAINS, BURN, SWEEPS = 40, 30, 40
"""Chains run side by side, sweeps that are thrown away, and sweeps that are kept."""
GRID = np.geomspace(3e-3, 50.0, 40)
"""Standard deviations between groups that are weighed, in units of their scale; further ones of
the same ratio where groups are farther apart."""
BEYOND = 4.0
"""How far beyond the largest difference of two groups the grid reaches: with two groups, a standard
deviation of four times their difference is a tenth as likely as one like it."""
COMMON_GRID = np.geomspace(1e-2, 10.0, 25)
SLAB = 10.0
"""Size of a difference that nobody would call small, in units of the scale."""
FREE = 0.5
"""Prior probability that a parameter's scatter is of that size, whatever the others do."""
LEVEL = 0.9
"""Probability of the interval by which a scatter that is not known is replaced by one normal."""
BISECTIONS = 50
"""Halvings of an interval, down to rounding."""
BROAD = 1e-4
"""Share of the prior's precision that a group's estimate keeps where its data are silent."""


@dataclass(frozen=True)
class Between:
    """Posterior of the standard deviations between groups, and of the population's values.

    ``sd`` (n, p) are draws of the standard deviations, ``population`` (n, p) of the values that
    groups scatter about, row by row.
    """

    sd: Array
    population: Array


def between_groups(
    means: Array, precisions: Array, scale: Array, prior: Array, rng: np.random.Generator
) -> Between:
    """Estimate the scatter between groups from each group's own estimate.

    Group r has estimate ``means[r]`` (p,) with precision ``precisions[r]`` (p, p), by its
    likelihood alone. Its true values are normal about the population's, independently by parameter:

        theta_r ~ N(theta, diag(tau^2)),
        tau_j ~ N+(0, (g scale_j)^2) or N+(0, (SLAB scale_j)^2), evenly,  g ~ C+(0, 1) up to 10.

    Groups mostly agree, by a size g that all parameters share (Carvalho, Polson and Scott 2010,
    doi:10.1093/biomet/asq017), and where one parameter does not, it alone is let go. Its prior is
    then flat up to the slab's size, which leaves few groups the wide intervals that they must have
    (Gelman 2006, doi:10.1214/06-BA117A); with two groups nothing but the slab bounds tau from
    above. Every moment of tau is finite, as both priors are half-normal. ``prior`` (p, p) is the
    precision of the parameters' own prior, which holds what a group's data leave open. Gibbs
    sampling over grids of tau, with theta_r integrated out.

    ValueError where an estimate is not finite, or a scale not above zero.
    """
    if not (np.all(np.isfinite(means)) and np.all(np.isfinite(precisions))):
        raise ValueError("groups are compared by estimates that are finite numbers")
    if not np.all(scale > 0.0):
        raise ValueError("groups are compared on scales above zero")
    grids = [_grid(float(apart)) for apart in np.ptp(means, axis=0) / scale]
    held = precisions + BROAD * prior
    covariances = np.linalg.inv(held)
    p = means.shape[1]
    state = _State(
        scale=scale,
        theta=np.broadcast_to(means.mean(axis=0), (CHAINS, p)).copy(),
        tau=scale * rng.choice(GRID[5:35], (CHAINS, p)),
        common=np.ones(CHAINS),
    )
    kept: list[tuple[Array, Array]] = []
    for sweep in range(BURN + SWEEPS):
        spread = state.tau[:, None, :, None] ** 2 * np.eye(p)
        inverse = np.asarray(np.linalg.inv(covariances + spread), dtype=np.float64)
        _move_population(state, means, inverse, rng)
        for j in range(p):
            _move_sd(state, j, grids[j], means, inverse, rng)
        _move_common(state, rng)
        if sweep >= BURN:
            kept.append((state.tau.copy(), state.theta.copy()))
    return Between(*(np.concatenate(parts) for parts in zip(*kept, strict=True)))


def one_normal(variances: Array) -> Array:
    """Standard deviations (p,) of the normals whose 90 % intervals are those of mixtures.

    ``variances`` (n, p) are those of n equally likely normals about one centre. Two groups say so
    little of their scatter that the sd of the mixture over it is up to seven times its 90 %
    half-width: it follows tails of the prior, which no group has shown. A normal of the same
    interval keeps what is promised, and its moments agree with its quantiles.

    >>> one_normal(np.full((8, 1), 4.0)).round(6)
    array([2.])
    """
    from scipy.special import erf, ndtri

    reach = float(ndtri(0.5 + 0.5 * LEVEL))
    sd = np.sqrt(np.maximum(variances, np.finfo(float).tiny))
    low, high = reach * sd.min(axis=0), reach * sd.max(axis=0)
    for _ in range(BISECTIONS):
        middle = 0.5 * (low + high)
        inside = np.mean(erf(middle / (np.sqrt(2.0) * sd)), axis=0)
        low, high = np.where(inside < LEVEL, middle, low), np.where(inside < LEVEL, high, middle)
    return np.asarray(0.5 * (low + high) / reach)


@dataclass
class _State:
    """Where every chain is: population (c, p), standard deviations (c, p), common scale (c,).

    ``scale`` (p,) is the one in whose units standard deviations have their grids.
    """

    scale: Array
    theta: Array
    tau: Array
    common: Array


def _move_population(state: _State, means: Array, inverse: Array, rng: np.random.Generator) -> None:
    """Draw theta given tau; ``inverse`` (c, r, p, p) are precisions of estimates about theta."""
    covariance = np.linalg.inv(inverse.sum(axis=1))
    centre = np.einsum("cij,crjk,rk->ci", covariance, inverse, means)
    values, vectors = np.linalg.eigh(covariance)
    noise = rng.standard_normal(centre.shape) * np.sqrt(np.maximum(values, 0.0))
    state.theta = centre + np.einsum("cij,cj->ci", vectors, noise)


def _grid(apart: float) -> Array:
    """The grid for groups whose estimates lie ``apart``, in units of the scale."""
    ratio = float(GRID[1] / GRID[0])
    more = max(0, int(np.ceil(np.log(max(BEYOND * apart, 1e-300) / GRID[-1]) / np.log(ratio))))
    return np.concatenate([GRID, GRID[-1] * ratio ** np.arange(1, more + 1)])


def _move_sd(
    state: _State, j: int, sizes: Array, means: Array, inverse: Array, rng: np.random.Generator
) -> None:
    """Draw tau_j from a grid of ``sizes``, in units of its scale, given all else.

    ``inverse`` is brought up to date (Sherman and Morrison).
    """
    grid = float(state.scale[j]) * sizes
    away = means - state.theta[:, None, :]
    pulled = np.einsum("crk,crk->cr", inverse[..., j, :], away)
    own = inverse[..., j, j]
    added = grid**2 - state.tau[:, j, None] ** 2
    growth = np.maximum(1.0 + added[:, None, :] * own[..., None], 1e-12)
    log = 0.5 * (added[:, None, :] * pulled[..., None] ** 2 / growth - np.log(growth)).sum(axis=1)
    log += _log_prior(sizes, state.common[:, None])
    chosen = _drawn(log, rng)
    change = np.take_along_axis(added, chosen[:, None], axis=1)
    factor = change / np.maximum(1.0 + change * own, 1e-12)
    column = inverse[..., :, j]
    inverse -= factor[..., None, None] * column[..., :, None] * column[..., None, :]
    state.tau[:, j] = grid[chosen]


def _move_common(state: _State, rng: np.random.Generator) -> None:
    log = _log_prior((state.tau / state.scale)[:, :, None], COMMON_GRID).sum(axis=1)
    log = log + np.log(COMMON_GRID) - np.log1p(COMMON_GRID**2)
    state.common = COMMON_GRID[_drawn(log, rng)]


def _log_prior(sd: Array, common: Array) -> Array:
    """Log density of the logarithm of a standard deviation ``sd``, in units of its scale."""
    near, far = _half_normal(sd / common), _half_normal(sd / SLAB)
    return np.asarray(np.log(np.maximum((1.0 - FREE) * near + FREE * far, np.finfo(float).tiny)))


def _half_normal(sd: Array) -> Array:
    """Density of the logarithm of a half-normal variable of scale 1."""
    return np.asarray(np.sqrt(2.0 / np.pi) * sd * np.exp(-0.5 * sd**2))


def _drawn(log: Array, rng: np.random.Generator) -> NDArray[np.int64]:
    """Index (c,) drawn from each row of unnormalised log weights (c, k)."""
    noise = -np.log(-np.log(rng.random(log.shape)))
    return np.asarray(np.argmax(log + noise, axis=1))
