"""What photographs show, for people: detections and residuals drawn over them, views covered."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.files import replacing
from scissorcal.vision.geometry.camera import usual_camera
from scissorcal.vision.photo import Photo, Picture
from scissorcal.vision.targets.detect import SMALL_PX, Detection

Colour = tuple[int, int, int]

WIDEST_PX = 1000
"""Larger photographs are drawn smaller, small ones at most twice as large."""

GREEN, RED, BLUE = (60, 170, 0), (40, 40, 220), (200, 90, 0)

_WHITE, _BLACK = (255, 255, 255), (0, 0, 0)
_ARROW_SHARE = 0.03
_FINE = 4


def detection_overlay(photo: Photo, detection: Detection) -> Picture:
    """Draw the detected corners, the first one in red, connected in order."""
    canvas = _pale_canvas(photo)
    canvas.line(detection.pixels, BLUE)
    for index, pixel in enumerate(detection.pixels):
        canvas.ring(pixel, GREEN if index else RED, 5)
    canvas.title(f"{photo.source}: {len(detection.ids)} corners of the {detection.board.name}")
    return canvas.picture


def residual_overlay(
    photo: Photo, pixels: Array, residuals: Array, axes: Array | None = None
) -> Picture:
    """Draw residuals of corners as arrows, with a scale bar.

    Arrows run from the predicted corner toward the detected one, enlarged so that the median is 3 %
    of the picture's width; those three times as long are red. ``axes`` (4, 2) are the pixels of a
    frame's origin and the ends of its x, y and z axes.
    """
    canvas = _pale_canvas(photo)
    width = canvas.picture.shape[1]
    if axes is not None and np.all(np.isfinite(axes)):
        for name, colour, end in zip("xyz", (RED, GREEN, BLUE), axes[1:], strict=True):
            canvas.arrow(axes[0], end, colour, thickness=2)
            canvas.words(name, canvas.whole(end) + np.array([6, 0]))
    length = np.linalg.norm(residuals, axis=1)
    middle = max(float(np.median(length)), 1e-3)
    magnified = _ARROW_SHARE * width / middle
    for pixel, residual, size in zip(pixels, residuals, length, strict=True):
        start = pixel - residual
        colour = RED if size > 3.0 * middle else GREEN
        canvas.arrow(start, start + magnified / canvas.scale * residual, colour)
    bar = _round_length(0.1 * width / magnified)
    canvas.bar(round(bar * magnified), f"{bar:g} px")
    rms = float(np.sqrt(np.mean(length**2)))
    canvas.title(f"{photo.source}: {rms:.2f} px rms")
    return canvas.picture


def write_picture(picture: Picture, path: Path) -> Path:
    """Write a picture as PNG, atomically."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as part:
        part.write_bytes(cv2.imencode(".png", picture)[1].tobytes())
    return path


class Canvas:
    """A scaled copy of a picture, or of a part of it, to draw on in the picture's own pixels.

    ``image`` is grey or BGR, ``scale`` the canvas's pixels per pixel of it, ``origin`` the pixel at
    its corner. ``picture`` is the result.
    """

    def __init__(self, image: Picture, scale: float, origin: tuple[int, int] = (0, 0)) -> None:
        part: Any = cv2.cvtColor(image, cv2.COLOR_GRAY2BGR) if image.ndim == 2 else image
        size = (round(part.shape[1] * scale), round(part.shape[0] * scale))
        method = cv2.INTER_AREA if scale < 1.0 else cv2.INTER_CUBIC
        self.picture: Picture = np.asarray(cv2.resize(part, size, interpolation=method), np.uint8)
        self.scale = scale
        self.origin = np.array(origin, dtype=np.float64)

    def line(self, pixels: Array, colour: Colour, *, closed: bool = False) -> None:
        """Draw a line through pixels (n, 2) of the photograph."""
        cv2.polylines(
            self.picture, [self._fine(pixels)], closed, colour, 1, cv2.LINE_AA, shift=_FINE
        )

    def arrow(self, start: Array, end: Array, colour: Colour, *, thickness: int = 1) -> None:
        """Draw an arrow between two pixels of the photograph."""
        ends = self._fine(np.array([start, end])).tolist()
        cv2.arrowedLine(
            self.picture, ends[0], ends[1], colour, thickness, cv2.LINE_AA, _FINE, tipLength=0.2
        )

    def cross(self, pixel: Array, colour: Colour) -> None:
        """Mark a pixel of the photograph."""
        for step in np.eye(2) * 12.0 / self.scale:
            self.line(np.array([pixel - step, pixel + step]), colour)

    def ring(self, pixel: Array, colour: Colour, radius: int) -> None:
        """Draw a circle of a radius on the canvas about a pixel of the photograph."""
        centre = self._fine(np.asarray(pixel)[None])[0].tolist()
        cv2.circle(self.picture, centre, radius * 2**_FINE, colour, 1, cv2.LINE_AA, shift=_FINE)

    def words(self, text: str, place: NDArray[np.int64]) -> None:
        """Write black on white; ``place`` (2,) on the canvas is the left end of the baseline."""
        font, size = cv2.FONT_HERSHEY_SIMPLEX, self._letter_size
        (width, height), below = cv2.getTextSize(text, font, size, 1)
        left, low = (int(value) for value in place)
        corner = (left - 4, low - height - 4)
        cv2.rectangle(self.picture, corner, (left + width + 4, low + below + 2), _WHITE, cv2.FILLED)
        cv2.putText(self.picture, text, (left, low), font, size, _BLACK, 1, cv2.LINE_AA)

    def title(self, text: str) -> None:
        """Write a line in the upper left corner."""
        self.words(text, np.array([8, round(40 * self._letter_size)]))

    def bar(self, length: int, text: str) -> None:
        """Draw a scale bar of a length on the canvas in the lower left corner."""
        low = self.picture.shape[0] - 20
        cv2.rectangle(self.picture, (10, low - 16), (40 + length, low + 14), _WHITE, cv2.FILLED)
        cv2.line(self.picture, (20, low), (20 + length, low), _BLACK, 2)
        for end in (20, 20 + length):
            cv2.line(self.picture, (end, low - 5), (end, low + 5), _BLACK, 2)
        self.words(text, np.array([34 + length, low + 7]))

    def whole(self, pixel: Array) -> NDArray[np.int64]:
        """The canvas's pixel (2,) at a pixel of the photograph."""
        return np.asarray(self._fine(np.asarray(pixel)[None])[0] // 2**_FINE, dtype=np.int64)

    def _fine(self, pixels: Array) -> NDArray[np.int32]:
        """Places (n, 2) on the canvas in sixteenths of its pixels."""
        there = (np.asarray(pixels) - self.origin + 0.5) * self.scale - 0.5
        return np.asarray(np.rint(np.nan_to_num(there, nan=-1e4) * 2**_FINE), dtype=np.int32)

    @property
    def _letter_size(self) -> float:
        return max(float(self.picture.shape[1]) / 1900.0, 0.5)


def _pale_canvas(photo: Photo) -> Canvas:
    """The photograph in pale grey, drawn on in pixels of the whole photograph."""
    pale = np.asarray(0.5 * photo.grey + 127.0, dtype=np.uint8)
    canvas = Canvas(pale, min(2.0, WIDEST_PX / max(pale.shape)))
    canvas.scale = canvas.picture.shape[1] / photo.width
    return canvas


def _round_length(length: float) -> float:
    """The largest of 1, 2, 5 times a power of ten below a length."""
    power = 10.0 ** np.floor(np.log10(length))
    step = max(step for step in (1.0, 2.0, 5.0) if step * power <= length * (1.0 + 1e-9))
    return float(step * power)


PLACES = (
    "upper left",
    "top",
    "upper right",
    "left",
    "middle",
    "right",
    "lower left",
    "bottom",
    "lower right",
)
SIZES = ("far", "middling", "near")
SLANTS = ("square-on", "facing left", "facing right", "facing up", "facing down")

_FAR, _NEAR = 0.4, 0.65
_SQUARE_ON = np.radians(12.0)


@dataclass(frozen=True)
class ViewCoverage:
    """Covered ninths of the picture, sizes of the board and its slants.

    A board is far where it spans less than 40 % of the picture, near where it spans more than 65 %.
    """

    places: frozenset[str] = frozenset()
    sizes: frozenset[str] = frozenset()
    slants: frozenset[str] = frozenset()

    def with_view(self, detection: Detection, width: int, height: int) -> "ViewCoverage":
        """Add a photograph of ``width`` by ``height`` pixels."""
        return ViewCoverage(
            self.places | _places(detection.pixels, width, height),
            self.sizes | {_size(detection, width, height)},
            self.slants | {_slant(detection, width, height)},
        )

    @property
    def wanted(self) -> tuple[str, ...]:
        """What no photograph has covered yet."""
        return (
            *(place for place in PLACES if place not in self.places),
            *(size for size in SIZES if size not in self.sizes),
            *(slant for slant in SLANTS if slant not in self.slants),
        )

    def sentence(self) -> str:
        """Sentence on what is covered and what is still wanted."""
        coverage = (
            f"places {len(self.places)} of {len(PLACES)}, sizes {len(self.sizes)} of {len(SIZES)}, "
            f"slants {len(self.slants)} of {len(SLANTS)}"
        )
        return f"{coverage}; wanted: {', '.join(self.wanted)}" if self.wanted else coverage


def _slant_of(detection: Detection, width: int, height: int) -> tuple[float, float]:
    """How a board is turned from square-on, to the right and up (rad), by the usual camera.

    That is enough to classify slants.
    """
    matrix = usual_camera(width, height).matrix
    _, turns, _, _ = cv2.solvePnPGeneric(
        detection.points, detection.pixels, matrix, None, flags=cv2.SOLVEPNP_IPPE
    )
    normal = cv2.Rodrigues(turns[0])[0][:, 2]
    facing = -normal * np.sign(normal[2])
    return float(np.arctan2(facing[0], -facing[2])), float(np.arctan2(-facing[1], -facing[2]))


def detection_words(photo: Photo, detection: Detection) -> str:
    """Describe a detection: corners, size of a square, size and slant of the board."""
    size = _size(detection, photo.width, photo.height)
    slant = _slant(detection, photo.width, photo.height)
    words = (
        f"{photo.source}: {len(detection.ids)} of {len(detection.board.points)} corners, "
        f"{detection.square_px:.0f} px a square, {size}, {slant}"
    )
    if detection.square_px < SMALL_PX:
        words += f" (small: {SMALL_PX:.0f} px a square and more are safe; move closer)"
    return words


def _places(pixels: Array, width: int, height: int) -> frozenset[str]:
    column = np.clip((3.0 * pixels[:, 0] / width).astype(int), 0, 2)
    row = np.clip((3.0 * pixels[:, 1] / height).astype(int), 0, 2)
    return frozenset(PLACES[place] for place in np.unique(3 * row + column))


def _size(detection: Detection, width: int, height: int) -> str:
    board = detection.board
    span = detection.px_per_m * max(board.width_m / width, board.height_m / height)
    return SIZES[0] if span < _FAR else SIZES[2] if span > _NEAR else SIZES[1]


def _slant(detection: Detection, width: int, height: int) -> str:
    right, up = _slant_of(detection, width, height)
    if max(abs(right), abs(up)) < _SQUARE_ON:
        return SLANTS[0]
    if abs(right) > abs(up):
        return SLANTS[2] if right > 0.0 else SLANTS[1]
    return SLANTS[3] if up > 0.0 else SLANTS[4]
