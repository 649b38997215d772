"""Edge, back, tip and pivot in the outline of a single blade."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from scissorcal.aliases import Array
from scissorcal.errors import InputError
from scissorcal.vision.blade.silhouette import Silhouette
from scissorcal.vision.targets.boards import MAT_PIVOT_M

EdgeSide = Literal["down", "up"]

FIRST, LAST = 0.12, 0.97
"""Where along a blade its edge is measured, in shares of its length from the pivot."""

BACK_FIRST, BACK_LAST = 0.3, 0.8
"""Where the centreline halves the blade: between edge and back over these shares of its length."""

_SOLID, _UNEVEN = 0.82, 0.06
_HOLE_MM = (0.6, 8.0)


@dataclass(frozen=True)
class BladeParts:
    """A blade's rough geometry on the sheet, good to a flat pixel.

    ``pivot`` (2,) and ``axis`` (2,), a unit vector towards the tip; ``up`` is the unit vector from
    the edge to the back. ``edge`` and ``back`` (n, 2) are points along both in order of station,
    ``hole`` (k, 2) the pivot hole's outline, empty where the pivot was given or found otherwise.
    ``length`` is the tip's station, known to ``tip_sd``. ``pivot_sd`` is how well a pivot without a
    hole is known. ``end`` (m, 2) is the metal's border about the tip where it was followed. The
    centreline halves the blade between the shares ``halved`` of its length.
    """

    pivot: Array
    axis: Array
    up: Array
    edge: Array
    back: Array
    hole: Array
    length: float
    pivot_sd: float = 0.0
    tip_sd: float = 0.0
    end: Array | None = None
    halved: tuple[float, float] = (BACK_FIRST, BACK_LAST)

    def frame(self, points: Array) -> Array:
        """Stations and offsets (n, 2) of sheet points."""
        away = points - self.pivot
        return np.column_stack([away @ self.axis, away @ self.up])

    def points(self, station: Array, offset: Array) -> Array:
        """Sheet points (n, 2) of stations and offsets (n,)."""
        return np.asarray(self.pivot + station[:, None] * self.axis + offset[:, None] * self.up)


def lone_blade(
    shape: Silhouette,
    source: str,
    *,
    edge_side: EdgeSide = "down",
    pivot: Array | None = None,
    pivot_sd: float = 0.0,
) -> BladeParts:
    """Find the parts of a silhouette that should be one blade.

    The pivot is the round hole (of several, the one nearest to the mat's pivot mark) unless it is
    given, and the tip the end farther from it. An outline does not show which side is the edge:
    it is the side that faces the mat's lower rim (``edge_side`` "down") or the upper one.
    """
    _refuse_others(shape, source)
    hole = np.empty((0, 2))
    if pivot is None:
        hole = _pivot_hole(shape, source)
        pivot = hole.mean(axis=0)
        pivot_sd = 0.0
    middle = shape.outer.mean(axis=0)
    axis = np.linalg.svd(shape.outer - middle, full_matrices=False)[2][0]
    ends = (shape.outer - pivot) @ axis
    if -ends.min() > ends.max():
        axis, ends = -axis, -ends
    for _ in range(3):
        up = np.array([axis[1], -axis[0]])
        facing = up[1] if abs(up[1]) > 0.05 else up[0]
        if (facing > 0) != (edge_side == "up"):
            up = -up
        parts = BladeParts(
            pivot, axis, up, *_sides(shape.outer, pivot, axis, up, source), hole, 0.0
        )
        length = float(((shape.outer - pivot) @ axis).max())
        axis = _halving(parts, length)
    up = up - (up @ axis) * axis
    up = up / np.linalg.norm(up)
    _refuse_cut_off(shape, pivot, axis, source)
    edge, back = _sides(shape.outer, pivot, axis, up, source)
    return BladeParts(pivot, axis, up, edge, back, hole, length, pivot_sd)


def _halving(parts: BladeParts, length: float) -> Array:
    """The axis turned so that it halves the width between edge and back."""
    along = np.linspace(BACK_FIRST, BACK_LAST, 101) * length
    lower, upper = (_by_station(parts.frame(side), along) for side in (parts.edge, parts.back))
    turn = float(np.sum(0.5 * (lower + upper) * along) / np.sum(along**2))
    axis = parts.axis + turn * parts.up
    return np.asarray(axis / np.linalg.norm(axis))


def _by_station(side: Array, along: Array) -> Array:
    order = np.argsort(side[:, 0])
    return np.asarray(np.interp(along, side[order, 0], side[order, 1]))


def _sides(outer: Array, pivot: Array, axis: Array, up: Array, source: str) -> tuple[Array, Array]:
    """The outline's lower and upper side between pivot and tip, in order of station."""
    s, e = (outer - pivot) @ axis, (outer - pivot) @ up
    length = float(s.max())
    ahead = s > 0.02 * length
    width = np.histogram(s[ahead], bins=120)[1]
    index = np.clip(np.digitize(s, width) - 1, 0, 119)
    lower, upper = [], []
    for cell in range(120):
        here = np.flatnonzero(ahead & (index == cell))
        if len(here) < 2:
            continue
        lower.append(here[e[here] <= e[here].min() + 0.25 * np.ptp(e[here])])
        upper.append(here[e[here] >= e[here].max() - 0.25 * np.ptp(e[here])])
    if len(lower) < 60:
        raise InputError(f"{source}: the outline is too fragmented to be a blade.")
    below, above = np.concatenate(lower), np.concatenate(upper)
    return outer[below[np.argsort(s[below])]], outer[above[np.argsort(s[above])]]


def _pivot_hole(shape: Silhouette, source: str) -> Array:
    """The round opening nearest to the mat's pivot mark.

    In a shadow or beside glare no single threshold separates an opening from metal, so several
    between metal and sheet are tried.
    """
    unit = 1e-3
    best: list[tuple[float, Array]] = []
    for hole in shape.openings():
        middle = hole.mean(axis=0)
        radii = np.linalg.norm(hole - middle, axis=1)
        radius = float(radii.mean())
        if not _HOLE_MM[0] * unit <= radius <= _HOLE_MM[1] * unit:
            continue
        uneven = float(radii.std()) / radius
        if uneven < _UNEVEN + 0.3 * shape.pixel / radius:
            away = float(np.hypot(*(middle - MAT_PIVOT_M)))
            best.append((away + 0.05 * uneven, hole))
    if not best:
        raise InputError(
            f"{source}: no round pivot hole of {_HOLE_MM[0]:g} to {_HOLE_MM[1]:g} mm radius is "
            "visible in the blade. Let the sheet show through it, or give the pivot's place with "
            "--pivot."
        )
    return min(best, key=lambda pair: pair[0])[1]


def _refuse_others(shape: Silhouette, source: str) -> None:
    import cv2

    if shape.others:
        raise InputError(
            f"{source}: {1 + len(shape.others)} objects of a blade's size are on the mat; one "
            "blade is expected. Leave one blade, or photograph open scissors with --both."
        )
    outline = shape.outer.astype(np.float32)[:, None, :]
    hull = float(cv2.contourArea(cv2.convexHull(outline)))
    solid = float(cv2.contourArea(outline)) / max(hull, 1e-30)
    if solid < _SOLID:
        raise InputError(
            f"{source}: the outline fills {100 * solid:.0f} % of its convex hull; a single blade "
            f"fills at least {100 * _SOLID:.0f} %. Leave one blade, or give --both for open "
            "scissors."
        )


def _refuse_cut_off(shape: Silhouette, pivot: Array, axis: Array, source: str) -> None:
    """Refuse a blade that is cut off ahead of the pivot; behind it nothing is measured."""
    if len(shape.cut_off) and np.any((shape.cut_off - pivot) @ axis > 0.0):
        raise InputError(
            f"{source}: the blade extends beyond the mat's field or the picture: place it inside "
            "the markers from pivot to tip."
        )
