"""Overlay of a measured blade on its photograph."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.vision.blade.measure import BladeMeasurement
from scissorcal.vision.blade.photo import BladePhoto
from scissorcal.vision.blade.view import View
from scissorcal.vision.overlay import Canvas

Picture = NDArray[np.uint8]

LARGEST = 1600
"""Pixels along the longer side of a picture."""

OUTLINE, END, EDGE, ARROW, NICK, PIVOT, AXIS = (
    (60, 140, 255),
    (255, 120, 200),
    (80, 220, 60),
    (220, 60, 220),
    (40, 40, 240),
    (240, 200, 0),
    (230, 230, 60),
)

_MARGIN = 0.12
_MOST_ARROWS = 120
_ARROW_PX = 30.0


@dataclass(frozen=True)
class NickMark:
    """A nick to be shown: where along the edge, and what to write beside it."""

    station: float
    text: str


def blade_picture(
    photo: BladePhoto,
    edges: Sequence[Callable[[Array], Array]],
    nicks: Sequence[Sequence[NickMark]],
) -> Picture:
    """Draw a measurement over its photograph: bytes (rows, columns, 3), BGR.

    The segmented outline (orange), each blade's back and the end of its metal (violet), its points
    of the edge, the fitted edge (green) as ``edges`` gives e(s), the enlarged residuals as arrows,
    the nicks (red), the pivot and the centreline. Cropped to what matters and enlarged or reduced
    to `LARGEST` pixels.
    """
    borders = [
        photo.view.to_pixels(border) for border in (photo.outline.outer, *photo.outline.others)
    ]
    left, top, right, bottom = _frame(photo, borders)
    part = photo.photo.image[top:bottom, left:right]
    canvas = Canvas(part, min(LARGEST / max(part.shape[:2]), 4.0), (left, top))
    for border in borders:
        canvas.line(border, OUTLINE, closed=True)
    factor = 0.0
    for measured, edge, marks in zip(photo.measured, edges, nicks, strict=True):
        factor = max(factor, _blade(canvas, photo.view, measured, edge, marks))
    words = [photo.photo.source]
    if factor:
        words.append(f"residuals x {factor:.0f}")
    canvas.title("   ".join(words))
    return canvas.picture


def _blade(
    canvas: Canvas,
    view: View,
    blade: BladeMeasurement,
    edge: Callable[[Array], Array],
    marks: Sequence[NickMark],
) -> float:
    def on_picture(station: Array, offset: Array) -> Array:
        return view.to_pixels(blade.parts.points(station, offset))

    canvas.line(np.array([blade.pivot_px, blade.axis_px]), AXIS)
    if blade.parts.end is not None:
        canvas.line(view.to_pixels(blade.parts.end), END)
    back = blade.back.pixels[np.argsort(blade.parts.frame(view.to_sheet(blade.back.pixels))[:, 0])]
    canvas.line(back, END)
    canvas.cross(blade.pivot_px, PIVOT)
    seen = on_picture(blade.station, blade.offset)
    station = np.linspace(blade.station[0], blade.station[-1], 400)
    canvas.line(on_picture(station, edge(station)), EDGE)
    factor = _arrows(canvas, seen, on_picture(blade.station, edge(blade.station)))
    for mark in marks:
        here = float(np.interp(mark.station, blade.station, blade.offset))
        place = on_picture(np.array([mark.station]), np.array([here]))[0]
        canvas.ring(place, NICK, 14)
        canvas.words(mark.text, canvas.whole(place) + 18)
    return factor


def _arrows(canvas: Canvas, seen: Array, fitted: Array) -> float:
    """Draw residuals from the fitted edge, enlarged; returns the factor."""
    off = seen - fitted
    usual = float(np.quantile(np.linalg.norm(off, axis=1), 0.9)) * canvas.scale
    factor = float(np.clip(_ARROW_PX / max(usual, 1e-6), 1.0, 1000.0))
    factor = float(f"{factor:.1g}")
    step = max(len(seen) // _MOST_ARROWS, 1)
    longest = 4.0 * _ARROW_PX / canvas.scale / factor
    for base, gap in zip(fitted[::step], off[::step], strict=True):
        size = float(np.linalg.norm(gap))
        shown = gap * min(1.0, longest / max(size, 1e-12)) * factor
        canvas.line(np.array([base, base + shown]), ARROW)
    return factor


def _frame(photo: BladePhoto, borders: Sequence[Array]) -> tuple[int, int, int, int]:
    height, width = photo.photo.image.shape[:2]
    points = [blade.edge.pixels for blade in photo.measured]
    points += [blade.pivot_px[None] for blade in photo.measured]
    corners = np.concatenate([*points, *borders])
    corners = corners[np.isfinite(corners).all(axis=1)]
    low, high = corners.min(axis=0), corners.max(axis=0)
    room = _MARGIN * float((high - low).max())
    left, top = np.maximum(np.floor(low - room).astype(int), 0)
    right, bottom = np.minimum(np.ceil(high + room).astype(int), [width, height])
    return int(left), int(top), int(right), int(bottom)
