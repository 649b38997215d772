"""What elements, attributes and properties of an SVG file mean for the place of its shapes.

Three kinds: what places or hides a shape and is read, what changes nothing of its outline, and the
rest, which is refused by its name. Of https://www.w3.org/TR/SVG11/, https://www.w3.org/TR/SVG2/,
https://www.w3.org/TR/css-transforms-1/ and what Inkscape, Illustrator and CorelDRAW write.
"""

from __future__ import annotations

import re
from collections.abc import Iterator


def _words(text: str) -> frozenset[str]:
    return frozenset(text.split())


SHAPES = {
    "path": ("d",),
    "rect": ("x", "y", "width", "height", "rx", "ry"),
    "circle": ("cx", "cy", "r"),
    "ellipse": ("cx", "cy", "rx", "ry"),
    "polygon": ("points",),
    "polyline": ("points",),
}
"""Elements that are outlines, with the attributes that draw them."""

CONTAINERS = ("svg", "g", "a")

PASSED_OVER = _words(
    "defs symbol clipPath mask pattern marker metadata linearGradient radialGradient meshgradient "
    "hatch solidcolor filter style title desc view cursor font font-face color-profile "
    "text flowRoot image line"
)
"""What holds no outline of the picture; of this list the last four are drawn, not as outlines."""

_ANIMATIONS = ("animate", "animateTransform", "animateMotion", "animateColor", "set", "discard")
REFUSED_ANYWHERE = {
    "script": "it has a script, which no drawing of a plate needs: save it as plain SVG",
} | {name: f"it is animated (<{name}>): remove the animation" for name in _ANIMATIONS}
REFUSED_WHERE_SHOWN = {
    "use": "it has clones (<use>): turn them into paths, such as with 'Unlink Clone'",
    "foreignObject": "it has foreign objects: save it as plain SVG",
    "switch": "it has alternatives (<switch>): keep one, and save it as plain SVG",
    "svg": "it has a drawing within the drawing (<svg>): save it as plain SVG",
}

_ROOT = _words(
    "width height viewBox preserveAspectRatio x y version baseProfile zoomAndPan contentScriptType "
    "contentStyleType"
)
_ANY = _words("id class style transform lang tabindex role focusable pathLength")
_LINK = _words("href target rel type download hreflang title")
_LOOKS = _words(
    "opacity paint-order shape-rendering image-rendering vector-effect clip-rule mask-type "
    "overflow overflow-x overflow-y enable-background mix-blend-mode isolation pointer-events "
    "cursor user-select will-change backface-visibility content-visibility letter-spacing "
    "word-spacing line-height writing-mode direction unicode-bidi baseline-shift "
    "dominant-baseline alignment-baseline glyph-orientation-vertical glyph-orientation-horizontal "
    "kerning white-space block-progression inline-size shape-inside shape-padding shape-margin "
    "shape-subtract src unicode-range"
)
_LOOKS_BEGIN = (
    *("fill", "stroke", "stop-", "flood-", "lighting-", "color", "solid-", "background"),
    *("font", "text", "marker", "-inkscape-", "--"),
)
_HIDING = {
    "display": _words("inline block none inherit"),
    "visibility": _words("visible hidden collapse inherit"),
}
_VENDOR = re.compile(r"-(webkit|moz|ms|o)-")

_APPLY = "apply the transforms to the shapes"
_RELEASE = "release it, so that the shapes have their final outline"
_ATTRIBUTE = "write it as an attribute of the shape"
_REMEDIES = (
    (
        re.compile(r"transform.*|translate|rotate|scale|zoom|offset.*|motion.*|perspective.*"),
        _APPLY,
    ),
    (re.compile(r"clip|clip-path|mask.*"), _RELEASE),
    (re.compile(r"d|x|y|r|rx|ry|cx|cy|width|height"), _ATTRIBUTE),
    (
        re.compile(r"display|visibility"),
        "remove what is hidden, or hide it by the attribute display of each shape",
    ),
)
_NOTHING = {"clip-path", "mask", "filter", "transform", "translate", "rotate", "scale"}
_ASIDE = re.compile(r"/\*.*?(?:\*/|$)|\"[^\"\n]*\"|'[^'\n]*'|url\([^)]*(?:\)|$)", re.DOTALL | re.I)
_STATEMENT = re.compile(r"([^{};]*)([{};]|$)")


def refuse_attributes(tag: str, keys: dict[str, str], *, is_root: bool = False) -> None:
    """Raise ValueError for an attribute of a shown element that is not understood, by its name."""
    for key, value in keys.items():
        own = SHAPES.get(tag, _ROOT if is_root else _LINK if tag == "a" else ())
        if key == "transform" and is_root:
            raise ValueError(f"it has transform as an attribute of its root: {_APPLY}")
        if key in own or key in _ANY or key.startswith(("data-", "aria-")):
            continue
        _refuse_property(key, value, f"as an attribute of <{tag}>")


def style_properties(style: str) -> dict[str, str]:
    """Properties of a style attribute that place or hide a shape; others change only its looks.

    Raises ValueError for one that is not understood, by its name.
    """
    found: dict[str, str] = {}
    for key, value in _declarations(style, "in a style"):
        if key in ("display", "visibility", "transform"):
            if key in found:
                raise ValueError(f"it has {key} twice in a style: keep one")
            found[key] = value
        if key != "transform":
            _refuse_property(key, value, "in a style")
    return found


def refuse_style_sheet(text: str) -> None:
    """Raise ValueError for a <style> that places or hides shapes, or is not understood."""
    for key, value in _declarations(text, "in a <style>"):
        if key in _HIDING:
            raise _refusal(key, "in a <style>")
        _refuse_property(key, value, "in a <style>")


def hides(properties: dict[str, str], attributes: dict[str, str], key: str) -> str:
    """The value of display or visibility of an element; "" where it is inherited."""
    value = properties.get(key, attributes.get(key, "")).strip().lower()
    return "" if value == "inherit" else value


def _declarations(text: str, where: str) -> Iterator[tuple[str, str]]:
    """Properties, in lower case, with their values; of a sheet those of all its rules."""
    if "\\" in text:
        raise ValueError(f"it has an escape (\\) {where}: save it as plain SVG")
    plain = _ASIDE.sub(lambda one: " " if one[0].startswith("/*") else "_", text)
    if '"' in plain or "'" in plain:
        raise ValueError(f"it has a quote that is not closed {where}: save it as plain SVG")
    for statement in _STATEMENT.finditer(plain):
        said = statement[1].strip()
        if said[:7].lower() == "@import":
            raise ValueError("it refers to another file (@import): embed or remove it")
        key, colon, value = said.partition(":")
        if statement[2] != "{" and colon:
            yield key.strip().lower(), value.partition("!")[0].strip()


def _refuse_property(key: str, value: str, where: str) -> None:
    bare = _VENDOR.sub("", key, count=1)
    said = value.strip().lower()
    if bare in _LOOKS or bare.startswith(_LOOKS_BEGIN) or (said == "none" and bare in _NOTHING):
        return
    if key in _HIDING and said in ("", *_HIDING[key]):
        return
    raise _refusal(key, where)


def _refusal(key: str, where: str) -> ValueError:
    name = key[:40]
    remedy = next((said for names, said in _REMEDIES if names.fullmatch(_VENDOR.sub("", key))), "")
    return ValueError(f"it has {name} {where}, which is not read: {remedy or f'remove {name}'}")
