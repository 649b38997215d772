"""Defects of a photograph: light, blur, noise, tone curve and compression."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

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
    import cv2

    done, data = cv2.imencode(".jpg", picture, [cv2.IMWRITE_JPEG_QUALITY, quality])
    if not done:
        raise InputError("The rendered picture cannot be stored as JPEG.")
    return data.tobytes()


def random_looks(rng: np.random.Generator, px_per_mm: float, strength: float = 1.0) -> Looks:
    """Draw how a picture is taken, from careful (``strength`` 0) to careless (1 and above)."""
    blur = strength * min(px_per_mm / 12.0, 1.5)
    looks = Looks(
        exposure=float(rng.uniform(0.7, 0.95)),
        defocus_px=float(rng.uniform(0.0, 2.0) * blur),
        motion_px=float(rng.uniform(0.0, 2.5) * blur),
        motion_angle=float(rng.uniform(0.0, np.pi)),
        softness_px=float(rng.uniform(0.5, 0.8)),
        vignetting=float(rng.uniform(0.0, 0.4) * strength),
        light_slope=float(rng.uniform(-0.3, 0.3) * strength),
        noise=float(rng.uniform(0.003, 0.02) * max(strength, 0.1)),
        tone=float(rng.normal(0.0, 0.15) * strength),
    )
    warm = float(rng.uniform(-0.06, 0.06) * strength)
    return replace(looks, tint=(1.0 - warm, 1.0, 1.0 + warm))


def _toned(index: NDArray[np.uint16], looks: Looks) -> Bytes:
    """Bytes (h, w, 3) of light in steps (h, w), looked up as one word of four bytes a pixel."""
    import cv2

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
    import cv2

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
    from scissorcal.vision.sim.coverage import coverage

    covered = coverage([outline + half], 2 * half + 1, 2 * half + 1)
    return np.asarray(covered / covered.sum(), dtype=np.float32)


def _convolved(one: Picture, other: Picture) -> Picture:
    import cv2

    room = (other.shape[0] - 1) // 2
    wide = np.pad(one, room)
    return np.asarray(cv2.filter2D(wide, -1, other, borderType=cv2.BORDER_CONSTANT))


def _tone(linear: Picture, contrast: float) -> Picture:
    curve = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)
    return np.asarray(curve + contrast * curve * (1.0 - curve) * (2.0 * curve - 1.0), np.float32)
