"""A path on a surface, laid along the contour that the blades can reach, and timed. Pure."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.control.path_file import SurfacePoints
from scissorcal.errors import InputError
from scissorcal.kernel import Contour
from scissorcal.model.surface import HeightField, Surface
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


def contour_at(foot: Foot, place: float, pose: PlatePose, lift: bool = False) -> Contour:
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


SPACING_M = 5e-4
MARGIN_M = 5e-3
"""The contour is looked at so far beyond both ends of the path."""
BESIDE_M = 1e-3
"""A point that states y may lie so far beside the blades' plane."""
FASTEST_M_PER_S = 0.1
ACCELERATION_M_PER_S2 = 0.3
LEAST_RAMP_S = 0.15
REST_S = 0.15
END_REST_S = 0.3
LONGEST_S = 3600.0
KINK_RAD = math.radians(10.0)
"""Turn of the normal within SPACING_M that no radius of 3 mm has."""


class ContourMap(NamedTuple):
    """The contour over a stretch of the plate: places along it against the plate's x axis.

    ``x`` (n,) in m ascends; ``place`` (n,) in m counts along the contour. ``feet`` are its points.
    """

    x: Array
    place: Array
    feet: tuple[Foot, ...]

    def place_of(self, foot: Foot) -> float:
        """Where along the contour a foot is; beyond the stretch as if it went on straight."""
        x = float(foot.in_plate[0])
        at = float(np.interp(x, self.x, self.place))
        for end, inner in ((0, 1), (-1, -2)):
            if (x - self.x[end]) * (self.x[end] - self.x[inner]) > 0.0:
                slope = (self.place[end] - self.place[inner]) / (self.x[end] - self.x[inner])
                at += float(slope * (x - self.x[end]))
        return at


@dataclass(frozen=True, eq=False)
class TimedPath:
    """What CONTROL follows, one entry each tick: arrays (n,).

    ``place`` (m) and ``rate`` (m/s) along the contour, ``force`` (N) in the rig's plane, ``stage``
    the index of the point that is passed next. ``way`` is the length of it all, in m, ``contour``
    what it lies on.
    """

    place: Array
    rate: Array
    force: Array
    stage: NDArray[np.int32]
    way: float
    contour: ContourMap


def map_contour(
    points: SurfacePoints, surface: Surface, pose: PlatePose, length_m: float
) -> ContourMap:
    """The contour along a path, the plate standing at ``pose``; its length along x is ``length_m``.

    Raises InputError, with the line, where a point leaves the plate or its surface, or lies beside
    the blades' plane; and where the surface has a kink.
    """
    for i, (x, y) in enumerate(zip(points.x, points.y, strict=True)):
        _refuse_beyond_plate(points, i, length_m)
        foot = _found(surface, pose, float(x))
        if foot is None or not _is_on(surface, foot):
            raise InputError(
                f"{points.line(i)}: x = {1e3 * x:g} mm leaves the surface, or the blades' plane "
                "does not meet it there. Shorten the path, or state the plate's pose and surface "
                "as they are."
            )
        if abs(y - foot.in_plate[1]) > BESIDE_M:
            raise InputError(
                f"{points.line(i)}: y = {1e3 * y:g} mm lies beside the blades' plane, which meets "
                f"the plate at y = {1e3 * foot.in_plate[1]:.2f} mm there: two axes cannot leave "
                "it. Move the plate, or leave the column y_mm out to follow the line below the "
                "blades."
            )
    low, high = float(points.x.min()) - MARGIN_M, float(points.x.max()) + MARGIN_M
    wanted = np.linspace(low, high, max(2, math.ceil((high - low) / SPACING_M) + 1))
    feet, kept = [], []
    for x in wanted:
        foot = _found(surface, pose, float(x))
        if foot is not None:
            feet.append(foot)
            kept.append(float(x))
    _refuse_kink(points, feet, kept)
    return ContourMap(np.array(kept), _places(feet), tuple(feet))


def time_path(points: SurfacePoints, contour: ContourMap, tick_s: float) -> TimedPath:
    """Time a path: each point's speed on the way to it, smooth ramps, rest where it turns round.

    ``points`` state force and speed throughout. Raises InputError where it would last longer than
    an hour, or goes faster than 0.1 m/s.
    """
    fast = np.flatnonzero(points.speed > FASTEST_M_PER_S)
    if len(fast):
        raise InputError(
            f"{points.line(int(fast[0]))}: {1e3 * points.speed[fast[0]]:g} mm/s is faster than "
            f"{1e3 * FASTEST_M_PER_S:g} mm/s, the fastest that a tip is moved over a surface."
        )
    places = np.interp(points.x, contour.x, contour.place)
    shares = np.array([foot.share for foot in contour.feet])
    share = np.interp(points.x, contour.x, shares)
    steps = np.diff(places)
    if not np.any(steps):
        raise InputError(f"{points.source}: all points are one: a path has to lead somewhere.")
    if float((np.abs(steps) / points.speed[1:]).sum()) > LONGEST_S:
        raise InputError(f"{points.source}: this path lasts longer than an hour. Go faster.")
    parts = [np.full(round(REST_S / tick_s), places[0])]
    for begin, end in _one_way(steps):
        parts.append(_ramped(places[begin : end + 1], points.speed[begin + 1 : end + 1], tick_s))
        parts.append(np.full(round(REST_S / tick_s), places[end]))
    parts.append(np.full(round(END_REST_S / tick_s), places[-1]))
    place = np.concatenate(parts)
    rate = np.gradient(place, tick_s)
    way = np.concatenate([[0.0], np.cumsum(np.abs(steps))])
    walked = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(place)))])
    walked = way[-1] * (walked / walked[-1])  # ends at way[-1] exactly, in the last stage
    force = np.interp(walked, way, points.force * share)
    stage = np.searchsorted(way, walked, side="right").clip(1, len(way) - 1).astype(np.int32)
    return TimedPath(place, rate, force, stage, float(way[-1]), contour)


def _refuse_beyond_plate(points: SurfacePoints, i: int, length_m: float) -> None:
    if not 0.0 <= points.x[i] <= length_m:
        raise InputError(
            f"{points.line(i)}: x = {1e3 * points.x[i]:g} mm is beyond the plate, which goes from "
            f"0 to {1e3 * length_m:g} mm (material.sheet_length_mm in the recipe)."
        )


def _is_on(surface: Surface, foot: Foot) -> bool:
    return not isinstance(surface, HeightField) or bool(surface.inside(foot.in_plate))


def _found(surface: Surface, pose: PlatePose, x: float) -> Foot | None:
    """The contour at a place of the plate: from its flat face on, and from nearer to its origin."""
    along, origin = pose.rotation[:2, 0], pose.translation[:2]
    for share in (1.0, 0.5, 0.0):
        foot = on_plate(surface, pose, share * x, origin + share * x * along)
        if foot is None:
            continue
        if share == 1.0:
            return foot
        steps = max(2, math.ceil(abs((1.0 - share) * x) / SPACING_M))
        for at in np.linspace(share * x, x, steps + 1)[1:]:
            beside = on_plate(surface, pose, float(at), np.array(foot.point))
            if beside is None:
                return None
            foot = beside
        return foot
    return None


def _places(feet: list[Foot]) -> Array:
    """Places along the contour, counted along its tangent from the first foot."""
    points = np.array([foot.point for foot in feet])
    tangents = np.array([foot.tangent for foot in feet])
    steps = np.diff(points, axis=0)
    middle = tangents[1:] + tangents[:-1]
    signs = np.sign((steps * middle).sum(axis=1))
    return np.concatenate([[0.0], np.cumsum(signs * np.hypot(*steps.T))])


def _refuse_kink(points: SurfacePoints, feet: list[Foot], kept: list[float]) -> None:
    for one, other, x in zip(feet, feet[1:], kept, strict=False):
        cross = one.normal[0] * other.normal[1] - one.normal[1] * other.normal[0]
        if abs(math.asin(max(-1.0, min(1.0, cross)))) > KINK_RAD:
            raise InputError(
                f"{points.source}: the surface has a kink near x = {1e3 * x:.1f} mm: its normal "
                f"turns by more than {math.degrees(KINK_RAD):g} degrees within "
                f"{1e3 * SPACING_M:g} mm, where no tip stays in touch. End the path before it."
            )


def _one_way(steps: Array) -> list[tuple[int, int]]:
    """First and last point of each stretch that goes one way."""
    runs: list[tuple[int, int]] = []
    begin, sign = 0, 0.0
    for i, step in enumerate(np.sign(steps)):
        if step * sign < 0.0:
            runs.append((begin, i))
            begin, sign = i, 0.0
        sign = sign or float(step)
    runs.append((begin, len(steps)))
    return runs


def _ramped(places: Array, speeds: Array, tick_s: float) -> Array:
    """Places at each tick on the way through points of one direction, from rest to rest."""
    times = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(places)) / speeds)])
    ramp_s = max(LEAST_RAMP_S, float(speeds.max()) / ACCELERATION_M_PER_S2)
    window = np.hanning(max(3, round(ramp_s / tick_s)) + 2)[1:-1]
    window /= window.sum()
    ticks = np.arange(0.0, times[-1] + tick_s, tick_s)
    steady = np.interp(ticks, times, places)
    padded = np.pad(steady, len(window), mode="edge")
    return np.asarray(np.convolve(padded, window, mode="valid"))


def start_foot(
    points: SurfacePoints, contour: ContourMap, surface: Surface, pose: PlatePose
) -> Foot:
    """The contour's point at which a path begins."""
    at = int(np.argmin(np.abs(contour.x - points.x[0])))
    found = on_plate(surface, pose, float(points.x[0]), np.array(contour.feet[at].point))
    if found is None:
        found = foot_of(surface, pose, *contour.feet[at].point)
    return contour.feet[at] if found is None else found
