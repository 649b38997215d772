"""The error bound of the kernel against the exact model, measured between the tables' knots."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.model import edge_height, settled_contact
from scissorcal.package.average import AverageTorque
from scissorcal.package.compile import STRONGEST_N
from scissorcal.package.exact import ExactModel
from scissorcal.package.grid import FELT_SHARE, Points, nearby_points, spread_points
from scissorcal.package.manifest import Ranges

STATED_OVER_SEEN = 2.0
"""The stated bound over the largest error found."""

SHARE_OF_TOLERANCE = 0.1
"""Tables may use up this share of the scene's tolerance."""

TIP_CLEARANCE = 1e-4
PARALLEL = 1e-5
"""The model itself jumps where the crack reaches the blade's tip, and where the edges become
parallel. Points nearer than this (m along the blade, tan(psi)) to either are left out."""

SEAM_OPENINGS = 400
SEAM_OFFSETS_m = np.concatenate([-np.geomspace(1e-9, 1e-3, 13), np.geomspace(1e-9, 1e-3, 13)])
TOUCH_N = 1e-30


WORST = 100
NEIGHBOURS = 40
ROUNDS = 3
"""The search is repeated around the worst points, in ever smaller neighbourhoods."""


@dataclass(frozen=True)
class Deviation:
    """Float32 kernel against float64 model, in N m, over points of a scene.

    ``largest`` deviation, where it was (opening, rate, contact), ``scene_torque``, the largest
    torque of the exact model, and on how many points.
    """

    largest: float
    where: tuple[float, float, float]
    scene_torque: float
    points: int


@dataclass(frozen=True)
class ExactTorque:
    """The exact model's torque at places of a scene, within the limit: what tables are held to.

    ``torque`` (n,) is 0 where the model itself jumps, which ``clear`` (n,) says; nothing is
    compared there. Differences count times ``weight`` (n,): 1, or more where the torque is weak.
    """

    points: Points
    torque: Array
    clear: NDArray[np.bool_]
    limit: float
    weight: Array

    @classmethod
    def at(
        cls, model: ExactModel, points: Points, limit: float, largest: float = 0.0
    ) -> "ExactTorque":
        """Evaluate a model at points; ``limit`` in N m is the largest torque that is rendered.

        With ``largest``, the scene's largest torque, differences are weighed as shares of the
        torque at each place: by how many times weaker it is, :data:`FELT_SHARE` at the weakest.
        """
        place = model.settled(points.opening, points.contact)
        clear = _clear(model, points, place)
        torque = model.torque_settled(points.opening, points.opening_rate, place)
        torque = np.where(clear, np.clip(torque, -limit, limit), 0.0)
        weight = np.ones(len(torque))
        if largest > 0.0:
            weight = largest / np.maximum(np.abs(torque), FELT_SHARE * largest)
        return cls(points, torque, clear, limit, weight)

    def away(self, torque: Array) -> Array:
        """How far another torque (n,) at these places is from the exact one, in N m, weighed."""
        other = np.where(self.clear, np.clip(torque, -self.limit, self.limit), 0.0)
        return np.asarray(np.abs(other - self.torque) * self.weight)

    def deviation(self, average: AverageTorque) -> Array:
        """How far a package's tables are from the exact model at each place, in N m."""
        points = self.points
        return self.away(average.torque(points.opening, points.opening_rate, points.contact))


@dataclass(frozen=True)
class SearchGrid:
    """Where tables are compared with the model: ranges, number of places, slowest rate (rad/s)."""

    scene: Ranges
    count: int
    slowest: float


def deviation(
    model: ExactModel,
    average: AverageTorque,
    search: SearchGrid,
    limit: float,
    *,
    largest: float = 0.0,
) -> Deviation:
    """Compare kernel and exact model as they are rendered: both within the torque limit.

    First on the places of `telling_points`; then in shrinking neighbourhoods of the worst.
    With ``largest``, the scene's largest torque, differences are weighed as `ExactTorque` does.
    """
    points, scene = telling_points(model, search), search.scene
    exact = ExactTorque.at(model, points, limit, largest)
    away, torque = exact.deviation(average), exact.torque
    scene_torque, total = float(np.max(np.abs(torque))), len(away)
    reach = search.count ** (-1.0 / 3.0)
    for _ in range(ROUNDS):
        worst = np.argsort(-away, kind="stable")[:WORST]
        near = nearby_points(scene, points.at(worst), NEIGHBOURS, reach, search.slowest)
        points = points.at(worst).joined(near)
        away = ExactTorque.at(model, points, limit, largest).deviation(average)
        total += len(near.opening)
        reach *= 0.2
    first = int(np.argmax(away))
    where = (
        float(points.opening[first]),
        float(points.opening_rate[first]),
        float(points.contact[first]),
    )
    return Deviation(float(away[first]), where, scene_torque, total)


def telling_points(model: ExactModel, search: SearchGrid) -> Points:
    """Places spread over the scene and its faces, at least as many as asked for, and the seams."""
    spread = spread_points(search.scene, search.count, search.slowest)
    return spread.joined(_seams(model, search))


def _seams(model: ExactModel, search: SearchGrid) -> Points:
    """Points close beside where the edge begins to touch, and where the crack begins to run.

    There the torque bends or, for a power below one, rises infinitely steeply, in regions so thin
    that points spread evenly would miss them.
    """
    scene = search.scene
    shift = (search.count % 97) / 97.0
    low, high = scene.opening_rad
    opening = low + (high - low) * (np.arange(SEAM_OPENINGS) + shift) / SEAM_OPENINGS
    cutting = model.cutting
    seams = [settled_contact(replace(cutting, fracture_energy=TOUCH_N, kappa=1.0), opening)]
    if cutting.fracture_energy is not None:
        seams.append(settled_contact(cutting, opening))
    contact = (np.concatenate(seams)[:, None] + SEAM_OFFSETS_m).ravel()
    opening = np.repeat(np.tile(opening, len(seams)), len(SEAM_OFFSETS_m))
    inside = (contact >= scene.contact_m[0]) & (contact <= scene.contact_m[1])
    rate = np.full(contact.shape, -max(scene.opening_rate_rad_per_s[0], search.slowest))
    return Points(opening[inside], rate[inside], contact[inside])


def _clear(model: ExactModel, points: Points, place: Array) -> NDArray[np.bool_]:
    """Where the model itself does not jump."""
    view = edge_height(model.cutting.edge, place, model.blade_angle(points.opening))
    indentation = model.cutting.upper_face_m - view.height
    clear = model.cutting.response.force_at(indentation) < STRONGEST_N
    clear &= np.abs(view.station - model.cutting.edge.length_m) > TIP_CLEARANCE
    if model.cutting.fracture_energy is not None:
        strongest = STRONGEST_N * model.cutting.moving_blades
        parallel = np.maximum(PARALLEL, 2.0 * model.cutting.fracture_energy / strongest)
        clear &= (view.slope > parallel) | (view.slope < -PARALLEL)
    return np.asarray(clear)
