"""What a file is, by its first and last bytes, whatever its name is."""

import os
import re
from codecs import getincrementaldecoder
from collections.abc import Callable, Sequence
from io import BytesIO
from typing import IO, NamedTuple

from scissorcal.errors import OtherKindError

HEAD_BYTES, TAIL_BYTES = 4096, 128
SHORTEST_TEXT = 16
"""Bytes from which printable ones are text: magic numbers, which may be printable, have 8."""
FIT_SEAL = b"\nscissorcal sha256 "
"""What the last line of a stored fit begins with."""
UNKNOWN = "a file of an unknown kind"
OF_SCISSORCAL = b"scissorcal"
"""Stands in every stored result and package several times."""
_LARGEST_FIT = 500_000_000


class FileKind(NamedTuple):
    """A kind of file: the word by which a format accepts it, and its name with an article.

    ``use`` is a sentence on what to do with it where another file was needed.
    """

    key: str
    name: str
    use: str = ""


_NAMED = "'scissorcal import' makes a recording of it, where its name ends in {}."
_UNPACK = "Unpack it, and name what was in it."
_OFFICE = "'scissorcal import' reads its table where it is saved as CSV in UTF-8."

_MAGIC: tuple[tuple[bytes, FileKind], ...] = (
    (b"\x89MCAP0\r\n", FileKind("recording", "a recording (MCAP)")),
    (b"\x89PNG\r\n\x1a\n", FileKind("image", "a PNG image")),
    (b"\xff\xd8\xff", FileKind("image", "a JPEG image")),
    (b"II*\0", FileKind("image", "a TIFF image")),
    (b"MM\0*", FileKind("image", "a TIFF image")),
    (b"GIF87a", FileKind("image", "a GIF image")),
    (b"GIF89a", FileKind("image", "a GIF image")),
    (b"\x1aE\xdf\xa3", FileKind("video", "a video (Matroska or WebM)")),
    (b"%PDF-", FileKind("pdf", "a PDF document")),
    (b"\x1f\x8b\x08", FileKind("gzip", "a file packed by gzip", _UNPACK)),
    (b"BZh", FileKind("packed", "a file packed by bzip2", _UNPACK)),
    (b"\xfd7zXZ\0", FileKind("packed", "a file packed by xz", _UNPACK)),
    (b"\x28\xb5\x2f\xfd", FileKind("packed", "a file packed by zstd", _UNPACK)),
    (b"7z\xbc\xaf\x27\x1c", FileKind("packed", "a 7z archive", _UNPACK)),
    (b"Rar!\x1a\x07", FileKind("packed", "a RAR archive", _UNPACK)),
    (b"CDF\x01", FileKind("netcdf3", "a netCDF file of another program (netCDF 3)")),
    (b"CDF\x02", FileKind("netcdf3", "a netCDF file of another program (netCDF 3)")),
    (b"CDF\x05", FileKind("netcdf3", "a netCDF file of another program (netCDF 3)")),
    (b"SQLite format 3\0", FileKind("sqlite", "a SQLite database (such as a ROS 2 bag)")),
    (b"#ROSBAG V", FileKind("bag", "a ROS bag")),
    (b"\x93NUMPY", FileKind("npy", "a NumPy array (.npy)")),
    (b"-----BEGIN ", FileKind("key", "a key or certificate")),
    (b"%YAML", FileKind("yaml", "a YAML file of OpenCV")),
    (b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1", FileKind("office", "an older Office document", _OFFICE)),
)
"""Bytes at the beginning that no text, and no other of these formats, begins with."""

_OWN = {
    "capture-design": "the design of a capture",
    "comparison": "a comparison's data",
    "extremes": "a result of 'scissorcal bench extremes'",
    "package": "a package's manifest without its package",
    "photographs": "an index of photographs (capture.json)",
    "probe": "a probe of a rig",
    "recipe": "a recipe",
    "report": "a report's data (report.json)",
    "signature": "a signature under a report",
    "specimen": "a specimen of the virtual rig",
    "track": "a track of lines",
    "trade": "a result of 'scissorcal bench trade'",
    "verify": "a verification of a fit",
}
"""Names of what scissorcal writes as text, by the word that each begins with."""
_OWN_FORMAT = re.compile(
    rb'(?:^|[{,\n])\s*"?format"?\s*[=:]\s*"scissorcal-([a-z-]+)/\d', re.MULTILINE
)


def kind_of(file: IO[bytes]) -> FileKind | None:
    """The kind of an open file; None for what is not known. It is left at its start.

    >>> from io import BytesIO
    >>> kind_of(BytesIO(b"%PDF-1.7")).name, kind_of(BytesIO(b"time_s,angle_rad,torque_Nm")).name
    ('a PDF document', 'text')
    """
    file.seek(0)
    head = file.read(HEAD_BYTES)
    size = file.seek(0, os.SEEK_END)
    file.seek(max(0, size - TAIL_BYTES))
    tail = file.read(TAIL_BYTES)
    file.seek(0)
    known = next((kind for start, kind in _MAGIC if head.startswith(start)), None)
    return known or next((kind for look in _LOOKS if (kind := look(head, tail))), None)


def refuse_other_kind(file: IO[bytes], path: object, name: str, holds: Sequence[str]) -> None:
    """Raise OtherKindError where an open file is of a known kind that is not in ``holds``.

    ``name`` is what is needed, with an article.
    """
    kind = None if "*" in holds else kind_of(file)
    if kind is not None and kind.key not in holds:
        what = _fit_in(file) if kind.key == "fit" else kind.name
        raise OtherKindError(path, what, name, kind.use)


def is_unknown(content: bytes) -> bool:
    """Whether nothing in a file's bytes is of a known kind, or of scissorcal.

    A damaged file of scissorcal has its name in several places; one of a few bytes says nothing.
    """
    if len(content) < SHORTEST_TEXT or OF_SCISSORCAL in content:
        return False
    return kind_of(BytesIO(content)) is None


def fit_name(what: str) -> str:
    """The name of a fit by the quantity that it is of.

    >>> fit_name("cut"), fit_name("friction-advance")
    ('a cut fit', 'a fit of friction along the advance')
    """
    if what == "friction-advance":
        return "a fit of friction along the advance"
    return f"a {what} fit" if what else "a fit"


def _fit_in(file: IO[bytes]) -> str:
    """The name of a stored fit, by the text that its header is."""
    match = re.search(rb'\{"what": "([a-z-]{1,40})"', file.read(_LARGEST_FIT))
    return fit_name(match[1].decode() if match else "")


def _hdf5(head: bytes, tail: bytes) -> FileKind | None:
    signature = b"\x89HDF\r\n\x1a\n"
    if head.startswith((b"MATLAB 5.0 MAT-file", b"MATLAB 7.3 MAT-file")):
        return FileKind("matlab", "a MATLAB file", _NAMED.format(".mat"))
    if not head.startswith(signature):
        return None
    if FIT_SEAL not in tail:  # of another program, or a fit that was cut off
        return FileKind("hdf5", "an HDF5 file (such as netCDF 4)")
    return FileKind("fit", "a fit")


def _zip(head: bytes, tail: bytes) -> FileKind | None:
    if head.startswith(b"PK\x05\x06"):
        return FileKind("zip", "an empty zip archive")
    if not head.startswith(b"PK\x03\x04"):
        return None
    name = head[30 : 30 + int.from_bytes(head[26:28], "little")]
    if name == b"manifest.json" and b"scissorcal-package/" in head:
        return FileKind("package", "a model package")
    if name.endswith(b".npy") and b"/" not in name:
        return FileKind("npz", "a NumPy archive (.npz)")
    if name in (b"[Content_Types].xml", b"_rels/.rels", b"mimetype"):
        return FileKind("office", "an Office document", _OFFICE)
    return FileKind("zip", "a zip archive", _UNPACK)


def _picture(head: bytes, tail: bytes) -> FileKind | None:
    if head[:4] == b"RIFF" and head[8:12] in (b"WEBP", b"AVI ", b"WAVE"):
        names = {b"WEBP": "a WebP image", b"AVI ": "a video (AVI)", b"WAVE": "a sound (WAV)"}
        key = {b"WEBP": "image", b"AVI ": "video", b"WAVE": "sound"}[head[8:12]]
        return FileKind(key, names[head[8:12]])
    if head[4:8] == b"ftyp":
        if head[8:12] in (b"heic", b"heix", b"mif1", b"msf1", b"hevc", b"avif"):
            return FileKind("image", "a HEIC or AVIF image")
        return FileKind("video", "a video (MP4 or QuickTime)")
    if head[:2] == b"BM" and head[6:10] == bytes(4) and len(head) > 26:
        return FileKind("image", "a BMP image")
    return None


def _parquet(head: bytes, tail: bytes) -> FileKind | None:
    whole = tail.endswith(b"PAR1") and len(head) > 12
    if head.startswith(b"PAR1") and (whole or b"\0" in head):  # PAR1 alone may be a heading
        return FileKind("parquet", "a Parquet table", _NAMED.format(".parquet"))
    return None


def _tar(head: bytes, tail: bytes) -> FileKind | None:
    return FileKind("packed", "a tar archive", _UNPACK) if head[257:262] == b"ustar" else None


def _text(head: bytes, tail: bytes) -> FileKind | None:
    if head.startswith((b"\xff\xfe", b"\xfe\xff")):
        return FileKind("utf16", "text in UTF-16", "Save it as UTF-8.")
    if head.startswith(b"version https://git-lfs.github.com/spec/"):
        return FileKind("lfs", "a pointer of Git LFS to a file", "'git lfs pull' fetches the file.")
    text = head.removeprefix(b"\xef\xbb\xbf").lstrip()
    if match := _OWN_FORMAT.search(text):
        word = match[1].decode()
        return FileKind(word, _OWN.get(word, f"a file of scissorcal ({word})"))
    low = text[:1000].lower()
    if low.startswith((b"<!doctype html", b"<html")):
        return FileKind("html", "a web page")
    if low.startswith((b"<?xml", b"<svg", b"<!doctype svg", b"<opencv_storage", b"<!--")):
        if re.search(rb"<(?:\w+:)?svg\b", text):
            return FileKind("svg", "a drawing in SVG")
        if text.startswith((b"<?xml", b"<opencv_storage")):
            return FileKind("xml", "an XML file")
    if re.match(rb'\{\s*"', text):
        return FileKind("json", "a JSON file")
    if text.startswith((b"ssh-ed25519 ", b"ssh-rsa ", b"ecdsa-sha2-")):
        return FileKind("key", "a public key")
    if len(text) >= SHORTEST_TEXT and _is_printable(text):
        return FileKind("text", "text", "'scissorcal import' reads tables in text.")
    return None


def _is_printable(text: bytes) -> bool:
    """Whether bytes are UTF-8 without control characters; the last character may be cut off."""
    decoded = getincrementaldecoder("utf-8")(errors="strict")
    try:
        return all(
            character >= " " or character in "\t\r\n\f" for character in decoded.decode(text)
        )
    except UnicodeDecodeError:
        return False


_LOOKS: tuple[Callable[[bytes, bytes], FileKind | None], ...] = (
    _hdf5,
    _zip,
    _picture,
    _parquet,
    _tar,
    _text,
)
