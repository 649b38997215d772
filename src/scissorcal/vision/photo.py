"""Read a photograph: upright, eight bits, limited in size.

Its bytes are decoded in the child process that `scissorcal.foreign` starts.
"""

import struct
import warnings
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scissorcal.aliases import Array
from scissorcal.errors import InputError
from scissorcal.foreign import parse_isolated, read_foreign
from scissorcal.foreign.formats import PHOTOGRAPH
from scissorcal.identity import bytes_digest

if TYPE_CHECKING:
    from PIL import Image


MOST_SIDE_PX = 65_535
"""Of width or height: what JPEG can state, and more than any camera has."""

_EXIF_ORIENTATION = 0x0112
_DEEP = ("I", "I;16", "I;16B", "I;16L", "I;16N")
_FORMATS = ("JPEG", "PNG", "TIFF", "BMP", "WEBP", "GIF")


Picture = NDArray[np.uint8]

MAX_PIXELS = 25_000_000
"""Default size limit; larger photographs are reduced by 2, 4 or 8."""


@dataclass(frozen=True)
class Photo:
    """A photograph in memory, upright as a person would look at it.

    ``image`` is (rows, columns) grey or (rows, columns, 3) blue-green-red, eight bits. ``width``
    and ``height`` are those of the whole photograph, turned upright; ``reduction`` says how many of
    its pixels make one of ``image`` along each side, ``origin`` where the corner of
    ``image`` lies in it. ``orientation`` is EXIF's, 1 to 8; 1 means
    upright. ``sha256`` is of the file's bytes, empty where there is no file.
    """

    image: Picture
    width: int
    height: int
    reduction: int
    origin: tuple[int, int]
    orientation: int
    sha256: str
    source: str

    @classmethod
    def from_array(cls, picture: ArrayLike, source: str = "The picture") -> "Photo":
        """A picture that is in memory already; ``source`` is its name in messages and results.

        ``picture`` is (rows, columns) grey or (rows, columns, 3) blue-green-red as OpenCV has it,
        eight bits, upright and not cropped: pixels count from the middle of the first one.
        Red-green-blue gives other greys where a thing has a colour. Raises InputError with the
        remedy where it is anything else.

        >>> import numpy as np
        >>> Photo.from_array(np.zeros((480, 640, 3), np.uint8)).width
        640
        >>> Photo.from_array(np.zeros((480, 640)))  # doctest: +ELLIPSIS
        Traceback (most recent call last):
        scissorcal.errors.InputError: The picture has pixels of type float64, not uint8: where ...
        """
        image = _checked(picture, source)
        height, width = image.shape[:2]
        return cls(image, width, height, 1, (0, 0), 1, "", source)

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
        rows, columns = self.image.shape[:2]
        if factor < 1 or rows % factor or columns % factor:
            raise ValueError(f"{columns} x {rows} pixels are no multiples of {factor}")
        coarse = _averaged(self.image, factor)
        return replace(self, image=coarse, reduction=self.reduction * factor)

    def whole(self, pixels: ArrayLike) -> Array:
        """Where pixels (n, 2) of ``image`` lie in the whole photograph; (0, 0) is a centre."""
        scaled = (np.asarray(pixels, dtype=np.float64) + 0.5) * self.reduction - 0.5
        return np.asarray(scaled + self.origin)

    def within(self, pixels: ArrayLike) -> Array:
        """Pixels (n, 2) of ``image`` from those of the whole photograph."""
        moved = np.asarray(pixels, dtype=np.float64) - self.origin
        return np.asarray((moved + 0.5) / self.reduction - 0.5)


def as_photo(picture: "Photo | ArrayLike") -> Photo:
    """The photograph itself, or that of an array; raises InputError as `Photo.from_array` does."""
    return picture if isinstance(picture, Photo) else Photo.from_array(picture)


_TO_EIGHT_BITS = {
    "f": "where white is 1, give np.rint(255 * np.clip(picture, 0, 1)).astype(np.uint8)",
    "b": "give 255 * picture.astype(np.uint8)",
    "u": "where all bits are used, give (picture >> 8).astype(np.uint8) of 16 bits",
    "i": "where white is 255, give picture.astype(np.uint8)",
}


def _checked(picture: Any, source: str) -> Picture:
    """The array as one that OpenCV takes. Raises InputError where it is no picture."""
    if isinstance(picture, str | Path):
        raise InputError(
            f"{source} is the name of a file, {picture}: read it with "
            "scissorcal.vision.read_photo, and give what that returns."
        )
    if picture is None:
        raise InputError(
            f"{source} is None, which cv2.imread returns for a file that it cannot read: check "
            "the path, or read it with scissorcal.vision.read_photo, which names the fault."
        )
    image = np.asarray(picture)
    if not image.size:
        raise InputError(
            f"{source} has the shape {image.shape}, and so no pixel: check what it was cut from."
        )
    if image.dtype != np.uint8:
        remedy = _TO_EIGHT_BITS.get(image.dtype.kind, "give an array of np.uint8")
        raise InputError(f"{source} has pixels of type {image.dtype}, not uint8: {remedy}.")
    if image.ndim != 2 and not (image.ndim == 3 and image.shape[2] == 3):
        raise InputError(
            f"{source} has the shape {image.shape}, not (rows, columns) or (rows, columns, 3): "
            f"{_reshaped(image.shape)}."
        )
    return np.ascontiguousarray(image)


def _reshaped(shape: tuple[int, ...]) -> str:
    """What to do with an array of another shape than a picture's."""
    if len(shape) == 3 and shape[2] == 4:
        return "leave the transparency out, picture[:, :, :3]"
    if len(shape) == 3 and shape[2] == 1:
        return "give picture[:, :, 0]"
    if len(shape) == 3 and shape[0] == 3:
        return "bring the channels last, np.moveaxis(picture, 0, 2)"
    if len(shape) == 4:
        return "give the pictures one by one"
    return "give one picture"


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
    facts = parse_isolated(f"{__name__}:decode", data, path, PHOTOGRAPH, **options)
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
    size = parse_isolated(f"{__name__}:_decode_size", data, path, PHOTOGRAPH, path=str(path))
    return size[0], size[1]


PictureShape = tuple[int, int, int]
"""Width and height in pixels, and the EXIF orientation that was applied."""


def same_shape(photo: Photo, shape: PictureShape | None) -> PictureShape:
    """The shape of a photograph. Raises InputError where it is not ``shape``.

    A photograph of another size or orientation would be one of another camera to the fit.
    """
    taken = (photo.width, photo.height, photo.orientation)
    if shape is None or taken == shape:
        return taken
    if taken[:2] != shape[:2]:
        raise InputError(
            f"{photo.source} has {taken[0]} x {taken[1]} pixels, the photographs before it "
            f"{shape[0]} x {shape[1]}: a fit takes one size, without zoom."
        )
    raise InputError(
        f"{photo.source} has the EXIF orientation {taken[2]}, the photographs before it "
        f"{shape[2]}: hold the camera the same way for all."
    )


def decode(data: bytes, path: str, max_pixels: int, colour: bool) -> dict[str, Any]:
    """The facts of a `scissorcal.vision.photo.Photo`; see `scissorcal.vision.photo.read_photo`."""
    with _opened(data, path) as opened:
        return _photo(path, opened, max_pixels, colour)


def _decode_size(data: bytes, path: str) -> list[int]:
    """Width and height in pixels, as the header states them."""
    with _opened(data, path) as opened:
        return list(opened.size)


@contextmanager
def _opened(data: bytes, path: str) -> "Iterator[Image.Image]":
    """The picture, not decoded yet; what its decoder raises becomes an InputError."""
    from PIL import Image, UnidentifiedImageError

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        warnings.simplefilter("error", Image.DecompressionBombWarning)
        try:
            with Image.open(BytesIO(data), formats=_FORMATS) as opened:
                if max(opened.size) > MOST_SIDE_PX:
                    raise InputError(_too_long(path, opened.size))  # noqa: TRY301
                if opened.format == "PNG":
                    _check_png(data)
                yield opened
        except (InputError, MemoryError):
            raise
        except (Image.DecompressionBombWarning, Image.DecompressionBombError):
            limit = (Image.MAX_IMAGE_PIXELS or 0) // 1_000_000
            raise InputError(
                f"{path} has more than {limit} million pixels: save it at a smaller size."
            ) from None
        except UnidentifiedImageError:
            raise InputError(_not_a_picture(path)) from None
        except Exception as error:  # noqa: BLE001 - whatever a decoder raises is a fact of the file
            raise InputError(
                f"{path} is damaged or truncated ({error}). {PHOTOGRAPH.remedy}"
            ) from None


def _check_png(data: bytes) -> None:
    """ValueError where a checksum of a picture's own chunks is wrong; Pillow shows such pixels."""
    at = 8
    while at + 12 <= len(data):
        (length,) = struct.unpack_from(">I", data, at)
        name, end = data[at + 4 : at + 8], at + 8 + length
        is_needed = name[:1].isupper()  # what only adds to a picture begins with a small letter
        if is_needed and zlib.crc32(data[at + 4 : end]) != int.from_bytes(
            data[end : end + 4], "big"
        ):
            raise ValueError(f"the checksum of the part at byte {at} does not match")
        if name == b"IEND":
            return
        at = end + 4


def _too_long(path: str, size: tuple[int, int]) -> str:
    return (
        f"{path} states {size[0]} x {size[1]} pixels, and no side has more than {MOST_SIDE_PX}: it "
        f"is damaged. {PHOTOGRAPH.remedy}"
    )


def _photo(path: str, opened: "Image.Image", max_pixels: int, colour: bool) -> dict[str, Any]:
    width, height = opened.size
    orientation = _orientation(opened)
    reduction = _reduction(width, height, max_pixels)
    if opened.mode == "F":
        raise InputError(
            f"{path} has floating-point pixels of unknown white level: save it as an 8- or 16-bit "
            "picture."
        )
    left = reduction
    if opened.format in ("JPEG", "MPO"):
        mode = "L" if not colour and opened.mode in ("RGB", "L") else None
        opened.draft(mode, (-(-width // reduction), -(-height // reduction)))
        left = reduction // round(width / opened.size[0])
    image = _eight_bits(opened, colour, left)
    spare = (width - image.shape[1] * reduction, height - image.shape[0] * reduction)
    image = _upright(image, orientation)
    origin = _origin(spare, orientation)
    if orientation >= 5:
        width, height = height, width
    return {
        "image": image,
        "width": width,
        "height": height,
        "reduction": reduction,
        "across": origin[0],
        "down": origin[1],
        "orientation": orientation,
    }


def _eight_bits(opened: "Image.Image", colour: bool, reduction: int) -> Picture:
    """Decode to grey or blue-green-red, averaging blocks of ``reduction`` by as many pixels."""
    from PIL import Image

    if opened.mode in _DEEP:
        return _averaged(_from_deep(np.asarray(opened)), reduction)
    if opened.mode in ("1", "P", "PA", "LA", "La", "RGBa") or "transparency" in opened.info:
        opened = opened.convert("L" if opened.mode == "1" else "RGBA")
    if reduction > 1:
        opened = opened.reduce(reduction)
    if opened.mode == "RGBA":
        paper = Image.new("RGBA", opened.size, "white")
        opened = Image.alpha_composite(paper, opened).convert("RGB")
    if opened.mode == "L" or not colour:
        return np.array(opened.convert("L"), dtype=np.uint8)
    return np.ascontiguousarray(np.asarray(opened.convert("RGB"), dtype=np.uint8)[:, :, ::-1])


def _from_deep(deep: NDArray[Any]) -> Picture:
    """Take the upper eight bits of those in use: 10-, 12- and 14-bit sensors fill 16 in part."""
    values = np.maximum(deep, 0)
    bits = max(8, int(values.max()).bit_length())
    return np.asarray(values >> (bits - 8), dtype=np.uint8)


def _averaged(image: Picture, factor: int) -> Picture:
    """Average blocks of ``factor`` by ``factor`` pixels; an incomplete last block is dropped."""
    import cv2

    if factor == 1:
        return image
    rows, columns = image.shape[0] // factor, image.shape[1] // factor
    whole = image[: rows * factor, : columns * factor]
    return np.asarray(
        cv2.resize(whole, (columns, rows), interpolation=cv2.INTER_AREA), dtype=np.uint8
    )


def _upright(image: Picture, orientation: int) -> Picture:
    """Rotate and mirror by EXIF's orientation (1 to 8)."""
    if orientation in (2, 4, 5, 7):
        image = image[:, ::-1]
    turns = {3: 2, 4: 2, 5: 1, 6: 3, 7: 3, 8: 1}.get(orientation, 0)
    return np.ascontiguousarray(np.rot90(image, turns))


def _origin(spare: tuple[int, int], orientation: int) -> tuple[int, int]:
    """Place of the reduced picture's corner in the whole one, both upright.

    A reduced picture lacks (or exceeds) the whole one by ``spare`` pixels at its right and lower
    end, which the turn may bring to the left or to the top.
    """
    across = {2: spare[0], 3: spare[0], 6: spare[1], 7: spare[1]}.get(orientation, 0)
    down = {3: spare[1], 4: spare[1], 7: spare[0], 8: spare[0]}.get(orientation, 0)
    return across, down


def _orientation(opened: "Image.Image") -> int:
    try:
        stated = opened.getexif().get(_EXIF_ORIENTATION, 1)
    except (ValueError, KeyError, TypeError, OSError, SyntaxError, struct.error):
        return 1
    return stated if isinstance(stated, int) and 1 <= stated <= 8 else 1


def _reduction(width: int, height: int, max_pixels: int) -> int:
    for factor in (1, 2, 4):
        if width * height <= max_pixels * factor**2:
            return factor
    return 8


def _not_a_picture(path: str) -> str:
    if Path(path).suffix.lower() in (".heic", ".heif"):
        return f"{path} is an HEIF photograph: set the camera to JPEG, or save it as JPEG or PNG."
    return f"{path} is not a readable photograph: give a JPEG, PNG, TIFF, BMP or WebP file."
