"""Shapes of an SVG drawing as outlines in metres."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scissorcal.errors import InputError
from scissorcal.foreign import parse_isolated, read_foreign
from scissorcal.foreign.formats import DRAWING

if TYPE_CHECKING:
    from scissorcal.model.plate_pieces import Outline


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
    from scissorcal.recipe.svg.curves import contours_mm
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
