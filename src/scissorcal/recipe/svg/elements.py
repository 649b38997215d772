"""The shapes of an SVG file: their paths, and the matrices that place them on the page."""

from __future__ import annotations

import zlib
from dataclasses import dataclass
from typing import Any
from xml.parsers import expat

from scissorcal.recipe.svg import names, numbers, paths

MOST_SHAPES = 400
MOST_POINTS = 4_000
MOST_POINTS_OF_FILE = 20_000
"""Of one outline, and of all in a file; as the page reads at most (``svg_file.ts``)."""

MOST_ELEMENTS = 5_000
DEEPEST = 32
MOST_CHARACTERS = 1_000
"""Of an attribute other than a path or points; a transform has some 100."""

TOO_MANY = (
    f"it has an outline of more than {MOST_POINTS:,} points, or {MOST_POINTS_OF_FILE:,} in all: "
    "draw it simpler"
)
_SVG = ("", "http://www.w3.org/2000/svg")
_SHORT = {"id", "transform", "viewBox", "preserveAspectRatio"} | {
    key for keys in names.SHAPES.values() for key in keys if key not in ("d", "points")
}
_ENTITIES = (
    "its document type has entities (an internal subset): save it as plain SVG, from Illustrator "
    "without 'Preserve Illustrator Editing Capabilities'"
)


@dataclass(frozen=True)
class DrawnShape:
    """One shown shape: its path in its own units, and the matrix from these to mm on the page."""

    id: str
    path: str
    to_mm: numbers.Matrix


def unpacked(data: bytes, most_bytes: int) -> bytes:
    """An SVG file's text, of svgz, too; ValueError where it unpacks to more than ``most_bytes``."""
    if data[:2] != b"\x1f\x8b":
        return data
    packed = zlib.decompressobj(wbits=31)
    try:
        text = packed.decompress(data, most_bytes + 1)
    except zlib.error as error:
        raise ValueError(f"it is compressed (svgz), and damaged: {error}") from None
    if len(text) > most_bytes:
        raise ValueError(f"it unpacks to more than {most_bytes / 1e6:g} MB: draw it simpler")
    if not packed.eof or packed.unused_data:
        raise ValueError("it is compressed (svgz), and cut short or followed by something else")
    return text


def shown_shapes(data: bytes) -> list[DrawnShape]:
    """The shapes of a file that are shown, in its order.

    ValueError for what places, shapes or hides something in a way that is not read, by its name,
    and for what is refused anywhere: scripts, animations, other files, entities.
    """
    found = _Shapes()
    parser = expat.ParserCreate(namespace_separator=" ")
    parser.StartElementHandler, parser.EndElementHandler = found.begin, found.end
    parser.CharacterDataHandler = found.said
    parser.ProcessingInstructionHandler = found.instructed
    _parse(parser, _without_type(data))
    return found.shapes


class _Shapes:
    """Collects shapes while a file is parsed; ValueError for what is refused."""

    def __init__(self) -> None:
        self.shapes: list[DrawnShape] = []
        self._elements = self._drawn = self._points = 0
        self._places: list[numbers.Matrix] = []
        self._visibility = [""]
        self._style: list[str] | None = None
        self._hidden: list[bool] = [False]

    def begin(self, name: str, attributes: dict[str, str]) -> None:
        """Called for each element in the order of the file; ``name`` is "namespace local"."""
        space, _, tag = name.rpartition(" ")
        self._elements += 1
        is_root = self._elements == 1
        if self._elements > MOST_ELEMENTS or len(self._places) >= DEEPEST:
            raise ValueError(f"it has more than {MOST_ELEMENTS} elements, or {DEEPEST} levels")
        if is_root and (tag != "svg" or space not in _SVG):
            raise ValueError(f"its root is <{tag[:40]}>, not <svg>")
        if tag in names.REFUSED_ANYWHERE:
            raise ValueError(names.REFUSED_ANYWHERE[tag])
        for key, value in attributes.items():
            _refuse_anywhere(key.rpartition(" ")[2], value)
        if tag == "style":
            self._style = []
        if is_root:
            self._places.append(numbers.view_to_mm(attributes))
        else:
            self._places.append(self._places[-1])
        self._visibility.append(self._visibility[-1])
        passed = space not in _SVG or tag in names.PASSED_OVER
        self._hidden.append(self._hidden[-1] or passed)
        if not self._hidden[-1]:
            own = {key: value for key, value in attributes.items() if " " not in key}
            self._shown(tag, own, is_root)

    def end(self, name: str) -> None:
        """Called where an element ends."""
        for stack in (self._places, self._visibility, self._hidden):
            stack.pop()
        if name.rpartition(" ")[2] == "style":
            names.refuse_style_sheet("".join(self._style or ()))
            self._style = None

    def said(self, text: str) -> None:
        """Called for text between elements; that of a style is kept until it ends."""
        if self._style is not None:
            self._style.append(text)

    def instructed(self, target: str, text: str) -> None:
        """Called for a processing instruction, which may name a style sheet."""
        if target == "xml-stylesheet":
            raise ValueError(f"it refers to a style sheet ({text[:60]}): save it as plain SVG")

    def _shown(self, tag: str, attributes: dict[str, str], is_root: bool) -> None:
        """Take an element that nothing around it hides."""
        if tag in names.REFUSED_WHERE_SHOWN and not is_root:
            raise ValueError(names.REFUSED_WHERE_SHOWN[tag])
        style = names.style_properties(attributes.get("style", ""), is_root=is_root)
        if names.hiding_value(style, attributes, "display") == "none":
            self._hidden[-1] = True
            return
        visibility = names.hiding_value(style, attributes, "visibility")
        self._visibility[-1] = visibility or self._visibility[-1]
        if tag in names.SHAPES and self._visibility[-1] in ("hidden", "collapse"):
            return
        if tag not in names.SHAPES and tag not in names.CONTAINERS:
            raise ValueError(f"it has <{tag[:40]}>, which is not read: remove it")
        names.refuse_attributes(tag, attributes, is_root=is_root)
        if "transform" in style:
            placed = numbers.transform(style["transform"], css=True)
        else:
            placed = numbers.transform(attributes.get("transform", ""))
        self._places[-1] = numbers.product(self._places[-1], placed)
        if tag in names.SHAPES:
            self._drawn += 1
            if self._drawn > MOST_SHAPES:
                raise ValueError(f"it has more than {MOST_SHAPES} shapes: draw it simpler")
            path = self._path(tag, attributes)
            self.shapes.append(DrawnShape(attributes.get("id", ""), path, self._places[-1]))

    def _path(self, tag: str, attributes: dict[str, str]) -> str:
        """A shape as a path; "" where it has no size."""
        if tag in ("path", "polygon", "polyline"):
            most = MOST_POINTS_OF_FILE - self._points
            read, key = (paths.path_data, "d") if tag == "path" else (paths.points, "points")
            text = attributes.get(key, "")
            path, count = read("" if text.strip() == "none" else text, most)
            self._points += count
            if count > most:
                raise ValueError(TOO_MANY)
            return path
        lengths = {
            key: numbers.user_length(attributes[key], key)
            for key in names.SHAPES[tag]
            if attributes.get(key, "auto").strip() != "auto"
        }
        if any(lengths.get(key, 0.0) < 0.0 for key in ("width", "height", "r", "rx", "ry")):
            raise ValueError(f"it has a <{tag}> of a size below 0: draw it anew")
        return _rect(lengths) if tag == "rect" else _ellipse(lengths)


def _rect(at: dict[str, float]) -> str:
    x, y = at.get("x", 0.0), at.get("y", 0.0)
    width, height = at.get("width", 0.0), at.get("height", 0.0)
    if not (width and height):
        return ""
    rx = min(at.get("rx", at.get("ry", 0.0)), 0.5 * width)
    ry = min(at.get("ry", at.get("rx", 0.0)), 0.5 * height)
    if not (rx and ry):
        return f"M {x} {y} h {width} v {height} h {-width} z"

    def corner(dx: float, dy: float) -> str:
        return f"a {rx} {ry} 0.0 0 1 {dx} {dy}"

    across, down = width - 2.0 * rx, height - 2.0 * ry
    return (
        f"M {x + rx} {y} h {across} {corner(rx, ry)} v {down} {corner(-rx, ry)} "
        f"h {-across} {corner(-rx, -ry)} v {-down} {corner(rx, -ry)} z"
    )


def _ellipse(at: dict[str, float]) -> str:
    cx, cy = at.get("cx", 0.0), at.get("cy", 0.0)
    rx = at.get("r", at.get("rx", at.get("ry", 0.0)))
    ry = at.get("r", at.get("ry", at.get("rx", 0.0)))
    if not (rx and ry):
        return ""
    half = f"a {rx} {ry} 0.0 1 0"
    return f"M {cx - rx} {cy} {half} {2.0 * rx} 0.0 {half} {-2.0 * rx} 0.0 z"


def _refuse_anywhere(key: str, value: str) -> None:
    if key.lower() == "href" and not value.startswith(("#", "data:image/")):
        raise ValueError(f"it refers to another file ({value[:60]}): embed or remove it")
    if key.lower().startswith("on"):
        raise ValueError(f"it has a script ({key[:60]}): save it as plain SVG")
    if key in _SHORT and len(value) > MOST_CHARACTERS:
        raise ValueError(f"its {key} has {len(value)} characters: save it as plain SVG")


def _without_type(data: bytes) -> bytes:
    """A file without its document type, so that an entity that nothing defines is an error.

    With a type that names a file, expat leaves such an entity out of an attribute without a word.
    """
    end: list[int] = []

    def begun(_name: str, _system: str | None, _public: str | None, has_subset: int) -> None:
        if has_subset:
            raise ValueError(_ENTITIES)

    def entity(*_: Any) -> None:
        raise ValueError(_ENTITIES)

    parser = expat.ParserCreate()
    parser.StartDoctypeDeclHandler, parser.EntityDeclHandler = begun, entity
    parser.EndDoctypeDeclHandler = lambda: end.append(parser.CurrentByteIndex)
    _parse(parser, data)
    if not end:
        return data
    for codec in ("utf-8", "utf-16-le", "utf-16-be"):
        begin = data.rfind("<!DOCTYPE".encode(codec), 0, end[0])
        if begin >= 0:
            return data[:begin] + data[end[0] + len(">".encode(codec)) :]
    raise ValueError("its document type is not understood: save it as plain SVG")


def _parse(parser: Any, data: bytes) -> None:
    try:
        parser.Parse(data, True)
    except expat.ExpatError as error:
        raise ValueError(f"it is not well-formed XML: {error}") from None
