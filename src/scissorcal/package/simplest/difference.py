"""How far the torque of one law is from that of another, over a scene and the posterior."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from scissorcal.aliases import Array, Mask
from scissorcal.model import edge_height, friction_torque, mean_share
from scissorcal.package.bound import PARALLEL, TIP_CLEARANCE
from scissorcal.package.compile import SLOWEST_EPS, scene_ranges
from scissorcal.package.exact import ExactModel
from scissorcal.package.grid import FELT_SHARE, Points, spread_points
from scissorcal.package.simplest.law import Law
from scissorcal.recipe.schema import Recipe

PROJECTING, JUDGING = 160, 700
"""Places over which a law is projected, and independent ones on which the result is judged; a
quarter more of each lies on the faces of the scene's ranges."""


@dataclass(frozen=True)
class Scene:
    """Places of a scene (n,), and the largest torque (N m) that is ever rendered there."""

    points: Points
    limit: float

    @classmethod
    def of(cls, recipe: Recipe, count: int = JUDGING) -> Scene:
        """Places spread over a recipe's scene, none slower than what the kernel smooths."""
        slowest = max(SLOWEST_EPS, recipe.scene.opening_rate_rad_per_s[0])
        points = spread_points(scene_ranges(recipe), count, slowest)
        return cls(points, recipe.limits.torque_Nm)


@dataclass(frozen=True)
class Felt:
    """What a law renders at the places of a scene, each (rows, n) or (1, n).

    ``cut`` is the mean torque of the material alone (N m), ``ripple`` its peak-to-peak ripple where
    the crack runs, ``friction`` the torque of friction. ``reached`` says that the blade is there,
    ``clear`` that the law itself does not jump nearby: at the blade's tip, or where the edges are
    parallel. No torque exceeds ``limit``.
    """

    law: Law
    cut: Array
    ripple: Array
    friction: Array
    reached: Mask
    clear: Mask
    limit: float

    @cached_property
    def torque(self) -> Array:
        """Mean torque (rows, n) as it is rendered."""
        return np.asarray(np.clip(self.cut - self.friction, -self.limit, self.limit))

    @cached_property
    def largest(self) -> Array:
        """Largest torque of the scene by row, shape (rows, 1)."""
        return np.asarray(np.max(np.abs(self.torque), axis=1, keepdims=True))

    @cached_property
    def scale(self) -> Array:
        """What differences are shares of: the local torque, no less than can be felt."""
        return np.asarray(np.maximum(np.abs(self.torque), FELT_SHARE * self.largest))


@dataclass(frozen=True)
class Difference:
    """Another law's torque against a reference, by row: the MAP point, then posterior draws.

    ``worst_share`` (rows,) is the largest difference as a share of the local torque, over places
    where either law can be felt, ``rms_share`` (rows,) its root mean square, ``worst_Nm`` (rows,)
    the largest difference in N m. A change of the ripple's size counts as a difference.
    """

    worst_share: Array
    rms_share: Array
    worst_Nm: Array

    def probability(self, allowed: float) -> float:
        """Share of the posterior draws whose worst difference is at most ``allowed``."""
        draws = self.worst_share[1:] if len(self.worst_share) > 1 else self.worst_share
        return float(np.mean(draws <= allowed))

    def within(self, allowed: float, confidence: float) -> bool:
        """Whether it is ``allowed`` with ``confidence`` over the draws, and at the MAP point."""
        return bool(self.worst_share[0] <= allowed and self.probability(allowed) >= confidence)

    def at(self, confidence: float) -> tuple[float, float, float]:
        """Worst share, rms share and worst N m that ``confidence`` of the draws do not exceed."""
        rows = slice(1, None) if len(self.worst_share) > 1 else slice(None)
        found = (self.worst_share[rows], self.rms_share[rows], self.worst_Nm[rows])
        worst, rms, newton_metres = (
            float(np.quantile(each, confidence, method="higher")) for each in found
        )
        return worst, rms, newton_metres


def felt(law: Law, scene: Scene, known: Felt | None = None) -> Felt:
    """Evaluate every row of a law at the places of a scene.

    ``known`` is what a law renders at the same places: parts that both have are taken from it.
    """
    model, points = law.model(), scene.points
    friction = np.zeros((1, 1))
    if known is not None and known.law.friction is law.friction:
        friction = known.friction
    elif model.friction is not None:
        friction = friction_torque(model.friction, points.opening, points.opening_rate)
    if known is not None and known.law.cut is law.cut:
        return replace(known, law=law, friction=friction)
    return _with_material(law, model, friction, scene)


def _with_material(law: Law, model: ExactModel, friction: Array, scene: Scene) -> Felt:
    points, cutting = scene.points, model.cutting
    material = ExactModel(cutting, None)
    place = np.atleast_2d(model.settled(points.opening, points.contact))
    torque = np.atleast_2d(material.torque_settled(points.opening, points.opening_rate, place))
    view = edge_height(cutting.edge, place, model.blade_angle(points.opening))
    reached = np.asarray(view.station < cutting.edge.length_m)
    clear = np.abs(view.station - cutting.edge.length_m) > TIP_CLEARANCE
    clear = np.asarray(clear & (np.abs(view.slope) > PARALLEL))
    ripple = np.zeros((1, 1))
    if cutting.fracture_energy is not None and np.any(np.asarray(cutting.kappa) < 1.0):
        runs = reached & (place > points.contact) & (view.slope > PARALLEL)
        runs = runs & (points.opening_rate < 0.0)
        slope = np.where(runs, view.slope, 1.0)
        peak = cutting.fracture_energy / (cutting.moving_blades * slope)
        share = mean_share(cutting, peak)
        teeth = (1.0 - np.asarray(cutting.kappa)) / np.where(share > 0.0, share, 1.0)
        ripple = np.where(runs, teeth * np.abs(torque), 0.0)
    return Felt(law, torque, ripple, friction, reached, clear, scene.limit)


def difference(reference: Felt, other: Felt) -> Difference:
    """How far ``other`` is from ``reference``, row by row.

    Places count where one of both laws exceeds :data:`FELT_SHARE` of the scene's largest torque.
    Left out are places where either law jumps, and those that only one of both blades reaches: an
    edge that ends some micrometres farther on the grid is no difference of the torque.
    """
    size = np.maximum(np.abs(reference.torque), np.abs(other.torque))
    counted = reference.clear & other.clear & (reference.reached == other.reached)
    counted = counted & (size >= FELT_SHARE * reference.largest) & (size > 0.0)
    away = np.abs(other.torque - reference.torque) + np.abs(other.ripple - reference.ripple)
    away = np.where(counted, away, 0.0)
    share = np.where(counted, away / np.where(counted, reference.scale, 1.0), 0.0)
    places = np.maximum(counted.sum(axis=1), 1)
    return Difference(
        share.max(axis=1),
        np.sqrt((share**2).sum(axis=1) / places),
        away.max(axis=1),
    )
