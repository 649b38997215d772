"""Figures as inline SVG that take the page's colours, light or dark, and need nothing from outside.

Figures are drawn with matplotlib's objects (no pyplot). Colours are placeholders while drawing and
become CSS variables in the SVG, so that one drawing serves screen, night and paper.
"""

from __future__ import annotations

import io
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INK = "#010203"
MUTED = "#010204"
GRID = "#010205"
BLUE = "#010206"
VERMILLION = "#010207"
GREEN = "#010208"
PURPLE = "#010209"
ORANGE = "#01020a"

CSS_NAMES = {
    INK: "var(--ink)",
    MUTED: "var(--muted)",
    GRID: "var(--grid)",
    BLUE: "var(--blue)",
    VERMILLION: "var(--vermillion)",
    GREEN: "var(--green)",
    PURPLE: "var(--purple)",
    ORANGE: "var(--orange)",
}

KIND_LOOKS = {
    "closing": (BLUE, "o"),
    "opening": (VERMILLION, "^"),
    "excitation": (GREEN, "s"),
    "press": (PURPLE, "D"),
}
"""Colour and marker of each kind of stroke: never colour alone.

The colours are those of Okabe and Ito, as given in doi:10.1038/nmeth.1618.
"""

PANEL = (4.6, 3.1)
CARD = (3.4, 2.1)

CHARACTER_WIDTH = 0.072
MARGIN_RIGHT = 0.10
MARGIN_BOTTOM = 0.45
MARGIN_TOP = 0.22

STYLE: Any = {
    "svg.fonttype": "none",
    "svg.hashsalt": "scissorcal",
    "text.parse_math": False,
    "path.simplify": True,
    "font.family": "DejaVu Sans",
    "font.size": 8.5,
    "axes.labelsize": 8.5,
    "axes.titlesize": 9,
    "text.color": INK,
    "axes.edgecolor": MUTED,
    "axes.labelcolor": INK,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": GRID,
    "grid.linewidth": 0.6,
    "xtick.color": MUTED,
    "ytick.color": MUTED,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "lines.linewidth": 1.4,
    "axes.formatter.useoffset": False,
    "axes.unicode_minus": True,
}

SVG_SPACE = "{http://www.w3.org/2000/svg}"
LONG_DECIMAL = re.compile(r"-?\d+\.\d{3,}")
LINK = "{http://www.w3.org/1999/xlink}href"


@dataclass(frozen=True)
class Svg:
    """A finished figure: its markup, what it shows in words, its title and its caption."""

    markup: str
    alt: str
    title: str
    caption: str


@contextmanager
def drawing_style() -> Iterator[None]:
    """Apply the report's style while figures are drawn and written."""
    import matplotlib as mpl

    with mpl.rc_context(STYLE):
        yield


def new_axes(size: tuple[float, float]) -> tuple[Figure, Axes]:
    """A figure with one set of axes; ``size`` in inches."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=size)
    figure.patch.set_visible(False)
    axes = figure.add_subplot()
    axes.patch.set_visible(False)
    axes.margins(x=0.02)
    axes.locator_params(nbins=6 if size[0] >= PANEL[0] else 4)
    return figure, axes


def new_grid(size: tuple[float, float], rows: int, columns: int) -> tuple[Figure, Any]:
    """A figure with a grid of axes (rows, columns), margins left for labels; ``size`` in inches."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=size)
    figure.patch.set_visible(False)
    axes = figure.subplots(rows, columns, squeeze=False)
    for one in axes.ravel():
        one.patch.set_visible(False)
        one.grid(visible=False)
    width, height = size
    figure.subplots_adjust(
        left=0.75 / width,
        right=1 - 0.08 / width,
        bottom=0.55 / height,
        top=1 - 0.25 / height,
        wspace=0.12,
        hspace=0.12,
    )
    return figure, axes


def label_lines(axes: Axes, lines: Sequence[tuple[Any, Any, str, str]]) -> None:
    """Write each line's name where it is farthest from the others; (x, y, name, colour)."""
    import numpy as np

    low, high = axes.get_ylim()
    left, right = axes.get_xlim()
    step = 0.075 * (high - low)
    taken: list[tuple[float, float]] = []
    for number, (x, y, name, colour) in enumerate(lines):
        if not np.any(np.isfinite(y)):
            continue
        apart = np.full(len(x), 0.2)
        for other, (u, v, *_) in enumerate(lines):
            if other != number and np.any(np.isfinite(v)):
                gap = np.abs(y - np.interp(x, u, v, left=np.inf, right=np.inf)) / (high - low)
                apart = np.fmin(apart, gap)
        with np.errstate(invalid="ignore"):
            at = int(np.nanargmax(np.round(apart, 2) + 0.05 * (y - low) / (high - low)))
        place, side = float(y[at]) + 0.35 * step, float(x[at])
        reach = 0.2 * (right - left)
        while any(abs(place - b) < step and abs(side - a) < reach for a, b in taken):
            place += step
        taken.append((side, place))
        middle = 0.5 * (left + right)
        axes.text(
            side, place, name, color=colour, fontsize=8.5, ha="left" if side < middle else "right"
        )
    if taken:
        axes.set_ylim(low, max(high, max(place for _, place in taken) + 1.1 * step))


def look_of(kind: str) -> tuple[str, str]:
    """Colour and marker of a kind of stroke."""
    return KIND_LOOKS.get(kind, (ORANGE, "v"))


def finish(figure: Figure, anchor: str, title: str, caption: str, reading: str = "") -> Svg:
    """Write a figure as inline SVG whose ids start with ``anchor``, unique on the page.

    ``reading`` says in words what is to be seen; with title and caption it is the figure's
    alternative text.
    """
    alt = " ".join(part for part in (f"{title}.", reading or caption) if part)
    _set_margins(figure)
    buffer = io.BytesIO()
    metadata = dict.fromkeys(("Creator", "Date", "Format", "Type"))
    figure.savefig(buffer, format="svg", metadata=metadata, transparent=True)
    root = ET.fromstring(buffer.getvalue())
    for name in ("width", "height", "version"):
        root.attrib.pop(name, None)
    _drop_unneeded(root)
    linked = _own_ids(root, anchor)
    _take_page_looks(root)
    _share_styles(root)
    root.set("role", "group" if linked else "img")
    root.set("aria-label", alt)
    return Svg(ET.tostring(root, encoding="unicode"), alt, title, caption)


def _set_margins(figure: Figure) -> None:
    """Leave room for the labels, counted in characters: a layout engine draws everything twice.

    A grid of axes has its margins already.
    """
    if len(figure.axes) != 1:
        return
    (axes,) = figure.axes
    formatter, places = axes.yaxis.get_major_formatter(), list(axes.get_yticks())
    longest = max((len(label) for label in formatter.format_ticks(places)), default=0)
    title = 0.22 if axes.get_ylabel() else 0.0
    width, height = figure.get_size_inches()
    axes.set_position(
        (
            left := (0.14 + title + CHARACTER_WIDTH * longest) / width,
            MARGIN_BOTTOM / height,
            1 - left - MARGIN_RIGHT / width,
            1 - (MARGIN_BOTTOM + MARGIN_TOP) / height,
        )
    )


def _drop_unneeded(root: ET.Element) -> None:
    """Drop metadata, the style sheet (it would reach the whole page) and blanks between tags."""
    for parent in list(root.iter()):
        for child in list(parent):
            if child.tag in {f"{SVG_SPACE}metadata", f"{SVG_SPACE}style"}:
                parent.remove(child)
        parent.tail = None
        if parent.tag != f"{SVG_SPACE}text":
            parent.text = None


def _own_ids(root: ET.Element, anchor: str) -> bool:
    """Prefix ids that are used, drop the others; True where the figure links to the page."""
    ids = {element.get("id") for element in root.iter()}
    used = set()
    linked = False
    for element in root.iter():
        element.tag = element.tag.removeprefix(SVG_SPACE)
        target = element.attrib.pop(LINK, None)
        if target is not None:
            inner = target.removeprefix("#")
            if element.tag != "a" and inner in ids:
                used.add(inner)
                target = f"#{anchor}-{inner}"
            linked = linked or element.tag == "a"
            element.set("href", target)
        clip = element.get("clip-path")
        if clip:
            inner = clip.removeprefix("url(#").removesuffix(")")
            used.add(inner)
            element.set("clip-path", f"url(#{anchor}-{inner})")
    for element in root.iter():
        name = element.attrib.pop("id", None)
        if name in used:
            element.set("id", f"{anchor}-{name}")
    return linked


def _take_page_looks(root: ET.Element) -> None:
    """Colours become the page's variables, fonts the page's font, coordinates short."""
    for element in root.iter():
        for name in ("d", "x", "y", "transform"):
            value = element.get(name)
            if value is not None:
                element.set(name, _shorten(value))
        if element.get("transform", "").startswith("rotate(-0 "):
            del element.attrib["transform"]
        element.attrib.pop("target", None)
        style = element.attrib.pop("style", "")
        kept = [part.strip() for part in style.split(";") if part.strip()]
        joined = ";".join(part for part in kept if not part.startswith("font-family"))
        for placeholder, name in CSS_NAMES.items():
            joined = joined.replace(placeholder, name)
        if joined:
            element.set("style", joined.replace(": ", ":"))


def _share_styles(root: ET.Element) -> None:
    """Write the style that all of a group's markers share once, on the group."""
    for group in root.iter("g"):
        styles = {child.get("style") for child in group}
        if len(group) > 1 and len(styles) == 1 and all(child.tag == "use" for child in group):
            for child in group:
                group.set("style", child.attrib.pop("style", ""))


def _shorten(text: str) -> str:
    """Round every coordinate to a hundredth of a point."""
    rounded = LONG_DECIMAL.sub(lambda found: f"{float(found.group()):.2f}", text)
    return " ".join(rounded.split())
