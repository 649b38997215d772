"""A fitted cut as a model: at its best point, or at posterior draws."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.cut.structure import cutting_from
from scissorcal.calibration.result import FitResult
from scissorcal.model import Cutting

Array = NDArray[np.float64]


def fitted_cutting(fit: FitResult, values: Array | None = None) -> Cutting | None:
    """The cut's model at its best point, or at parameters (..., p) in the fit's order.

    None where the fit is of friction, or holds no usable numbers.
    """
    if fit.what != "cut" or not has_numbers(fit, {"response", "edge"}):
        return None
    given = fit.map_point if values is None else values
    named = {p.name: np.asarray(given[..., i]) for i, p in enumerate(fit.parameters)}
    return cutting_from(dict(fit.structure), named)


def has_numbers(fit: FitResult, keys: set[str]) -> bool:
    """Whether a fit's structure has ``keys``, and its draws and best point are finite."""
    known = keys <= set(fit.structure) and len(fit.parameters) > 0 and len(fit.draws) > 1
    return known and bool(np.all(np.isfinite(fit.draws)) and np.all(np.isfinite(fit.map_point)))


def some_draws(fit: FitResult, most: int = 200) -> Array:
    """At most ``most`` posterior draws, evenly taken, shape (k, parameters)."""
    count = len(fit.draws)
    if count <= most:
        return fit.draws
    return fit.draws[np.linspace(0, count - 1, most).round().astype(np.int64)]
