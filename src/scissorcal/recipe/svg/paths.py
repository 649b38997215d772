"""Paths and lists of points as SVG writes them, in absolute commands of which each says all.

What breaks the grammar is refused: a viewer draws such a path in part, or not at all.
"""

from __future__ import annotations

import re

from scissorcal.recipe.svg.numbers import END, GAP, NUMBER, finite

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
            said = []
            for place in range(takes):
                kind = _FLAG if takes == 7 and place in (3, 4) else _ARGUMENT
                found = kind.match(text, at)
                if not found or (found[1] and is_first and not place):
                    raise _no_path(text, at)
                said.append(finite(found[2]))
                at = found.end()
            count += letter not in "zZ" or before in "zZ"  # to close adds no point
            if count > most:
                return "", count
            pen.draw(letter, said)
            before = letter
            letter = {"m": "l", "M": "L"}.get(letter, letter)
            is_first = False
    return " ".join(pen.made), count


def points(text: str, most: int) -> tuple[str, int]:
    """Corners as a path, not closed, and their number; ``most`` are taken."""
    made: list[str] = []
    at = 0
    while not END.match(text, at) and len(made) <= 2 * most:
        found = _ARGUMENT.match(text, at)
        if not found or (found[1] and not at):
            raise ValueError(f'its points are no numbers at "{text[at : at + 20]}": draw it anew')
        made.append(repr(finite(found[2])))
        at = found.end()
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
        flags = [str(int(one)) for one in at[3:5]] if kind == "a" else []
        numbers = [repr(one) for one in at]
        numbers[3:5] = flags or numbers[3:5]
        self.made += [{"m": "M", "c": "C", "s": "C", "q": "Q", "t": "Q", "a": "A"}.get(kind, "L")]
        self.made += numbers


def _reflected(control: tuple[float, float] | None, x: float, y: float) -> tuple[float, float]:
    """The control point of a smooth curve: the end itself after a curve of another kind."""
    return (x, y) if control is None else (2.0 * x - control[0], 2.0 * y - control[1])


def _no_path(text: str, at: int) -> ValueError:
    return ValueError(f'its path breaks off at "{text[at : at + 20].strip()}": draw it anew')
