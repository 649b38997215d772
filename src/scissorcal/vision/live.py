"""Frames of a running camera or a video: photographs selected, and the pose of a target in each."""

import math
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import cv2
import numpy as np

from scissorcal.errors import DeviceError, InputError
from scissorcal.files import replacing
from scissorcal.foreign import refuse_unless_regular
from scissorcal.foreign.formats import VIDEO
from scissorcal.recipe.priors import PlatePriors
from scissorcal.vision.geometry.board_pose import ODDS, BoardPose, Corners, locate_board
from scissorcal.vision.geometry.camera import Camera
from scissorcal.vision.photo import Photo
from scissorcal.vision.targets.boards import Board, MarkedBoard
from scissorcal.vision.targets.detect import Detection, find_any_board

APART_FRAMES = 5
STILL_SHARE = 0.002
NEW_SHARE = 0.05
"""Shares of the picture's width: a board held still moves less from frame to frame than the first,
one in a new place has moved farther than the second from where it was in every picture kept."""

LEAST_RATE_HZ, MOST_RATE_HZ = 0.5, 2000.0
RATE_EVERY = 10
RATE_SHARE = 0.05

LONGEST_CAMERA_NUMBER = 4

_ENCODE = "write it anew with its true rate, such as 'ffmpeg -r 30 -i VIDEO NEW.mp4'"


@dataclass(frozen=True)
class Frame:
    """One picture of a camera or video. ``time_s`` counts from the first one; ``count`` is the
    total, None where it is unknown.

    ``stamp_s`` is the time by the camera's or video's own clock, NaN where it states none;
    ``arrived_s`` by the host's monotonic clock, NaN for a video. ``rate_Hz`` is what a video says.
    """

    number: int
    time_s: float
    image: Any
    count: int | None
    stamp_s: float = math.nan
    arrived_s: float = math.nan
    rate_Hz: float = math.nan


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
        if not camera.takes(width, height):
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


def pick_frames(source: str, board: Board, folder: Path, most: int) -> Iterator[Path]:
    """Yield frames as PNG files in ``folder``, each with the board held still in a new place.

    ``source`` is a camera's number or a video file. Ends after ``most``, with the video, or by an
    interrupt from the keyboard; selected frames are kept. Raises DeviceError or InputError
    without any frame.
    """

    def new_place(frame: Frame, detection: Detection, kept: list[tuple[int, Detection]]) -> bool:
        far = NEW_SHARE * frame.image.shape[1]
        return all(_moved(detection, old) >= far for _, old in kept)

    yield from _picked(source, (board,), folder, most, new_place)


def pick_at_rest(source: str, boards: Sequence[Board], folder: Path, most: int) -> Iterator[Path]:
    """Yield frames as `pick_frames` does, of one of several boards that stays where it is."""

    def later(frame: Frame, _: Detection, kept: list[tuple[int, Detection]]) -> bool:
        return not kept or frame.number - kept[-1][0] >= APART_FRAMES

    yield from _picked(source, boards, folder, most, later)


def frames_of(source: str) -> Iterator[Frame]:
    """Read a camera (by its number) or a video file, picture by picture.

    Raises DeviceError where the camera gives none, InputError where the file is no video.
    """
    number = camera_number(source)
    if number is None and not Path(source).exists():
        raise InputError(f"{source} does not exist: give a video file, or a camera's number.")
    if number is None:
        refuse_unless_regular(Path(source), VIDEO)
    video = cv2.VideoCapture(source if number is None else number)
    try:
        good, image = video.read() if video.isOpened() else (False, None)
        if not good:
            if number is not None:
                raise DeviceError(
                    f"Camera {number} gives no picture: check that it is connected, that no other "
                    "program uses it, and its number."
                )
            raise InputError(f"{source} is not a readable video.")
        stated = float(video.get(cv2.CAP_PROP_FPS))
        rate = stated if _plausible(stated) else 30.0
        total = int(video.get(cv2.CAP_PROP_FRAME_COUNT))
        count = total if number is None and total > 0 else None
        began, index = time.monotonic(), 0
        while good:
            now, stamp = time.monotonic(), 1e-3 * float(video.get(cv2.CAP_PROP_POS_MSEC))
            if number is None:
                yield Frame(index, index / rate, image, count, stamp, rate_Hz=stated)
            else:
                camera_time = stamp if stamp > 0.0 else math.nan
                yield Frame(index, now - began, image, count, camera_time, now)
            index += 1
            good, image = video.read()
    finally:
        video.release()


def camera_number(source: str) -> int | None:
    """The number of a camera that a person named; None where it is the name of a file.

    >>> camera_number("0"), camera_number("\u00b2"), camera_number("plate.mp4")
    (0, None, None)
    """
    return int(source) if source.isdecimal() and len(source) <= LONGEST_CAMERA_NUMBER else None


def timed(frames: Iterable[Frame], source: str) -> Iterator[Frame]:
    """Pass on a video's pictures, whose times count: InputError where its frame rate is wrong.

    A rate is wrong where no camera has it, or where the pictures' own time stamps contradict it.
    """
    first = math.nan
    for frame in frames:
        if not math.isnan(frame.rate_Hz) and not _plausible(frame.rate_Hz):
            raise InputError(
                f"{source} states a frame rate of {frame.rate_Hz:g} per second, so the times of "
                f"its pictures are not known: {_ENCODE}."
            )
        if frame.number == 0:
            first = frame.stamp_s
        passed = frame.stamp_s - first
        if frame.number % RATE_EVERY == RATE_EVERY - 1 and passed > 0.0:
            measured_Hz = frame.number / passed
            if not 1.0 - RATE_SHARE < measured_Hz / frame.rate_Hz < 1.0 + RATE_SHARE:
                raise InputError(
                    f"{source} states a frame rate of {frame.rate_Hz:g} per second, and its time "
                    f"stamps have {measured_Hz:.3g}: {_ENCODE}."
                )
        yield frame


def _plausible(rate_Hz: float) -> bool:
    return LEAST_RATE_HZ <= rate_Hz <= MOST_RATE_HZ


def _picked(
    source: str,
    boards: Sequence[Board],
    folder: Path,
    most: int,
    wanted: Callable[[Frame, Detection, list[tuple[int, Detection]]], bool],
) -> Iterator[Path]:
    previous: Detection | None = None
    kept: list[tuple[int, Detection]] = []
    try:
        for frame in frames_of(source):
            name = f"frame-{frame.number:05d}.png"
            detection = look(frame.image, boards, name)
            still = _moved(detection, previous) < STILL_SHARE * frame.image.shape[1]
            previous = detection
            if detection is None or not still or not wanted(frame, detection, kept):
                continue
            kept.append((frame.number, detection))
            yield _stored(frame.image, folder / name)
            if len(kept) >= most:
                return
    except KeyboardInterrupt:
        return


def look(image: Any, boards: Sequence[Board], name: str) -> Detection | None:
    """Find the first of several boards that a picture shows, or None."""
    photo = Photo.from_array(image, name)
    try:
        return find_any_board(photo, boards, explain=False)
    except InputError:
        return None


def _moved(first: Detection | None, second: Detection | None) -> float:
    """Median distance in pixels between the corners that both show."""
    if first is None or second is None:
        return float("inf")
    _, here, there = np.intersect1d(first.ids, second.ids, return_indices=True)
    if len(here) < 4:
        return float("inf")
    apart = first.pixels[here] - second.pixels[there]
    return float(np.median(np.linalg.norm(apart, axis=1)))


def _stored(frame: Any, path: Path) -> Path:
    with replacing(path) as part:
        part.write_bytes(cv2.imencode(".png", frame)[1].tobytes())
    return path
