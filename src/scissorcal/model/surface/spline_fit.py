"""Least squares of a bicubic spline through scattered points."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.model.bspline import FEWEST
from scissorcal.model.surface.height_field import HeightField

_PENALTY = 1e-6
"""Of second differences of weights, against the mean weight of the points: 1 nm where a spline
bends by 1 mm in an interval, and it continues the spline straight where there are no points."""


@dataclass(frozen=True)
class SplineFit:
    """A spline, its residuals (n,) in z, and the number of weights on which points have a say."""

    surface: HeightField
    residuals: Array
    weights: int


def fit_spline(
    points: Array,
    sd: Array,
    x_m: tuple[float, float],
    y_m: tuple[float, float],
    intervals: tuple[int, int],
) -> SplineFit:
    """Weighted least squares of heights: points (n, 3), their standard deviations (n,) in z.

    Weights that no point reaches, as in the corners of a round field, follow from a small penalty
    on second differences (Eilers and Marx 1996, doi:10.1214/ss/1038425655).
    """
    from scipy.sparse import csc_array, csr_array, eye_array, kron
    from scipy.sparse.linalg import spsolve

    counts = [n + FEWEST - 1 for n in intervals]
    of_x, on_x = _basis(points[:, 0], x_m, intervals[0])
    of_y, on_y = _basis(points[:, 1], y_m, intervals[1])
    shares = (of_x[:, :, None] * of_y[:, None, :]).reshape(len(points), -1)
    columns = (on_x[:, :, None] * counts[1] + on_y[:, None, :]).reshape(len(points), -1)
    starts = np.arange(len(points) + 1) * FEWEST**2
    shape = (len(points), counts[0] * counts[1])
    design = csr_array((shares.ravel(), columns.ravel(), starts), shape=shape)
    weighted = csr_array(((shares / sd[:, None]).ravel(), columns.ravel(), starts), shape=shape)
    normal = weighted.T @ weighted
    bends = [csr_array(np.diff(np.eye(count), 2, axis=0)) for count in counts]
    along_x = kron(bends[0].T @ bends[0], eye_array(counts[1]))
    along_y = kron(eye_array(counts[0]), bends[1].T @ bends[1])
    reached = normal.diagonal()
    penalised = normal + _PENALTY * reached.mean() * (along_x + along_y)
    weights = spsolve(csc_array(penalised), weighted.T @ (points[:, 2] / sd))
    return SplineFit(
        HeightField(x_m, y_m, np.asarray(weights).reshape(counts)),
        np.asarray(points[:, 2] - design @ weights),
        int((reached > 1e-9 * reached.max()).sum()),
    )


def _basis(at: Array, ends: tuple[float, float], intervals: int) -> tuple[Array, NDArray[np.int64]]:
    """The four basis functions at each place (n, 4), and which they are."""
    from scipy.interpolate import BSpline

    start, end = ends
    knots = start + (end - start) / intervals * np.arange(-3, intervals + FEWEST)
    inside = np.clip(at, knots[3], knots[-4])
    table = BSpline.design_matrix(inside, knots, 3)
    return (
        np.asarray(table.data).reshape(-1, FEWEST),
        np.asarray(table.indices, dtype=np.int64).reshape(-1, FEWEST),
    )
