"""Coverage of a board's views: places, sizes and slants, and what is still missing."""

from dataclasses import dataclass

import cv2
import numpy as np

from scissorcal.aliases import Array
from scissorcal.vision.geometry.camera import usual_camera
from scissorcal.vision.photo import Photo
from scissorcal.vision.targets.detect import SMALL_PX, Detection

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
