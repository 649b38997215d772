"""Paths, lists of points, lengths and transforms as SVG and CSS write them.

Paths become absolute commands of which each says all. What breaks the grammar is refused: a viewer
draws such a path in part or elsewhere, or not at all. Errors are ValueErrors that begin with what
is wrong.
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


_PLAIN = "save it as plain SVG, transforms applied to the shapes"


_COMMAND = re.compile(rf"{GAP}([a-zA-Z])", re.ASCII)
_ARGUMENT = re.compile(rf"{GAP}(,?){GAP}({NUMBER})", re.ASCII)
_FLAG = re.compile(rf"{GAP}(,?){GAP}([01])", re.ASCII)
_TAKES = {"m": 2, "l": 2, "h": 1, "v": 1, "c": 6, "s": 4, "q": 4, "t": 2, "a": 7, "z": 0}


def path_data(text: str, most: int) -> tuple[str, int]:
    """A path in the commands M, L, C, Q, A and Z, and its number of points; ``most`` are taken.

    >>> path_data("M0-1h2 3z", 9)
    ('M 0.0 -1.0 L 2.0 -1.0 L 5.0 -1.0 Z', 3)
    """
    pen = _Pen()
    at, count, before = 0, 0, ""
    while not END.match(text, at):
        command = _COMMAND.match(text, at)
        if not command or command[1].lower() not in _TAKES or not (before or command[1] in "mM"):
            raise _no_path(text, at)
        letter, at = command[1], command.end()
        takes, is_first = _TAKES[letter.lower()], True
        while is_first or (takes and _ARGUMENT.match(text, at)):
            numbers = []
            for place in range(takes):
                kind = _FLAG if takes == 7 and place in (3, 4) else _ARGUMENT
                argument = kind.match(text, at)
                if not argument or (argument[1] and is_first and not place):
                    raise _no_path(text, at)
                numbers.append(finite(argument[2]))
                at = argument.end()
            count += letter not in "zZ" or before in "zZ"  # to close adds no point
            if count > most:
                return "", count
            pen.draw(letter, numbers)
            before = letter
            letter = {"m": "l", "M": "L"}.get(letter, letter)
            is_first = False
    return " ".join(pen.made), count


def points(text: str, most: int) -> tuple[str, int]:
    """Corners as a path, not closed, and their number; ``most`` are taken."""
    made: list[str] = []
    at = 0
    while not END.match(text, at) and len(made) <= 2 * most:
        number = _ARGUMENT.match(text, at)
        if not number or (number[1] and not at):
            raise ValueError(f'its points are no numbers at "{text[at : at + 20]}": draw it anew')
        made.append(repr(finite(number[2])))
        at = number.end()
    if len(made) % 2 and len(made) <= 2 * most:
        raise ValueError("its points end with an x without y: draw it anew")
    return (
        "M " + " L ".join(map(" ".join, zip(made[::2], made[1::2], strict=False))),
        len(made) // 2,
    )


class _Pen:
    """Follows a path, https://www.w3.org/TR/SVG11/paths.html#PathData."""

    def __init__(self) -> None:
        self.made: list[str] = []
        self._x = self._y = 0.0
        self._begin = (0.0, 0.0)
        self._cubic: tuple[float, float] | None = None
        self._quadratic: tuple[float, float] | None = None
        self._closed = False

    def draw(self, letter: str, said: list[float]) -> None:
        """One segment, with the numbers that the path says for it."""
        kind, x, y = letter.lower(), self._x, self._y
        left, top = (x, y) if letter == kind else (0.0, 0.0)
        if kind == "h":
            said = [said[0], y - top]
        elif kind == "v":
            said = [x - left, said[0]]
        shifts = [0.0] * 5 + [left, top] if kind == "a" else [left, top] * (len(said) // 2)
        at = [number + shift for number, shift in zip(said, shifts, strict=True)]
        if kind == "s":
            at = [*_reflected(self._cubic, x, y), *at]
        elif kind == "t":
            at = [*_reflected(self._quadratic, x, y), *at]
        self._cubic = (at[2], at[3]) if kind in "cs" else None
        self._quadratic = (at[0], at[1]) if kind in "qt" else None
        if self._closed and kind not in "mz":
            self.made += ["M", repr(x), repr(y)]
        self._closed = kind == "z"
        if kind == "z":
            self.made.append("Z")
            self._x, self._y = self._begin
            return
        if kind == "m":
            self._begin = (at[0], at[1])
        self._x, self._y = at[-2:]
        flags = [str(int(flag)) for flag in at[3:5]] if kind == "a" else []
        numbers = [repr(number) for number in at]
        numbers[3:5] = flags or numbers[3:5]
        self.made += [{"m": "M", "c": "C", "s": "C", "q": "Q", "t": "Q", "a": "A"}.get(kind, "L")]
        self.made += numbers


def _reflected(control: tuple[float, float] | None, x: float, y: float) -> tuple[float, float]:
    """The control point of a smooth curve: the end itself after a curve of another kind."""
    return (x, y) if control is None else (2.0 * x - control[0], 2.0 * y - control[1])


def _no_path(text: str, at: int) -> ValueError:
    return ValueError(f'its path breaks off at "{text[at : at + 20].strip()}": draw it anew')


def user_length(text: str, key: str) -> float:
    """A length in user units; one relative to a page or a font is refused by its unit."""
    length = _WITH_UNIT.fullmatch(text.strip())
    if not length or len(text) > LONGEST_NUMBER:
        raise ValueError(f'its {key}="{text[:40]}" is no length: state a number')
    unit = length[2].lower()
    if unit and unit not in _MM:
        raise ValueError(f'its {key}="{text[:40]}" is relative ({length[2][:20]}): state a number')
    return finite(length[1]) * (_MM[unit] / MM_PER_PX if unit else 1.0)


def _page_length_mm(text: str, key: str) -> float:
    """A length of the page, above 0 and in a unit that has a size."""
    length = _WITH_UNIT.fullmatch(text.strip())
    unit = length[2] if length else ""
    if not length or unit not in _MM or unit == "px" or not finite(length[1]) > 0.0:
        raise ValueError(
            f'its {key} is "{text[:40]}": state it with a unit, such as {key}="80mm", so that '
            "lengths are known"
        )
    return finite(length[1]) * _MM[unit]


def view_to_mm(attributes: Mapping[str, str]) -> Matrix:
    """The matrix from user units of a page to mm: width, height, viewBox, preserveAspectRatio."""
    width, height = (_page_length_mm(attributes.get(key, ""), key) for key in ("width", "height"))
    view_box = attributes.get("viewBox")
    if view_box is None:
        return (MM_PER_PX, 0.0, 0.0, MM_PER_PX, 0.0, 0.0)
    words = re.split(r"[\s,]+", view_box.strip())
    box = [finite(word) for word in words if _is_number(word)]
    if not len(words) == len(box) == 4 or not min(box[2:]) > 0.0:
        raise ValueError(
            f'its viewBox is "{view_box[:40]}": state four numbers, the last two above 0, so that '
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


def _arguments(call: re.Match[str], name: str, css: bool) -> list[float]:
    """The numbers of a function of a transform: lengths in user units, angles in degrees."""
    inner = call[3].strip()
    texts = inner.split(",") if css else re.split(r"\s*,\s*|\s+", inner)
    arguments = []
    for place, text in enumerate(texts):
        argument = _WITH_UNIT.fullmatch(text.strip())
        if not argument:
            raise ValueError(f"its transform has {call[0].strip()[:40]}, no numbers: {_PLAIN}")
        factor = (
            1.0 if not argument[2] else _factor(name, place, argument[2].lower()) if css else None
        )
        is_bare = (
            css
            and not argument[2]
            and name not in ("matrix", "scale")
            and finite(argument[1]) != 0.0
        )
        if factor is None or is_bare:
            what = "has no unit" if is_bare else f"has the unit {argument[2][:20]}"
            raise ValueError(f"its transform {call[0].strip()[:40]} {what}: {_PLAIN}")
        arguments.append(finite(argument[1]) * factor)
    if len(arguments) not in _COUNTS[name] or (css and name == "rotate" and len(arguments) != 1):
        raise ValueError(f"its transform has {call[0].strip()[:40]}, too many or too few: {_PLAIN}")
    return arguments


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
