"""Least squares by scipy, for models that give residuals and slopes together."""

from collections.abc import Callable

import numpy as np

from scissorcal.aliases import Array

MOST_EVALUATIONS = 200
WORST = 1e75
"""Stands for a residual that is not finite; its square still is."""


def least_squares(
    evaluate: Callable[[Array], tuple[Array, Array]], start: Array, *, precision: float = 1e-10
) -> tuple[Array, bool]:
    """Minimise a sum of squared residuals from ``start`` (p,); return the point and convergence.

    ``evaluate`` gives residuals (n,) and their slopes (n, p) at a point: models that come with
    both (OpenCV's projection, products of columns) are evaluated once per step. The search is
    Levenberg and Marquardt's as MINPACK has it (More 1978, doi:10.1007/BFb0067700), each parameter
    scaled by its slopes; its overhead is a fifth of that of scipy's trust-region method. It has
    converged where a step changes the sum or the point by less than ``precision`` of it. There must
    be as many residuals as parameters at least, else ValueError. It has not converged where
    residuals or slopes are not finite at the end, or beyond ``WORST``. Residuals of different
    points are compared by their sum of squares alone, so that they may be rotated from point to
    point.
    """
    from scipy.optimize import least_squares as search

    last: list[tuple[bytes, Array, Array, bool]] = []

    def at(x: Array) -> tuple[Array, Array, bool]:
        if not last or last[0][0] != x.tobytes():
            with np.errstate(all="ignore"):
                rows, slopes = evaluate(x)
                known = all(bool(np.all(np.abs(a) < WORST)) for a in (rows, slopes))
                if not known:
                    rows, slopes = _bounded(rows), _bounded(slopes)
            last[:] = [(x.tobytes(), rows, slopes, known)]
        return last[0][1:]

    if len(at(np.asarray(start))[0]) < len(start):
        raise ValueError("least squares need at least as many residuals as parameters")

    def residuals(x: Array) -> Array:
        return at(x)[0]

    def jacobian(x: Array) -> Array:
        return at(x)[1]

    found = search(
        residuals,
        start,
        jac=jacobian,
        method="lm",
        x_scale="jac",
        ftol=precision,
        xtol=precision,
        gtol=1e-15,
        max_nfev=MOST_EVALUATIONS,
    )
    return np.asarray(found.x), bool(found.success) and at(found.x)[2]


def _bounded(values: Array) -> Array:
    """Values without what is not finite, within ``WORST``."""
    return np.asarray(np.clip(np.nan_to_num(values), -WORST, WORST))
