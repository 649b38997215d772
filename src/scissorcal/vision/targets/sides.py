"""The corners of dark square markers, where their sides cross, and what a lens bends of them.

Sides are independent of blur and tone curve, which draw what a corner detector finds inward.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.vision.geometry.camera import Camera

Flags = NDArray[np.bool_]

_ALONG = np.linspace(0.12, 0.88, 28)
_ROUNDS = 2
_LEAST_SIDE_PX = 16.0
_LEAST_REACH_PX = 2.0
_MOST_REACH_PX = 12.0
_WORST_LINE_PX = 0.6


def corners_by_sides(grey: NDArray[np.uint8], corners: Array, module: float) -> tuple[Array, Flags]:
    """Move corners (n, 4, 2) of dark square markers to the intersections of their sides.

    A corner detector finds the corner of a blurred dark square half a pixel or more inside, and a
    camera's tone curve moves all four sides inward. So each side is sampled at 28 places: across it
    the light rises from the dark border (one ``module`` wide, as a share of the side) to the white
    around it, and the side is where the *linear* light is half way. A robust line through these
    places intersects its neighbours in the corners.

    Returns the corners, and (n,) whether a marker was sharp enough. Others - too small, blurred
    over more than their border, or with a side partly covered - keep their corners.
    """
    if not len(corners):
        return corners, np.zeros(0, dtype=np.bool_)
    refined = np.array(corners, dtype=np.float64)
    linear = linear_light(grey)
    side = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).min(axis=1)
    good = side >= _LEAST_SIDE_PX
    for _ in range(_ROUNDS):
        lines, spread = _side_lines(linear, refined, module)
        crossing = _crossings(lines)
        jump = np.linalg.norm(crossing - corners, axis=2).max(axis=1)
        good &= spread.max(axis=1) < _WORST_LINE_PX
        good &= jump < np.maximum(0.5 * module * side, 2.0)
        refined = np.where(good[:, None, None], crossing, corners)
    return refined, good


def unbent_corners(corners: Array, camera: Camera) -> Array:
    """Where the corners (n, 4, 2) of markers are whose sides were measured as straight lines.

    A lens that distorts bends a side, by its length squared, and a line fitted to it meets its
    neighbours beside the corner. The camera says by how much: its picture of straight sides is
    fitted as `corners_by_sides` fits what is measured, and the difference is taken off. A marker
    outside of where the camera's distortion holds keeps its corners.
    """
    unbent = corners
    for _ in range(_ROUNDS):
        unbent = corners - np.nan_to_num(_straight_crossings(unbent, camera) - unbent)
    return unbent


def _straight_crossings(corners: Array, camera: Camera) -> Array:
    """What `corners_by_sides` finds of markers whose corners (n, 4, 2) are these, or NaN."""
    start = camera.rays(corners.reshape(-1, 2)).reshape(-1, 4, 1, 2)
    rays = start + _ALONG[:, None] * (np.roll(start, -1, axis=1) - start)
    ahead = np.insert(rays.reshape(-1, 2), 2, 1.0, axis=1)
    lines, spread = _fitted_lines(camera.project(ahead).reshape(rays.shape), _outward(corners))
    held: Flags = np.asarray(np.isfinite(spread).all(axis=1))
    return np.where(held[:, None, None], _crossings(lines), np.nan)


def linear_light(grey: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Undo the sRGB tone curve (IEC 61966-2-1): light from 0 to 1."""
    level = np.arange(256) / 255.0
    table = np.where(level <= 0.04045, level / 12.92, ((level + 0.055) / 1.055) ** 2.4)
    return np.asarray(table.astype(np.float32)[grey])


def _side_lines(linear: NDArray[np.float32], corners: Array, module: float) -> tuple[Array, Array]:
    """Lines (n, 4, 3) with a x + b y = c, (a, b) of length 1; their residual's spread (n, 4)."""
    start, along, outward = corners, np.roll(corners, -1, axis=1) - corners, _outward(corners)
    across = 0.5 * (np.roll(along, -1, axis=1) - np.roll(along, 1, axis=1))
    width = np.abs(np.sum(across * outward, axis=2))
    reach = np.clip(0.85 * module * width, _LEAST_REACH_PX, _MOST_REACH_PX)
    places = start[:, :, None] + _ALONG[None, None, :, None] * along[:, :, None]
    shift = _half_way(linear, places, outward, reach)
    edge = places + shift[..., None] * outward[:, :, None]
    return _fitted_lines(edge, outward)


def _outward(corners: Array) -> Array:
    """Unit normals (n, 4, 2) of the sides of markers, away from their middle."""
    along = np.roll(corners, -1, axis=1) - corners
    length = np.maximum(np.linalg.norm(along, axis=2), 1e-9)
    return np.asarray(np.stack([along[..., 1], -along[..., 0]], axis=2) / length[..., None])


def _half_way(linear: NDArray[np.float32], places: Array, outward: Array, reach: Array) -> Array:
    """How far outward of each place (n, 4, places) the light is half way; NaN where it never is."""
    count = 2 * int(np.ceil(2.0 * float(reach.max()))) + 1
    step = np.linspace(-1.0, 1.0, count)
    offset = reach[:, :, None] * step
    where = places[:, :, :, None] + offset[:, :, None, :, None] * outward[:, :, None, None]
    flat = where.reshape(len(where), -1, 2).astype(np.float32)
    taken = cv2.remap(
        linear, flat[..., 0], flat[..., 1], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
    )
    light: Array = np.asarray(taken, dtype=np.float64).reshape(where.shape[:-1])
    ends = max(count // 6, 1)
    dark: Array = np.asarray(np.median(light[..., :ends], axis=(2, 3), keepdims=True))
    bright: Array = np.asarray(np.median(light[..., -ends:], axis=(2, 3), keepdims=True))
    half = 0.5 * (dark + bright)
    above: Flags = np.asarray(light >= half)
    rising: Flags = np.logical_and(~above[..., :-1], above[..., 1:])
    # Of several crossings the one nearest to the middle counts.
    distance = np.where(rising, np.abs(np.arange(count - 1) + 0.5 - 0.5 * (count - 1)), np.inf)
    at = distance.argmin(axis=-1)
    low = np.take_along_axis(light, at[..., None], -1)[..., 0]
    high = np.take_along_axis(light, at[..., None] + 1, -1)[..., 0]
    share = (half[..., 0] - low) / np.maximum(high - low, 1e-9)
    place = (at + share) / (count - 1) * 2.0 - 1.0
    clear = rising.any(axis=-1) & ((bright - dark)[..., 0] > 0.03)
    return np.asarray(np.where(clear, place * reach[:, :, None], np.nan))


def _fitted_lines(edge: Array, outward: Array) -> tuple[Array, Array]:
    """Fit lines to points (n, 4, places, 2) by least squares with Tukey's weights."""
    known: Flags = np.asarray(np.isfinite(edge).all(axis=-1))
    points = np.where(known[..., None], edge, 0.0)
    weight = known.astype(np.float64)
    enough: Flags = np.asarray(known.mean(axis=-1) > 0.6)
    usable = known | ~enough[..., None]
    for _ in range(5):
        total: Array = np.asarray(np.maximum(weight.sum(axis=-1), 1e-9))
        middle = (weight[..., None] * points).sum(axis=2) / total[..., None]
        off = points - middle[:, :, None]
        scatter = np.einsum("...p,...pi,...pj->...ij", weight, off, off)
        _, vectors = np.linalg.eigh(scatter)
        normal = vectors[..., 0]
        normal = normal * np.sign((normal * outward).sum(axis=-1))[..., None]
        residual = np.einsum("...pi,...i->...p", off, normal)
        spread = 1.4826 * np.nanmedian(np.where(usable, np.abs(residual), np.nan), axis=-1)
        scale: Array = np.asarray(4.0 * np.maximum(spread, 0.05))
        ratio = np.clip(residual / scale[..., None], -1.0, 1.0)
        weight = known * (1.0 - ratio**2) ** 2
    level = (normal * middle).sum(axis=-1)
    lines = np.concatenate([normal, level[..., None]], axis=-1)
    return lines, np.where(enough, spread, np.inf)


def _crossings(lines: Array) -> Array:
    """Corners (n, 4, 2): corner i lies on side i - 1 and on side i."""
    before = np.roll(lines, 1, axis=1)
    (a, b, c), (d, e, f) = np.moveaxis(before, -1, 0), np.moveaxis(lines, -1, 0)
    det = a * e - b * d
    det = np.where(np.abs(det) < 1e-6, np.nan, det)
    return np.stack([(c * e - b * f) / det, (a * f - c * d) / det], axis=-1)
