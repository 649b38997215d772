"""Shapes of an SVG drawing as outlines in metres; curves become polygons."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scissorcal.errors import InputError
from scissorcal.foreign import parse_isolated, read_foreign
from scissorcal.foreign.formats import DRAWING

if TYPE_CHECKING:
    from scissorcal.model.plate_pieces import Outline

import math

from scissorcal.recipe.svg.elements import MOST_POINTS, MOST_POINTS_OF_FILE, TOO_MANY, DrawnShape

FLAT_MM = 0.01
"""Curves become polygons that lie nowhere farther from them."""

LARGEST_MM = 100_000.0
_NO_PLACES = "it has numbers that are no places on a plate"


@dataclass(frozen=True)
class Drawing:
    """Shapes of one file: by id, in the order of the file; shapes without id are "" alone."""

    path: Path
    shapes: tuple[tuple[str, Outline], ...]

    def shape(self, name: str | None) -> Outline:
        """The shape with this id, or the only one; ValueError, a sentence, where there is none."""
        named = [one for one, _ in self.shapes if one]
        listed = ", ".join(named[:20]) or "none has an id"
        if name is None:
            if len(self.shapes) != 1:
                raise ValueError(
                    f"{self.path.name} has {len(self.shapes)} shapes: say which is meant with id "
                    f"(there are: {listed})"
                )
            return self.shapes[0][1]
        found = [outline for one, outline in self.shapes if one == name]
        if len(found) != 1:
            count = "no" if not found else str(len(found))
            raise ValueError(
                f'{self.path.name} has {count} shapes with id "{name}" (there are: {listed})'
            )
        return found[0]


def read_drawing(path: Path) -> Drawing:
    """Read the shapes of an SVG file, by a child process with limits of memory and time.

    Lengths come from the file's width and height, which need a unit, and its viewBox. Taken are
    path, rect, circle, ellipse, polygon and polyline with their transforms; curves are flattened
    to 0.01 mm, open contours closed. Text, pictures, single lines and colours are passed over (a
    shape without fill and line is a shape), and what display or visibility hides. The file may be
    compressed (svgz).

    Raises InputError where it is no such file, has entities, a script or a clone, or refers to
    another file; and, by its name, for any element, attribute or property that is not known to
    leave the shapes' places as they are, such as transform-origin, clip-path or <switch>.
    """
    from scissorcal.model.plate_pieces import Outline

    data = read_foreign(path, DRAWING)
    answer = parse_isolated(
        "scissorcal.recipe.drawing:parse_drawing", data, path, DRAWING, name=str(path)
    )
    shapes: dict[int, tuple[str, list[Any]]] = {}
    for index, name, contour in answer:
        shapes.setdefault(index, (name, []))[1].append(contour * 1e-3)
    return Drawing(
        path, tuple((name, Outline(tuple(contours))) for name, contours in shapes.values())
    )


def parse_drawing(data: bytes, name: str) -> list[list[Any]]:
    """Contours of an SVG file's shapes: number of the shape, its id, corners (n, 2) in mm.

    InputError, with the file's ``name`` and the reason, where it is not taken; see
    :func:`read_drawing`.
    """
    from scissorcal.recipe.drawing import contours_mm
    from scissorcal.recipe.svg.elements import MOST_POINTS_OF_FILE, shown_shapes, unpacked

    found: list[list[Any]] = []
    room = MOST_POINTS_OF_FILE
    try:
        for index, shape in enumerate(shown_shapes(unpacked(data, DRAWING.most_bytes))):
            contours = contours_mm(shape, room)
            room -= sum(map(len, contours))
            found += [[index, shape.id, contour] for contour in contours]
    except ValueError as error:
        raise InputError(f"{name} is not taken as a drawing: {error}.") from None
    if not found:
        raise InputError(
            f"{name} has no closed shape: draw path, rect, circle, ellipse or polygon."
        )
    return found


def contours_mm(shape: DrawnShape, most: int) -> list[Any]:
    """Corners (n, 2) of each contour of a shape, each once; ``most`` are taken of all together.

    ValueError where there are more, or numbers that are no places.
    """
    import numpy as np
    from svgelements import Path

    found: list[Any] = []
    if not shape.path:
        return found
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
            found.append(contour)
    return found


def _flattened(path: Any, tolerance: float, room: int) -> list[Any]:
    """Corners of one contour: ends of lines, and points of curves close enough together."""
    from svgelements import Arc, CubicBezier, Move, QuadraticBezier

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
    import numpy as np

    return float(np.linalg.norm(matrix[:, :2], 2)) or 1.0


def _closed(corners: list[Any], to_mm: Any) -> Any:
    """Corners (n, 2) in mm, each once."""
    import numpy as np

    if not corners:
        return np.zeros((0, 2))
    drawn = np.array([[one.x, one.y, 1.0] for one in corners], dtype=np.float64)
    with np.errstate(all="ignore"):
        places = drawn @ to_mm.T
    if not (np.isfinite(places).all() and np.abs(places).max() <= LARGEST_MM):
        raise ValueError(_NO_PLACES)
    kept = np.any(places != np.roll(places, 1, axis=0), axis=1)
    return places[kept]
