"""The borders of a blade in the picture: its edge, its back, the pivot's hole."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter1d, median_filter
from scipy.optimize import least_squares

from scissorcal.aliases import Array
from scissorcal.errors import InputError
from scissorcal.vision.blade.profile import (
    Crossings,
    Light,
    crossings,
    outermost_sharp,
    steepest,
)
from scissorcal.vision.blade.silhouette import BACK_FIRST, FIRST, BladeParts
from scissorcal.vision.blade.view import View

_MOST_POINTS = 3000
_SHADOW_SEARCH = 0.05
_LEAST_MERIT, _INNER_MERIT = 0.35, 0.6
"""Merit below which a back is taken as followed; merit of the inner of two lines, over that of the
outer one, from which it is the metal's: under a small lamp a shadow's border is sharp too."""

_SHARP_SHARE = 1.0 / 300.0
"""Blur of a border in focus as a share of the blade's length; a pixel where that is less."""
_LEAST_GOOD = {"edge": 0.75, "back": 0.3}
_LEAST_IN_SHADOW = {"edge": 0.4, "back": 0.2}
_MOST_BLUR_PX, _MOST_BLUR_SHARE = 8.0, 0.15


Side = Literal["edge", "back"]


@dataclass(frozen=True)
class PicturedBlade:
    """A blade in a photograph of linear ``light``, seen by ``view``, whose parts are roughly known.

    ``source`` names the photograph in refusals.
    """

    light: Light
    view: View
    parts: BladeParts
    source: str


@dataclass(frozen=True)
class BorderPoints:
    """Border points of one part in the picture: ``pixels`` (n, 2), unit ``normals`` (n, 2) outward.

    ``sd_px`` (n,) is how well each is known along its normal.
    """

    pixels: Array
    normals: Array
    sd_px: Array
    softness: Array
    blur_px: float
    good_share: float


def find_border(blade: PicturedBlade, side: Side, last: float, search: float) -> BorderPoints:
    """Cross one side of a blade in the picture, about once every pixel.

    Of its rough points those before the share ``last`` of the blade's length count; ``search`` is
    how far from them the border may lie, in blade lengths. Raises InputError where the picture is
    too blurred, or too little of the side has a clear border.
    """
    light, view, parts, source = blade.light, blade.view, blade.parts, blade.source
    first = FIRST if side == "edge" else BACK_FIRST
    frame = parts.frame(parts.edge if side == "edge" else parts.back)
    there = (frame[:, 0] > first * parts.length) & (frame[:, 0] < last * parts.length)
    if there.sum() < 20:
        raise InputError(f"{source}: too little of the blade's {side} is visible.")
    s, e = _thinned(frame[there])
    rough = view.to_pixels(parts.points(s, e))
    count = int(np.clip(np.sum(np.linalg.norm(np.diff(rough, axis=0), axis=1)), 60, _MOST_POINTS))
    stations = np.linspace(s[0], s[-1], count)
    per_unit = count / max(s[-1] - s[0], 1e-12)
    offsets = np.interp(stations, s, e)
    shadowed = search > _SHADOW_SEARCH
    rough_side = _Rough(blade, stations, offsets, float(np.sign(np.median(e))), per_unit)
    if shadowed:
        lines = [
            rough_side.followed(search, "innermost"),
            rough_side.followed(search, "outermost sharp"),
        ]
        inner, outer = (_crossed(light, *line) for line in lines)
        best = inner if _merit(inner) > _INNER_MERIT * _merit(outer) else outer
        if side == "back" and _merit(best) < _LEAST_MERIT:
            return _as_followed(lines[-1], _in_focus(parts, per_unit))
        points, normals, crossed, blur = best
    else:
        points, normals, crossed, blur = _crossed(light, *rough_side.followed(search, "steepest"))
    good = crossed.good & _alike(crossed)
    share = float(good.mean())
    _refuse_blur(blur, per_unit, parts, source)
    if share < (_LEAST_IN_SHADOW if shadowed else _LEAST_GOOD)[side]:
        raise InputError(
            f"{source}: only {100 * share:.0f} % of the blade's {side} shows a clear border: a "
            "mirror's glare, a shadow or dirt hides the rest. Turn the blade or the lamp so that "
            "the metal looks darker than the sheet."
        )
    places = points + normals * crossed.place[:, None]
    return BorderPoints(
        places[good], normals[good], crossed.sd[good], crossed.blur[good] / blur, blur, share
    )


@dataclass(frozen=True)
class _Rough:
    """A side of the blade, roughly: stations and offsets of points about a pixel apart."""

    blade: PicturedBlade
    stations: Array
    offsets: Array
    outward: float
    per_unit: float

    def followed(
        self, search: float, kind: Literal["steepest", "innermost", "outermost sharp"]
    ) -> tuple[Array, Array]:
        """Points (n, 2) on a border near this side and normals there, both in the picture."""
        light, offsets = self.blade.light, self.offsets
        length = self.blade.parts.length
        sharp = _in_focus(self.blade.parts, self.per_unit)
        for first, far in ((True, search), (False, 0.012)):
            points, normals = _with_normals(self.blade, self.stations, offsets, self.outward)
            reach = float(np.clip(far * length * self.per_unit, 6.0, 80.0))
            if kind == "outermost sharp":
                shift = outermost_sharp(light, points, normals, reach, sharp)
            else:
                inner = kind == "innermost" and first
                soft = 1.5 if not first else 1.2 if inner else 2.0
                shift = steepest(light, points, normals, reach, soft, innermost=inner)
            offsets = offsets + self.outward * shift / self.per_unit
        return _with_normals(self.blade, self.stations, offsets, self.outward)


def _crossed(light: Light, points: Array, normals: Array) -> tuple[Array, Array, Crossings, float]:
    """A line of points and normals with its crossings, wide enough for their blur, and that."""
    crossed = crossings(light, points, normals, 6.0)
    blur = float(np.median(crossed.blur[crossed.good])) if crossed.good.any() else np.inf
    if blur > 1.6:
        crossed = crossings(light, points, normals, float(np.clip(4.0 * blur, 6.0, 30.0)))
        blur = float(np.median(crossed.blur[crossed.good])) if crossed.good.any() else np.inf
    return points, normals, crossed, blur


def _merit(line: tuple[Array, Array, Crossings, float]) -> float:
    """How much of a line is one clear border, divided by its blur: a shadow's is soft."""
    _, _, crossed, blur = line
    return float(np.mean(crossed.good & _alike(crossed))) / max(blur, 1.0)


def _as_followed(line: tuple[Array, Array], soft: float) -> BorderPoints:
    """A line as it was followed, where metal, shadow and sheet make no single step to be fitted.

    It is good to about the blur ``soft`` of a border in focus.
    """
    points, normals = line
    ones = np.ones(len(points))
    return BorderPoints(points, normals, soft * ones, ones, soft, 1.0)


def _in_focus(parts: BladeParts, per_unit: float) -> float:
    """Blur in pixels of a border in focus, of a blade that has ``per_unit`` pixels a unit."""
    return max(_SHARP_SHARE * parts.length * per_unit, 1.0)


def _refuse_blur(blur: float, per_unit: float, parts: BladeParts, source: str) -> None:
    width = float(np.median(np.abs(parts.frame(parts.edge)[:, 1]))) * per_unit
    if not blur < max(_MOST_BLUR_PX, _MOST_BLUR_SHARE * width):
        raise InputError(
            f"{source} is too blurred: borders are {blur:.1f} pixels soft. Hold the camera still, "
            "focus on the blade, and try again."
        )


def _alike(crossed: Crossings) -> NDArray[np.bool_]:
    """Crossings whose blur and contrast are like those of most."""
    contrast = crossed.outer - crossed.inner
    usual = np.median(contrast[crossed.good]) if crossed.good.any() else 0.0
    blur = np.median(crossed.blur[crossed.good]) if crossed.good.any() else 1.0
    return np.asarray(
        (contrast * np.sign(usual) > 0.25 * abs(usual))
        & (crossed.blur < 1.8 * blur + 0.2)
        & (crossed.blur > 0.4 * blur - 0.3)
    )


def find_hole(blade: PicturedBlade) -> BorderPoints | None:
    """Cross the pivot hole's border all around; None where there is no hole, or no clear one."""
    light, view, parts = blade.light, blade.view, blade.parts
    if not len(parts.hole):
        return None
    middle = parts.hole.mean(axis=0)
    radius = float(np.linalg.norm(parts.hole - middle, axis=1).mean())
    turn = np.linspace(0.0, 2.0 * np.pi, 181)[:-1]
    ring = np.column_stack([np.cos(turn), np.sin(turn)])
    for _ in range(2):
        points = view.to_pixels(middle + radius * ring)
        inward = view.to_pixels(middle + 0.98 * radius * ring) - points
        size = float(np.median(np.linalg.norm(points - points.mean(axis=0), axis=1)))
        normals = inward / np.linalg.norm(inward, axis=1, keepdims=True)
        crossed = crossings(light, points, normals, float(np.clip(0.6 * size, 3.0, 12.0)))
        if crossed.good.sum() < 60:
            return None
        places = points + normals * crossed.place[:, None]
        middle, radius = fit_circle(view.to_sheet(places[crossed.good]))
        off = np.abs(np.linalg.norm(view.to_sheet(places) - middle, axis=1) - radius)
        sure = crossed.good & (off < 4.0 * 1.4826 * np.median(off[crossed.good]) + 1e-12)
        middle, radius = fit_circle(view.to_sheet(places[sure]))
    return BorderPoints(
        places[sure],
        normals[sure],
        crossed.sd[sure],
        np.ones(int(sure.sum())),
        float(np.median(crossed.blur[sure])),
        1.0,
    )


def fit_circle(points: Array) -> tuple[Array, float]:
    """Centre (2,) and radius of the circle with the least squared distances from points (n, 2)."""
    middle = points.mean(axis=0)
    away = points - middle
    size = float(np.sqrt(np.mean(np.sum(away**2, axis=1))))

    def distances(circle: Array) -> Array:
        return np.asarray(np.linalg.norm(away / size - circle[:2], axis=1) - circle[2])

    x, y, radius = least_squares(distances, [0.0, 0.0, 1.0], method="lm").x
    return middle + size * np.array([x, y]), size * float(radius)


def _thinned(frame: Array) -> tuple[Array, Array]:
    """One offset per station, smoothed over a few flat pixels."""
    order = np.argsort(frame[:, 0])
    s, e = frame[order, 0], frame[order, 1]
    cells = np.linspace(s[0], s[-1], max(len(s) // 4, 10))
    index = np.digitize(s, cells)
    kept = [(s[index == k].mean(), np.median(e[index == k])) for k in np.unique(index)]
    thin = np.array(kept)
    return thin[:, 0], np.asarray(median_filter(thin[:, 1], size=5, mode="nearest"))


def _with_normals(blade: PicturedBlade, s: Array, e: Array, outward: float) -> tuple[Array, Array]:
    """Points in the picture and unit normals there that lead out of the blade."""
    view, parts = blade.view, blade.parts
    smooth = gaussian_filter1d(e, 8.0, mode="nearest")
    points = view.to_pixels(parts.points(s, e))
    line = view.to_pixels(parts.points(s, smooth))
    along = np.gradient(line, axis=0)
    normals = np.column_stack([along[:, 1], -along[:, 0]])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    step = outward * 0.01 * parts.length
    leads = view.to_pixels(parts.points(s, smooth + step)) - line
    return points, normals * np.sign(np.sum(leads * normals, axis=1))[:, None]
