"""Lengths, transforms, paths and lists of points as SVG and CSS write them, and nothing else.

What breaks the grammar is refused: a viewer draws such a shape in part, elsewhere, or not at all.
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
_NUMBER = r"[+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?"
_WITH_UNIT = re.compile(rf"({_NUMBER})([a-zA-Z%]*)", re.ASCII)
_GAP = r"[ \t\r\n\f]*"
_COMMAND = re.compile(rf"{_GAP}([a-zA-Z])", re.ASCII)
_ARGUMENT = re.compile(rf"{_GAP}(,?){_GAP}({_NUMBER})", re.ASCII)
_FLAG = re.compile(rf"{_GAP}(,?){_GAP}([01])", re.ASCII)
_END = re.compile(rf"{_GAP}\Z")
_CALL = re.compile(rf"{_GAP}(,?){_GAP}([a-zA-Z]+){_GAP}\(([^()]*)\)", re.ASCII)
_TAKES = {"m": 2, "l": 2, "h": 1, "v": 1, "c": 6, "s": 4, "q": 4, "t": 2, "a": 7, "z": 0}
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
    return _finite(found[1]) * (_MM[unit] / MM_PER_PX if unit else 1.0)


def page_length_mm(text: str, key: str) -> float:
    """A length of the page, above 0 and in a unit that has a size."""
    found = _WITH_UNIT.fullmatch(text.strip())
    unit = found[2] if found else ""
    if not found or unit not in _MM or unit == "px" or not _finite(found[1]) > 0.0:
        raise ValueError(
            f'its {key} is "{text[:40]}": state it with a unit, such as {key}="80mm", so that '
            "lengths are known"
        )
    return _finite(found[1]) * _MM[unit]


def view_to_mm(attributes: Mapping[str, str]) -> Matrix:
    """The matrix from user units of a page to mm: width, height, viewBox, preserveAspectRatio."""
    width, height = (page_length_mm(attributes.get(key, ""), key) for key in ("width", "height"))
    said = attributes.get("viewBox")
    if said is None:
        return (MM_PER_PX, 0.0, 0.0, MM_PER_PX, 0.0, 0.0)
    box = [_finite(one) for one in re.split(r"[\s,]+", said.strip()) if _is_number(one)]
    if len(box) != 4 or len(re.split(r"[\s,]+", said.strip())) != 4 or not min(box[2:]) > 0.0:
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
    while not _END.match(text, at):
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


def path_data(text: str, most: int) -> tuple[str, int]:
    """A path with one command for each segment, and its number of points; ``most`` are taken.

    >>> path_data("M0-1h2 3z", 9)
    ('M 0.0 -1.0 h 2.0 h 3.0 z', 3)
    """
    made: list[str] = []
    at, count = 0, 0
    while not _END.match(text, at):
        command = _COMMAND.match(text, at)
        if not command or command[1].lower() not in _TAKES or (not made and command[1] not in "mM"):
            raise _no_path(text, at)
        letter, at = command[1], command.end()
        takes, is_first = _TAKES[letter.lower()], True
        while is_first or (takes and _ARGUMENT.match(text, at)):
            said = [letter]
            for place in range(takes):
                kind = _FLAG if takes == 7 and place in (3, 4) else _ARGUMENT
                found = kind.match(text, at)
                if not found or (found[1] and is_first and not place):
                    raise _no_path(text, at)
                said.append(found[2] if kind is _FLAG else repr(_finite(found[2])))
                at = found.end()
            count += letter not in "zZ" or made[-1] in "zZ"  # to close adds no point
            made += said
            if count > most:
                return " ".join(made), count
            letter = {"m": "l", "M": "L"}.get(letter, letter)
            is_first = False
    return " ".join(made), count


def points(text: str, most: int) -> tuple[str, int]:
    """Corners as a path, not closed, and their number; ``most`` are taken."""
    made: list[str] = []
    at = 0
    while not _END.match(text, at) and len(made) <= 2 * most:
        found = _ARGUMENT.match(text, at)
        if not found or (found[1] and not at):
            raise ValueError(f'its points are no numbers at "{text[at : at + 20]}": draw it anew')
        made.append(repr(_finite(found[2])))
        at = found.end()
    if len(made) % 2 and len(made) <= 2 * most:
        raise ValueError("its points end with an x without y: draw it anew")
    return (
        "M " + " L ".join(map(" ".join, zip(made[::2], made[1::2], strict=False))),
        len(made) // 2,
    )


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
        is_bare = css and not one[2] and name not in ("matrix", "scale") and _finite(one[1]) != 0.0
        if factor is None or is_bare:
            what = "has no unit" if is_bare else f"has the unit {one[2][:20]}"
            raise ValueError(f"its transform {call[0].strip()[:40]} {what}: {_PLAIN}")
        found.append(_finite(one[1]) * factor)
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
    return len(text) <= LONGEST_NUMBER and re.fullmatch(_NUMBER, text, re.ASCII) is not None


def _finite(text: str) -> float:
    value = float(text) if len(text) <= LONGEST_NUMBER else math.inf
    if not math.isfinite(value):
        raise ValueError("it has numbers that are no places on a plate")
    return value


def _no_path(text: str, at: int) -> ValueError:
    return ValueError(f'its path breaks off at "{text[at : at + 20].strip()}": draw it anew')
