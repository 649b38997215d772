"""Shapes of an SVG drawing as outlines in metres."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scissorcal.foreign import parse_isolated, read_foreign
from scissorcal.foreign.formats import DRAWING

if TYPE_CHECKING:
    from scissorcal.model.plate_pieces import Outline

FLAT_MM = 0.01
"""Curves become polygons that lie nowhere farther from them."""

MOST_SHAPES = 400
MOST_POINTS = 4_000
MOST_POINTS_OF_FILE = 20_000
"""Of one outline, and of all in a file; as the page reads at most (``svg_file.ts``)."""

MOST_ELEMENTS = 5_000
DEEPEST = 32
MOST_CHARACTERS = 1_000
"""Of an attribute other than a path or points; a transform has some 100."""

LARGEST_MM = 100_000.0

_LENGTH = re.compile(r"\+?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?(mm|cm|in|pt|pc)")
"""A length of a page in a unit that has a size; svgelements takes what it cannot read as pixels."""

SHAPES = ("path", "rect", "circle", "ellipse", "polygon", "polyline")
_POINTS = ("d", "points")
_SIZES = ("x", "y", "width", "height", "r", "rx", "ry", "cx", "cy", "viewBox")
_PLACES = (*_POINTS, *_SIZES, "id", "transform", "preserveAspectRatio")
_NOT_SHOWN = ("defs", "symbol", "clipPath", "mask", "pattern", "marker", "metadata")
_HIDDEN = ("hidden", "collapse")
_HIDES = re.compile(
    r"(?<![\w-])(display\s*:\s*none|visibility\s*:\s*(hidden|collapse))\b", re.IGNORECASE
)
_COMMENT = re.compile(r"/\*.*?(\*/|$)", re.DOTALL)
_NUMBERS = {"h": 1, "v": 1, "c": 6, "s": 4, "q": 4, "a": 7}
"""That a segment of a path takes; any other takes 2."""
_TOKEN = re.compile(r"[a-df-zA-DF-Z]|[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")

_TOO_MANY = (
    f"it has an outline of more than {MOST_POINTS:,} points, or {MOST_POINTS_OF_FILE:,} in all: "
    "draw it simpler"
)
_NO_SHAPE = "it has no closed shape: draw path, rect, circle, ellipse or polygon"
_NO_PLACES = "it has numbers that are no places on a plate"
_STYLE_HIDES = (
    "it has a <style> that hides something: remove what is hidden, or hide it by the attribute "
    "display of each shape"
)
_REFUSED = {
    "script": "it has a script, which no drawing of a plate needs: save it as plain SVG",
    "use": "it has clones (<use>): turn them into paths, such as with 'Unlink Clone'",
    "foreignObject": "it has foreign objects: save it as plain SVG",
}


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
    to 0.01 mm, open contours closed. Text, pictures and styles are passed over, and what display
    or visibility hides. Raises InputError where it is no such file, has a document type, script or
    clone, a <style> that hides something, or refers to another file.
    """
    from scissorcal.model.plate_pieces import Outline

    data = read_foreign(path, DRAWING)
    answer = parse_isolated("scissorcal.recipe.drawing:parse_drawing", data, path, DRAWING)
    shapes: dict[int, tuple[str, list[Any]]] = {}
    for index, name, contour in answer:
        shapes.setdefault(index, (name, []))[1].append(contour * 1e-3)
    return Drawing(
        path, tuple((name, Outline(tuple(contours))) for name, contours in shapes.values())
    )


def parse_drawing(data: bytes) -> list[list[Any]]:
    """Contours of an SVG file's shapes: number of the shape, its id, corners (n, 2) in mm.

    ValueError with the reason where the file is not taken; see :func:`read_drawing`.
    """
    import io

    from svgelements import SVG, Length, Path, Shape

    data = _plain(data)
    if not data:  # its root is hidden
        raise ValueError(_NO_SHAPE)
    millimetre = float(Length("1mm").value(ppi=96.0))  # in 1/96 inch, as svgelements rounds it
    parsed = SVG.parse(io.BytesIO(data), reify=False, ppi=96.0)
    found: list[list[Any]] = []
    room = MOST_POINTS_OF_FILE
    shapes = [one for one in parsed.elements() if isinstance(one, Shape)]
    shapes = [one for one in shapes if type(one).__name__.lower() in SHAPES]
    for index, shape in enumerate(shapes):
        name, path = str(shape.id or ""), Path(shape)
        to_mm = _matrix(path.transform) / millimetre
        tolerance = FLAT_MM / _stretch(to_mm)
        for part in path.as_subpaths():
            corners = _flattened(Path(part), tolerance, min(room, MOST_POINTS))
            contour = _closed(corners, to_mm)
            room -= len(contour)
            if len(contour) >= 3:
                found.append([index, name, contour])
    if not found:
        raise ValueError(_NO_SHAPE)
    return found


class _Plain:
    """An SVG file with nothing but its shapes and their places; ValueError for what is refused.

    Nobody else's parser sees styles, texts or pictures: reading them may take forever.
    """

    def __init__(self) -> None:
        self.text: list[str] = []
        self._elements = self._shapes = self._points = 0
        self._open: list[str] = []
        self._visibility = [""]
        self._style: list[str] | None = None
        self._hidden = 0

    def begin(self, name: str, attributes: dict[str, str]) -> None:
        """Called for each element in the order of the file; ``name`` is "namespace local"."""
        from xml.sax.saxutils import quoteattr

        space, _, local = name.rpartition(" ")
        self._elements += 1
        if self._elements > MOST_ELEMENTS or len(self._open) >= DEEPEST:
            raise ValueError(f"it has more than {MOST_ELEMENTS} elements, or {DEEPEST} levels")
        if local in _REFUSED:
            raise ValueError(_REFUSED[local])
        if self._elements == 1:
            _refuse_unitless(local, attributes)
        elif local == "svg":
            raise ValueError("it has a drawing within the drawing (<svg>): save it as plain SVG")
        for key, value in attributes.items():
            _refuse_attribute(key.rpartition(" ")[2], value)
        is_svg = space in ("", "http://www.w3.org/2000/svg")
        tag = local if is_svg and local in (*SHAPES, "svg") else "g"
        if local == "style":
            self._style = []
        visibility = _property(attributes, "visibility")
        self._visibility.append(visibility or self._visibility[-1])
        hidden = not is_svg or local in _NOT_SHOWN or _property(attributes, "display") == "none"
        hidden |= tag in SHAPES and self._visibility[-1] in _HIDDEN
        self._open.append(tag if not hidden and not self._hidden else "")
        self._hidden += hidden or self._hidden > 0
        if self._hidden:
            return
        places = _places(attributes)
        if tag in SHAPES:
            self._count(places)
        said = " ".join(f"{key}={quoteattr(value)}" for key, value in places.items())
        self.text.append(f"<{tag} {said}>")

    def end(self, name: str) -> None:
        """Called where an element ends."""
        tag = self._open.pop()
        self._visibility.pop()
        if name.rpartition(" ")[2] == "style":
            if _HIDES.search(_COMMENT.sub(" ", "".join(self._style or ()))):
                raise ValueError(_STYLE_HIDES)
            self._style = None
        self._hidden -= self._hidden > 0
        if tag:
            self.text.append(f"</{tag}>")

    def said(self, text: str) -> None:
        """Called for text between elements; that of a style is kept until it ends."""
        if self._style is not None:
            self._style.append(text)

    def _count(self, places: dict[str, str]) -> None:
        self._shapes += 1
        self._points += _nodes(places.get("d", "")) + _nodes(places.get("points", ""))
        if self._shapes > MOST_SHAPES:
            raise ValueError(f"it has more than {MOST_SHAPES} shapes: draw it simpler")
        if self._points > MOST_POINTS_OF_FILE:
            raise ValueError(_TOO_MANY)


def _plain(data: bytes) -> bytes:
    """The shapes of a file alone, as SVG; see :class:`_Plain`."""
    from xml.parsers import expat

    def refuse(*_: Any) -> None:
        raise ValueError("it has a document type or entities: save it as plain SVG")

    found = _Plain()
    parser = expat.ParserCreate(namespace_separator=" ")
    parser.StartElementHandler, parser.EndElementHandler = found.begin, found.end
    parser.CharacterDataHandler = found.said
    parser.StartDoctypeDeclHandler = parser.EntityDeclHandler = refuse
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        raise ValueError(f"it is not well-formed XML: {error}") from None
    return "".join(found.text).encode("utf-8")


def _refuse_attribute(key: str, value: str) -> None:
    if key.lower() == "href" and not value.startswith(("#", "data:image/")):
        raise ValueError(f"it refers to another file ({value[:60]}): embed or remove it")
    if key.lower().startswith("on"):
        raise ValueError(f"it has a script ({key[:60]}): save it as plain SVG")
    if key in _PLACES and key not in _POINTS and len(value) > MOST_CHARACTERS:
        raise ValueError(f"its {key} has {len(value)} characters: save it as plain SVG")


def _places(attributes: dict[str, str]) -> dict[str, str]:
    """The attributes of an element that say what and where it is, a transform in its style, too."""
    found = {key: value for key, value in attributes.items() if key in _PLACES}
    transform = _style(attributes).get("transform")
    if transform is not None:
        _refuse_attribute("transform", transform)
        found["transform"] = transform
    return found


def _property(attributes: dict[str, str], key: str) -> str:
    """A property of an element, in its style or else as an attribute; "" where it is inherited."""
    value = _style(attributes).get(key, attributes.get(key, ""))
    value = value.partition("!")[0].strip().lower()
    return "" if value == "inherit" else value


def _style(attributes: dict[str, str]) -> dict[str, str]:
    text = _COMMENT.sub(" ", attributes.get("style", ""))
    said = (one.partition(":") for one in text.split(";"))
    return {key.strip().lower(): value.strip() for key, _, value in said}


def _nodes(drawn: str) -> int:
    """Segments that a path or a list of points states, or fewer: flags of arcs may be joined."""
    count, numbers, each, letter = 0, 0, 2, False
    for token in _TOKEN.finditer(drawn):
        if token[0].isalpha():
            count += max(numbers // each, letter)
            each, numbers, letter = _NUMBERS.get(token[0].lower(), 2), 0, token[0] not in "zZ"
        else:
            numbers += 1
    return count + max(numbers // each, letter)


def _refuse_unitless(root: str, attributes: dict[str, str]) -> None:
    if root != "svg":
        raise ValueError(f"its root is <{root}>, not <svg>")
    for key in ("width", "height"):
        value = attributes.get(key, "").strip()
        if not _LENGTH.fullmatch(value):
            raise ValueError(
                f'its {key} is "{value[:40]}": state it with a unit, such as {key}="80mm", so that '
                "lengths are known"
            )
    box = attributes.get("viewBox")
    if box is not None and not _is_view_box(box):
        raise ValueError(
            f'its viewBox is "{box[:40]}": state four numbers, the last two above 0, so that '
            "lengths are known"
        )


def _is_view_box(text: str) -> bool:
    try:
        numbers = [float(one) for one in text.replace(",", " ").split()]
    except ValueError:
        return False
    return len(numbers) == 4 and all(map(math.isfinite, numbers)) and min(numbers[2:]) > 0.0


def _flattened(path: Any, tolerance: float, room: int) -> list[Any]:
    """Corners of one contour: ends of lines, and points of curves close enough together."""
    from svgelements import Arc, CubicBezier, Line, QuadraticBezier

    corners: list[Any] = []
    for segment in path:
        if segment.start is None or segment.end is None:
            continue
        steps = 1
        if isinstance(segment, Arc):
            steps = _arc_steps(segment, tolerance)
        elif isinstance(segment, CubicBezier | QuadraticBezier):
            steps = _bezier_steps(segment, tolerance)
        elif not isinstance(segment, Line) and type(segment).__name__ not in ("Close", "Move"):
            continue
        if type(segment).__name__ == "Move":
            continue
        if len(corners) + steps > room + 1:  # the first corner comes again at the end
            raise ValueError(_TOO_MANY)
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


def _matrix(transform: Any) -> Any:
    """The rows (2, 3) of a shape's transform, groups and viewBox included.

    svgelements would apply it to segments; arcs that it skews are off by some per cent.
    """
    import numpy as np

    t = transform
    rows = np.array([[t.a, t.c, t.e], [t.b, t.d, t.f]], dtype=np.float64)
    if not np.isfinite(rows).all():
        raise ValueError(_NO_PLACES)
    return rows


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
