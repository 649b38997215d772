"""What a recording is, apart from its samples: kind, joint, strokes, recipe, notes. Quick to read.

Nothing heavy is imported here, so that a command can look at every recording of a workspace.
"""

import json
import struct
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, fields
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


UNTIL_MARK = "until tolerance"
"""Name of the mark; the last one of a recording says how its capture ended."""

REACHED = "tolerance"


@dataclass(frozen=True)
class UntilMark:
    """How far a capture was from the scene's tolerance after so many strokes.

    ``ended`` is "tolerance" (it is reached), "time" (the minutes allowed are used up), "out of
    reach" (further strokes are not expected to reach it), "no fit" (the last strokes cannot be
    fitted, and no stroke is expected to help), or empty: the capture went on, or was interrupted.
    ``minutes`` are those planned so far, not measured: of motion, of the least pauses for the fit,
    and of what the recipe gives a person; ``minutes_left`` those expected still, None where nothing
    is known. ``within`` is the share of the places that can be felt whose
    band is within ``tolerance`` at ``confidence``, ``needed`` the share that counts as reached;
    ``typical`` is half of the band at the median place as a share of the torque. Both are None
    before the first fit. ``friction_alone``: the band is of friction only, which may take half of
    the tolerance. ``why`` says what bounds the band where the tolerance was not reached.
    """

    ended: str
    strokes: int
    pieces: int
    minutes: float
    minutes_left: float | None
    within: float | None
    typical: float | None
    tolerance: float
    confidence: float
    needed: float = 0.95
    friction_alone: bool = False
    why: str = ""

    @property
    def reached(self) -> bool:
        """Whether the capture ended because the tolerance was reached."""
        return self.ended == REACHED

    @property
    def sentence(self) -> str:
        """How far it is, in one line.

        >>> UntilMark("", 5, 2, 1.6, 0.8, 0.83, 0.041, 0.07, 0.95).sentence.partition(" (")[0]
        '5 strokes, 1.6 planned min: band within 7 % at 83 % of felt places'
        """
        band = "no fit yet"
        if self.within is not None and self.typical is not None:
            whose = "friction alone, counted twice, " if self.friction_alone else "band "
            band = (
                f"{whose}within {100 * self.tolerance:g} % at {100 * self.within:.0f} % of felt "
                f"places (median {100 * self.typical:.1f} %)"
            )
        head = f"{self.strokes} strokes, {self.minutes:.1f} planned min: {band}"
        if self.reached:
            return f"{head}; tolerance reached at {100 * self.confidence:g} % confidence"
        if self.ended:
            return f"{head}; tolerance not reached. {self.why}"
        if self.minutes_left is None:
            return head
        return f"{head}; about {self.minutes_left:.1f} min left"

    def as_dict(self) -> dict[str, Any]:
        """Plain values."""
        return asdict(self)

    def as_text(self) -> str:
        """As a mark holds it."""
        return json.dumps(self.as_dict())

    @classmethod
    def last_of(cls, marks: Sequence[tuple[str, str]]) -> "UntilMark | None":
        """The last one among a recording's marks; None where the capture followed a list."""
        texts = [value for name, value in marks if name == UNTIL_MARK]
        if not texts:
            return None
        return cls.of(json.loads(texts[-1]))

    @classmethod
    def of(cls, plain: Mapping[str, Any]) -> "UntilMark":
        """From plain values; names that this version does not know are passed over."""
        known = {field.name for field in fields(cls)}
        return cls(**{name: value for name, value in plain.items() if name in known})
