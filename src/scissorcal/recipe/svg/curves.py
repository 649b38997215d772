"""The shapes of a drawing as polygons in mm; it runs where the drawing is parsed."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from svgelements import Arc, CubicBezier, Move, Path, QuadraticBezier

from scissorcal.errors import InputError
from scissorcal.foreign.formats import DRAWING
from scissorcal.recipe.svg.elements import (
    MOST_POINTS,
    MOST_POINTS_OF_FILE,
    TOO_MANY,
    DrawnShape,
    shown_shapes,
    unpacked,
)

FLAT_MM = 0.01
"""Curves become polygons that lie nowhere farther from them."""

LARGEST_MM = 100_000.0
_NO_PLACES = "it has numbers that are no places on a plate"


def parse_drawing(data: bytes, name: str) -> list[list[Any]]:
    """Contours of an SVG file's shapes: number of the shape, its id, corners (n, 2) in mm.

    InputError, with the file's ``name`` and the reason, where it is not taken; see
    :func:`scissorcal.recipe.plate_layers.read_drawing`.
    """
    shapes: list[list[Any]] = []
    room = MOST_POINTS_OF_FILE
    try:
        for index, shape in enumerate(shown_shapes(unpacked(data, DRAWING.most_bytes))):
            contours = _contours_mm(shape, room)
            room -= sum(map(len, contours))
            shapes += [[index, shape.id, contour] for contour in contours]
    except ValueError as error:
        raise InputError(f"{name} is not taken as a drawing: {error}.") from None
    if not shapes:
        raise InputError(
            f"{name} has no closed shape: draw path, rect, circle, ellipse or polygon."
        )
    return shapes


def _contours_mm(shape: DrawnShape, most: int) -> list[Any]:
    """Corners (n, 2) of each contour of a shape, each once; ``most`` are taken of all together.

    ValueError where there are more, or numbers that are no places.
    """
    closed: list[Any] = []
    if not shape.path:
        return closed
    a, b, c, d, e, f = shape.to_mm
    to_mm = np.array([[a, c, e], [b, d, f]], dtype=np.float64)
    if not np.isfinite(to_mm).all():
        raise ValueError(_NO_PLACES)
    tolerance = FLAT_MM / _stretch(to_mm)
    for part in Path(shape.path).as_subpaths():
        corners = _flattened(Path(part), tolerance, min(most, MOST_POINTS))
        contour = _closed(corners, to_mm)
        most -= len(contour)
        if len(contour) >= 3:
            closed.append(contour)
    return closed


def _flattened(path: Any, tolerance: float, room: int) -> list[Any]:
    """Corners of one contour: ends of lines, and points of curves close enough together."""
    corners: list[Any] = []
    for segment in path:
        if isinstance(segment, Move) or segment.start is None or segment.end is None:
            continue
        steps = 1
        if isinstance(segment, Arc):
            steps = _arc_steps(segment, tolerance)
        elif isinstance(segment, CubicBezier | QuadraticBezier):
            steps = _bezier_steps(segment, tolerance)
        if len(corners) + steps > room + 1:  # the first corner comes again at the end
            raise ValueError(TOO_MANY)
        if not corners or corners[-1] != segment.start:
            corners += [segment.start]
        corners += [segment.point(step / steps) for step in range(1, steps)]
        corners += [segment.end]
    return corners


def _arc_steps(arc: Any, tolerance: float) -> int:
    """A chord over the angle a is r (1 - cos(a / 2)) off its arc."""
    radius = max(abs(arc.rx), abs(arc.ry))
    if not radius > tolerance:
        return 4
    widest = 2.0 * math.acos(1.0 - tolerance / radius)
    return max(4, _whole(abs(arc.sweep) / widest))


def _bezier_steps(curve: Any, tolerance: float) -> int:
    """A chord over a share h of a curve is at most h^2 / 8 of its largest second derivative off."""
    names = ("start", "control", "end") if hasattr(curve, "control") else None
    points = [getattr(curve, n) for n in names or ("start", "control1", "control2", "end")]
    degree = len(points) - 1
    bends = (
        abs(complex(a.x - 2 * b.x + c.x, a.y - 2 * b.y + c.y))
        for a, b, c in zip(points, points[1:], points[2:], strict=False)
    )
    largest = degree * (degree - 1) * max(bends)
    return max(1, _whole(math.sqrt(largest / (8.0 * tolerance))))


def _whole(number: float) -> int:
    if not math.isfinite(number):
        raise ValueError(_NO_PLACES)
    return math.ceil(min(number, MOST_POINTS_OF_FILE + 1))


def _stretch(matrix: Any) -> float:
    """By how much a matrix lengthens at most; 1 where it makes a point of everything."""
    return float(np.linalg.norm(matrix[:, :2], 2)) or 1.0


def _closed(corners: list[Any], to_mm: Any) -> Any:
    """Corners (n, 2) in mm, each once."""
    if not corners:
        return np.zeros((0, 2))
    drawn = np.array([[corner.x, corner.y, 1.0] for corner in corners], dtype=np.float64)
    with np.errstate(all="ignore"):
        places = drawn @ to_mm.T
    if not (np.isfinite(places).all() and np.abs(places).max() <= LARGEST_MM):
        raise ValueError(_NO_PLACES)
    kept = np.any(places != np.roll(places, 1, axis=0), axis=1)
    return places[kept]
