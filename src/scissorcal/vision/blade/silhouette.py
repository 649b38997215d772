"""The silhouette of a dark object on a bright sheet."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.errors import InputError
from scissorcal.vision.blade.view import View

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
        import cv2

        whole = np.zeros_like(self.mask)
        cv2.fillPoly(whole, [np.rint(self.grid(self.outer)).astype(np.int32)], 255)
        metal = float(np.median(self.relative[self.mask > 0]))
        inner = cv2.erode(whole, np.ones((3, 3), np.uint8))
        found = []
        for share in _LEVELS:
            level = metal + share * (1.0 - metal)
            bright = ((self.relative > level) & (inner > 0)).astype(np.uint8)
            contours, _ = cv2.findContours(bright, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
            for contour in contours:
                if cv2.contourArea(contour) > 12.0:
                    place = np.asarray(contour, dtype=np.float64).reshape(-1, 2)
                    found.append(place * self.pixel + np.asarray(self.origin))
        return found

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
    import cv2
    from scipy.ndimage import zoom

    left, top, right, bottom = view.bounds
    columns, rows = int((right - left) / pixel), int((bottom - top) / pixel)
    # distortion varies slowly: every eighth pixel is projected, those between are interpolated
    coarse = (columns // 8 + 2, rows // 8 + 2)
    x, y = np.meshgrid(np.linspace(0, columns - 1, coarse[0]), np.linspace(0, rows - 1, coarse[1]))
    points = np.column_stack([x.ravel() * pixel + left, y.ravel() * pixel + top])
    there = view.to_pixels(points).reshape(coarse[1], coarse[0], 2)
    seen = zoom(there, (rows / coarse[1], columns / coarse[0], 1.0), order=1)
    spacing = float(np.nanmedian(np.abs(np.diff(seen[..., 0], axis=1)))) + float(
        np.nanmedian(np.abs(np.diff(seen[..., 1], axis=1)))
    )
    if spacing > 1.5:
        light = np.asarray(cv2.GaussianBlur(light, (0, 0), 0.4 * spacing), dtype=np.float32)
    x, y = np.moveaxis(np.nan_to_num(seen, nan=-1.0).astype(np.float32), -1, 0)
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
    import cv2

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
    import cv2

    found, tree = cv2.findContours(mask, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_NONE)
    if not found:
        raise InputError(f"{source}: nothing is on the sheet.")
    areas = [cv2.contourArea(c) if tree[0][i][3] < 0 else 0.0 for i, c in enumerate(found)]
    order = np.argsort(areas)[::-1]
    main = int(order[0])
    if areas[main] < _LEAST_SHARE * mask.size:
        raise InputError(f"{source}: nothing of a blade's size is on the sheet.")

    def place(contour: NDArray[Any]) -> Array:
        return np.asarray(contour.reshape(-1, 2) * pixel + np.asarray(origin), dtype=np.float64)

    holes = [
        place(c) for i, c in enumerate(found) if tree[0][i][3] == main and cv2.contourArea(c) > 20.0
    ]
    others = [place(np.asarray(found[i])) for i in order[1:] if areas[i] > 0.2 * areas[main]]
    own = np.zeros_like(mask)
    cv2.drawContours(own, found, main, 255, cv2.FILLED)
    edge = found[main].reshape(-1, 2)
    rows, columns = mask.shape
    out = (edge[:, 0] <= 1) | (edge[:, 1] <= 1) | (edge[:, 0] >= columns - 2)
    out |= edge[:, 1] >= rows - 2
    return Silhouette(
        place(np.asarray(found[main])),
        tuple(holes),
        tuple(others),
        place(edge[out]),
        pixel,
        origin,
        np.asarray(own & mask, dtype=np.uint8),
        relative,
    )
