"""A blade in one photograph: its edge with subpixel accuracy, and its error sources."""

from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from scissorcal.aliases import Array
from scissorcal.errors import InputError
from scissorcal.recipe.priors import BladePriors
from scissorcal.vision.blade.borders import (
    BorderPoints,
    PicturedBlade,
    find_border,
    find_hole,
    fit_circle,
)
from scissorcal.vision.blade.modes import (
    SHARP,
    BladeFrame,
    SeenBorders,
    edge_modes,
    halving_stations,
)
from scissorcal.vision.blade.silhouette import BACK_LAST, LAST, BladeParts
from scissorcal.vision.blade.view import View

_ANCHORS, _STRETCHES = 14, 30
_LEAST_HALVED = 0.4
_WAVY = 0.008
"""Largest distance of a side's points from a parabola, as a share of the blade's length."""


@dataclass(frozen=True)
class BladeMeasurement:
    """One blade of one photograph.

    ``station``, ``offset`` and ``sd`` (n,) are points of the edge in the blade's frame (sheet
    units: metres, or pixels without a scale), each with independent noise; ``modes`` (n, k) are
    their common errors, one standard deviation per column: the mapping, the print's scale, the
    pivot, the centreline, the tone of blurred borders, the metal's grain; ``mode_names``
    say which. ``softness`` (n,) is the blur of each point against the usual one. ``pivot_px`` and
    ``axis_px`` are for pictures. ``unit_length`` is the length that a stated one
    replaces, and 1 where none is stated: that of the pair for open scissors (None: the blade's),
    with the relative error ``unit_length_sd``.
    """

    source: str
    station: Array
    offset: Array
    sd: Array
    softness: Array
    modes: Array
    mode_names: tuple[str, ...]
    length: float
    hole_radius: float
    parts: BladeParts
    edge: BorderPoints
    back: BorderPoints
    metric: bool
    uncertainty: str
    pivot_px: Array
    axis_px: Array
    unit_length: float | None = None
    unit_length_sd: float = 0.0

    @property
    def total_sd(self) -> Array:
        """Standard deviation (n,) of each offset, by its noise and the common errors together."""
        return np.asarray(np.sqrt(self.sd**2 + np.sum(self.modes**2, axis=1)))


def measure_blade(
    blade: PicturedBlade, priors: BladePriors = BladePriors(), *, search: float = 0.035
) -> BladeMeasurement:
    """Measure a blade whose parts are roughly known, in the photograph's pixels.

    Nothing is resampled: borders are found in the picture and mapped to the sheet. Each error
    source has a linear response (see `edge_modes`), and ``priors`` state what no picture shows.
    ``search`` is how far from the rough outline a border may lie, in blade lengths.
    Raises InputError where the picture is too blurred or too much of the edge is hidden.
    """
    view, parts, source = blade.view, blade.parts, blade.source
    edge = find_border(blade, "edge", LAST, search)
    back = find_border(blade, "back", BACK_LAST, search)
    for border, what in ((edge, "edge"), (back, "back")):
        _refuse_unhalved(view, parts, border, f"{source}: too little of the blade's {what}")
    borders = SeenBorders(edge, back, find_hole(blade))
    frame = _framed(view, parts, borders)
    columns, names = edge_modes(view, borders, frame, parts, priors)
    there = view.to_sheet(edge.pixels)
    station, offset = frame.of(there)
    # noise along the normals in pixels becomes noise along ``up`` in sheet units
    unit = np.abs((view.to_sheet(edge.pixels + edge.normals) - there) @ frame.up)
    length = float(parts.length + (parts.pivot - frame.pivot) @ frame.axis)
    order = np.argsort(station)
    apart = np.diff(station[order], prepend=-np.inf, append=np.inf)
    # points that share a station have no slope between them
    order = order[(station[order] > 0.0) & (apart[1:] > 0.0) & (apart[:-1] > 0.0)]
    return BladeMeasurement(
        source,
        station[order],
        offset[order],
        (unit * edge.sd_px)[order],
        edge.softness[order],
        columns[order],
        names,
        length,
        frame.radius,
        replace(parts, pivot=frame.pivot, axis=frame.axis, up=frame.up, length=length),
        edge,
        back,
        view.metric,
        view.uncertainty,
        view.to_pixels(frame.pivot[None])[0],
        view.to_pixels((frame.pivot + 0.5 * length * frame.axis)[None])[0],
    )


def _refuse_unhalved(view: View, parts: BladeParts, border: BorderPoints, what: str) -> None:
    """Refuse a side that is hardly seen where the centreline halves the blade."""
    station = parts.frame(view.to_sheet(border.pixels[border.softness < SHARP]))[:, 0]
    along = halving_stations(parts)
    here = station[(station > along[0]) & (station < along[-1])]
    if len(here) < _ANCHORS or np.ptp(here) < _LEAST_HALVED * (along[-1] - along[0]):
        first, last = (100.0 * share for share in parts.halved)
        raise InputError(
            f"{what} has a clear border between {first:.0f} and {last:.0f} % of its length, where "
            "the centreline halves the blade. Open scissors wider, and light all of it evenly."
        )


def _framed(view: View, parts: BladeParts, borders: SeenBorders) -> BladeFrame:
    """The blade's frame as its borders give it."""
    if borders.hole is None:
        pivot, radius = parts.pivot, 0.0
    else:
        pivot, radius = fit_circle(view.to_sheet(borders.hole.pixels))
    sides = [
        view.to_sheet(border.pixels[border.softness < SHARP])
        for border in (borders.edge, borders.back)
    ]
    axis, up = parts.axis, parts.up
    for _ in range(3):
        axis, up = _halved(sides, pivot, axis, up, halving_stations(parts))
    return BladeFrame(pivot, axis, up, radius)


def _halved(
    sides: list[Array], pivot: Array, axis: Array, up: Array, along: Array
) -> tuple[Array, Array]:
    """The axis turned so that it halves the way between both sides of the blade."""
    middle = np.zeros_like(along)
    for side in sides:
        away = side - pivot
        middle += 0.5 * _smooth(away @ axis, away @ up, along)
    return _turned(axis, up, float(np.sum(middle * along) / np.sum(along**2)))


def _smooth(station: Array, offset: Array, along: Array) -> Array:
    """A side of the blade at places along it, robust against nicks and glare.

    Of all parabolas through three of the side's stretches, the one closest to most stretches
    selects the inliers. The result is their medians, and the parabola where there are none.
    """
    here = (station > along[0]) & (station < along[-1])
    s, e = station[here], offset[here]
    middle = 0.5 * (along[0] + along[-1])
    anchors = np.array(
        [
            (np.median(x), np.median(y))
            for x, y in zip(np.array_split(s, _ANCHORS), np.array_split(e, _ANCHORS), strict=True)
            if len(x)
        ]
    )
    triples = np.array(list(combinations(range(len(anchors)), 3)))
    powers = np.vander(anchors[:, 0] - middle, 3)
    curves = np.linalg.solve(powers[triples], anchors[triples, 1][..., None])[..., 0]
    off = np.abs(anchors[:, 1] - curves @ powers.T)
    curve = curves[np.argmin(np.quantile(off, 0.6, axis=1))]
    for _ in range(4):
        rest = np.abs(e - np.polyval(curve, s - middle))
        usual = 4.0 * 1.4826 * float(np.quantile(rest, 0.4))
        kept = rest < max(usual, _WAVY * float(along[-1]))
        curve = np.polyfit(s[kept] - middle, e[kept], 2)
    cells = np.linspace(along[0], along[-1], _STRETCHES + 1)
    index = np.digitize(s, cells) - 1
    places = 0.5 * (cells[1:] + cells[:-1])
    values = np.polyval(curve, places - middle)
    for cell in range(_STRETCHES):
        in_cell = kept & (index == cell)
        if in_cell.sum() >= 2:
            shift = e[in_cell] - np.polyval(curve, s[in_cell] - middle)
            values[cell] += float(np.median(shift))
    return np.asarray(np.interp(along, places, values))


def _turned(axis: Array, up: Array, angle: float) -> tuple[Array, Array]:
    c, s = np.cos(angle), np.sin(angle)
    return c * axis + s * up, c * up - s * axis
