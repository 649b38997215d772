"""Pareto smoothing of importance weights, and the tail index k-hat that judges them."""

import numpy as np

from scissorcal.aliases import Array

LARGEST_TAIL = 0.2
"""Share of the weights that may count as their tail."""

FEWEST_IN_TAIL = 5
PRIOR_DRAWS = 10
PRIOR_K = 0.5
"""Weak prior on the tail index: as much as ten draws, at a half."""

QUARTILES = 3.0


def smooth_weights(log_ratios: Array) -> tuple[Array, Array]:
    """Pareto-smoothed normalised log weights of log ratios (..., n), and their k-hats (...,).

    The largest 3 sqrt(n) ratios, a fifth of them at most, are replaced by quantiles of a
    generalised Pareto distribution that is fitted to them; its shape is k-hat, infinite where the
    tail is too short to be fitted (Vehtari et al. 2024, JMLR 25:72). Ratios must be finite;
    ValueError where they are not, or where there are none.

    >>> draws = np.random.default_rng(0).standard_normal(1000)
    >>> weights, k_hat = smooth_weights(0.1 * draws)
    >>> round(float(np.exp(weights).sum()), 6), bool(k_hat < 0.5)
    (1.0, True)
    """
    rows = np.atleast_2d(log_ratios)
    if rows.size == 0 or not np.all(np.isfinite(rows)):
        raise ValueError("importance ratios are smoothed where there are some, and all are finite")
    smoothed = [_smoothed(row) for row in rows]
    weights = np.stack([row for row, _ in smoothed]).reshape(np.shape(log_ratios))
    return weights, np.array([k_hat for _, k_hat in smoothed]).reshape(np.shape(log_ratios)[:-1])


def _smoothed(log_ratios: Array) -> tuple[Array, float]:
    logs = log_ratios - log_ratios.max()
    count = len(logs)
    length = int(np.ceil(min(LARGEST_TAIL * count, 3.0 * np.sqrt(count))))
    order = np.argsort(logs)
    cutoff = max(
        float(logs[order[-min(length, count - 1) - 1]]), float(np.log(np.finfo(float).tiny))
    )
    tail = order[logs[order] > cutoff]
    k_hat = float("inf")
    if len(tail) >= FEWEST_IN_TAIL:
        above = np.exp(logs[tail]) - np.exp(cutoff)
        k_hat, scale = _fit_pareto(above)
        if np.isfinite(k_hat) and scale > 0.0:
            places = (np.arange(len(tail)) + 0.5) / len(tail)
            logs[tail] = np.log(_pareto_quantiles(places, k_hat, scale) + np.exp(cutoff))
            logs = np.minimum(logs, 0.0)
    return logs - float(np.logaddexp.reduce(logs)), k_hat


def _fit_pareto(sample: Array) -> tuple[float, float]:
    """Shape and scale of a generalised Pareto distribution for a sorted sample (n,) above zero.

    The empirical Bayes estimate of Zhang and Stephens 2009 (doi:10.1198/tech.2009.08017), its shape
    drawn to a half by a weak prior.
    """
    count = len(sample)
    points = 30 + int(np.sqrt(count))
    quartile = sample[int(count / 4 + 0.5) - 1]
    grid = (1.0 - np.sqrt(points / (np.arange(points) + 0.5))) / (QUARTILES * quartile)
    grid = grid + 1.0 / sample[-1]
    shapes = np.mean(np.log1p(-grid[:, None] * sample), axis=1)
    heights = count * (np.log(-grid / shapes) - shapes - 1.0)
    weights = np.exp(heights - np.logaddexp.reduce(heights))
    weights = np.where(weights >= 10 * np.finfo(float).eps, weights, 0.0)
    best = float(np.sum(grid * weights) / np.sum(weights))
    shape = float(np.mean(np.log1p(-best * sample)))
    scale = -shape / best
    return (count * shape + PRIOR_DRAWS * PRIOR_K) / (count + PRIOR_DRAWS), scale


def _pareto_quantiles(places: Array, shape: float, scale: float) -> Array:
    if abs(shape) < np.finfo(float).eps:
        return np.asarray(-scale * np.log1p(-places))
    with np.errstate(over="ignore"):  # an infinite quantile is cut to the largest ratio
        return np.asarray(scale * np.expm1(-shape * np.log1p(-places)) / shape)
