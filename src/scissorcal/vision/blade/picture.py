"""Overlay of a measured blade on its photograph."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.vision.blade.measure import BladeMeasurement
from scissorcal.vision.blade.silhouette import Silhouette
from scissorcal.vision.blade.view import View
from scissorcal.vision.photo import Photo

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]

LARGEST = 1600
"""Pixels along the longer side of a picture."""

OUTLINE, EDGE, ARROW, NICK, PIVOT, AXIS = (
    (60, 140, 255),
    (80, 220, 60),
    (220, 60, 220),
    (40, 40, 240),
    (240, 200, 0),
    (230, 230, 60),
)

_MARGIN = 0.12
_MOST_ARROWS = 120
_ARROW_PX = 30.0
_FINE = 4


@dataclass(frozen=True)
class NickMark:
    """A nick to be shown: where along the edge, and what to write beside it."""

    station: float
    text: str


def blade_picture(
    photo: Photo,
    view: View,
    outline: Silhouette | None,
    measured: Sequence[BladeMeasurement],
    edges: Sequence[Callable[[Array], Array] | None] = (),
    nicks: Sequence[Sequence[NickMark]] = (),
    caption: str = "",
) -> Picture:
    """Draw a measurement over its photograph: bytes (rows, columns, 3), BGR.

    The segmented outline (orange), each blade's points of the edge, the fitted edge (green) where
    ``edges`` gives e(s), the enlarged residuals as arrows, the nicks (red), the
    pivot and the centreline. Cropped to what matters and enlarged or reduced to `LARGEST` pixels.
    """
    canvas = _Canvas(photo, _frame(photo, view, outline, measured))
    if outline is not None:
        for border in (outline.outer, *outline.others):
            canvas.line(view.to_pixels(border), OUTLINE, closed=True)
    factor = 0.0
    for index, one in enumerate(measured):
        edge = edges[index] if index < len(edges) else None
        marks = nicks[index] if index < len(nicks) else ()
        factor = max(factor, _blade(canvas, view, one, edge, marks))
    words = [caption] if caption else []
    if factor:
        words.append(f"residuals x {factor:.0f}")
    canvas.words("   ".join(words))
    return canvas.picture


def _blade(
    canvas: "_Canvas",
    view: View,
    one: BladeMeasurement,
    edge: Callable[[Array], Array] | None,
    marks: Sequence[NickMark],
) -> float:
    def on_picture(station: Array, offset: Array) -> Array:
        parts = one.parts
        return view.to_pixels(
            parts.pivot + station[:, None] * parts.axis + offset[:, None] * parts.up
        )

    canvas.line(np.array([one.pivot_px, one.axis_px]), AXIS)
    canvas.cross(one.pivot_px, PIVOT)
    seen = on_picture(one.station, one.offset)
    factor = 0.0
    if edge is None:
        canvas.line(seen, EDGE)
    else:
        station = np.linspace(one.station[0], one.station[-1], 400)
        canvas.line(on_picture(station, edge(station)), EDGE)
        factor = _arrows(canvas, seen, on_picture(one.station, edge(one.station)))
    for mark in marks:
        here = float(np.interp(mark.station, one.station, one.offset))
        canvas.ring(on_picture(np.array([mark.station]), np.array([here]))[0], NICK, mark.text)
    return factor


def _arrows(canvas: "_Canvas", seen: Array, fitted: Array) -> float:
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


def _frame(
    photo: Photo, view: View, outline: Silhouette | None, measured: Sequence[BladeMeasurement]
) -> tuple[int, int, int, int]:
    height, width = photo.image.shape[:2]
    points = [one.edge.pixels for one in measured] + [one.pivot_px[None] for one in measured]
    if outline is not None:
        points += [view.to_pixels(border) for border in (outline.outer, *outline.others)]
    every = np.concatenate(points) if points else np.array([[0.0, 0.0], [width, height]])
    every = every[np.isfinite(every).all(axis=1)]
    low, high = every.min(axis=0), every.max(axis=0)
    room = _MARGIN * float((high - low).max())
    left, top = np.maximum(np.floor(low - room).astype(int), 0)
    right, bottom = np.minimum(np.ceil(high + room).astype(int), [width, height])
    return int(left), int(top), int(right), int(bottom)


class _Canvas:
    """A cropped and scaled copy of a photograph to draw on in the photograph's own pixels."""

    def __init__(self, photo: Photo, frame: tuple[int, int, int, int]) -> None:
        import cv2

        left, top, right, bottom = frame
        part: Any = photo.image[top:bottom, left:right]
        if part.ndim == 2:
            part = cv2.cvtColor(part, cv2.COLOR_GRAY2BGR)
        self.scale = min(LARGEST / max(part.shape[:2]), 4.0)
        method = cv2.INTER_AREA if self.scale < 1.0 else cv2.INTER_CUBIC
        size = (round(part.shape[1] * self.scale), round(part.shape[0] * self.scale))
        self.picture: Picture = np.asarray(
            cv2.resize(part, size, interpolation=method), dtype=np.uint8
        )
        self.origin = np.array([left, top], dtype=np.float64)

    def place(self, pixels: Array) -> NDArray[np.int32]:
        """Where pixels of the photograph lie on the canvas, in sixteenths."""
        there = (np.asarray(pixels) - self.origin + 0.5) * self.scale - 0.5
        sixteenths = np.rint(np.nan_to_num(there, nan=-1e4) * 2**_FINE)
        return np.asarray(sixteenths, dtype=np.int32)

    def line(self, pixels: Array, colour: tuple[int, int, int], *, closed: bool = False) -> None:
        import cv2

        cv2.polylines(
            self.picture, [self.place(pixels)], closed, colour, 1, cv2.LINE_AA, shift=_FINE
        )

    def cross(self, pixel: Array, colour: tuple[int, int, int]) -> None:
        arm = 12.0 / self.scale
        for step in (np.array([arm, 0.0]), np.array([0.0, arm])):
            self.line(np.array([pixel - step, pixel + step]), colour)

    def ring(self, pixel: Array, colour: tuple[int, int, int], text: str) -> None:
        import cv2

        x, y = self.place(pixel[None])[0]
        cv2.circle(
            self.picture, (int(x), int(y)), 14 * 2**_FINE, colour, 1, cv2.LINE_AA, shift=_FINE
        )
        self.words(text, (int(x) // 2**_FINE + 18, int(y) // 2**_FINE + 18), colour)

    def words(
        self,
        text: str,
        place: tuple[int, int] = (12, 26),
        colour: tuple[int, int, int] = (255, 255, 255),
    ) -> None:
        import cv2

        dark = (place[0] + 1, place[1] + 1)
        for shade, where in (((0, 0, 0), dark), (colour, place)):
            cv2.putText(
                self.picture, text, where, cv2.FONT_HERSHEY_SIMPLEX, 0.6, shade, 1, cv2.LINE_AA
            )
