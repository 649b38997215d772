"""Photographs in every shape are read right, or refused with a sentence."""

import io
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pytest
from PIL import Image

from scissorcal.errors import InputError
from scissorcal.vision.photo import Photo, read_photo

WIDTH, HEIGHT = 211, 147
SPOT = (150.0, 40.0)

UPRIGHT = {
    1: lambda a: a,
    2: np.fliplr,
    3: lambda a: np.rot90(a, 2),
    4: np.flipud,
    5: lambda a: np.swapaxes(a, 0, 1),
    6: lambda a: np.rot90(a, -1),
    7: lambda a: np.rot90(np.swapaxes(a, 0, 1), 2),
    8: lambda a: np.rot90(a, 1),
}


def spotted() -> np.ndarray:
    """Draw a soft bright spot on a slope of grey."""
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    spot = 150.0 * np.exp(-((x - SPOT[0]) ** 2 + (y - SPOT[1]) ** 2) / (2.0 * 9.0**2))
    return (20.0 + 0.2 * x + spot).astype(np.uint8)


def centre(image: np.ndarray) -> np.ndarray:
    """Find the spot's middle by its brightest part."""
    weight = np.clip(image.astype(float) - 110.0, 0.0, None)
    y, x = np.mgrid[0 : image.shape[0], 0 : image.shape[1]]
    return np.array([(weight * x).sum(), (weight * y).sum()]) / weight.sum()


def saved(path: Path, image: Image.Image, **options: object) -> Path:
    image.save(path, **options)
    return path


def with_orientation(path: Path, image: np.ndarray, orientation: int, kind: str) -> Path:
    exif = Image.Exif()
    exif[0x0112] = orientation
    options = {"quality": 95} if kind == "jpg" else {}
    return saved(path / f"o{orientation}.{kind}", Image.fromarray(image), exif=exif, **options)


@pytest.mark.parametrize("orientation", range(1, 9))
def test_exif_orientation_is_applied(tmp_path: Path, orientation: int) -> None:
    image = spotted()
    read = read_photo(with_orientation(tmp_path, image, orientation, "png"))
    expected = UPRIGHT[orientation](image)
    assert np.array_equal(read.image, expected)
    assert (read.height, read.width) == expected.shape
    assert read.orientation == orientation


@pytest.mark.parametrize("kind", ["jpg", "png"])
@pytest.mark.parametrize("orientation", range(1, 9))
def test_a_reduced_photograph_maps_to_original_pixels(
    tmp_path: Path, orientation: int, kind: str
) -> None:
    image = spotted()
    path = with_orientation(tmp_path, image, orientation, kind)
    whole = read_photo(path, colour=False)
    small = read_photo(path, max_pixels=WIDTH * HEIGHT // 3, colour=False)
    assert small.reduction == 2
    assert small.image.size <= WIDTH * HEIGHT // 3
    assert (small.width, small.height) == (whole.width, whole.height)
    assert small.whole(centre(small.grey)) == pytest.approx(centre(whole.grey), abs=0.25)


def test_a_small_photograph_is_not_reduced_and_pixels_keep_their_place(tmp_path: Path) -> None:
    read = read_photo(saved(tmp_path / "a.png", Image.fromarray(spotted())))
    assert read.reduction == 1
    assert read.whole([[3.0, 4.0]]) == pytest.approx(np.array([[3.0, 4.0]]))


def test_colours_come_blue_first(tmp_path: Path) -> None:
    path = saved(tmp_path / "red.png", Image.new("RGB", (30, 20), (200, 10, 30)))
    assert read_photo(path).image[5, 5].tolist() == [30, 10, 200]


def modes() -> dict[str, Image.Image]:
    grey = Image.fromarray(spotted())
    clear = Image.new("L", grey.size, 255)
    deep = Image.fromarray(spotted().astype(np.uint16) << 4)
    return {
        "grey.png": grey,
        "colour.png": grey.convert("RGB"),
        "colour.bmp": grey.convert("RGB"),
        "colour.webp": grey.convert("RGB"),
        "alpha.png": Image.merge("LA", (grey, clear)),
        "rgba.png": Image.merge("RGBA", (grey, grey, grey, clear)),
        "palette.png": grey.convert("RGB").quantize(200),
        "palette.gif": grey.convert("RGB").quantize(200),
        "cmyk.jpg": grey.convert("RGB").convert("CMYK"),
        "cmyk.tif": grey.convert("RGB").convert("CMYK"),
        "twelve-bits.png": deep,
        "sixteen-bits.tif": Image.fromarray(spotted().astype(np.uint16) << 8),
        "progressive.jpg": grey.convert("RGB"),
    }


@pytest.mark.parametrize("name", sorted(modes()))
@pytest.mark.parametrize("colour", [True, False])
@pytest.mark.parametrize("reduced", [False, True])
def test_all_image_formats_give_the_same_picture(
    tmp_path: Path, name: str, colour: bool, reduced: bool
) -> None:
    options = {"quality": 97} if name.endswith((".jpg", ".webp")) else {}
    if name == "progressive.jpg":
        options["progressive"] = True
    path = saved(tmp_path / name, modes()[name], **options)
    most = WIDTH * HEIGHT // 3 if reduced else WIDTH * HEIGHT
    read = read_photo(path, max_pixels=most, colour=colour)
    assert read.image.dtype == np.uint8
    assert read.image.ndim == 2 or colour
    shown = cv2.resize(spotted(), read.grey.shape[::-1], interpolation=cv2.INTER_AREA)
    assert np.abs(read.grey.astype(int) - shown.astype(int)).mean() < (
        6 if "palette" in name else 4
    )


def test_transparency_is_composited_on_white(tmp_path: Path) -> None:
    path = saved(tmp_path / "clear.png", Image.new("RGBA", (20, 20), (0, 0, 0, 0)))
    assert read_photo(path).image.min() == 255


def test_one_bit_pictures_are_black_and_white(tmp_path: Path) -> None:
    path = saved(tmp_path / "bits.png", Image.fromarray(spotted()).convert("1"))
    assert set(np.unique(read_photo(path).image)) == {0, 255}


def refused(path: Path) -> str:
    with pytest.raises(InputError) as caught:
        read_photo(path)
    assert str(path) in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize("kind", ["JPEG", "PNG", "TIFF"])
@pytest.mark.parametrize("share", [0.3, 0.9])
def test_a_truncated_file_is_refused(tmp_path: Path, kind: str, share: float) -> None:
    stream = io.BytesIO()
    Image.fromarray(np.random.default_rng(0).integers(0, 255, (200, 300), np.uint8)).save(
        stream, format=kind
    )
    path = tmp_path / f"cut.{kind.lower()}"
    path.write_bytes(stream.getvalue()[: int(share * len(stream.getvalue()))])
    assert "Copy it from the camera again" in refused(path) or "give a JPEG" in refused(path)


def test_a_file_that_is_no_image_is_refused(tmp_path: Path) -> None:
    for name, content, words in (
        ("notes.txt", b"a list of things", "is text, not a photograph"),
        ("empty.jpg", b"", "is empty"),
        ("phone.heic", b"\0\0\0\x18ftypheic" + bytes(40), "HEIF"),
    ):
        (tmp_path / name).write_bytes(content)
        assert words in refused(tmp_path / name)
    assert "does not exist" in refused(tmp_path / "none.jpg")
    assert "cannot be read" in refused(tmp_path)
    image = Image.fromarray(np.linspace(0, 1, 400, dtype=np.float32).reshape(20, 20))
    assert "floating-point" in refused(saved(tmp_path / "float.tif", image))


def test_a_picture_with_a_huge_header_size_is_refused(tmp_path: Path) -> None:
    path = saved(tmp_path / "bomb.png", Image.new("1", (12_000, 9_000)))
    assert "million pixels" in refused(path)


def test_fifty_megapixels_take_little_memory(tmp_path: Path) -> None:
    path = saved(tmp_path / "big.jpg", Image.new("RGB", (8192, 6144), (90, 120, 150)))
    program = (
        "import resource, sys\n"
        "from pathlib import Path\n"
        "from scissorcal.vision.photo import read_photo\n"
        "from scissorcal.foreign.isolated import close_children\n"
        "peak = lambda who: resource.getrusage(who).ru_maxrss / 1024\n"
        "import numpy, cv2\n"
        "before = peak(resource.RUSAGE_SELF)\n"
        "photo = read_photo(Path(sys.argv[1]))\n"
        "assert (photo.width, photo.height, photo.reduction) == (8192, 6144, 2), photo.reduction\n"
        "close_children()\n"
        "print(max(map(peak, (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))) - before)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", program, str(path)], capture_output=True, text=True, check=True
    )
    whole = 3 * 8192 * 6144 / 2**20
    assert float(done.stdout) < 1.2 * whole


def test_the_hash_is_of_the_files_bytes(tmp_path: Path) -> None:
    import hashlib

    path = saved(tmp_path / "a.png", Image.fromarray(spotted()))
    read: Photo = read_photo(path)
    assert read.sha256 == hashlib.sha256(path.read_bytes()).hexdigest()
    assert read.source == "a.png"
