"""What every drawing is drawn with: lines, arrows, boxes, text, on a white card."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from xml.sax.saxutils import escape

import numpy as np

Point = tuple[float, float]

INK, GREY, PALE = "#1f2933", "#667380", "#e6eaee"
BLUE, ORANGE, GREEN, PURPLE = "#0072B2", "#C24E00", "#00785A", "#8E4585"
STEEL, SHEET, SHEET_CUT = "#cfd8e3", "#f6e3b4", "#fbf4e0"


@dataclass
class Drawing:
    """An SVG on a white card, which can be read on a light page and on a dark one."""

    width: float
    height: float
    title: str
    parts: list[str] = field(default_factory=list)

    def line(
        self, points: Sequence[Point], colour: str = INK, width: float = 1.5, **more: str
    ) -> None:
        """Draw a polyline; ``more`` are attributes such as stroke_dasharray."""
        at = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        self.parts.append(
            f'<polyline points="{at}" fill="none" stroke="{colour}" stroke-width="{width:g}"'
            f' stroke-linejoin="round"{_attributes(more)}/>'
        )

    def area(self, points: Sequence[Point], fill: str, stroke: str = "none", **more: str) -> None:
        """Draw a closed polygon."""
        at = " ".join(f"{x:.1f},{y:.1f}" for x, y in points)
        self.parts.append(
            f'<polygon points="{at}" fill="{fill}" stroke="{stroke}"{_attributes(more)}/>'
        )

    def dot(self, at: Point, radius: float, fill: str, stroke: str = "none") -> None:
        """Draw a disc."""
        self.parts.append(
            f'<circle cx="{at[0]:.1f}" cy="{at[1]:.1f}" r="{radius:g}" fill="{fill}"'
            f' stroke="{stroke}" stroke-width="1.5"/>'
        )

    def text(self, at: Point, words: str, colour: str = INK, size: int = 15, **more: str) -> None:
        """Write one line; text_anchor places it (start, middle, end)."""
        self.parts.append(
            f'<text x="{at[0]:.1f}" y="{at[1]:.1f}" fill="{colour}" font-size="{size}"'
            f"{_attributes(more)}>{escape(words)}</text>"
        )

    def arrow(self, points: Sequence[Point], colour: str = INK, width: float = 1.8) -> None:
        """Draw a polyline with a head at its end."""
        (x0, y0), (x1, y1) = points[-2], points[-1]
        length = float(np.hypot(x1 - x0, y1 - y0))
        ux, uy = (x1 - x0) / length, (y1 - y0) / length
        size = 4.0 + 2.2 * width
        foot = (x1 - size * ux, y1 - size * uy)
        self.line([*points[:-1], foot], colour, width)
        side = (-0.4 * size * uy, 0.4 * size * ux)
        head = [(x1, y1), (foot[0] + side[0], foot[1] + side[1])]
        self.area([*head, (foot[0] - side[0], foot[1] - side[1])], colour)

    def measure(self, a: Point, b: Point, colour: str = INK) -> None:
        """Draw a dimension line with a head at both ends."""
        middle = (0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]))
        self.arrow([middle, a], colour, 1.2)
        self.arrow([middle, b], colour, 1.2)

    def arc(
        self, centre: Point, radius: float, start: float, end: float, colour: str = INK
    ) -> None:
        """Draw an arc with a head; angles in rad, counted against the clock from the x axis."""
        angles = np.linspace(start, end, 24)
        points = [
            (centre[0] + radius * float(np.cos(a)), centre[1] - radius * float(np.sin(a)))
            for a in angles
        ]
        self.arrow(points, colour, 1.5)

    def box(self, at: Point, size: Point, title: str, lines: Sequence[str], colour: str) -> None:
        """Draw a titled box; ``at`` is its upper left corner."""
        (x, y), (w, h) = at, size
        self.parts.append(
            f'<rect x="{x:g}" y="{y:g}" width="{w:g}" height="{h:g}" rx="8" fill="#ffffff"'
            f' stroke="{colour}" stroke-width="2"/>'
        )
        self.text((x + w / 2, y + 23), title, colour, 15, text_anchor="middle", font_weight="bold")
        for number, words in enumerate(lines):
            self.text((x + w / 2, y + 42 + 17 * number), words, INK, 13, text_anchor="middle")

    def svg(self) -> str:
        """Return the whole file."""
        head = (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {self.width:g} {self.height:g}"'
            f' width="{self.width:g}" height="{self.height:g}"'
            ' font-family="Helvetica, Arial, sans-serif" role="img">'
            f"<title>{escape(self.title)}</title>"
            f'<rect width="{self.width:g}" height="{self.height:g}" rx="10" fill="#ffffff"/>'
        )
        return "\n".join([head, *self.parts, "</svg>", ""])


def _attributes(more: dict[str, str]) -> str:
    return "".join(f' {name.replace("_", "-")}="{value}"' for name, value in more.items())
