"""Photographs picked from a running camera or a video: a board held still, in a new place."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.errors import DeviceError, InputError
from scissorcal.vision.boards import Board
from scissorcal.vision.detect import Detection, find_board
from scissorcal.vision.photo import Photo

Array = NDArray[np.float64]

STILL_SHARE = 0.002
NEW_SHARE = 0.05
"""Shares of the picture's width: a board held still moves less from frame to frame than the first,
one in a new place has moved farther than the second from where it was in every picture kept."""


def pick_frames(source: str, board: Board, folder: Path, most: int) -> Iterator[Path]:
    """Yield frames as PNG files in ``folder``, until there are ``most`` or the video ends.

    ``source`` is a camera's number or a video file. Interrupting from the keyboard ends the
    picking, and what was picked counts. Raises DeviceError or InputError where nothing comes.
    """
    previous: Detection | None = None
    kept: list[Detection] = []
    try:
        for number, frame in enumerate(_frames(source)):
            seen = _look(frame, board, f"frame-{number:05d}.png")
            still = _moved(seen, previous) < STILL_SHARE * frame.shape[1]
            previous = seen
            if seen is None or not still:
                continue
            if any(_moved(seen, old) < NEW_SHARE * frame.shape[1] for old in kept):
                continue
            kept.append(seen)
            yield _stored(frame, folder / f"frame-{number:05d}.png")
            if len(kept) >= most:
                return
    except KeyboardInterrupt:
        return


def _frames(source: str) -> Iterator[Any]:
    import cv2

    number = int(source) if source.isdigit() else None
    video = cv2.VideoCapture(source if number is None else number)
    try:
        good, frame = video.read() if video.isOpened() else (False, None)
        if not good:
            if number is not None:
                raise DeviceError(
                    f"Camera {number} gives no picture: see that it is plugged in, that no other "
                    "program uses it, and which number it has."
                )
            raise InputError(f"{source} is no video that can be read.")
        while good:
            yield frame
            good, frame = video.read()
    finally:
        video.release()


def _look(frame: Any, board: Board, name: str) -> Detection | None:
    height, width = frame.shape[:2]
    photo = Photo(frame, width, height, 1, (0, 0), 1, "", name)
    try:
        return find_board(photo, board, explain=False)
    except InputError:
        return None


def _moved(one: Detection | None, other: Detection | None) -> float:
    """Middle distance in pixels by which the corners that both show are apart."""
    if one is None or other is None:
        return float("inf")
    _, here, there = np.intersect1d(one.ids, other.ids, return_indices=True)
    if len(here) < 4:
        return float("inf")
    apart = one.pixels[here] - other.pixels[there]
    return float(np.median(np.linalg.norm(apart, axis=1)))


def _stored(frame: Any, path: Path) -> Path:
    import cv2

    path.write_bytes(cv2.imencode(".png", frame)[1].tobytes())
    return path
