"""Prior sensitivity: how posteriors change when prior or likelihood are raised to a power."""

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.verify.result import Diagnosis

STEP = 1.01
"""A component is raised to this power and to its reciprocal."""

SENSITIVE = 0.05
"""Sensitivity from which a component matters: a normal's mean then moves by about 0.3 standard
deviations when the component's weight is doubled (Kallioinen et al. 2023)."""


def power_sensitivity(draws: Array, log_component: Array) -> Array:
    """Sensitivity (p,) of marginals to the power of one component of their posterior.

    ``draws`` (n, p) come from the posterior, ``log_component`` (n,) is the log-prior or the
    log-likelihood at each, up to a constant. The cumulative Jensen-Shannon distance between the
    draws as they are and the draws reweighted for component^1.01 and component^(1/1.01), divided
    by the power's binary logarithm (Kallioinen, Paananen, Bürkner and Vehtari 2023,
    doi:10.1007/s11222-023-10366-5). Weights so near to one need no Pareto smoothing.
    """
    found = np.zeros(draws.shape[1])
    for power in (STEP, 1.0 / STEP):
        log_weights = (power - 1.0) * log_component
        weights = np.exp(log_weights - log_weights.max())
        weights /= weights.sum()
        found += [cumulative_distance(column, weights) for column in draws.T]
    return np.asarray(found / (2.0 * np.log2(STEP)))


def cumulative_distance(draws: Array, weights: Array) -> float:
    """Cumulative Jensen-Shannon distance, 0 to 1, from draws (n,) to the same draws weighted (n,).

    Nguyen and Vreeken 2015, doi:10.1007/978-3-319-23525-7_11; symmetric, normalised by its upper
    bound, and the larger one of the draws and their negatives, as the measure is not symmetric
    about zero. Equal draws have no distance.
    """
    order = np.argsort(draws)
    x, weighted = draws[order], weights[order] / weights.sum()
    width = np.diff(x)
    if not np.any(width > 0):
        return 0.0
    plain = np.arange(1, len(x)) / len(x)
    below = np.cumsum(weighted)[:-1]
    above = np.cumsum(weighted[::-1])[:-1]
    return float(
        np.sqrt(max(_divergence(plain, below, width), _divergence(plain, above, width[::-1])))
    )


def diagnose(prior: float, likelihood: float) -> Diagnosis:
    """Diagnosis of the two sensitivities.

    >>> diagnose(0.2, 0.3), diagnose(0.2, 0.01), diagnose(0.01, 0.3)
    ('prior-data conflict', 'weak likelihood', 'fine')
    """
    if prior < SENSITIVE:
        return "fine"
    return "prior-data conflict" if likelihood >= SENSITIVE else "weak likelihood"


def _divergence(P: Array, Q: Array, width: Array) -> float:
    middle = np.log2(0.5 * (P + Q))
    slope = 0.5 / np.log(2.0) * float((Q - P) @ width)
    one = float(_times_log(P, middle) @ width) + slope
    other = float(_times_log(Q, middle) @ width) - slope
    return float(max(one + other, 0.0) / ((P + Q) @ width))


def _times_log(P: Array, log_middle: Array) -> Array:
    """P log2(P / middle), and 0 where P is."""
    return np.where(P > 0, P * (np.log2(np.maximum(P, 1e-300)) - log_middle), 0.0)
