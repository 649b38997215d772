"""Photographs on the page: made small, carried within it, and dropped where they would be much."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, zip_longest
from pathlib import Path

WIDEST_PX = 900
QUALITY = 70
PAGE_BYTES = 4_800_000
"""What the whole page may take, pictures in it included."""
PICTURE_BYTES = 2_400_000
"""What pictures may take of it."""


@dataclass(frozen=True)
class PictureFile:
    """A picture that a fit left on disk: its title, its caption, and in words what it shows.

    It is made no wider than ``widest`` pixels.
    """

    path: Path
    title: str
    caption: str
    alt: str
    widest: int = WIDEST_PX


@dataclass(frozen=True)
class Picture:
    """A picture for the page: ``data`` is a data URI of a JPEG, or of nothing where it was dropped,
    which ``caption`` then says."""

    data: str
    width: int
    height: int
    title: str
    caption: str
    alt: str


def place_pictures(
    files: Mapping[str, Sequence[PictureFile]], room: int
) -> dict[str, tuple[Picture, ...]]:
    """Make the pictures of each fit ready for the page, as many as ``room`` bytes hold.

    The first of every fit come before the second of any, so that each fit shows something. What
    does not fit in is still there, with its file's name in its place.
    """
    placed: dict[Path, Picture] = {}
    taken = 0
    for file in chain.from_iterable(zip_longest(*files.values())):
        if file is None:
            continue
        picture = _read(file)
        if picture.data and taken + len(picture.data) > room:
            picture = _without(file, "left out to keep this page small")
        taken += len(picture.data)
        placed[file.path] = picture
    return {what: tuple(placed[file.path] for file in own) for what, own in files.items()}


def _read(file: PictureFile) -> Picture:
    """The picture as a small JPEG; one that cannot be read says so."""
    import cv2
    import numpy as np

    try:
        raw = np.frombuffer(file.path.read_bytes(), dtype=np.uint8)
    except OSError:
        raw = np.empty(0, dtype=np.uint8)
    image = cv2.imdecode(raw, cv2.IMREAD_COLOR) if len(raw) else None
    if image is None:
        return _without(file, "not there any more, or damaged")
    height, width = image.shape[:2]
    if width > file.widest:
        size = (file.widest, max(round(height * file.widest / width), 1))
        image = cv2.resize(image, size, interpolation=cv2.INTER_AREA)
    height, width = image.shape[:2]
    # colours at full resolution: what is drawn is one pixel wide
    full = (cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444)
    done, jpeg = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, QUALITY, *full])
    if not done:
        return _without(file, "not there any more, or damaged")
    data = "data:image/jpeg;base64," + base64.b64encode(jpeg.tobytes()).decode("ascii")
    return Picture(data, width, height, file.title, file.caption, file.alt)


def _without(file: PictureFile, why: str) -> Picture:
    return Picture("", 0, 0, file.title, f"{file.path.name} is {why}.", file.alt)
