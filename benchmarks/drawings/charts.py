"""A chart on a drawing: axes with a few marks, curves and bands in data's own units."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from benchmarks.drawings.canvas import GREY, INK, PALE, Drawing, Point


@dataclass(frozen=True)
class Chart:
    """A frame (x, y, width, height) on a drawing, and the ranges that it shows."""

    drawing: Drawing
    frame: tuple[float, float, float, float]
    across: tuple[float, float]
    up: tuple[float, float]

    def at(self, x: float, y: float) -> Point:
        """The place of a point on the drawing."""
        left, top, width, height = self.frame
        right = (x - self.across[0]) / (self.across[1] - self.across[0])
        return left + width * right, top + height * (
            1 - (y - self.up[0]) / (self.up[1] - self.up[0])
        )

    def axes(
        self,
        across: str,
        up: str,
        marks_x: Sequence[float],
        marks_y: Sequence[float],
        label: Callable[[float], str] = "{:g}".format,
    ) -> None:
        """Draw grid, marks and both titles."""
        left, top, width, height = self.frame
        for x in marks_x:
            self.drawing.line([self.at(x, self.up[0]), self.at(x, self.up[1])], PALE, 1)
            place = (self.at(x, 0)[0], top + height + 18)
            self.drawing.text(place, label(x), GREY, 13, text_anchor="middle")
        for y in marks_y:
            self.drawing.line([self.at(self.across[0], y), self.at(self.across[1], y)], PALE, 1)
            place = (left - 8, self.at(0, y)[1] + 4)
            self.drawing.text(place, f"{y:g}", GREY, 13, text_anchor="end")
        self.drawing.line(
            [(left, top), (left, top + height), (left + width, top + height)], GREY, 1
        )
        self.drawing.text(
            (left + width / 2, top + height + 38), across, INK, 14, text_anchor="middle"
        )
        self.drawing.text((left, top - 10), up, INK, 14)

    def curve(
        self, x: Sequence[float], y: Sequence[float], colour: str, width: float = 2.0, **more: str
    ) -> None:
        """Draw a line through points."""
        self.drawing.line([self.at(a, b) for a, b in zip(x, y, strict=True)], colour, width, **more)

    def band(
        self, x: Sequence[float], low: Sequence[float], high: Sequence[float], colour: str
    ) -> None:
        """Shade what lies between two lines."""
        there = [self.at(a, b) for a, b in zip(x, high, strict=True)]
        back = [self.at(a, b) for a, b in zip(x, low, strict=True)][::-1]
        self.drawing.area([*there, *back], colour, fill_opacity="0.2")

    def note(self, x: float, y: float, words: str, colour: str = INK, **more: str) -> None:
        """Write beside a place."""
        self.drawing.text(self.at(x, y), words, colour, 13, **more)
