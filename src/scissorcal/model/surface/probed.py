"""A height field through probed points: a smoothing spline no finer than their noise allows."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scissorcal.aliases import Array
from scissorcal.model.bspline import FEWEST
from scissorcal.model.surface.height_field import HeightField
from scissorcal.model.surface.probed_checks import (
    checked_points,
    hull,
    point_spacing,
    refuse_frame,
    refuse_kinks,
    refuse_shape,
)

_PENALTY = 1e-6
"""Of second differences of weights, against the mean weight of the points: 1 nm where a spline
bends by 1 mm in an interval, and it continues the spline straight where there are no points."""


@dataclass(frozen=True)
class SplineFit:
    """A spline, its residuals (n,) in z, and the number of weights on which points have a say."""

    surface: HeightField
    residuals: Array
    weights: int


_WEIGHTS_PER_POINT = 0.7
"""A spline with more weights than this share of the points leaves too little to judge it by."""

_GAPS_PER_INTERVAL = 2.0
"""Of the finest spline: an interval as narrow as the gap between points would follow any kink."""


@dataclass(frozen=True)
class ProbedSurface:
    """A height field that was fitted to points, and how well it follows them.

    ``residual_rms_m`` and ``largest_residual_m`` are measured along the normal; ``sd_m`` is the
    standard deviation of the surface (rms over the points) that follows from their noise;
    ``smallest_radius_m`` is of curvature, at least an interval within the points.
    """

    surface: HeightField
    residual_rms_m: float
    largest_residual_m: float
    sd_m: float
    smallest_radius_m: float


def fit_height_field(
    points: ArrayLike, noise_m: float, labels: Sequence[str] | None = None
) -> ProbedSurface:
    """Fit a height field to probed points (n, 3) with the standard deviation ``noise_m``.

    The noise is along the normal. Of bicubic splines with even intervals, from one interval to
    intervals of two gaps between points, the one with the least chi-square + 2 x weights is taken
    (Akaike 1974, doi:10.1109/TAC.1974.1100705). The points are in the plate's frame and stay there:
    the surface passes through the origin within 1 mm and 10 degrees, not exactly.

    ``labels`` name the points in messages ("line 7"). Raises InputError where points are not
    finite, fewer than 25, repeated, on a line, leave a hole, have two heights at one place or are
    in another frame; and where the surface is steeper than 75 degrees or has a kink: a point
    farther than 5 standard deviations from the spline, or a radius of curvature below 2 mm.
    """
    probed = np.array(points, dtype=np.float64)
    named = labels if labels is not None else [f"point {k + 1}" for k in range(len(probed))]
    probed = checked_points(probed, noise_m, named)
    sd, intervals = _finest_and_best(probed, noise_m)
    fit = _fit(probed, sd, intervals)
    refuse_frame(fit.surface)
    refuse_kinks(probed, fit.residuals / sd, fit.weights, noise_m, named)
    surface = replace(fit.surface, outline=hull(probed))
    radius = refuse_shape(surface)
    off = fit.residuals / sd * noise_m
    return ProbedSurface(
        surface,
        float(np.sqrt(np.mean(off**2))),
        float(np.abs(off).max()),
        noise_m * math.sqrt(fit.weights / len(probed)),
        radius,
    )


def _finest_and_best(points: Array, noise_m: float) -> tuple[Array, tuple[int, int]]:
    """Vertical standard deviations of the points, and the intervals of the best spline."""
    sizes = _sizes(points)
    finest = _fit(points, np.full(len(points), noise_m), sizes[-1])
    sd = _vertical_sd(finest.surface, points, noise_m)
    costs = []
    for size in sizes:
        fit = _fit(points, sd, size)
        costs.append(float(((fit.residuals / sd) ** 2).sum()) + 2.0 * fit.weights)
    return sd, sizes[int(np.argmin(costs))]


def _sizes(points: Array) -> list[tuple[int, int]]:
    """Numbers of intervals along x and y that may be tried, the fewest first."""
    sides = _box(points)[:, 1] - _box(points)[:, 0]
    narrowest = _GAPS_PER_INTERVAL * point_spacing(points)
    sizes: list[tuple[int, int]] = []
    width = float(sides.max())
    while width >= narrowest or not sizes:
        n, m = (max(1, math.ceil(side / width - 1e-9)) for side in sides)
        if sizes and (n + 3) * (m + 3) > _WEIGHTS_PER_POINT * len(points):
            break
        if (n, m) not in sizes:
            sizes.append((n, m))
        width /= math.sqrt(2.0)
    return sizes


def _fit(points: Array, sd: Array, intervals: tuple[int, int]) -> SplineFit:
    (a, b), (c, d) = _box(points)
    return _fit_spline(points, sd, (float(a), float(b)), (float(c), float(d)), intervals)


def _box(points: Array) -> Array:
    """Ends (2, 2) of x and y, with the origin, which may lie a little outside the points."""
    flat = np.concatenate((points[:, :2], np.zeros((1, 2))))
    return np.stack((flat.min(axis=0), flat.max(axis=0)), axis=-1)


def _vertical_sd(surface: HeightField, points: Array, noise_m: float) -> Array:
    """Noise along the normal shows in heights by 1 / cos(slope)."""
    return np.asarray(noise_m * np.linalg.norm(surface.gradient(points), axis=-1))


def _fit_spline(
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
