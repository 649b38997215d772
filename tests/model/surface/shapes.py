"""Surfaces that the tests compare with: splines made by SciPy, and rough ones."""

import numpy as np
from scipy.interpolate import make_lsq_spline

from scissorcal.model.surface import HeightField, normal

X_M, Y_M = (-0.03, 0.03), (-0.02, 0.02)


def knots(ends, intervals):
    start, end = ends
    return start + (end - start) / intervals * np.arange(-3, intervals + 4)


def spline_of(height, intervals=(24, 16), x_m=X_M, y_m=Y_M):
    """The height field nearest to ``height(x, y)``, by SciPy's least squares along each axis."""
    x, y = (np.linspace(*e, 4 * n + 1) for e, n in zip((x_m, y_m), intervals, strict=True))
    rows = make_lsq_spline(x, height(x[:, None], y[None, :]), knots(x_m, intervals[0])).c
    weights = make_lsq_spline(y, rows.T, knots(y_m, intervals[1])).c.T
    return HeightField(x_m, y_m, weights)


def rough(seed=0, size=1e-3, intervals=(6, 8)):
    rng = np.random.default_rng(seed)
    weights = size * rng.standard_normal((intervals[0] + 3, intervals[1] + 3))
    return HeightField(X_M, Y_M, weights)


def shape_operator(surface, points):
    """Derivative of the normal along the surface, (..., 3, 3) [1/m]: P H P / abs(grad phi0)."""
    unit = normal(surface, points)
    length = np.linalg.norm(surface.gradient(points), axis=-1)[..., None, None]
    across = np.eye(3) - unit[..., :, None] * unit[..., None, :]
    return across @ surface.hessian(points) @ across / length
