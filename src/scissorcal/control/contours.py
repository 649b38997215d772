"""The curve in which the rig's plane meets a plate's surface: points on it, and its shape. Pure."""

import math
from dataclasses import dataclass

import numpy as np

from scissorcal.aliases import Array
from scissorcal.kernel import Contour
from scissorcal.model.surface import Surface
from scissorcal.tracking.plate_pose import PlatePose

ROUNDS = 20
CLOSE_M = 1e-9
LEAST_SHARE = 0.5
"""Of the normal, in the rig's plane: a surface that leans more sideways is not one to press on."""


@dataclass(frozen=True)
class Foot:
    """A point of the contour, in the rig's plane (m), and how the contour runs there.

    ``normal`` is the contour's, out of the material and of length 1; ``share`` is how much of the
    surface's own normal lies in the plane, so that a force along that one is the plane's over
    ``share``. ``curvature`` (1/m) is positive where the contour bulges. ``in_plate`` (3,) is the
    point in the plate's frame.
    """

    point: tuple[float, float]
    normal: tuple[float, float]
    share: float
    curvature: float
    in_plate: Array

    @property
    def tangent(self) -> tuple[float, float]:
        """Along the contour, to the right of its normal."""
        return self.normal[1], -self.normal[0]


def foot_of(surface: Surface, pose: PlatePose, x: float, y: float) -> Foot | None:
    """The contour's point nearest to a point (m) of the rig's plane, to second order.

    None where the search leaves the surface: where it does not meet the plane, or leans so far
    sideways that less than half of its normal lies in it.
    """
    place = np.array((x, y))
    for _ in range(ROUNDS):
        level, slope, bend, inside = _in_plane(surface, pose, place)
        square = float(slope @ slope)
        if not (square > 0.0 and math.isfinite(level)):
            return None
        tangent = np.array((slope[1], -slope[0])) / math.sqrt(square)
        away = np.array((x, y)) - place
        # Newton's step onto the curve, and along it to where the way to the point is its normal.
        along = float(tangent @ away)
        curvature = float(tangent @ bend @ tangent) / math.sqrt(square)
        height = float(slope @ away) / math.sqrt(square)
        along /= max(1.0 + curvature * height, 0.2)
        step = -level * slope / square + along * tangent
        place = place + step
        if float(np.abs(step).max()) < CLOSE_M:
            break
    else:
        return None
    level, slope, bend, inside = _in_plane(surface, pose, place)
    length = math.hypot(*slope)
    share = length / float(np.linalg.norm(surface.at(inside).gradient))
    if not share >= LEAST_SHARE:
        return None
    normal = slope / length
    tangent = np.array((normal[1], -normal[0]))
    return Foot(
        (float(place[0]), float(place[1])),
        (float(normal[0]), float(normal[1])),
        share,
        float(tangent @ bend @ tangent) / length,
        inside,
    )


def on_plate(surface: Surface, pose: PlatePose, x_plate: float, start: Array) -> Foot | None:
    """The contour's point at a place (m) along the plate's x axis; the search begins at ``start``.

    None where the contour does not reach there.
    """
    along = pose.rotation[:2, 0]
    place = np.array(start, dtype=np.float64)
    for _ in range(ROUNDS):
        level, slope, _, inside = _in_plane(surface, pose, place)
        matrix = np.array((slope, along))
        if not abs(np.linalg.det(matrix)) > 1e-6 * math.hypot(*slope):
            return None
        step = np.linalg.solve(matrix, (-level, x_plate - inside[0]))
        place = place + step
        if not np.all(np.isfinite(place)) or float(np.abs(place).max()) > 10.0:
            return None
        if float(np.abs(step).max()) < CLOSE_M:
            return foot_of(surface, pose, float(place[0]), float(place[1]))
    return None


def contour_at(foot: Foot, place: float, pose: PlatePose, *, lift: bool = False) -> Contour:
    """What the servo needs of a foot; ``place`` (m) is where it is along the contour."""
    reach = np.array((*foot.point, 0.0)) - pose.translation
    velocity = pose.velocity + np.cross(pose.turn_rate, reach)
    return Contour(
        point=foot.point,
        normal=foot.normal,
        curvature=foot.curvature,
        place=place,
        velocity=(float(velocity[0]), float(velocity[1])),
        turn_rate=float(pose.turn_rate[2]),
        lift=lift,
    )


def _in_plane(surface: Surface, pose: PlatePose, place: Array) -> tuple[float, Array, Array, Array]:
    """Level, gradient (2,) and Hessian (2, 2) by the rig's x and y, and the point in the plate."""
    inside = pose.rotation.T @ (np.array((place[0], place[1], 0.0)) - pose.translation)
    found = surface.at(inside)
    turned = pose.rotation[:2]
    return found.level, turned @ found.gradient, turned @ found.hessian @ turned.T, inside
