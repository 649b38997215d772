"""What elements, attributes and properties of an SVG file mean for the place of its shapes.

Three kinds: what places or hides a shape and is read, what changes nothing of its outline, and the
rest, which is refused by its name. Of https://www.w3.org/TR/SVG11/, https://www.w3.org/TR/SVG2/,
https://www.w3.org/TR/css-transforms-1/ and what Inkscape, Illustrator and CorelDRAW write.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

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


def refuse_attributes(tag: str, keys: dict[str, str], *, is_root: bool = False) -> None:
    """Raise ValueError for an attribute of a shown element that is not understood, by its name."""
    for key, value in keys.items():
        own = SHAPES.get(tag, _ROOT if is_root else _LINK if tag == "a" else ())
        if key == "transform" and is_root:
            raise ValueError(f"it has transform as an attribute of its root: {_APPLY}")
        if key in own or key in _ANY or key.startswith(("data-", "aria-")):
            continue
        _refuse_property(key, value, f"as an attribute of <{tag}>")


def style_properties(style: str, *, is_root: bool = False) -> dict[str, str]:
    """Properties of a style attribute that place or hide a shape; others change only its looks.

    Raises ValueError for one that is not understood, by its name.
    """
    found: dict[str, str] = {}
    for key, value in _declarations(style, "in a style"):
        if key in ("display", "visibility", "transform"):
            if key in found:
                raise ValueError(f"it has {key} twice in a style: keep one")
            found[key] = value
        if key == "transform" and is_root:  # it turns about the middle of the page
            raise ValueError(f"it has transform in a style of its root: {_APPLY}")
        if key != "transform":
            _refuse_property(key, value, "in a style")
    return found


def refuse_style_sheet(text: str) -> None:
    """Raise ValueError for a <style> that places or hides shapes, or is not understood."""
    for key, value in _declarations(text, "in a <style>"):
        if key in _HIDING:
            raise _refusal(key, "in a <style>")
        _refuse_property(key, value, "in a <style>")


def hiding_value(properties: dict[str, str], attributes: dict[str, str], key: str) -> str:
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
