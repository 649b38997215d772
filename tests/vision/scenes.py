"""Rendered photographs of targets for the tests of this room."""

import numpy as np
from numpy.typing import NDArray

from scissorcal.vision.photo import Photo
from scissorcal.vision.sim import Lens, Looks, SimPose, render, target_layers
from scissorcal.vision.targets.boards import Board

SOFT = Looks(softness_px=0.7, noise=0.01)


def lens(width: int = 1280, height: int = 720, focal_px: float = 1150.0) -> Lens:
    """Give a lens with a little of every distortion, its centre off the picture's."""
    bend = (-0.12, 0.05, 0.0008, -0.0005, 0.0)
    return Lens(focal_px, (0.5 * width + 7.3, 0.5 * height - 5.6), width, height, bend)


def pose_before(
    board: Board, distance_m: float, *, tilt: float = 0.0, azimuth: float = 0.0, turn: float = 0.0
) -> SimPose:
    """Look at the middle of a board."""
    middle = (0.5 * board.width_m, 0.5 * board.height_m)
    return SimPose.looking_at(middle, distance_m, tilt=tilt, azimuth=azimuth, turn=turn)


def picture(
    board: Board, pose: SimPose, seen_by: Lens, looks: Looks = SOFT, seed: int = 0
) -> NDArray[np.uint8]:
    """Photograph one board: (height, width, 3)."""
    return render(target_layers(board, pose), seen_by, looks, np.random.default_rng(seed))


def photo_of(image: NDArray[np.uint8], name: str = "photo.png") -> Photo:
    """Take an array for a photograph that was read."""
    return Photo.from_array(image, name)
