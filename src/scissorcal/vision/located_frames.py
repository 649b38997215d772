"""The pose of a target in each picture of a sequence, or why it has none."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from scissorcal.errors import InputError
from scissorcal.recipe.photograph_priors import PlatePriors
from scissorcal.vision.geometry.board_pose import ODDS, BoardPose, Corners, locate_board
from scissorcal.vision.geometry.camera import Camera
from scissorcal.vision.live import Frame, look
from scissorcal.vision.targets.boards import MarkedBoard

BLANK_LEVELS = 8.0
"""A picture is blank where 98 % of it lies within fewer grey levels than these."""

State = Literal["seen", "ambiguous", "blank", "no target", "no pose"]

STATES: dict[State, str] = {
    "seen": "its pose is known",
    "ambiguous": "two poses explain the picture about equally well",
    "blank": "the picture is uniform: lens covered, or no light",
    "no target": "the target is outside the picture, hidden or blurred",
    "no pose": "the visible part of the target does not determine a pose",
}
"""The states of a picture and their meaning. The last three are drop-outs: no pose."""


@dataclass(frozen=True)
class LocatedFrame:
    """One picture and its state, and the target's pose if there is one."""

    frame: Frame
    state: State
    board: MarkedBoard | None
    corners: int
    pose: BoardPose | None


def located_frames(
    frames: Iterable[Frame],
    boards: Sequence[MarkedBoard],
    camera: Camera,
    priors: PlatePriors = PlatePriors(),
) -> Iterator[LocatedFrame]:
    """Locate a target in every picture independently; the first board that is seen is the target.

    Raises InputError where pictures are of another size than the camera was fitted at.
    """
    for frame in frames:
        height, width = frame.image.shape[:2]
        if (width, height) != (camera.width, camera.height):
            raise InputError(
                f"The pictures are {width} x {height} pixels, the camera was fitted at "
                f"{camera.width} x {camera.height}: use the same camera, size, focus and zoom."
            )
        detection = look(frame.image, boards, f"picture {frame.number}")
        if detection is None:
            state: State = "blank" if _is_blank(frame) else "no target"
            yield LocatedFrame(_without_image(frame), state, None, 0, None)
            continue
        boards = tuple(board for board in boards if board == detection.board)
        try:
            pose = locate_board(Corners.of(detection), camera, priors)
        except ValueError:
            count = len(detection.ids)
            yield LocatedFrame(_without_image(frame), "no pose", boards[0], count, None)
            continue
        state = "seen" if pose.odds >= ODDS else "ambiguous"
        yield LocatedFrame(_without_image(frame), state, boards[0], len(detection.ids), pose)


def _without_image(frame: Frame) -> Frame:
    return replace(frame, image=None)


def _is_blank(frame: Frame) -> bool:
    low, high = np.percentile(np.asarray(frame.image)[::4, ::4], [1.0, 99.0])
    return bool(high - low < BLANK_LEVELS)
