"""What a recording is, apart from its samples: kind, joint, strokes, recipe, notes. Quick to read.

Nothing heavy is imported here, so that a command can look at every recording of a workspace.
"""

import json
import struct
import zlib
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

Kind = Literal["friction", "friction-advance", "cut", "render", "control", "track"]
"""What was recorded: empty motion of the blades, of the carriage, cuts and presses, a rendering, a
path along a surface, a plate's pose."""

StrokeKind = Literal["closing", "opening", "excitation", "press", "forward", "backward"]
"""What a stroke moves: the blades, or forward and backward the carriage."""


FORMAT: Literal["scissorcal-recording/1"] = "scissorcal-recording/1"
METADATA_NAME = "scissorcal.recording"
NOTE_NAME = "scissorcal.note"
MAGIC = b"\x89MCAP0\r\n"
HEAD = struct.Struct("<BQ")
"""Opcode and length that precede every MCAP record."""

SAMPLE_CHANNEL = 1
"""Number of the channel of samples in a file that this program wrote."""


@dataclass(frozen=True)
class Joint:
    """Whether the moving joint turns or slides, which fixes the units of its channels.

    A rotary joint has radians and N m; a linear one metres and newtons.

    >>> Joint("linear").effort_unit
    'N'
    """

    kind: Literal["rotary", "linear"] = "rotary"

    @property
    def position_unit(self) -> str:
        return "rad" if self.kind == "rotary" else "m"

    @property
    def effort_unit(self) -> str:
        return "N m" if self.kind == "rotary" else "N"


@dataclass(frozen=True)
class Stroke:
    """One planned movement within a recording: its kind, nominal speed and sheet of material.

    ``speed`` is the magnitude of the nominal rate (rad/s or m/s), NaN where the movement has no
    single speed; ``sheet`` counts fresh pieces of material from 0, -1 where none is loaded.
    """

    index: int
    kind: StrokeKind
    speed: float = float("nan")
    sheet: int = -1


@dataclass(frozen=True)
class RecordingHeader:
    """A recording without its samples.

    ``sample_count`` and ``duration_s`` (by the computer's clock) are those that the file states.
    ``strokes`` are the planned ones; where ``min_travel`` (rad or m) is set they are found from
    the motion when the samples are read, and ``strokes`` is empty. ``notes`` are those that were
    written during the capture. Other fields as in Recording.
    """

    kind: Kind
    joint: Joint
    handle_radius_m: float
    strokes: tuple[Stroke, ...]
    min_travel: float | None
    recipe_toml: str
    device: Mapping[str, Any]
    notes: tuple[str, ...]
    sample_count: int
    duration_s: float
    finished: bool


def checksum(entries: Mapping[str, str]) -> str:
    """Return the CRC-32, in hexadecimal, of all entries of the metadata but the checksum itself."""
    body = {key: value for key, value in entries.items() if key != "crc32"}
    text = json.dumps(body, sort_keys=True, ensure_ascii=False)
    return f"{zlib.crc32(text.encode()):08x}"
