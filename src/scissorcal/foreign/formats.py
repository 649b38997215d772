"""Every format that is read from files of others: its largest size, and the limits of its parser.

A size is what the largest honest file has, with room; a larger file is another file.
"""

from dataclasses import dataclass

_MB = 1_000_000
_GB = 1_000_000_000


@dataclass(frozen=True)
class Format:
    """A format of files: its name with an article, its largest size, and what to do about a file.

    ``remedy`` is a whole sentence. ``holds`` are the kinds of file that it may be
    (:mod:`scissorcal.foreign.kinds`); one of another known kind is refused by its name, and one of
    none goes to the parser; "*" holds all. Where the parser runs in a child process,
    ``memory_bytes`` is what a file may add to what that holds, ``processor_s`` the processor time
    that it has, and ``wall_s`` the time.
    """

    name: str
    most_bytes: int
    remedy: str
    holds: tuple[str, ...] = ("text",)
    memory_bytes: int = 0
    processor_s: int = 60
    wall_s: float = 300.0

    @property
    def memory(self) -> str:
        """The limit of memory in words."""
        return f"more than {self.memory_bytes / 1e9:g} GB of memory"


ANY = Format("a file", 2 * _GB, "Name another file.", holds=("*",))
"""What is read for its bytes alone, such as for their digest."""

RECIPE = Format(
    "a recipe",
    _MB,
    "Correct it, or copy a built-in recipe with 'scissorcal init'.",
    ("recipe", "text"),
)
"""The longest built-in recipe has 6 kB."""

SPECIMEN = Format(
    "a specimen",
    _MB,
    "Correct it, or name a built-in one, such as office-paper.",
    ("specimen", "text"),
)
"""The longest built-in specimen has 1.2 kB."""

LOG = Format("a table in text", 500 * _MB, "Save it as CSV in UTF-8, one row a line.")
"""An hour at 1 kHz with 100 characters a line has 360 MB."""

MATLAB = Format(
    "a MATLAB file",
    500 * _MB,
    "Save it again in MATLAB (save -v7), or export it as CSV.",
    holds=("matlab", "hdf5"),
    memory_bytes=3 * _GB,
)
"""An hour at 1 kHz of ten numbers has 288 MB; the memory is the file, its arrays, their copies."""

PARQUET = Format(
    "a Parquet table",
    500 * _MB,
    "Write it again, or export it as CSV.",
    holds=("parquet",),
    memory_bytes=3 * _GB,
)
"""As for MATLAB files; compressed, it holds several hours."""

RECORDING = Format(
    "a recording", 2 * _GB, "Capture again, or restore it from a backup.", ("recording",)
)
"""Six hours at 1 kHz of messages of 88 bytes, not compressed, have 1.9 GB."""

FIT = Format(
    "a fit",
    500 * _MB,
    "Remove it and fit again.",
    holds=("fit", "hdf5"),
    memory_bytes=2 * _GB,
    processor_s=10,
)
"""A fit has at most some 20,000 draws of 50 parameters and as many predictions: 8 to 80 MB."""

CAMERA = Format(
    "a camera file",
    _MB,
    "Save it again from the program that wrote it.",
    ("yaml", "json", "xml", "text", "utf16"),
)
"""A dozen numbers and, in some, the corners of 100 photographs of 100 corners: 0.5 MB."""

PHOTOGRAPH = Format(
    "a photograph",
    300 * _MB,
    "Copy it from the camera again.",
    holds=("image",),
    memory_bytes=2 * _GB,
    processor_s=20,
)
"""The most pixels that are read (89 million) of three bytes, not compressed, have 268 MB. The
memory is the picture with transparency (360 MB), a copy of it, and what is handed back."""

VIDEO = Format("a video", 20 * _GB, "Encode it again, such as with ffmpeg.", ("video", "image"))
"""An hour of 45 Mbit/s. Only that it is a regular file is checked: see docs/decisions."""

PACKAGE = Format(
    "a model package",
    16 * _MB,
    "Build it again with 'scissorcal package build', or fetch an unchanged copy.",
    holds=("package", "zip"),
)
"""Tables of the largest scene have 2 MB; a package's own checks bound each member."""

REPORT = Format(
    "a report's data (report.json)", 50 * _MB, "Run 'scissorcal report' again.", ("report", "json")
)
"""A page with its pictures has 5 MB, its twin less."""
PAGE = Format(
    "a report (report.html)", 50 * _MB, "Run 'scissorcal report' again.", ("html", "text")
)

SIGNATURE = Format(
    "a signature",
    _MB,
    "Sign the report again with 'scissorcal report sign'.",
    ("signature", "json", "text"),
)
"""JSON with a line for each file that it covers, at most 5,000."""

KEY = Format("a key", 100_000, "Make one with 'ssh-keygen -t ed25519 -f lab-key'.", ("key", "text"))
"""A private key has 400 bytes, a file of trusted keys a line of 100 for each."""

PHOTO_INDEX = Format(
    "an index of photographs",
    50 * _MB,
    "Capture its photographs again.",
    ("photographs", "json", "text"),
)
"""60 photographs of 1,000 corners each have 3 MB."""

STATE = Format(
    "a file of this workspace",
    100 * _MB,
    "Remove it; it is made again.",
    ("index", "records", "scene-choice", "capture-design", "probe", "trade", "json", "text"),
)
"""Indexes, designs, probes and studies that scissorcal writes for itself; kilobytes to 10 MB."""

RECORDS = Format("records of a run", 500 * _MB, "Move it away; the run begins anew.", ("*",))
"""100,000 fits of a verification with 50 parameters of five numbers have 500 MB; most have 1 MB.
What is no record, such as half a line of a killed run, is put aside by its reader."""

SURFACE = Format("a table of probed points", 5 * _MB, "Write x_mm, y_mm, z_mm, one point a line.")
"""200,000 points of 25 characters."""

DRAWING = Format(
    "a drawing in SVG",
    2 * _MB,
    "Save it as plain SVG, its width and height in mm.",
    holds=("svg", "xml", "gzip", "text", "utf16"),
    memory_bytes=_GB,
    processor_s=20,
    wall_s=60.0,
)
"""20,000 points of 100 characters; as segments of curves they take 100 MB."""

PATH = Format("a path", 5 * _MB, "Write x_mm and what else is stated, one point a line.")
"""200,000 points of 25 characters."""

RIG_POSITIONS = Format(
    "a table of rig positions", _MB, "Write a line for each photograph of the rig."
)
"""A line for each photograph, of 50 characters."""

TRACK_LINES = Format(
    "a track of lines",
    500 * _MB,
    "Restore it from a backup.",
    ("track", "json", "text"),
)
"""An hour at 60 pictures a second of 1.5 kB each has 324 MB."""

CHECKPOINT = Format(
    "a checkpoint", _GB, "Move it away, or name another file, to start afresh.", ("npz", "zip")
)
"""Four ensembles of 100 walkers, 20,000 stored steps and 12 parameters have 768 MB."""
