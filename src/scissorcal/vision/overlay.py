"""Overlays: detections and a fit's residuals, drawn over the photograph."""

from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from scissorcal.vision.photo import Photo, Picture
from scissorcal.vision.targets.detect import Detection

Array = NDArray[np.float64]

WIDEST_PX = 1000
"""Larger photographs are drawn smaller, small ones at most twice as large."""

_GREEN, _RED, _BLUE, _WHITE, _BLACK = (
    (60, 170, 0),
    (40, 40, 220),
    (200, 90, 0),
    (255, 255, 255),
    (0, 0, 0),
)
_ARROW_SHARE = 0.03


def detection_overlay(photo: Photo, detection: Detection) -> Picture:
    """Draw the detected corners, the first one in red, connected in order."""
    import cv2

    canvas, scale = _canvas(photo)
    places = [_place(pixel, scale) for pixel in detection.pixels]
    for before, after in pairwise(places):
        cv2.line(canvas, before, after, _BLUE, 1, cv2.LINE_AA)
    for index, place in enumerate(places):
        cv2.circle(canvas, place, 5, _GREEN if index else _RED, 1, cv2.LINE_AA)
    words = f"{photo.source}: {len(places)} corners of the {detection.board.name}"
    return _labelled(canvas, words)


def residual_overlay(
    photo: Photo, pixels: Array, residuals: Array, words: str = "", axes: Array | None = None
) -> Picture:
    """Draw residuals of corners as arrows, with a scale bar.

    Arrows run from the predicted corner toward the detected one, enlarged so that the median is 3 %
    of the picture's width; those three times as long are red. ``axes`` (4, 2) are the pixels of a
    frame's origin and the ends of its x, y and z axes.
    """
    import cv2

    canvas, scale = _canvas(photo)
    if axes is not None and np.all(np.isfinite(axes)):
        _draw_axes(canvas, [_place(pixel, scale) for pixel in axes])
    length = np.linalg.norm(residuals, axis=1)
    middle = max(float(np.median(length)), 1e-3)
    magnified = _ARROW_SHARE * canvas.shape[1] / middle
    for pixel, residual, size in zip(pixels, residuals, length, strict=True):
        start = _place(pixel - residual, scale)
        off = magnified * residual
        end = (round(start[0] + off[0]), round(start[1] + off[1]))
        colour = _RED if size > 3.0 * middle else _GREEN
        cv2.arrowedLine(canvas, start, end, colour, 1, cv2.LINE_AA, tipLength=0.25)
    bar = _round_length(0.1 * canvas.shape[1] / magnified)
    _draw_bar(canvas, round(bar * magnified), f"{bar:g} px")
    rms = float(np.sqrt(np.mean(length**2)))
    return _labelled(canvas, f"{photo.source}: {rms:.2f} px rms {words}".rstrip())


def write_picture(picture: Picture, path: Path) -> Path:
    """Write a picture as PNG, atomically."""
    import cv2

    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(path.name + ".part")
    part.write_bytes(cv2.imencode(".png", picture)[1].tobytes())
    part.replace(path)
    return path


def _canvas(photo: Photo) -> tuple[Picture, float]:
    """The photograph in pale grey at a handy size, and the canvas's pixels per photo's pixel."""
    import cv2

    grey = photo.grey
    zoom = min(2.0, WIDEST_PX / max(grey.shape))
    size = (round(grey.shape[1] * zoom), round(grey.shape[0] * zoom))
    way = cv2.INTER_AREA if zoom < 1.0 else cv2.INTER_CUBIC
    pale = (0.5 * cv2.resize(grey, size, interpolation=way) + 127.0).astype(np.uint8)
    canvas = np.asarray(cv2.cvtColor(pale, cv2.COLOR_GRAY2BGR), dtype=np.uint8)
    return canvas, size[0] / photo.width


def _place(pixel: Array, scale: float) -> tuple[int, int]:
    u, v = (np.asarray(pixel) + 0.5) * scale - 0.5
    return round(float(u)), round(float(v))


def _draw_axes(canvas: Picture, ends: list[tuple[int, int]]) -> None:
    import cv2

    for name, colour, end in zip("xyz", (_RED, _GREEN, _BLUE), ends[1:], strict=True):
        cv2.arrowedLine(canvas, ends[0], end, colour, 2, cv2.LINE_AA, tipLength=0.1)
        _write(canvas, name, (end[0] + 6, end[1]))


def _labelled(canvas: Picture, words: str) -> Picture:
    size = _letter_size(canvas)
    _write(canvas, words, (8, round(40 * size)))
    return canvas


def _draw_bar(canvas: Picture, length: int, words: str) -> None:
    import cv2

    low = canvas.shape[0] - 20
    cv2.rectangle(canvas, (10, low - 16), (40 + length, low + 14), _WHITE, cv2.FILLED)
    cv2.line(canvas, (20, low), (20 + length, low), _BLACK, 2)
    for end in (20, 20 + length):
        cv2.line(canvas, (end, low - 5), (end, low + 5), _BLACK, 2)
    _write(canvas, words, (34 + length, low + 7))


def _write(canvas: Picture, words: str, place: tuple[int, int]) -> None:
    """Write black on a white field; ``place`` is the left end of the baseline."""
    import cv2

    font, size = cv2.FONT_HERSHEY_SIMPLEX, _letter_size(canvas)
    (width, height), below = cv2.getTextSize(words, font, size, 1)
    left, low = place
    corner = (left - 4, low - height - 4)
    cv2.rectangle(canvas, corner, (left + width + 4, low + below + 2), _WHITE, cv2.FILLED)
    cv2.putText(canvas, words, place, font, size, _BLACK, 1, cv2.LINE_AA)


def _letter_size(canvas: Picture) -> float:
    return max(float(canvas.shape[1]) / 1900.0, 0.5)


def _round_length(length: float) -> float:
    """The nearest of 1, 2, 5 times a power of ten below a length."""
    power = 10.0 ** np.floor(np.log10(length))
    step = max(step for step in (1.0, 2.0, 5.0) if step * power <= length * (1.0 + 1e-9))
    return float(step * power)
