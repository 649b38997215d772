"""The silhouette of a dark object on a bright sheet, and the parts of a single blade in it."""

from dataclasses import dataclass
from typing import Any, Literal

import cv2
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import zoom

from scissorcal.aliases import Array
from scissorcal.errors import InputError
from scissorcal.vision.blade.view import View
from scissorcal.vision.targets.boards import MAT_PIVOT_M

EdgeSide = Literal["down", "up"]

FIRST, LAST = 0.12, 0.97
"""Where along a blade its edge is measured, in shares of its length from the pivot."""

BACK_FIRST, BACK_LAST = 0.3, 0.8
"""Where the centreline halves the blade: between edge and back over these shares of its length."""

_SOLID, _UNEVEN = 0.82, 0.06
_HOLE_MM = (0.6, 8.0)


@dataclass(frozen=True)
class BladeParts:
    """A blade's rough geometry on the sheet, good to a flat pixel.

    ``pivot`` (2,) and ``axis`` (2,), a unit vector towards the tip; ``up`` is the unit vector from
    the edge to the back. ``edge`` and ``back`` (n, 2) are points along both in order of station,
    ``hole`` (k, 2) the pivot hole's outline, empty where the pivot was given or found otherwise.
    ``length`` is the tip's station, known to ``tip_sd``. ``pivot_sd`` is how well a pivot without a
    hole is known. ``end`` (m, 2) is the metal's border about the tip where it was followed. The
    centreline halves the blade between the shares ``halved`` of its length.
    """

    pivot: Array
    axis: Array
    up: Array
    edge: Array
    back: Array
    hole: Array
    length: float
    pivot_sd: float = 0.0
    tip_sd: float = 0.0
    end: Array | None = None
    halved: tuple[float, float] = (BACK_FIRST, BACK_LAST)

    def frame(self, points: Array) -> Array:
        """Stations and offsets (n, 2) of sheet points."""
        away = points - self.pivot
        return np.column_stack([away @ self.axis, away @ self.up])

    def points(self, station: Array, offset: Array) -> Array:
        """Sheet points (n, 2) of stations and offsets (n,)."""
        return np.asarray(self.pivot + station[:, None] * self.axis + offset[:, None] * self.up)


Light = NDArray[np.float32]
Mask = NDArray[np.uint8]

LONGEST = 1000
"""Pixels along the longer side of the flat picture: 0.2 mm each on the blade mat."""

_LEAST_CONTRAST = 0.15
_LEAST_SHARE = 0.002
_ROUNDS = 6
_LEVELS = (0.8, 0.65, 0.5, 0.35, 0.2)


@dataclass(frozen=True)
class Silhouette:
    """The outline of the object on the sheet, in sheet units; y points down.

    ``outer`` (n, 2) runs around it, ``holes`` are the openings in it. ``pixel`` is the size of the
    flat picture's pixels, whose ``mask`` and relative light ``relative`` (1 is bare sheet) are
    kept for pictures. ``others`` are further outlines of at least a fifth of its area; ``cut_off``
    are the places where it meets the border of what can be seen (n, 2).
    """

    outer: Array
    holes: tuple[Array, ...]
    others: tuple[Array, ...]
    cut_off: Array
    pixel: float
    origin: tuple[float, float]
    mask: Mask
    relative: Light

    def openings(self) -> list[Array]:
        """Outlines (n, 2) of bright patches within the outline, at several levels of light.

        The same patch may come more than once.
        """
        whole = np.zeros_like(self.mask)
        cv2.fillPoly(whole, [np.rint(self.grid(self.outer)).astype(np.int32)], 255)
        metal = float(np.median(self.relative[self.mask > 0]))
        inner = cv2.erode(whole, np.ones((3, 3), np.uint8))
        outlines = []
        for share in _LEVELS:
            level = metal + share * (1.0 - metal)
            bright = ((self.relative > level) & (inner > 0)).astype(np.uint8)
            contours, _ = cv2.findContours(bright, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
            for contour in contours:
                if cv2.contourArea(contour) > 12.0:
                    place = np.asarray(contour, dtype=np.float64).reshape(-1, 2)
                    outlines.append(place * self.pixel + np.asarray(self.origin))
        return outlines

    def grid(self, points: Array) -> Array:
        """Places (n, 2) of sheet points in the flat picture, in its pixels."""
        return np.asarray((points - self.origin) / self.pixel)


def silhouette(light: Light, view: View, source: str, *, longest: int = LONGEST) -> Silhouette:
    """Find the object on a bright, even sheet.

    The sheet's light is a smooth surface, fitted robustly without dark pixels; the object is what
    lies below a threshold between both, with its bright patches filled. Raises InputError where
    nothing is dark enough.
    """
    left, top, right, bottom = view.bounds
    pixel = max(right - left, bottom - top) / longest
    flat = _flat(light, view, pixel)
    relative = flat / _sheet_light(flat)
    mask = _dark(relative, source)
    return _outlined(mask, relative, pixel, (left, top), source)


def _flat(light: Light, view: View, pixel: float) -> Light:
    left, top, right, bottom = view.bounds
    columns, rows = int((right - left) / pixel), int((bottom - top) / pixel)
    # distortion varies slowly: every eighth pixel is projected, those between are interpolated
    coarse = (columns // 8 + 2, rows // 8 + 2)
    x, y = np.meshgrid(np.linspace(0, columns - 1, coarse[0]), np.linspace(0, rows - 1, coarse[1]))
    points = np.column_stack([x.ravel() * pixel + left, y.ravel() * pixel + top])
    there = view.to_pixels(points).reshape(coarse[1], coarse[0], 2)
    pixels = zoom(there, (rows / coarse[1], columns / coarse[0], 1.0), order=1)
    spacing = float(np.nanmedian(np.abs(np.diff(pixels[..., 0], axis=1)))) + float(
        np.nanmedian(np.abs(np.diff(pixels[..., 1], axis=1)))
    )
    if spacing > 1.5:
        light = np.asarray(cv2.GaussianBlur(light, (0, 0), 0.4 * spacing), dtype=np.float32)
    x, y = np.moveaxis(np.nan_to_num(pixels, nan=-1.0).astype(np.float32), -1, 0)
    return np.asarray(
        cv2.remap(light, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE),
        dtype=np.float32,
    )


def _sheet_light(flat: Light) -> Light:
    """The bare sheet's light: a bicubic surface through what is not darker than its surroundings.

    Its logarithm is a polynomial, fitted again and again without what lies well below.
    """
    rows, columns = flat.shape
    step = max(rows, columns) // 120 + 1
    y, x = np.mgrid[0:rows:step, 0:columns:step]
    log = np.log(np.maximum(flat[::step, ::step], 1e-3)).ravel().astype(np.float64)
    u, v = 2.0 * x.ravel() / columns - 1.0, 2.0 * y.ravel() / rows - 1.0
    terms = [(i, j) for i in range(4) for j in range(4 - i)]
    design = np.stack([u**i * v**j for i, j in terms], axis=1)
    kept = log >= np.quantile(log, 0.3)
    weights = np.zeros(len(terms))
    for _ in range(_ROUNDS):
        weights = np.linalg.lstsq(design[kept], log[kept], rcond=None)[0]
        off = log - design @ weights
        spread = 1.4826 * float(np.median(np.abs(off[kept] - np.median(off[kept])))) + 1e-3
        kept = (off > -3.0 * spread) & (off < 4.0 * spread + 0.05)
        if kept.sum() < 4 * len(terms):
            break
    fine_u = 2.0 * np.arange(columns) / columns - 1.0
    fine_v = 2.0 * np.arange(rows) / rows - 1.0
    surface = np.zeros((rows, columns))
    for weight, (i, j) in zip(weights, terms, strict=True):
        surface += weight * np.outer(fine_v**j, fine_u**i)
    return np.asarray(np.exp(surface), dtype=np.float32)


def _dark(relative: Light, source: str) -> Mask:
    smooth = np.asarray(cv2.GaussianBlur(relative, (0, 0), 1.0))
    level = np.clip(smooth * 170.0, 0, 255).astype(np.uint8)
    threshold, _ = cv2.threshold(level, 0, 255, cv2.THRESH_BINARY + cv2.THRESH_OTSU)
    if threshold / 170.0 > 1.0 - 0.5 * _LEAST_CONTRAST:
        threshold = 170.0 * (1.0 - 0.5 * _LEAST_CONTRAST)
    mask = np.asarray((level < threshold) * 255, dtype=np.uint8)
    dark = smooth[mask > 0]
    if dark.size < _LEAST_SHARE * mask.size or float(np.median(dark)) > 1.0 - _LEAST_CONTRAST:
        raise InputError(
            f"{source}: nothing dark enough is on the sheet: lay the blade flat on it, in even "
            "light without glare."
        )
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (3, 3))
    return np.asarray(cv2.morphologyEx(mask, cv2.MORPH_OPEN, kernel), dtype=np.uint8)


def _outlined(
    mask: Mask, relative: Light, pixel: float, origin: tuple[float, float], source: str
) -> Silhouette:
    contours, tree = cv2.findContours(mask, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    if not contours:
        raise InputError(f"{source}: nothing is on the sheet.")
    areas = [cv2.contourArea(c) if tree[0][i][3] < 0 else 0.0 for i, c in enumerate(contours)]
    order = np.argsort(areas)[::-1]
    main = int(order[0])
    if areas[main] < _LEAST_SHARE * mask.size:
        raise InputError(f"{source}: nothing of a blade's size is on the sheet.")

    def place(contour: NDArray[Any]) -> Array:
        return np.asarray(contour.reshape(-1, 2) * pixel + np.asarray(origin), dtype=np.float64)

    holes = [
        place(c)
        for i, c in enumerate(contours)
        if tree[0][i][3] == main and cv2.contourArea(c) > 20.0
    ]
    others = [place(np.asarray(contours[i])) for i in order[1:] if areas[i] > 0.2 * areas[main]]
    filled = np.zeros_like(mask)
    cv2.drawContours(filled, contours, main, 255, cv2.FILLED)
    edge = contours[main].reshape(-1, 2)
    rows, columns = mask.shape
    out = (edge[:, 0] <= 1) | (edge[:, 1] <= 1) | (edge[:, 0] >= columns - 2)
    out |= edge[:, 1] >= rows - 2
    return Silhouette(
        place(np.asarray(contours[main])),
        tuple(holes),
        tuple(others),
        place(edge[out]),
        pixel,
        origin,
        np.asarray(filled & mask, dtype=np.uint8),
        relative,
    )


def lone_blade(
    shape: Silhouette,
    source: str,
    edge_side: EdgeSide = "down",
    pivot: Array | None = None,
    pivot_sd: float = 0.0,
) -> BladeParts:
    """Find the parts of a silhouette that should be one blade.

    The pivot is the round hole (of several, the one nearest to the mat's pivot mark) unless it is
    given, and the tip the end farther from it. An outline does not show which side is the edge:
    it is the side that faces the mat's lower rim (``edge_side`` "down") or the upper one.
    """
    _refuse_others(shape, source)
    hole = np.empty((0, 2))
    if pivot is None:
        hole = _pivot_hole(shape, source)
        pivot = hole.mean(axis=0)
        pivot_sd = 0.0
    middle = shape.outer.mean(axis=0)
    axis = np.linalg.svd(shape.outer - middle, full_matrices=False)[2][0]
    ends = (shape.outer - pivot) @ axis
    if -ends.min() > ends.max():
        axis, ends = -axis, -ends
    for _ in range(3):
        up = np.array([axis[1], -axis[0]])
        facing = up[1] if abs(up[1]) > 0.05 else up[0]
        if (facing > 0) != (edge_side == "up"):
            up = -up
        parts = BladeParts(
            pivot, axis, up, *_sides(shape.outer, pivot, axis, up, source), hole, 0.0
        )
        length = float(((shape.outer - pivot) @ axis).max())
        axis = _halving(parts, length)
    up = up - (up @ axis) * axis
    up = up / np.linalg.norm(up)
    _refuse_cut_off(shape, pivot, axis, source)
    edge, back = _sides(shape.outer, pivot, axis, up, source)
    return BladeParts(pivot, axis, up, edge, back, hole, length, pivot_sd)


def _halving(parts: BladeParts, length: float) -> Array:
    """The axis turned so that it halves the width between edge and back."""
    along = np.linspace(BACK_FIRST, BACK_LAST, 101) * length
    lower, upper = (_by_station(parts.frame(side), along) for side in (parts.edge, parts.back))
    turn = float(np.sum(0.5 * (lower + upper) * along) / np.sum(along**2))
    axis = parts.axis + turn * parts.up
    return np.asarray(axis / np.linalg.norm(axis))


def _by_station(side: Array, along: Array) -> Array:
    order = np.argsort(side[:, 0])
    return np.asarray(np.interp(along, side[order, 0], side[order, 1]))


def _sides(outer: Array, pivot: Array, axis: Array, up: Array, source: str) -> tuple[Array, Array]:
    """The outline's lower and upper side between pivot and tip, in order of station."""
    s, e = (outer - pivot) @ axis, (outer - pivot) @ up
    length = float(s.max())
    ahead = s > 0.02 * length
    width = np.histogram(s[ahead], bins=120)[1]
    index = np.clip(np.digitize(s, width) - 1, 0, 119)
    lower, upper = [], []
    for cell in range(120):
        here = np.flatnonzero(ahead & (index == cell))
        if len(here) < 2:
            continue
        lower.append(here[e[here] <= e[here].min() + 0.25 * np.ptp(e[here])])
        upper.append(here[e[here] >= e[here].max() - 0.25 * np.ptp(e[here])])
    if len(lower) < 60:
        raise InputError(f"{source}: the outline is too fragmented to be a blade.")
    below, above = np.concatenate(lower), np.concatenate(upper)
    return outer[below[np.argsort(s[below])]], outer[above[np.argsort(s[above])]]


def _pivot_hole(shape: Silhouette, source: str) -> Array:
    """The round opening nearest to the mat's pivot mark.

    In a shadow or beside glare no single threshold separates an opening from metal, so several
    between metal and sheet are tried.
    """
    unit = 1e-3
    best: list[tuple[float, Array]] = []
    for hole in shape.openings():
        middle = hole.mean(axis=0)
        radii = np.linalg.norm(hole - middle, axis=1)
        radius = float(radii.mean())
        if not _HOLE_MM[0] * unit <= radius <= _HOLE_MM[1] * unit:
            continue
        uneven = float(radii.std()) / radius
        if uneven < _UNEVEN + 0.3 * shape.pixel / radius:
            away = float(np.hypot(*(middle - MAT_PIVOT_M)))
            best.append((away + 0.05 * uneven, hole))
    if not best:
        raise InputError(
            f"{source}: no round pivot hole of {_HOLE_MM[0]:g} to {_HOLE_MM[1]:g} mm radius is "
            "visible in the blade. Let the sheet show through it, or give the pivot's place with "
            "--pivot."
        )
    return min(best, key=lambda pair: pair[0])[1]


def _refuse_others(shape: Silhouette, source: str) -> None:
    if shape.others:
        raise InputError(
            f"{source}: {1 + len(shape.others)} objects of a blade's size are on the mat; one "
            "blade is expected. Leave one blade, or photograph open scissors with --both."
        )
    outline = shape.outer.astype(np.float32)[:, None, :]
    hull = float(cv2.contourArea(cv2.convexHull(outline)))
    solid = float(cv2.contourArea(outline)) / max(hull, 1e-30)
    if solid < _SOLID:
        raise InputError(
            f"{source}: the outline fills {100 * solid:.0f} % of its convex hull; a single blade "
            f"fills at least {100 * _SOLID:.0f} %. Leave one blade, or give --both for open "
            "scissors."
        )


def _refuse_cut_off(shape: Silhouette, pivot: Array, axis: Array, source: str) -> None:
    """Refuse a blade that is cut off ahead of the pivot; behind it nothing is measured."""
    if len(shape.cut_off) and np.any((shape.cut_off - pivot) @ axis > 0.0):
        raise InputError(
            f"{source}: the blade extends beyond the mat's field or the picture: place it inside "
            "the markers from pivot to tip."
        )
