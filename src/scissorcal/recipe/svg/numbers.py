"""Lengths and transforms as SVG and CSS write them, and nothing else.

What breaks the grammar is refused: a viewer puts such a shape elsewhere, or draws it not at all.
Errors are ValueErrors that begin with what is wrong.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping

Matrix = tuple[float, float, float, float, float, float]
"""a, b, c, d, e, f as in SVG: (x, y) goes to (a x + c y + e, b x + d y + f)."""

IDENTITY: Matrix = (1.0, 0.0, 0.0, 1.0, 0.0, 0.0)

MM_PER_PX = 25.4 / 96.0
"""A CSS pixel is 1/96 inch, https://www.w3.org/TR/css-values-3/#absolute-lengths."""

LONGEST_NUMBER = 1_000
"""Characters; the longest that programs write have some 25."""

_MM = {"mm": 1.0, "cm": 10.0, "in": 25.4, "pt": 25.4 / 72.0, "pc": 25.4 / 6.0, "px": MM_PER_PX}
_DEGREES = {"deg": 1.0, "grad": 0.9, "rad": 180.0 / math.pi, "turn": 360.0}
NUMBER = r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?"
_WITH_UNIT = re.compile(rf"({NUMBER})([a-zA-Z%]*)", re.ASCII)
GAP = r"[ \t\r\n\f]*"
END = re.compile(rf"{GAP}\Z")
_CALL = re.compile(rf"{GAP}(,?){GAP}([a-zA-Z]+){GAP}\(([^()]*)\)", re.ASCII)
_COUNTS = {
    "matrix": (6,),
    "translate": (1, 2),
    "scale": (1, 2),
    "rotate": (1, 3),
    "skewx": (1,),
    "skewy": (1,),
}
_ALIGNED = re.compile(r"x(Min|Mid|Max)Y(Min|Mid|Max)(?: +(meet|slice))?")
_SHARE = {"Min": 0.0, "Mid": 0.5, "Max": 1.0}


def user_length(text: str, key: str) -> float:
    """A length in user units; one relative to a page or a font is refused by its unit."""
    found = _WITH_UNIT.fullmatch(text.strip())
    if not found or len(text) > LONGEST_NUMBER:
        raise ValueError(f'its {key}="{text[:40]}" is no length: state a number')
    unit = found[2].lower()
    if unit and unit not in _MM:
        raise ValueError(f'its {key}="{text[:40]}" is relative ({found[2][:20]}): state a number')
    return finite(found[1]) * (_MM[unit] / MM_PER_PX if unit else 1.0)


def page_length_mm(text: str, key: str) -> float:
    """A length of the page, above 0 and in a unit that has a size."""
    found = _WITH_UNIT.fullmatch(text.strip())
    unit = found[2] if found else ""
    if not found or unit not in _MM or unit == "px" or not finite(found[1]) > 0.0:
        raise ValueError(
            f'its {key} is "{text[:40]}": state it with a unit, such as {key}="80mm", so that '
            "lengths are known"
        )
    return finite(found[1]) * _MM[unit]


def view_to_mm(attributes: Mapping[str, str]) -> Matrix:
    """The matrix from user units of a page to mm: width, height, viewBox, preserveAspectRatio."""
    width, height = (page_length_mm(attributes.get(key, ""), key) for key in ("width", "height"))
    said = attributes.get("viewBox")
    if said is None:
        return (MM_PER_PX, 0.0, 0.0, MM_PER_PX, 0.0, 0.0)
    words = re.split(r"[\s,]+", said.strip())
    box = [finite(one) for one in words if _is_number(one)]
    if not len(words) == len(box) == 4 or not min(box[2:]) > 0.0:
        raise ValueError(
            f'its viewBox is "{said[:40]}": state four numbers, the last two above 0, so that '
            "lengths are known"
        )
    x, y = width / box[2], height / box[3]
    fit = attributes.get("preserveAspectRatio", "xMidYMid").strip()
    if fit == "none":
        return (x, 0.0, 0.0, y, -x * box[0], -y * box[1])
    aligned = _ALIGNED.fullmatch(fit)
    if not aligned:
        raise ValueError(f'its preserveAspectRatio="{fit[:40]}" is not understood: remove it')
    scale = max(x, y) if aligned[3] == "slice" else min(x, y)
    left = _SHARE[aligned[1]] * (width - scale * box[2]) - scale * box[0]
    top = _SHARE[aligned[2]] * (height - scale * box[3]) - scale * box[1]
    return (scale, 0.0, 0.0, scale, left, top)


def transform(text: str, *, css: bool = False) -> Matrix:
    """The matrix of a transform: of an attribute, without units, or of CSS, with units.

    >>> transform("translate(3 4) scale(2)")
    (2.0, 0.0, 0.0, 2.0, 3.0, 4.0)
    """
    matrix, at = IDENTITY, 0
    if text.strip() == "none":
        return matrix
    while not END.match(text, at):
        call = _CALL.match(text, at)
        if not call or (call[1] and (css or not at)):
            raise ValueError(f'its transform="{text[:60]}" is not understood: {_PLAIN}')
        name = call[2].lower() if css else call[2]
        known = name in ("skewX", "skewY") or name == name.lower()
        if not known or name.lower() not in _COUNTS:
            raise ValueError(f"its transform has {call[2][:20]}(), not understood: {_PLAIN}")
        matrix = product(matrix, _matrix(name.lower(), _arguments(call, name.lower(), css)))
        at = call.end()
    return matrix


def product(first: Matrix, second: Matrix) -> Matrix:
    """The matrix that applies ``second``, then ``first``."""
    a, b, c, d, e, f = first
    g, h, i, j, k, m = second
    return (
        a * g + c * h,
        b * g + d * h,
        a * i + c * j,
        b * i + d * j,
        a * k + c * m + e,
        b * k + d * m + f,
    )


def finite(text: str) -> float:
    """A number that is a place on a plate."""
    value = float(text) if len(text) <= LONGEST_NUMBER else math.inf
    if not math.isfinite(value):
        raise ValueError("it has numbers that are no places on a plate")
    return value


_PLAIN = "save it as plain SVG, transforms applied to the shapes"


def _arguments(call: re.Match[str], name: str, css: bool) -> list[float]:
    """The numbers of a function of a transform: lengths in user units, angles in degrees."""
    inner = call[3].strip()
    texts = inner.split(",") if css else re.split(r"\s*,\s*|\s+", inner)
    found = []
    for place, text in enumerate(texts):
        one = _WITH_UNIT.fullmatch(text.strip())
        if not one:
            raise ValueError(f"its transform has {call[0].strip()[:40]}, no numbers: {_PLAIN}")
        factor = 1.0 if not one[2] else _factor(name, place, one[2].lower()) if css else None
        is_bare = css and not one[2] and name not in ("matrix", "scale") and finite(one[1]) != 0.0
        if factor is None or is_bare:
            what = "has no unit" if is_bare else f"has the unit {one[2][:20]}"
            raise ValueError(f"its transform {call[0].strip()[:40]} {what}: {_PLAIN}")
        found.append(finite(one[1]) * factor)
    if len(found) not in _COUNTS[name] or (css and name == "rotate" and len(found) != 1):
        raise ValueError(f"its transform has {call[0].strip()[:40]}, too many or too few: {_PLAIN}")
    return found


def _factor(name: str, place: int, unit: str) -> float | None:
    if name == "translate":
        return _MM[unit] / MM_PER_PX if unit in _MM else None
    return _DEGREES.get(unit) if name in ("rotate", "skewx", "skewy") and not place else None


def _matrix(name: str, n: list[float]) -> Matrix:
    """https://www.w3.org/TR/SVG11/coords.html#TransformAttribute."""
    if name == "matrix":
        return (n[0], n[1], n[2], n[3], n[4], n[5])
    if name == "translate":
        return (1.0, 0.0, 0.0, 1.0, n[0], n[1] if len(n) > 1 else 0.0)
    if name == "scale":
        return (n[0], 0.0, 0.0, n[-1], 0.0, 0.0)
    if name == "rotate":
        cos, sin = _turn(n[0])
        about: Matrix = (cos, sin, -sin, cos, 0.0, 0.0)
        if len(n) == 1:
            return about
        moved = product((1.0, 0.0, 0.0, 1.0, n[1], n[2]), about)
        return product(moved, (1.0, 0.0, 0.0, 1.0, -n[1], -n[2]))
    slope = math.tan(math.radians(n[0]))
    return (1.0, 0.0, slope, 1.0, 0.0, 0.0) if name == "skewx" else (1.0, slope, 0.0, 1.0, 0.0, 0.0)


def _turn(degrees: float) -> tuple[float, float]:
    """Cosine and sine, exact for quarter turns."""
    quarter = math.remainder(degrees, 360.0) / 90.0
    if quarter == round(quarter):
        return ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0))[int(quarter) % 4]
    return math.cos(math.radians(degrees)), math.sin(math.radians(degrees))


def _is_number(text: str) -> bool:
    return len(text) <= LONGEST_NUMBER and re.fullmatch(NUMBER, text, re.ASCII) is not None
