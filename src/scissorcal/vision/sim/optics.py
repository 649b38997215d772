"""The rendered camera: place and share of a pixel, light, blur, noise, tone and compression."""

from collections.abc import Iterable
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from scissorcal.aliases import Array
from scissorcal.errors import InputError

Picture = NDArray[np.float32]
Bytes = NDArray[np.uint8]

_STEPS, _HEADROOM = 4096.0, 1.25


@dataclass(frozen=True)
class Looks:
    """How a picture is taken. Blur in pixels; light and noise in shares of full white.

    ``defocus_px`` is the radius of the disc that a point becomes, ``motion_px`` and
    ``motion_angle`` the line it is drawn out to, ``softness_px`` the standard deviation of the lens
    and sensor. ``vignetting`` is the light lost in the corners, ``light_slope`` its gain from the
    left border to the right one. ``noise`` is that of white, shot and read noise together. ``tone``
    is an S of contrast laid over the sRGB curve: 0 is sRGB.
    """

    exposure: float = 0.9
    defocus_px: float = 0.0
    motion_px: float = 0.0
    motion_angle: float = 0.0
    softness_px: float = 0.5
    vignetting: float = 0.0
    light_slope: float = 0.0
    noise: float = 0.0
    tone: float = 0.0
    tint: tuple[float, float, float] = (1.0, 1.0, 1.0)


@dataclass(frozen=True)
class SimPose:
    """Takes points of a plane's frame into the camera's: ``rotation`` (3, 3), ``shift_m`` (3,)."""

    rotation: Array
    shift_m: Array

    @classmethod
    def looking_at(
        cls,
        target_m: tuple[float, float],
        distance_m: float,
        *,
        tilt: float = 0.0,
        azimuth: float = 0.0,
        turn: float = 0.0,
    ) -> "SimPose":
        """Look at a place of the plane from a distance.

        Square-on where ``tilt`` is 0; else leaned by it towards ``azimuth``, and turned by ``turn``
        about the line of sight; all in radians.
        """
        to_azimuth = about(2, azimuth)
        rotation = about(2, turn) @ to_azimuth @ about(1, tilt) @ to_azimuth.T
        target = np.array([target_m[0], target_m[1], 0.0])
        return cls(rotation, np.array([0.0, 0.0, distance_m]) - rotation @ target)


@dataclass(frozen=True)
class Lens:
    """Focal length and centre in pixels, and Brown's distortion (k1, k2, p1, p2, k3)."""

    focal_px: float
    centre_px: tuple[float, float]
    width: int
    height: int
    distortion: tuple[float, float, float, float, float] = (0.0, 0.0, 0.0, 0.0, 0.0)

    def sees(self, points: ArrayLike, pose: SimPose) -> Array:
        """Pixels (n, 2) of points (n, 2) in the plane of ``pose``; NaN behind the camera.

        Pixels have their first centre at (0, 0).
        """
        flat = np.asarray(points, dtype=np.float64)
        x, y, z = (flat @ pose.rotation[:, :2].T + pose.shift_m).T
        ahead = z > 1e-6
        depth = np.where(ahead, z, np.nan)
        return self.bend(np.column_stack([x / depth, y / depth]))

    def bend(self, directions: Array) -> Array:
        """Pixels of undistorted directions (n, 2), x/z and y/z."""
        k1, k2, p1, p2, k3 = self.distortion
        x, y = directions[:, 0], directions[:, 1]
        r2 = x * x + y * y
        radial = 1.0 + r2 * (k1 + r2 * (k2 + r2 * k3))
        bent_x = x * radial + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x)
        bent_y = y * radial + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y
        return np.column_stack(
            [
                self.focal_px * bent_x + self.centre_px[0],
                self.focal_px * bent_y + self.centre_px[1],
            ]
        )


def about(axis: int, angle: float) -> Array:
    """Rotation (3, 3) by an angle (rad) about the axis x, y or z (0, 1 or 2)."""
    turned = np.eye(3)
    first, second = (axis + 1) % 3, (axis + 2) % 3
    turned[first, first] = turned[second, second] = np.cos(angle)
    turned[second, first] = np.sin(angle)
    turned[first, second] = -np.sin(angle)
    return turned


def develop(radiance: Picture, looks: Looks, rng: np.random.Generator) -> Bytes:
    """Turn linear radiance (h, w) into the bytes (h, w, 3) that a camera would store."""
    lit = _blurred(_lit(radiance, looks), looks)
    if looks.noise > 0.0:
        grain = rng.standard_normal(lit.shape, dtype=np.float32)
        spread = np.maximum(lit, 0.0)
        spread *= 0.8
        spread += 0.2
        np.sqrt(spread, out=spread)
        grain *= spread
        grain *= looks.noise
        lit = lit + grain
    lit *= _STEPS
    index = np.clip(lit, 0.0, _STEPS * _HEADROOM, out=lit).astype(np.uint16)
    return _toned(index, looks)


def as_jpeg(picture: Bytes, quality: int) -> bytes:
    """Compress a picture as a camera would."""
    done, data = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])
    if not done:
        raise InputError("The rendered picture cannot be stored as JPEG.")
    return data.tobytes()


def _toned(index: NDArray[np.uint16], looks: Looks) -> Bytes:
    """Bytes (h, w, 3) of light in steps (h, w), looked up as one word of four bytes a pixel."""
    levels = np.arange(int(_STEPS * _HEADROOM) + 1, dtype=np.float32) / _STEPS
    table = np.zeros((len(levels), 4), dtype=np.uint8)
    for channel, share in enumerate(looks.tint):
        tone = _tone(np.clip(levels * share, 0.0, 1.0), looks.tone)
        table[:, channel] = np.rint(255.0 * tone)
    words = np.take(table.view(np.uint32)[:, 0], index, mode="clip")
    pixels = words.view(np.uint8).reshape(*index.shape, 4)
    return np.asarray(cv2.cvtColor(pixels, cv2.COLOR_BGRA2BGR), dtype=np.uint8)


def _lit(radiance: Picture, looks: Looks) -> Picture:
    """The scene's radiance under uneven light and vignetting."""
    height, width = radiance.shape
    x = np.linspace(-1.0, 1.0, max(width, 2), dtype=np.float32)[None, :width]
    y = np.linspace(-1.0, 1.0, max(height, 2), dtype=np.float32)[:height, None]
    across = looks.exposure * (1.0 + 0.5 * looks.light_slope * x)
    half = np.float32(0.5 * looks.vignetting)
    fall = np.subtract(1.0 - half * x**2, half * y**2, dtype=np.float32)
    fall *= across
    fall *= radiance
    return np.asarray(fall)


def _blurred(picture: Picture, looks: Looks) -> Picture:
    kernel = None
    if looks.defocus_px > 0.05:
        kernel = _disc(looks.defocus_px)
    if looks.motion_px > 0.05:
        line = _line(looks.motion_px, looks.motion_angle)
        kernel = line if kernel is None else _convolved(kernel, line)
    if kernel is not None:
        blurred = cv2.filter2D(picture, -1, kernel, borderType=cv2.BORDER_REPLICATE)
        picture = np.asarray(blurred, dtype=np.float32)
    if looks.softness_px > 0.05:
        softened = cv2.GaussianBlur(
            picture, (0, 0), looks.softness_px, borderType=cv2.BORDER_REPLICATE
        )
        picture = np.asarray(softened, dtype=np.float32)
    return picture


def _disc(radius: float) -> Picture:
    turn = np.linspace(0.0, 2.0 * np.pi, 181)[:-1]
    half = int(np.ceil(radius + 0.5))
    return _kernel(radius * np.column_stack([np.cos(turn), np.sin(turn)]), half)


def _line(length: float, angle: float) -> Picture:
    along = 0.5 * length * np.array([np.cos(angle), np.sin(angle)])
    across = 0.25 * np.array([-np.sin(angle), np.cos(angle)])
    corners = np.array([-along - across, along - across, along + across, -along + across])
    return _kernel(corners, int(np.ceil(0.5 * length + 1.0)))


def _kernel(outline: NDArray[np.float64], half: int) -> Picture:
    covered = coverage([outline + half], 2 * half + 1, 2 * half + 1)
    return np.asarray(covered / covered.sum(), dtype=np.float32)


def _convolved(first: Picture, second: Picture) -> Picture:
    room = (second.shape[0] - 1) // 2
    wide = np.pad(first, room)
    return np.asarray(cv2.filter2D(wide, -1, second, borderType=cv2.BORDER_CONSTANT))


def _tone(linear: Picture, contrast: float) -> Picture:
    curve = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return np.asarray(curve + contrast * curve * (1.0 - curve) * (2.0 * curve - 1.0), np.float32)


def coverage(polygons: Iterable[Array], width: int, height: int) -> NDArray[np.float32]:
    """Share (height, width) of each pixel's area that lies within the polygons, summed over them.

    Vertices (n, 2) are pixels, with the centre of the first one at (0, 0). A polygon that runs the
    other way round subtracts, which makes holes. Every side is cut at the pixels' borders; a piece
    within one pixel covers all that is to the right of it by its height, and of that pixel the
    part to the right of its middle. The running sum over a row is then exact.
    """
    sides = np.concatenate(
        [np.hstack([p, np.roll(p, -1, axis=0)]) for p in map(np.asarray, polygons) if len(p)]
        or [np.empty((0, 4))]
    )
    sides = sides[np.isfinite(sides).all(axis=1)] + 0.5
    within = (np.maximum(sides[:, 1], sides[:, 3]) > 0) & (
        np.minimum(sides[:, 1], sides[:, 3]) < height
    )
    pieces = _cut(_cut(sides[within], axis=1), axis=0)
    row = np.floor(0.5 * (pieces[:, 1] + pieces[:, 3])).astype(np.int64)
    inside = (row >= 0) & (row < height)
    pieces, row = pieces[inside], row[inside]
    x = np.clip(0.5 * (pieces[:, 0] + pieces[:, 2]), 0.0, float(width))
    column = np.floor(x).astype(np.int64)
    rise = pieces[:, 3] - pieces[:, 1]
    share = x - column
    stride = width + 2
    cells = row * stride + column
    total = np.bincount(cells, rise * (1.0 - share), height * stride)
    total += np.bincount(cells + 1, rise * share, height * stride)
    grid = total.reshape(height, stride).astype(np.float32)
    np.cumsum(grid, axis=1, out=grid)
    covered = grid[:, :width]
    return np.clip(covered if covered.sum() >= 0 else -covered, 0.0, 1.0)


def _cut(sides: Array, axis: int) -> Array:
    """Cut sides (n, 4) of x0, y0, x1, y1 wherever they pass a whole number along ``axis``."""
    a, b = sides[:, axis], sides[:, axis + 2]
    low, high = np.floor(np.minimum(a, b)), np.floor(np.maximum(a, b))
    count = (high - low).astype(np.int64) + 1
    index = np.repeat(np.arange(len(sides)), count)
    step = np.arange(len(index)) - np.repeat(np.cumsum(count) - count, count)
    start, end = sides[index, :2], sides[index, 2:]
    run = (end - start)[:, axis]
    forward = run >= 0
    border = np.where(forward, low[index] + step, high[index] - step + 1)
    safe = np.where(run == 0.0, 1.0, run)
    first = np.where(step == 0, 0.0, (border - start[:, axis]) / safe)
    border = border + np.where(forward, 1.0, -1.0)
    last = np.where(step == count[index] - 1, 1.0, (border - start[:, axis]) / safe)
    first, last = np.clip(first, 0.0, 1.0)[:, None], np.clip(last, 0.0, 1.0)[:, None]
    return np.hstack([start + first * (end - start), start + last * (end - start)])
