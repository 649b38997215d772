"""Both blades of open scissors: measured in one plane, with the lengths against each other.

The end of each blade's metal is told from the end of its shadow.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import hypot
from typing import NamedTuple, get_args

import cv2
import numpy as np

from scissorcal.aliases import Array
from scissorcal.recipe.priors import BladePriors
from scissorcal.vision.blade.borders import PicturedBlade, Side, find_border
from scissorcal.vision.blade.measure import BladeMeasurement, measure_blade
from scissorcal.vision.blade.profile import (
    ASIDE,
    COARSE,
    DARKEST,
    ENOUGH,
    LOSS,
    Light,
    best_path,
)
from scissorcal.vision.blade.silhouette import BladeParts
from scissorcal.vision.blade.view import PlainView, View

BEFORE_TIP = 0.85
"""Share of the outline's length up to which edge and back are metal's, whatever casts a shadow."""

_CENTRE = 0.8
_WIDEST, _TURNS = np.radians(115.0), 1601
_REACH = 0.27
_BEYOND_PX = 3.0
_SD_PX = 0.5


SEARCH = 0.1
"""Largest distance, in blade lengths, of the outline of scissors from the metal, by shadows."""

_STEP = 1e-4


class PairLengths(NamedTuple):
    """The lengths of a pair's blades, in the order of its measurements, and how unlike they are.

    ``seen`` are lengths in the picture (pixels of the sheet without tilt), or on the mat.
    ``log_ratio`` is the logarithm of their ratio, ``sd`` what a pair of one length shows by its
    tips, by the real difference of a pair, and by the camera's tilt where no mat shows it.
    ``tilt_deg`` is the least tilt that would make them equal, 0 on the mat.
    """

    seen: tuple[float, float]
    log_ratio: float
    sd: float
    tilt_deg: float


def measure_pair(
    light: Light,
    view: View,
    blades: Sequence[BladeParts],
    source: str,
    priors: BladePriors,
) -> tuple[View, tuple[BladeMeasurement, ...], PairLengths]:
    """Measure both blades in one plane of one scale.

    Tips are those of the metal. Without a mat the ratio of the blades' lengths tells part of the
    camera's tilt, which has a prior: its estimate becomes the view's, its remaining covariance
    moves both edges. The length of the pair, the mean of both, is one for both blades, with the
    error of tips and pivot; a stated length is that one. Raises InputError as `measure_blade` does.
    """
    tips = [_of_metal(PicturedBlade(light, view, parts, source)) for parts in blades]
    ends = [parts.points(np.array([parts.length]), np.zeros(1))[0] for parts in tips]
    pixels = view.to_pixels(np.array([tips[0].pivot, *ends]))
    sds = [parts.tip_sd / parts.length for parts in tips]
    real = 0.01 * priors.pair_length_sd_percent
    sd_of_pair = hypot(*sds, real)
    ratio = _log_ratio(view, pixels, view.values)
    sd, tilt = sd_of_pair, 0.0
    leant = view
    if isinstance(view, PlainView):
        lean_covariance = view.covariance[:4, :4]
        slope = _slope(view, pixels)
        carried = lean_covariance @ slope
        sd = float(np.sqrt(sd_of_pair**2 + slope @ carried))
        tilt = float(np.degrees(abs(ratio) / max(float(np.linalg.norm(slope[:2])), 1e-12)))
        gain = carried / sd**2
        leant = view.leaning(-gain * ratio, lean_covariance - np.outer(gain, carried))
        tips = [_in_view(parts, view, leant) for parts in tips]
    measured = [
        measure_blade(PicturedBlade(light, leant, parts, source), priors, search=SEARCH)
        for parts in tips
    ]
    lengths = [measurement.length for measurement in measured]
    pair = float(np.exp(np.mean(np.log(lengths))))
    middle = float(np.linalg.norm(measured[0].parts.axis + measured[1].parts.axis)) / 2.0
    share = hypot(0.5 * hypot(*sds), 0.5 * real, tips[0].pivot_sd * middle / pair)
    sized = tuple(
        replace(measurement, unit_length=pair, unit_length_sd=share) for measurement in measured
    )
    seen_lengths = (
        (float(tips[0].length), float(tips[1].length)) if leant is view else _lengths(view, pixels)
    )
    return leant, sized, PairLengths(seen_lengths, ratio, sd, tilt)


def _of_metal(blade: PicturedBlade) -> BladeParts:
    """The parts with the tip of the metal in place of the outline's, which may be a shadow's."""
    edge, back = (find_border(blade, side, BEFORE_TIP, SEARCH) for side in get_args(Side))
    sides = [blade.view.to_sheet(border.pixels) for border in (edge, back)]
    return _with_metal_end(blade, sides, max(edge.blur_px, back.blur_px))


def _lengths(view: View, pixels: Array, values: Array | None = None) -> tuple[float, float]:
    """Distances of both tips from the pivot; ``pixels`` (3, 2) are pivot and tips."""
    pivot, *tips = view.to_sheet(pixels, values)
    first, second = (float(np.linalg.norm(tip - pivot)) for tip in tips)
    return first, second


def _log_ratio(view: View, pixels: Array, values: Array) -> float:
    first, second = _lengths(view, pixels, values)
    return float(np.log(first / second))


def _slope(view: PlainView, pixels: Array) -> Array:
    """Derivatives (4,) of the lengths' log ratio by the tilt's components."""
    moved = view.values + _STEP * np.eye(5)[:4]
    here = _log_ratio(view, pixels, view.values)
    return np.array([_log_ratio(view, pixels, values) - here for values in moved]) / _STEP


def _in_view(parts: BladeParts, old: View, new: View) -> BladeParts:
    """The same parts in another view of the same picture."""

    def over(points: Array) -> Array:
        return new.to_sheet(old.to_pixels(points)) if len(points) else points

    ends = parts.points(np.array([0.0, parts.length, 0.0]), np.array([0.0, 0.0, parts.length]))
    pivot, tip, aside = over(ends)
    axis = (tip - pivot) / np.linalg.norm(tip - pivot)
    up = np.array([-axis[1], axis[0]])
    up *= np.sign(up @ (aside - pivot))
    size = float(np.linalg.norm(tip - pivot)) / parts.length
    return replace(
        parts,
        pivot=pivot,
        axis=axis,
        up=up,
        edge=over(parts.edge),
        back=over(parts.back),
        length=parts.length * size,
        pivot_sd=parts.pivot_sd * size,
        tip_sd=parts.tip_sd * size,
        end=None if parts.end is None else over(parts.end),
    )


def _with_metal_end(blade: PicturedBlade, sides: Sequence[Array], soft: float) -> BladeParts:
    """The parts of a blade with the tip of its metal; its edge and back (n, 2) are known before.

    From a place within the metal short of the tip, the outermost sharp border is followed around
    the end (by the best path over directions). A cast shadow ends beyond the metal with a soft
    border and is passed over. ``soft`` is the blur of a border in focus, in pixels. The outline in
    ``parts`` may include the shadow: it bounds the search.
    """
    view, parts = blade.view, blade.parts
    outline = parts.frame(np.concatenate([parts.edge, parts.back]))
    stop = parts.length
    at = _CENTRE * stop
    middle = np.mean([_offset_at(parts.frame(side), at) for side in sides])
    turn = np.linspace(-_WIDEST, _WIDEST, _TURNS)
    pixel = 1.0 / _pixels_per_unit(view, parts, at)
    reach = _REACH * stop / pixel
    r = np.arange(2.0, reach, 1.0)
    station = at + np.outer(np.cos(turn), r * pixel)
    offset = middle + np.outer(np.sin(turn), r * pixel)
    places = parts.points(station.ravel(), offset.ravel())
    sharp = _sampled_sharpness(blade.light, view.to_pixels(places), soft).reshape(station.shape)
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
    sd = float(np.hypot(_SD_PX, soft)) * pixel
    return replace(parts, length=float(ahead.max()), tip_sd=sd, end=border)


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
