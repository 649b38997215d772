"""Read a photograph: upright, eight bits, limited in size."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scissorcal.aliases import Array
from scissorcal.errors import InputError
from scissorcal.foreign import parse_isolated, read_foreign
from scissorcal.foreign.formats import PHOTOGRAPH
from scissorcal.identity import bytes_digest

Picture = NDArray[np.uint8]

MAX_PIXELS = 25_000_000
"""Default size limit; larger photographs are reduced by 2, 4 or 8."""

_DECODER = "scissorcal.vision.photo_decoding"


@dataclass(frozen=True)
class Photo:
    """A photograph in memory, upright as a person would look at it.

    ``image`` is (rows, columns) grey or (rows, columns, 3) blue-green-red, eight bits. ``width``
    and ``height`` are those of the whole photograph, turned upright; ``reduction`` says how many of
    its pixels make one of ``image`` along each side, ``origin`` where the corner of
    ``image`` lies in it. ``orientation`` is EXIF's, 1 to 8; 1 means
    upright. ``sha256`` is of the file's bytes.
    """

    image: Picture
    width: int
    height: int
    reduction: int
    origin: tuple[int, int]
    orientation: int
    sha256: str
    source: str

    @property
    def grey(self) -> Picture:
        """The picture in grey, (rows, columns)."""
        import cv2

        if self.image.ndim == 2:
            return self.image
        return np.asarray(cv2.cvtColor(self.image, cv2.COLOR_BGR2GRAY), dtype=np.uint8)

    def reduced(self, factor: int) -> "Photo":
        """The same photograph read more coarsely: ``factor`` by ``factor`` pixels make one.

        Raises ValueError unless ``factor`` divides both sides, as the rest would be cut off.
        """
        from scissorcal.vision.photo_decoding import averaged

        rows, columns = self.image.shape[:2]
        if factor < 1 or rows % factor or columns % factor:
            raise ValueError(f"{columns} x {rows} pixels are no multiples of {factor}")
        image = averaged(self.image, factor)
        return replace(self, image=image, reduction=self.reduction * factor)

    def whole(self, pixels: ArrayLike) -> Array:
        """Where pixels (n, 2) of ``image`` lie in the whole photograph; (0, 0) is a centre."""
        scaled = (np.asarray(pixels, dtype=np.float64) + 0.5) * self.reduction - 0.5
        return np.asarray(scaled + self.origin)

    def within(self, pixels: ArrayLike) -> Array:
        """Pixels (n, 2) of ``image`` from those of the whole photograph."""
        moved = np.asarray(pixels, dtype=np.float64) - self.origin
        return np.asarray((moved + 0.5) / self.reduction - 0.5)


def read_photo(path: Path, *, max_pixels: int = MAX_PIXELS, colour: bool = True) -> Photo:
    """Read a JPEG, PNG, TIFF, BMP or WebP file.

    Turns it as its EXIF data say, brings 16-bit, CMYK and palette pictures to eight bits of grey or
    colour, and lays transparent ones on white. A photograph of more than ``max_pixels`` is read at
    1/2, 1/4 or 1/8 (a JPEG without ever being held whole). ``colour=False`` gives grey, in less
    time and memory. It is decoded in a child process. Raises InputError naming the file and what to
    do where it cannot be read.
    """
    data = read_foreign(path, PHOTOGRAPH)
    options = {"path": str(path), "max_pixels": max_pixels, "colour": colour}
    facts = parse_isolated(f"{_DECODER}:decode", data, path, PHOTOGRAPH, **options)
    return Photo(
        facts["image"],
        facts["width"],
        facts["height"],
        facts["reduction"],
        (facts["across"], facts["down"]),
        facts["orientation"],
        bytes_digest(data),
        path.name,
    )


def picture_size(path: Path) -> tuple[int, int]:
    """Width and height in pixels by the header alone; raises InputError as `read_photo` does."""
    data = read_foreign(path, PHOTOGRAPH)
    found = parse_isolated(f"{_DECODER}:decode_size", data, path, PHOTOGRAPH, path=str(path))
    return found[0], found[1]


PictureShape = tuple[int, int, int]
"""Width and height in pixels, and the EXIF orientation that was applied."""


def same_shape(photo: Photo, shape: PictureShape | None) -> PictureShape:
    """The shape of a photograph. Raises InputError where it is not ``shape``.

    A photograph of another size or orientation would be one of another camera to the fit.
    """
    own = (photo.width, photo.height, photo.orientation)
    if shape is None or own == shape:
        return own
    if own[:2] != shape[:2]:
        raise InputError(
            f"{photo.source} has {own[0]} x {own[1]} pixels, the photographs before it "
            f"{shape[0]} x {shape[1]}: a fit takes one size, without zoom."
        )
    raise InputError(
        f"{photo.source} has the EXIF orientation {own[2]}, the photographs before it "
        f"{shape[2]}: hold the camera the same way for all."
    )
