"""Whether a filter's covariance is honest: NEES against a chi-square's band."""

import numpy as np
from numpy.typing import ArrayLike
from scipy.stats import chi2

from scissorcal.aliases import Array


def nees(error: Array, covariance: Array) -> float:
    """Normalised estimation error squared: chi-square with 6 degrees of freedom if consistent.

    Bar-Shalom, Li and Kirubarajan 2001, section 5.4, doi:10.1002/0471221279.
    """
    return float(error @ np.linalg.solve(covariance, error))


def mean_band(runs: int, share: float = 0.95) -> tuple[float, float]:
    """Band that a consistent filter keeps of the mean NEES over runs (5.5 to 6.5 of 200)."""
    low, high = (float(chi2.ppf(0.5 + side * share / 2, 6 * runs)) / runs for side in (-1, 1))
    return low, high


def share_held(values: ArrayLike) -> float:
    """Share of runs whose error lies in the filter's own set of 95 %."""
    return float(np.mean(np.asarray(values) <= chi2.ppf(0.95, 6)))
