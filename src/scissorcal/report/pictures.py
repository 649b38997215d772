"""Photographs on the page: made small, carried within it, left out where they would be too much."""

from __future__ import annotations

import base64
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, zip_longest
from pathlib import Path

from scissorcal.errors import InputError

QUALITY = 70
PAGE_BYTES = 4_800_000
"""What the whole page may take, pictures in it included."""
PICTURE_BYTES = 2_400_000
"""What pictures may take of it."""


@dataclass(frozen=True)
class Image:
    """A picture for the page: a data URI of a JPEG, or empty with the reason in ``missing``."""

    data: str
    width: int
    height: int
    missing: str = ""


def place_pictures(
    files: Mapping[str, Sequence[tuple[Path, int]]], room: int
) -> dict[str, tuple[Image, ...]]:
    """Make the pictures of each part ready for the page, as many as ``room`` bytes hold.

    ``files`` has the path of each picture, and how many pixels wide it may be. The first of every
    part come before the second of any, so that each part shows something.
    """
    placed: dict[tuple[Path, int], Image] = {}
    taken = 0
    for file in chain.from_iterable(zip_longest(*files.values())):
        if file is None:
            continue
        path, widest_px = file
        image = _read(path, widest_px)
        if image.data and taken + len(image.data) > room:
            image = _without(path, "left out to keep this page small")
        taken += len(image.data)
        placed[file] = image
    return {what: tuple(placed[file] for file in part) for what, part in files.items()}


def _read(path: Path, widest_px: int) -> Image:
    """The picture as a small JPEG; with the reason where it cannot be read."""
    import cv2

    from scissorcal.vision.photo import read_photo

    try:
        image = read_photo(path).image
    except InputError:
        return _without(path, "not there any more, or damaged")
    height, width = image.shape[:2]
    if width > widest_px:
        size = (widest_px, max(round(height * widest_px / width), 1))
        image = cv2.resize(image, size, interpolation=cv2.INTER_AREA)  # type: ignore[assignment]
    height, width = image.shape[:2]
    # colours at full resolution: what is drawn is one pixel wide
    full = (cv2.IMWRITE_JPEG_SAMPLING_FACTOR, cv2.IMWRITE_JPEG_SAMPLING_FACTOR_444)
    done, jpeg = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, QUALITY, *full])
    if not done:
        return _without(path, "not there any more, or damaged")
    data = "data:image/jpeg;base64," + base64.b64encode(jpeg.tobytes()).decode("ascii")
    return Image(data, width, height)


def _without(path: Path, why: str) -> Image:
    return Image("", 0, 0, f"{path.name} is {why}.")
