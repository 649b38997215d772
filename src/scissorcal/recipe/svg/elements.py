"""The shapes of an SVG file: their paths, and the matrices that place them on the page.

Elements, attributes and properties are of three kinds: what places or hides a shape and is read,
what changes nothing of its outline, and the rest, which is refused by its name. Of
https://www.w3.org/TR/SVG11/, https://www.w3.org/TR/SVG2/, https://www.w3.org/TR/css-transforms-1/
and what Inkscape, Illustrator and CorelDRAW write.
"""

from __future__ import annotations

import json
import re
import zlib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple
from xml.parsers import expat

from scissorcal.recipe.svg import path_data as paths

_LISTS: Any = json.loads(Path(__file__).with_name("names.json").read_text("utf-8"))
"""The names, of which the prototype's page has the same (``svg_names.ts``)."""


def _words(name: str) -> frozenset[str]:
    return frozenset(_LISTS[name].split())


SHAPES: Mapping[str, tuple[str, ...]] = {
    tag: tuple(keys.split()) for tag, keys in _LISTS["shapes"].items()
}
"""Elements that are outlines, with the attributes that draw them."""

CONTAINERS = _words("containers")
PASSED_OVER = _words("passed_over")
"""What holds no outline of the picture; text, flowRoot, image and line are drawn, not as outlines.
"""

REFUSED_ANYWHERE: Mapping[str, str] = _LISTS["refused_anywhere"]
REFUSED_WHERE_SHOWN: Mapping[str, str] = _LISTS["refused_where_shown"]

_ROOT, _ANY, _LINK = (_words(f"{of}_attributes") for of in ("root", "any", "link"))
_LOOKS = _words("looks")
_LOOKS_BEGIN = tuple(_LISTS["looks_begin"].split())
_HIDING = {key: values.split() for key, values in _LISTS["hiding"].items()}
_NOTHING = _words("may_be_none")
_REMEDIES = tuple((re.compile(names), remedy) for names, remedy in _LISTS["remedies"])
_APPLY = "apply the transforms to the shapes"
_VENDOR = re.compile(r"-(webkit|moz|ms|o)-")

_ASIDE = re.compile(r"/\*.*?(?:\*/|$)|\"[^\"\n]*\"|'[^'\n]*'|url\([^)]*(?:\)|$)", re.DOTALL | re.I)
_STATEMENT = re.compile(r"([^{};]*)([{};]|$)")


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
    key for keys in SHAPES.values() for key in keys if key not in ("d", "points")
}
_ENTITIES = (
    "its document type has entities (an internal subset): save it as plain SVG, from Illustrator "
    "without 'Preserve Illustrator Editing Capabilities'"
)


class DrawnShape(NamedTuple):
    """One shown shape: its path in its own units, and the matrix from these to mm on the page."""

    id: str
    path: str
    to_mm: paths.Matrix


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
    collected = _Shapes()
    parser = expat.ParserCreate(namespace_separator=" ")
    parser.StartElementHandler, parser.EndElementHandler = collected.begin, collected.end
    parser.CharacterDataHandler = collected.said
    parser.ProcessingInstructionHandler = collected.instructed
    _parse(parser, _without_type(data))
    return collected.shapes


class _Shapes:
    """Collects shapes while a file is parsed; ValueError for what is refused."""

    def __init__(self) -> None:
        self.shapes: list[DrawnShape] = []
        self._elements = self._drawn = self._points = 0
        self._places: list[paths.Matrix] = []
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
        if tag in REFUSED_ANYWHERE:
            raise ValueError(REFUSED_ANYWHERE[tag])
        for key, value in attributes.items():
            _refuse_anywhere(key.rpartition(" ")[2], value)
        if tag == "style":
            self._style = []
        if is_root:
            self._places.append(paths.view_to_mm(attributes))
        else:
            self._places.append(self._places[-1])
        self._visibility.append(self._visibility[-1])
        passed = space not in _SVG or tag in PASSED_OVER
        self._hidden.append(self._hidden[-1] or passed)
        if not self._hidden[-1]:
            svg_attributes = {key: value for key, value in attributes.items() if " " not in key}
            self._shown(tag, svg_attributes, is_root)

    def end(self, name: str) -> None:
        """Called where an element ends."""
        for stack in (self._places, self._visibility, self._hidden):
            stack.pop()
        if name.rpartition(" ")[2] == "style":
            _refuse_style_sheet("".join(self._style or ()))
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
        if tag in REFUSED_WHERE_SHOWN and not is_root:
            raise ValueError(REFUSED_WHERE_SHOWN[tag])
        style = _style_properties(attributes.get("style", ""), is_root=is_root)
        if _hiding_value(style, attributes, "display") == "none":
            self._hidden[-1] = True
            return
        visibility = _hiding_value(style, attributes, "visibility")
        self._visibility[-1] = visibility or self._visibility[-1]
        if tag in SHAPES and self._visibility[-1] in ("hidden", "collapse"):
            return
        if tag not in SHAPES and tag not in CONTAINERS:
            raise ValueError(f"it has <{tag[:40]}>, which is not read: remove it")
        _refuse_attributes(tag, attributes, is_root=is_root)
        if "transform" in style:
            placed = paths.transform(style["transform"], css=True)
        else:
            placed = paths.transform(attributes.get("transform", ""))
        self._places[-1] = paths.product(self._places[-1], placed)
        if tag in SHAPES:
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
            key: paths.user_length(attributes[key], key)
            for key in SHAPES[tag]
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


def _refuse_attributes(tag: str, keys: dict[str, str], *, is_root: bool = False) -> None:
    """Raise ValueError for an attribute of a shown element that is not understood, by its name."""
    for key, value in keys.items():
        of_element = SHAPES.get(tag, _ROOT if is_root else _LINK if tag == "a" else ())
        if key == "transform" and is_root:
            raise ValueError(f"it has transform as an attribute of its root: {_APPLY}")
        if key in of_element or key in _ANY or key.startswith(("data-", "aria-")):
            continue
        _refuse_property(key, value, f"as an attribute of <{tag}>")


def _style_properties(style: str, *, is_root: bool = False) -> dict[str, str]:
    """Properties of a style attribute that place or hide a shape; others change only its looks.

    Raises ValueError for one that is not understood, by its name.
    """
    properties: dict[str, str] = {}
    for key, value in _declarations(style, "in a style"):
        if key in ("display", "visibility", "transform"):
            if key in properties:
                raise ValueError(f"it has {key} twice in a style: keep one")
            properties[key] = value
        if is_root and key == "transform" and value.lower() != "none":
            # it turns about the middle of the page
            raise ValueError(f"it has transform in a style of its root: {_APPLY}")
        if key != "transform":
            _refuse_property(key, value, "in a style")
    return properties


def _refuse_style_sheet(text: str) -> None:
    """Raise ValueError for a <style> that places or hides shapes, or is not understood."""
    for key, value in _declarations(text, "in a <style>"):
        if key in _HIDING:
            raise _refusal(key, "in a <style>")
        _refuse_property(key, value, "in a <style>")


def _hiding_value(properties: dict[str, str], attributes: dict[str, str], key: str) -> str:
    """The value of display or visibility of an element; "" where it is inherited."""
    value = properties.get(key, attributes.get(key, "")).strip().lower()
    return "" if value == "inherit" else value


def _declarations(text: str, where: str) -> Iterator[tuple[str, str]]:
    """Properties, in lower case, with their values; of a sheet those of all its rules."""
    if "\\" in text:
        raise ValueError(f"it has an escape (\\) {where}: save it as plain SVG")
    plain = _ASIDE.sub(lambda match: " " if match[0].startswith("/*") else "_", text)
    if '"' in plain or "'" in plain:
        raise ValueError(f"it has a quote that is not closed {where}: save it as plain SVG")
    for statement in _STATEMENT.finditer(plain):
        declaration = statement[1].strip()
        if declaration[:7].lower() == "@import":
            raise ValueError("it refers to another file (@import): embed or remove it")
        key, colon, value = declaration.partition(":")
        if statement[2] != "{" and colon:
            yield key.strip().lower(), value.partition("!")[0].strip()


def _refuse_property(key: str, value: str, where: str) -> None:
    bare = _VENDOR.sub("", key, count=1)
    plain_value = value.strip().lower()
    if (
        bare in _LOOKS
        or bare.startswith(_LOOKS_BEGIN)
        or (plain_value == "none" and bare in _NOTHING)
    ):
        return
    if key in _HIDING and plain_value in ("", *_HIDING[key]):
        return
    raise _refusal(key, where)


def _refusal(key: str, where: str) -> ValueError:
    name = key[:40]
    remedy = next((cure for names, cure in _REMEDIES if names.fullmatch(_VENDOR.sub("", key))), "")
    return ValueError(f"it has {name} {where}, which is not read: {remedy or f'remove {name}'}")
