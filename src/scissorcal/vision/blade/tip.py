"""The end of a blade's metal, told from the end of its shadow."""

from dataclasses import dataclass

import numpy as np

from scissorcal.aliases import Array
from scissorcal.vision.blade.parts import BladeParts
from scissorcal.vision.blade.profile import (
    ASIDE,
    COARSE,
    DARKEST,
    ENOUGH,
    LOSS,
    Light,
    best_path,
)
from scissorcal.vision.blade.view import View

BEFORE_TIP = 0.85
"""Share of the outline's length up to which edge and back are metal's, whatever casts a shadow."""

_CENTRE = 0.8
_WIDEST, _TURNS = np.radians(115.0), 1601
_REACH = 0.27
_BEYOND_PX = 3.0
_SD_PX = 0.5


@dataclass(frozen=True)
class Tip:
    """Where the metal ends: ``station`` on the blade's axis with its ``sd``, in sheet units.

    ``border`` (n, 2) is the end's border on the sheet, for pictures.
    """

    station: float
    sd: float
    border: Array


def metal_end(
    light: Light, view: View, parts: BladeParts, edge: Array, back: Array, soft: float
) -> Tip:
    """Find the tip of a blade of which edge and back (n, 2), on the sheet, are known before it.

    From a place within the metal short of the tip, the outermost sharp border is followed around
    the end (by the best path over directions). A cast shadow ends beyond the metal with a soft
    border and is passed over. ``soft`` is the blur of a border in focus, in pixels. The outline in
    ``parts`` may include the shadow: it bounds the search.
    """
    outline = parts.frame(np.concatenate([parts.edge, parts.back]))
    stop = parts.length
    at = _CENTRE * stop
    middle = np.mean([_offset_at(parts.frame(side), at) for side in (edge, back)])
    turn = np.linspace(-_WIDEST, _WIDEST, _TURNS)
    pixel = 1.0 / _pixels_per_unit(view, parts, at)
    reach = _REACH * stop / pixel
    r = np.arange(2.0, reach, 1.0)
    station = at + np.outer(np.cos(turn), r * pixel)
    offset = middle + np.outer(np.sin(turn), r * pixel)
    places = parts.points(station.ravel(), offset.ravel())
    sharp = _sampled_sharpness(light, view.to_pixels(places), soft).reshape(station.shape)
    low, high = (float(bound) for bound in np.quantile(outline[:, 1], [0.0, 1.0]))
    room = _BEYOND_PX * pixel
    beyond = (station > stop + room) | (offset < low - room) | (offset > high + room)
    sharp[beyond] = 0.0
    top = max(float(np.quantile(sharp.max(axis=1), 0.75)), 1e-6)
    gain = np.clip(sharp / (ENOUGH * top), 0.0, 1.0) + ASIDE * r / reach
    gain[beyond] = -1.0
    path = best_path(gain)
    rows = np.arange(len(turn))
    border = parts.points(station[rows, path], offset[rows, path])
    ahead = station[rows, path]
    return Tip(float(ahead.max()), float(np.hypot(_SD_PX, soft)) * pixel, border)


def _offset_at(side: Array, station: float) -> float:
    """Offset of a side of the blade at a station, from the line through its points near there."""
    near = np.argsort(np.abs(side[:, 0] - station))[:40]
    if np.ptp(side[near, 0]) == 0.0:
        return float(np.median(side[near, 1]))
    return float(np.polyval(np.polyfit(side[near, 0] - station, side[near, 1], 1), 0.0))


def _pixels_per_unit(view: View, parts: BladeParts, station: float) -> float:
    there = parts.points(np.array([station, 1.01 * station]), np.zeros(2))
    return float(np.linalg.norm(np.diff(view.to_pixels(there), axis=0)) / (0.01 * station))


def _sampled_sharpness(light: Light, pixels: Array, soft: float) -> Array:
    """Sharpness of the picture at pixels (n, 2): as `outermost_sharp` has it, in two directions."""
    import cv2

    low = np.floor(pixels.min(axis=0)).astype(int) - 12
    high = np.ceil(pixels.max(axis=0)).astype(int) + 13
    rows, columns = light.shape
    left, top = max(low[0], 0), max(low[1], 0)
    part = np.log(
        np.maximum(light[top : min(high[1], rows), left : min(high[0], columns)], DARKEST)
    )
    if not part.size:
        return np.zeros(len(pixels))
    slopes = []
    for s in (soft, COARSE * soft):
        smooth = cv2.GaussianBlur(part, (0, 0), s)
        slopes.append([cv2.Sobel(smooth, cv2.CV_32F, i, j) / 8.0 for i, j in ((1, 0), (0, 1))])
    (fx, fy), (cx, cy) = slopes
    fine = np.hypot(fx, fy)
    along = np.abs(fx * cx + fy * cy) / np.maximum(fine, 1e-9)
    sharp = np.maximum(fine - LOSS * along, 0.0).astype(np.float32)
    # remap takes fewer than 32768 rows or columns
    x, y = (np.array_split((pixels[:, k] - (left, top)[k]).astype(np.float32), 64) for k in (0, 1))
    taken = [
        cv2.remap(sharp, a[:, None], b[:, None], cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT)
        for a, b in zip(x, y, strict=True)
    ]
    return np.concatenate(taken).ravel().astype(np.float64)
