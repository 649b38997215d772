"""A drawn plate along the line of the cut: where its layers have material, how high, how tough."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from scissorcal.aliases import Array

Spans = tuple[tuple[float, float], ...]

SMALLEST_M = 1e-5
"""Gaps and stretches below this are neither: it is the tolerance to which curves are flattened."""


@dataclass(frozen=True)
class Outline:
    """Closed contours, each (corners, 2) in metres: x along the cut, y across it.

    What lies within an odd number of them is inside, so that a contour within another is a hole.
    """

    contours: tuple[Array, ...]

    @property
    def area_m2(self) -> float:
        """Sum of the contours' areas, holes included."""
        return sum(abs(_signed_area(contour)) for contour in self.contours)


@dataclass(frozen=True)
class Region:
    """A part of a layer with another toughness, against the calibrated material's."""

    outline: Outline
    toughness_ratio: float


@dataclass(frozen=True)
class Layer:
    """One layer of a plate: ``holes`` are taken off its ``outline``."""

    name: str
    thickness_m: float
    toughness_ratio: float
    outline: Outline
    holes: tuple[Outline, ...] = ()
    regions: tuple[Region, ...] = ()


@dataclass(frozen=True)
class LayerStrip:
    """Up to ``end_m`` the toughness is ``toughness_ratio`` times the calibrated material's."""

    end_m: float
    toughness_ratio: float


@dataclass(frozen=True)
class LayerPiece:
    """A stretch of one layer without a gap, along the line of the cut.

    ``top_m`` is the height of its upper face above the lowest face of the plate.
    """

    layer: str
    begin_m: float
    top_m: float
    thickness_m: float
    strips: tuple[LayerStrip, ...]

    @property
    def end_m(self) -> float:
        """Place of its far edge."""
        return self.strips[-1].end_m

    def upper_face_m(self, moving_blades: int) -> float:
        """Its upper face over the x axis: half its height where both blades move."""
        return self.top_m / moving_blades


def layer_pieces(layers: Sequence[Layer], line_m: float) -> tuple[LayerPiece, ...]:
    """The pieces of a plate along the line y = ``line_m``, by layer from below, then along x.

    A layer lies flat on the highest top of those below it that it overlaps along the line.
    Neighbours of one layer that touch are one piece; layers never merge. A corner or an edge that
    lies on the line belongs to what is above it (greater y). Raises ValueError, a sentence, for a
    layer that the line misses, and where regions of a layer overlap on the line.

    >>> sheet = Outline((np.array([[0.0, -1.0], [8.0, -1.0], [8.0, 1.0], [0.0, 1.0]]),))
    >>> hole = Outline((np.array([[3.0, -0.5], [4.0, -0.5], [4.0, 0.5], [3.0, 0.5]]),))
    >>> found = layer_pieces([Layer("sheet", 1e-4, 1.0, sheet, (hole,))], 0.0)
    >>> [(piece.begin_m, piece.end_m) for piece in found]
    [(0.0, 3.0), (4.0, 8.0)]
    """
    pieces: list[LayerPiece] = []
    for layer in layers:
        spans = spans_on_line(layer.outline, line_m)
        for hole in layer.holes:
            spans = _without(spans, spans_on_line(hole, line_m))
        spans = _joined(spans)
        if not spans:
            raise ValueError(
                f'the line of the cut (y = {line_m * 1e3:g} mm) misses the layer "{layer.name}"'
            )
        regions = _regions_on_line(layer, line_m)
        below = tuple(pieces)
        for begin, end in spans:
            under = max((one.top_m for one in below if _overlap(one, begin, end)), default=0.0)
            strips = _strips(begin, end, layer.toughness_ratio, regions)
            top = under + layer.thickness_m
            pieces.append(LayerPiece(layer.name, begin, top, layer.thickness_m, strips))
    return tuple(pieces)


def spans_on_line(outline: Outline, line_m: float) -> Spans:
    """Where the line y = ``line_m`` is inside an outline: ascending spans of x.

    >>> triangle = Outline((np.array([[0.0, 0.0], [4.0, 0.0], [2.0, 2.0]]),))
    >>> spans_on_line(triangle, 1.0), spans_on_line(triangle, 3.0)
    (((1.0, 3.0),), ())
    """
    crossings: list[float] = []
    for contour in outline.contours:
        ahead = np.roll(contour, -1, axis=0)
        x, y = contour.T
        at = (y <= line_m) != (ahead[:, 1] <= line_m)
        rise = np.where(at, ahead[:, 1] - y, 1.0)
        crossings += (x + (line_m - y) / rise * (ahead[:, 0] - x))[at].tolist()
    crossings.sort()
    pairs = zip(crossings[::2], crossings[1::2], strict=True)
    return tuple(pair for pair in pairs if pair[0] < pair[1])


def _without(spans: Spans, holes: Spans) -> Spans:
    for low, high in holes:
        cut = [part for a, b in spans for part in ((a, min(b, low)), (max(a, high), b))]
        spans = tuple((a, b) for a, b in cut if a < b)
    return spans


def _joined(spans: Spans) -> Spans:
    """Spans with gaps too small to be any closed, and without those too short to be any."""
    joined: list[tuple[float, float]] = []
    for begin, end in spans:
        if joined and begin - joined[-1][1] < SMALLEST_M:
            joined[-1] = (joined[-1][0], end)
        else:
            joined.append((begin, end))
    return tuple((a, b) for a, b in joined if b - a >= SMALLEST_M)


def _overlap(piece: LayerPiece, begin: float, end: float) -> bool:
    return min(piece.end_m, end) - max(piece.begin_m, begin) >= SMALLEST_M


def _regions_on_line(layer: Layer, line_m: float) -> tuple[tuple[float, float, float], ...]:
    """Begin, end and ratio of the regions' spans, ascending."""
    found = sorted(
        (begin, end, region.toughness_ratio)
        for region in layer.regions
        for begin, end in spans_on_line(region.outline, line_m)
    )
    for (_, end, _), (begin, _, _) in pairwise(found):
        if begin < end - SMALLEST_M:
            raise ValueError(
                f'regions of the layer "{layer.name}" overlap on the line of the cut, at x = '
                f"{begin * 1e3:g} mm: draw them apart"
            )
    return tuple(found)


def _strips(
    begin: float, end: float, ratio: float, regions: tuple[tuple[float, float, float], ...]
) -> tuple[LayerStrip, ...]:
    """Strips from ``begin`` to ``end``: neighbours of one toughness are one strip."""
    borders = [begin]
    for border in sorted(place for one in regions for place in one[:2]):
        if border - borders[-1] >= SMALLEST_M and end - border >= SMALLEST_M:
            borders.append(border)
    strips: list[LayerStrip] = []
    for low, high in pairwise((*borders, end)):
        middle = 0.5 * (low + high)
        here = next((r for first, last, r in regions if first <= middle < last), ratio)
        if strips and strips[-1].toughness_ratio == here:
            strips.pop()
        strips.append(LayerStrip(high, here))
    return tuple(strips)


def _signed_area(contour: Array) -> float:
    x, y = (contour - contour[0]).T
    return float(0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))
