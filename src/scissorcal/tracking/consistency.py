"""Whether a filter's covariance is honest: NEES against a chi-square's band."""

import numpy as np
from numpy.typing import ArrayLike

from scissorcal.aliases import Array
from scissorcal.tracking.rotation import rotation_vector


def pose_error(rotation: Array, place_m: Array, true_rotation: Array, true_place_m: Array) -> Array:
    """Error (6,) of an estimated pose: rotation vector (rad) and way (m) that lead to the truth.

    True rotation = Exp(error[:3]) estimated rotation, the error that the filter's covariance is of.
    """
    turn = rotation_vector(true_rotation @ rotation.T)
    return np.concatenate([turn, np.subtract(true_place_m, place_m)])


def nees(error: Array, covariance: Array) -> float:
    """Normalised estimation error squared: chi-square with 6 degrees of freedom if consistent.

    Bar-Shalom, Li and Kirubarajan 2001, section 5.4, doi:10.1002/0471221279.
    """
    return float(error @ np.linalg.solve(covariance, error))


def mean_band(runs: int, freedom: int = 6, share: float = 0.95) -> tuple[float, float]:
    """Band of the mean NEES over independent runs that a consistent filter keeps.

    >>> tuple(round(edge, 2) for edge in mean_band(200))
    (5.53, 6.49)
    """
    from scipy.stats import chi2

    ends = [float(chi2.ppf(0.5 + half, freedom * runs)) / runs for half in (-share / 2, share / 2)]
    return ends[0], ends[1]


def share_held(values: ArrayLike, freedom: int = 6, share: float = 0.95) -> float:
    """Share of runs whose error lies in the filter's own set of probability ``share``."""
    from scipy.stats import chi2

    return float(np.mean(np.asarray(values) <= chi2.ppf(share, freedom)))
