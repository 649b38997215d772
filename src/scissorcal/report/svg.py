"""Charts as inline SVG that takes the page's colours, light or dark, and needs no script.

Each series is a separate group, so that a script can switch it and read its points back from the
path: the axes' ranges stand in ``data-`` attributes of the figure.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from html import escape
from itertools import pairwise

from scissorcal.report.numbers import Number, short, significant, unit_text, with_decimals
from scissorcal.report.panel import Axis, Chart, Look, Series

WIDTH, HEIGHT = 460, 300
SMALL = (340, 210)
ROW = 19
TOP, RIGHT, BOTTOM = 14, 14, 44
CHARACTER = 6.1
MOST_LABEL = 34

MARKS: dict[Look, str] = {
    "opening": "m-2.2 1.6h4.4l-2.2-3.9z",
    "vermillion": "m-2.2 1.6h4.4l-2.2-3.9z",
    "excitation": "m-1.8-1.8h3.6v3.6h-3.6z",
    "green": "m-1.8-1.8h3.6v3.6h-3.6z",
    "press": "m0-2.4l2.4 2.4l-2.4 2.4l-2.4-2.4z",
    "purple": "m0-2.4l2.4 2.4l-2.4 2.4l-2.4-2.4z",
}
"""Marks by look, so that kinds of strokes differ by more than colour; all others are discs."""
DISC = "m-2 0a2 2 0 1 0 4 0a2 2 0 1 0-4 0"
LARGEST_MARKS = 40
"""Up to so many points of a series are drawn with large marks."""


@dataclass(frozen=True)
class _Scale:
    """Takes values to pixels; ``log`` scales are logarithmic."""

    low: float
    high: float
    start: float
    end: float
    log: bool

    def __call__(self, value: float) -> float:
        low, high, v = self.low, self.high, value
        if self.log:
            low, high, v = math.log(low), math.log(high), math.log(max(v, 1e-300))
        return self.start + (v - low) / (high - low) * (self.end - self.start)

    @property
    def data(self) -> str:
        """Ends in values and pixels, as the script reads them."""
        kind = "log" if self.log else "lin"
        return f"{self.low:.6g} {self.high:.6g} {self.start:g} {self.end:g} {kind}"


def svg(chart: Chart) -> str:
    """Draw a chart; what it shows stands in words in its label (a title would cover the values)."""
    categories = len(chart.y.categories)
    width, height = SMALL if chart.small else (WIDTH, HEIGHT)
    if categories:
        height = TOP + BOTTOM + ROW * max(categories, 2)
    ys = _ticks(chart.y, _extent(chart, "y"))
    left = 30 + CHARACTER * max((len(label) for _, label in ys.labels), default=0)
    xs = _ticks(chart.x, _extent(chart, "x"))
    sx = _Scale(xs.low, xs.high, left, width - RIGHT, chart.x.log)
    ends = (TOP, height - BOTTOM) if categories or chart.y.reverse else (height - BOTTOM, TOP)
    sy = _Scale(ys.low, ys.high, *ends, chart.y.log)
    clip = f"{chart.id}-clip"
    parts = [
        f'<svg viewBox="0 0 {width} {height}" role="{"group" if chart.y.links else "img"}" '
        f'aria-label="{escape(reading(chart))}" data-x="{sx.data}" data-y="{sy.data}">',
        f"<desc>{escape(reading(chart))}</desc>",
        f'<clipPath id="{clip}"><rect x="{left:.1f}" y="{TOP - 5}" '
        f'width="{width - RIGHT - left:.1f}" height="{height - BOTTOM - TOP + 10}"/></clipPath>',
        _grid(chart, xs, ys, sx, sy, (left, width, height)),
        f'<g clip-path="url(#{clip})">',
    ]
    parts += [
        _series(one, number, sx, sy, across=bool(categories))
        for number, one in enumerate(chart.series)
    ]
    return "".join([*parts, "</g></svg>"])


def reading(chart: Chart) -> str:
    """What a chart shows, in words, for who does not see it."""
    words = [f"{chart.title}."]
    if chart.caption:
        words.append(chart.caption)
    for axis, key in ((chart.x, "x"), (chart.y, "y")):
        known = _values(chart.series, key)
        if axis.categories:
            words.append(f"{len(axis.categories)} rows: {', '.join(axis.categories[:3])} ...")
        elif known:
            ends = f"{significant(min(known))} to {significant(max(known))}"
            words.append(f"{axis.label} from {ends} {unit_text(axis.unit)}".rstrip() + ".")
    return " ".join(words)


def _label_of(axis: Axis) -> str:
    """An axis's label with its unit."""
    return f"{axis.label} [{unit_text(axis.unit)}]" if axis.unit else axis.label


@dataclass(frozen=True)
class _Ticks:
    low: float
    high: float
    labels: tuple[tuple[float, str], ...]


def _values(series: Sequence[Series], key: str) -> list[float]:
    found: list[float] = []
    for one in series:
        found += [v for v in getattr(one, key) if v is not None]
    return found


def _extent(chart: Chart, key: str) -> tuple[float, float]:
    """The range that an axis has to show: all values, with what bounds them."""
    axis = chart.x if key == "x" else chart.y
    if axis.categories:
        return -0.5, len(axis.categories) - 0.5
    known = _values(chart.series, key)
    for one in chart.series:
        known += _rims(one, key, axis) if one.kind == "cells" else []
    if key == ("x" if chart.y.categories else "y"):
        for one in chart.series:
            known += [v for v in (*one.low, *one.high) if v is not None]
            known += [0.0] if one.kind == "bars" else []
    if axis.log:
        known = [v for v in known if v > 0]
    low = min(known, default=1.0 if axis.log else 0.0) if axis.low is None else axis.low
    high = max(known, default=2.0) if axis.high is None else axis.high
    if high <= low:
        room = 0.1 * abs(high) or 1.0
        return (high / 1.2, high * 1.2) if axis.log else (low - room, low + room)
    if axis.log:
        below, above = low * 0.93, high * 1.07
    else:
        below, above = low - 0.04 * (high - low), high + 0.04 * (high - low)
    return below if axis.low is None else low, above if axis.high is None else high


def _rims(one: Series, key: str, axis: Axis) -> list[float]:
    """The outer ends of the cells along an axis."""
    values = sorted({v for v in getattr(one, key) if v is not None})
    if len(values) < 2 or axis.high is not None:
        return []
    a, b, y, z = values[0], values[1], values[-2], values[-1]
    if axis.log:
        return [a * math.sqrt(a / b), z * math.sqrt(z / y)]
    return [a - 0.5 * (b - a), z + 0.5 * (z - y)]


def _ticks(axis: Axis, extent: tuple[float, float]) -> _Ticks:
    low, high = extent
    if axis.categories:
        names = [
            name if len(name) <= MOST_LABEL else name[: MOST_LABEL - 1] + "…"
            for name in axis.categories
        ]
        return _Ticks(low, high, tuple(enumerate(names)))
    if axis.log:
        places = [
            m * 10.0**e
            for e in range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
            for m in ((1, 2, 5) if high / low < 300 else (1,))
        ]
        return _Ticks(low, high, tuple((v, short(v, 2)) for v in places if low <= v <= high))
    step = 10.0 ** math.floor(math.log10((high - low) / 4))
    step *= next(m for m in (1, 2, 5, 10) if (high - low) / (m * step) <= 6.5)
    first = math.ceil(low / step)
    places = [k * step for k in range(first, math.floor(high / step) + 1)]
    decimals = max(0, -math.floor(math.log10(step) + 1e-9))
    return _Ticks(low, high, tuple((v, with_decimals(v, decimals)) for v in places))


def _grid(
    chart: Chart, xs: _Ticks, ys: _Ticks, sx: _Scale, sy: _Scale, size: tuple[float, int, int]
) -> str:
    left, width, height = size
    bottom, right = height - BOTTOM, width - RIGHT
    parts = ['<g class="grid">']
    parts += [f'<path d="M{sx(x):.1f} {TOP - 5}V{bottom + 5}"/>' for x, _ in xs.labels]
    if not chart.y.categories:
        parts += [f'<path d="M{left - 4:.1f} {sy(y):.1f}H{right}"/>' for y, _ in ys.labels]
        if ys.low < 0 < ys.high and not sy.log:
            parts.append(f'<path class="zero" d="M{left:.1f} {sy(0.0):.1f}H{right}"/>')
        if xs.low < 0 < xs.high and not sx.log:
            parts.append(f'<path class="zero" d="M{sx(0.0):.1f} {TOP}V{bottom}"/>')
    parts.append("</g>")
    room = CHARACTER * sum(len(text) + 2 for _, text in xs.labels)
    for v, text in xs.labels[:: 1 + int(room / (right - left))]:
        parts.append(f'<text x="{sx(v):.1f}" y="{bottom + 17}" class="mid">{escape(text)}</text>')
    for number, (v, text) in enumerate(ys.labels):
        label = f'<text x="{left - 7:.1f}" y="{sy(v) + 3.5:.1f}" class="end">{escape(text)}</text>'
        link = chart.y.links[number] if number < len(chart.y.links) else ""
        parts.append(f'<a href="#{escape(link)}">{label}</a>' if link else label)
    middle = 0.5 * (left + right)
    label = escape(_label_of(chart.x))
    parts.append(f'<text x="{middle:.1f}" y="{height - 8}" class="mid axis">{label}</text>')
    if chart.y.label:
        at = 0.5 * (TOP + bottom)
        parts.append(
            f'<text transform="translate(12 {at:.1f}) rotate(-90)" class="mid axis">'
            f"{escape(_label_of(chart.y))}</text>"
        )
    return "".join(parts)


def _series(one: Series, number: int, sx: _Scale, sy: _Scale, *, across: bool) -> str:
    """A series as a group; ``across`` says that its bounds are of x."""
    if one.kind == "points":
        body = _points(one, sx, sy, across=across)
    else:
        draw = {"line": _line, "band": _band, "bars": _bars, "cells": _cells}[one.kind]
        body = draw(one, sx, sy)
    if not body:
        return ""
    named = f'data-group="{escape(one.group or str(number))}" data-name="{escape(one.name)}"'
    return f'<g class="s {one.kind} {one.look} {one.style}" {named}>{body}</g>'


def _line(one: Series, sx: _Scale, sy: _Scale) -> str:
    pieces, pen = [], "M"
    for x, y in zip(one.x, one.y, strict=True):
        if x is None or y is None or (sx.log and x <= 0) or (sy.log and y <= 0):
            pen = "M"
            continue
        pieces.append(f"{pen}{sx(x):.1f} {sy(y):.1f}")
        pen = "L"
    return f'<path d="{"".join(pieces)}"/>' if pieces else ""


def _band(one: Series, sx: _Scale, sy: _Scale) -> str:
    pieces = []
    for run in _runs(one.x, one.low, one.high):
        upper = [f"{sx(x):.1f} {sy(high):.1f}" for x, _, high in run]
        lower = [f"{sx(x):.1f} {sy(low):.1f}" for x, low, _ in reversed(run)]
        pieces.append("M" + "L".join(upper + lower) + "Z")
    return f'<path d="{"".join(pieces)}"/>' if pieces else ""


def _runs(*columns: Sequence[Number]) -> Iterable[list[tuple[float, ...]]]:
    run: list[tuple[float, ...]] = []
    for entry in zip(*columns, strict=True):
        known = tuple(v for v in entry if v is not None)
        if len(known) == len(columns):
            run.append(known)
        elif run:
            yield run
            run = []
    if run:
        yield run


def _points(one: Series, sx: _Scale, sy: _Scale, *, across: bool) -> str:
    mark = MARKS.get(one.look, DISC)
    large = len(one.x) <= LARGEST_MARKS
    bars, marks = [], []
    for place, (x, y) in enumerate(zip(one.x, one.y, strict=True)):
        if x is None or y is None or (sx.log and x <= 0) or (sy.log and y <= 0):
            continue
        marks.append(f"M{sx(x):.1f} {sy(y):.1f}{mark}")
        if one.low and one.high and one.low[place] is not None and one.high[place] is not None:
            low, high = one.low[place] or 0.0, one.high[place] or 0.0
            bars.append(
                f"M{sx(low):.1f} {sy(y):.1f}H{sx(high):.1f}"
                if across
                else f"M{sx(x):.1f} {sy(low):.1f}V{sy(high):.1f}"
            )
    if not marks:
        return ""
    error = f'<path class="error" d="{"".join(bars)}"/>' if bars else ""
    size = ' class="large"' if large else ""
    return f'{error}<path{size} d="{"".join(marks)}"/>{_labels(one, sx, sy)}'


def _labels(one: Series, sx: _Scale, sy: _Scale) -> str:
    """Words beside points, above and below in turn, on the side where there is more room."""
    parts = []
    for place, (x, y, label) in enumerate(zip(one.x, one.y, one.labels, strict=False)):
        if x is None or y is None or (sx.log and x <= 0) or (sy.log and y <= 0):
            continue
        left = sx(x) > 0.5 * (sx.start + sx.end)
        at = f'x="{sx(x) + (-5 if left else 5):.1f}" y="{sy(y) + (-5 if place % 2 else 11):.1f}"'
        parts.append(f'<text {at} class="{"end " if left else ""}cell">{escape(label)}</text>')
    return "".join(parts)


def _bars(one: Series, sx: _Scale, sy: _Scale) -> str:
    parts = []
    half = 0.34 * abs(sy(1.0) - sy(0.0))
    for place, (x, y) in enumerate(zip(one.x, one.y, strict=True)):
        start = one.low[place] if one.low else 0.0
        if x is None or y is None or start is None:
            continue
        a, b = sorted((sx(start), sx(x)))
        size = f'width="{b - a:.1f}" height="{2 * half:.1f}"'
        parts.append(f'<rect x="{a:.1f}" y="{sy(y) - half:.1f}" {size}/>')
    return "".join(parts)


def _cells(one: Series, sx: _Scale, sy: _Scale) -> str:
    """Cells about grid points, shaded from the least value to the largest, labelled where few."""
    known = [v for v in one.value if v is not None]
    if not known:
        return ""
    low, high = min(known), max(known)
    across, down = (
        _edges(sorted({v for v in places if v is not None}), scale)
        for places, scale in ((one.x, sx), (one.y, sy))
    )
    label = len(across) <= 12
    parts = []
    for x, y, value in zip(one.x, one.y, one.value, strict=True):
        if x is None or y is None or value is None:
            continue
        (a, b), (c, d) = across[x], down[y]
        shade = 0.06 + 0.5 * ((value - low) / (high - low) if high > low else 0.5)
        place = f'x="{a:.1f}" y="{c:.1f}" width="{b - a:.1f}" height="{d - c:.1f}"'
        parts.append(
            f'<rect {place} fill-opacity="{shade:.2f}"><title>{short(value)}</title></rect>'
        )
        if label and sx.start + 11 < 0.5 * (a + b) < sx.end - 11:
            at = f'x="{0.5 * (a + b):.1f}" y="{0.5 * (c + d) + 3:.1f}"'
            parts.append(f'<text {at} class="mid cell">{short(value, 2)}</text>')
    return "".join(parts)


def _edges(values: Sequence[float], scale: _Scale) -> dict[float, tuple[float, float]]:
    """The ends in pixels of the cell about each value."""
    at = [scale(v) for v in values]
    if len(at) < 2:
        return {v: (p - 8, p + 8) for v, p in zip(values, at, strict=True)}
    between = [0.5 * (a + b) for a, b in pairwise(at)]
    bounds = [2 * at[0] - between[0], *between, 2 * at[-1] - between[-1]]
    return {v: (min(ends), max(ends)) for v, ends in zip(values, pairwise(bounds), strict=True)}
