"""Torque over a scene, and the errors of it: the same places and shares for every knob."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scissorcal.aliases import Array
from scissorcal.bench.trade.case import Case
from scissorcal.bench.trade.point import Error
from scissorcal.calibration.result import FitResult
from scissorcal.model import FrictionLaw, edge_height, friction_torque
from scissorcal.package.compile import SLOWEST_EPS, scene_ranges
from scissorcal.package.exact import (
    ExactModel,
    FitDraws,
    central_model,
    exact_model,
    pick_draws,
    torque_quantiles,
)
from scissorcal.package.friction_tables import rendered_fits
from scissorcal.package.grid import Points, spread_points

PLACES = 400
"""Places spread over the scene; a quarter as many lie on its faces, and 8 in its corners."""

QUANTILES = (0.05, 0.95)

AVERAGE, WORST = "average torque error", "worst torque error"
BAND_AVERAGE, BAND_WORST = "average band error", "worst band error"
WIDTH_AVERAGE, WIDTH_WORST = "average band half width", "worst band half width"


@dataclass(frozen=True)
class SceneTorque:
    """Torque at the places of a scene, all (n,) in N m (N for a linear joint).

    At the MAP point, and the 5 % and 95 % quantiles over the posterior. NaN where the contact lies
    beyond the blade.
    """

    torque: Array
    low: Array
    high: Array

    def plain(self) -> dict[str, list[float | None]]:
        """Lists that JSON holds, None for NaN."""
        return {
            name: [None if np.isnan(value) else float(value) for value in getattr(self, name)]
            for name in ("torque", "low", "high")
        }

    @classmethod
    def of(cls, plain: Mapping[str, Any]) -> "SceneTorque":
        """Read back what `plain` gave."""
        return cls(*(np.asarray(plain[name], dtype=float) for name in ("torque", "low", "high")))


def scene_places(case: Case, count: int = PLACES) -> Points:
    """Places spread over a case's scene, none slower than the slowest rate that is rendered."""
    return spread_points(scene_ranges(case.recipe), count, SLOWEST_EPS)


def model_torque(case: Case, model: ExactModel, points: Points) -> Array:
    """Torque of a model with scalar parameters at places of the scene (n,), in N m.

    Held to the recipe's limit, as the loop does; NaN where the contact lies beyond the blade.
    """
    torque = np.ravel(model.torque(points.opening, points.opening_rate, points.contact))
    return np.where(_reached(model, points), _limited(case, torque), np.nan)


def fitted_torque(case: Case, cut: FitResult | None, friction: FitResult | None) -> SceneTorque:
    """Torque of fits over the scene, with its band over the posterior.

    Without a cut, as for a linear joint, the effort of friction alone. ValueError without a fit.
    """
    points = scene_places(case)
    rng = np.random.default_rng([case.seed, PLACES])
    if cut is None:
        if friction is None:
            raise ValueError("There is neither a fit of a cut nor one of friction.")
        return _friction_alone(case, friction, points)
    cut, rendered = rendered_fits(cut, friction if case.recipe.scene.render_friction else None)
    picked = pick_draws(cut, rendered, rng)
    drawn = exact_model(
        FitDraws.of(cut, picked["draws/cut.npy"]),
        FitDraws.of(rendered, picked["draws/friction.npy"]) if rendered else None,
    )
    central = central_model(FitDraws.centre(cut), FitDraws.centre(rendered) if rendered else None)
    low, high = torque_quantiles(
        drawn, points.opening, points.opening_rate, points.contact, QUANTILES
    )
    reached = _reached(central, points)
    band = (np.where(reached, _limited(case, values), np.nan) for values in (low, high))
    return SceneTorque(model_torque(case, central, points), *band)


def torque_errors(case: Case, torque: ArrayLike, reference: ArrayLike) -> dict[str, Error]:
    """Average and worst difference between torques at the same places (n,), NaN left out.

    Each in N m and as a share of the largest reference torque.
    """
    return _errors(case, [(torque, reference)], reference, AVERAGE, WORST)


def band_errors(case: Case, found: SceneTorque, reference: SceneTorque) -> dict[str, Error]:
    """Average and worst difference of the 5 % and 95 % quantiles, as in `torque_errors`."""
    pairs = [(found.low, reference.low), (found.high, reference.high)]
    return _errors(case, pairs, reference.torque, BAND_AVERAGE, BAND_WORST)


def band_widths(case: Case, found: SceneTorque, reference: SceneTorque) -> dict[str, Error]:
    """Average and worst half width of the band from 5 % to 95 %, as in `torque_errors`."""
    half = 0.5 * (found.high - found.low)
    pairs = [(half, np.zeros_like(half))]
    return _errors(case, pairs, reference.torque, WIDTH_AVERAGE, WIDTH_WORST)


def _errors(
    case: Case,
    pairs: Sequence[tuple[ArrayLike, ArrayLike]],
    torque: ArrayLike,
    average: str,
    worst: str,
) -> dict[str, Error]:
    away = np.concatenate([np.abs(np.asarray(a, float) - np.asarray(b, float)) for a, b in pairs])
    unit = "N" if case.recipe.rig.joint == "linear" else "N m"
    largest = float(np.nanmax(np.abs(np.asarray(torque, float))))
    values = {average: float(np.nanmean(away)), worst: float(np.nanmax(away))}
    return {name: Error(value, unit, value / largest) for name, value in values.items()}


def _friction_alone(case: Case, friction: FitResult, points: Points) -> SceneTorque:
    center = float(friction.structure["angle_center"])
    where = (points.opening, points.opening_rate)

    def felt(draws: FitDraws) -> Array:
        return np.asarray(-friction_torque(FrictionLaw.of_fit(draws.columns(), center), *where))

    low, high = np.quantile(felt(FitDraws.of(friction, friction.draws)), QUANTILES, axis=0)
    return SceneTorque(felt(FitDraws.centre(friction))[0], low, high)


def _limited(case: Case, torque: Array) -> Array:
    limit = case.recipe.limits.torque_Nm
    return np.clip(torque, -limit, limit)


def _reached(model: ExactModel, points: Points) -> NDArray[np.bool_]:
    place = np.ravel(model.settled(points.opening, points.contact))
    view = edge_height(model.cutting.edge, place, model.blade_angle(points.opening))
    return np.asarray(view.station < model.cutting.edge.length_m)
