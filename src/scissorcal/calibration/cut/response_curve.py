"""The material's response: force at the edge against indentation, with its band and its data."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.cut.structure import cutting_from, fitted_cutting, some_draws
from scissorcal.calibration.result import FitResult
from scissorcal.errors import MissingError
from scissorcal.model import Cutting, edge_height

POINTS = 60
SUPPORT = (0.01, 0.99)
BEYOND = 1.25
"""The curve runs to this many times the deepest indentation that data reach."""


@dataclass(frozen=True)
class OtherResponse:
    """The response (N) of another candidate at its best point, over the curve's indentations.

    ``force`` is None where the fit keeps no values of it. ``equivalent`` candidates do not differ
    from the chosen one in these data.
    """

    name: str
    equivalent: bool
    force: Array | None


@dataclass(frozen=True)
class ResponseCurve:
    """Force (N) over ``indentation`` (m), both (k,): posterior mean with 5 and 95 %.

    Data reach from ``support_low`` to ``support_high`` (m; the inner 98 % of pressed samples).
    ``data_indentation`` and ``data_force`` (n,) are the measured samples.
    """

    support_low: float
    support_high: float
    indentation: Array
    force: Array
    low: Array
    high: Array
    data_indentation: Array
    data_force: Array
    others: tuple[OtherResponse, ...]

    @property
    def half_width(self) -> float | None:
        """Half of the 90 % band over the force (median) where data press."""
        x = self.indentation
        known = (x >= self.support_low) & (x <= self.support_high) & (self.force > 0)
        if not known.any():
            return None
        return float(np.median(0.5 * (self.high - self.low)[known] / self.force[known]))


def response_curve(fit: FitResult) -> ResponseCurve:
    """The response with its band and its data. Raises MissingError with the reason for none."""
    cutting = fitted_cutting(fit)
    drawn = fitted_cutting(fit, some_draws(fit)[:, None, :]) if cutting is not None else None
    if cutting is None or drawn is None or len(fit.series.opening) == 0:
        raise MissingError("The fit holds no usable numbers to draw a response from.")
    indentation, measured = _at_edge(fit, cutting)
    pressed = indentation[indentation > 0]
    if len(pressed) < 3:
        raise MissingError("No sample pressed on the material, so its response is not known.")
    low, high = np.quantile(pressed, SUPPORT)
    x = np.linspace(0.0, BEYOND * float(high), POINTS)
    force = drawn.response.force_at(x[None, :])
    band = np.quantile(force, [0.05, 0.95], axis=0)
    others = tuple(
        OtherResponse(str(one["name"]), bool(one.get("equivalent")), _force_of(one, fit, x))
        for one in fit.rungs
        if not one.get("chosen")
    )
    return ResponseCurve(
        float(low), float(high), x, force.mean(axis=0), band[0], band[1], indentation, measured,
        others,
    )  # fmt: skip


def _at_edge(fit: FitResult, cutting: Cutting) -> tuple[Array, Array]:
    """Indentation at the model's crack tip (m), and measured torque as force at the edge (N)."""
    series = fit.series
    view = edge_height(cutting.edge, series.contact, series.opening / cutting.moving_blades)
    taper = cutting.edge.slope_at(view.station)
    lever = view.lever if cutting.closure == "work" else series.contact / np.sqrt(1 + taper**2)
    with np.errstate(divide="ignore", invalid="ignore"):
        force = np.asarray(series.measured / lever)
    return np.asarray(cutting.upper_face_m - view.height), force


def _force_of(candidate: Mapping[str, Any], fit: FitResult, x: Array) -> Array | None:
    """A candidate's response, where the fit kept the values that it ended at."""
    values, key = candidate.get("values"), candidate.get("key")
    if not isinstance(values, Mapping) or not isinstance(key, Mapping):
        return None
    named = {str(name): np.asarray(value) for name, value in values.items()}
    try:
        cutting = cutting_from({**fit.structure, **key}, named)
    except KeyError:
        return None
    return np.asarray(cutting.response.force_at(x))
