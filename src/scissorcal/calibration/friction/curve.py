"""Friction by itself, from a fit: over the rate with its band, and over rate and opening."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from scissorcal.aliases import Array
from scissorcal.model.friction import FrictionLaw, friction_torque

if TYPE_CHECKING:
    from scissorcal.calibration import FitResult

POINTS_EACH_WAY = 40
SLOWEST_SHARE = 5e-3
MOST_DRAWS = 300
MAP_DRAWS = 200
SPEEDS, OPENINGS = 10, 9
NEAR_SPEED = (0.7, 1.4)
FEWEST_SAMPLES = 5


@dataclass(frozen=True)
class FrictionCurve:
    """The law at one opening, arrays (k,) over ``rate``, in the fit's units.

    ``friction`` is the posterior mean, ``low`` and ``high`` its 5 and 95 %.
    """

    opening: float
    rate: Array
    friction: Array
    low: Array
    high: Array


@dataclass(frozen=True)
class FrictionMap:
    """Size of friction at ``rate`` (r,), signed and without rest, and ``opening`` (o,): (r, o).

    ``friction`` is the posterior mean of its size, ``sd`` its standard deviation; ``residual`` the
    mean of measured minus model near each place, in the direction of motion, NaN without data.
    """

    rate: Array
    opening: Array
    friction: Array
    sd: Array
    residual: Array


def friction_curve(fit: FitResult) -> FrictionCurve | None:
    """The law from standstill to the fastest measured rate; None for a cut or without numbers."""
    rates = np.abs(fit.series.opening_rate)
    rates = rates[np.isfinite(rates)]
    if fit.what == "cut" or len(rates) == 0 or not np.all(np.isfinite(fit.draws)):
        return None
    fastest = float(rates.max())
    if fastest <= 0:
        return None
    one_way = np.geomspace(SLOWEST_SHARE * fastest, fastest, POINTS_EACH_WAY)
    rate = np.concatenate([-one_way[::-1], one_way])
    center = angle_centre(fit)
    curves = _friction_at(fit, _draws(fit, MOST_DRAWS), np.asarray(center), rate[None, :])
    low, high = np.quantile(curves, [0.05, 0.95], axis=0)
    return FrictionCurve(center, rate, curves.mean(axis=0), low, high)


def partial_residuals(fit: FitResult) -> Array:
    """What was measured less all of the model but friction, (n,)."""
    series = fit.series
    friction = _friction_at(fit, fit.map_point[:, None], series.opening, series.opening_rate)
    return np.asarray(friction + series.measured - series.predicted)


def friction_map(fit: FitResult) -> FrictionMap | None:
    """Friction over the rates and openings that were recorded; None for a cut or no numbers."""
    series = fit.series
    known = np.isfinite(series.opening) & np.isfinite(series.opening_rate)
    if fit.what == "cut" or not known.any() or not np.all(np.isfinite(fit.draws)):
        return None
    speed = np.abs(series.opening_rate[known])
    fastest = float(speed.max())
    low, high = np.quantile(series.opening[known], [0.005, 0.995])
    if fastest <= 0 or high <= low:
        return None
    slowest = max(float(np.quantile(speed, 0.01)), 0.01 * fastest)
    speeds = np.geomspace(slowest, fastest, SPEEDS)
    rate = np.concatenate([-speeds[::-1], speeds])
    opening = np.linspace(low, high, OPENINGS)
    w, theta = (values.ravel() for values in np.meshgrid(rate, opening, indexing="ij"))
    curves = np.abs(_friction_at(fit, _draws(fit, MAP_DRAWS), theta, w))
    residual = _residuals(fit, w, theta, float(high - low) / OPENINGS)
    shape = (len(rate), len(opening))
    grids = (curves.mean(axis=0), curves.std(axis=0), residual)
    return FrictionMap(rate, opening, *(grid.reshape(shape) for grid in grids))


def _friction_at(fit: FitResult, columns: Array, opening: Array, rate: Array) -> Array:
    """The law for parameters ``columns``, whose axis of parameters is the last but one."""
    named = {p.name: np.take(columns, i, axis=-2) for i, p in enumerate(fit.parameters)}
    return friction_torque(FrictionLaw.of_fit(named, angle_centre(fit)), opening, rate)


def _draws(fit: FitResult, most: int) -> Array:
    step = max(1, -(-len(fit.draws) // most))
    return fit.draws[::step, :, None]


def _residuals(fit: FitResult, rate: Array, opening: Array, reach: float) -> Array:
    series = fit.series
    residual = np.sign(series.opening_rate) * (series.measured - series.predicted)
    means = np.full(len(rate), np.nan)
    for place, (w, theta) in enumerate(zip(rate, opening, strict=True)):
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = series.opening_rate / w
        near = (ratio > NEAR_SPEED[0]) & (ratio < NEAR_SPEED[1])
        near &= np.abs(series.opening - theta) <= reach
        if np.count_nonzero(near) >= FEWEST_SAMPLES:
            means[place] = np.mean(residual[near])
    return means


def angle_centre(fit: FitResult) -> float:
    """The opening about which a fit's friction changes along the stroke."""
    center = fit.structure.get("angle_center")
    if center is None or not np.isfinite(center):
        return float(np.nanmedian(fit.series.opening))
    return float(center)
