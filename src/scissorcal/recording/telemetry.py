"""Further channels of a recording, beside the samples: what a mode reports at each tick.

Those of a plate's tracked pose are its estimates, its pictures, and its frame for viewers.
"""

import struct
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.recording import layout


@dataclass(frozen=True)
class TelemetryChannel:
    """A channel of rows of one size: its topic, and name, type, unit and meaning of each field.

    Fields lie at their natural alignment, so that CDR adds no padding; "(3,)<f8" is an array.
    ``text`` is the schema's where it is not written from the fields, ``constants`` are its lines
    that name numbers.
    """

    topic: str
    schema_name: str
    fields: tuple[tuple[str, str, str, str], ...]
    constants: tuple[str, ...] = ()
    text: str = ""

    @cached_property
    def dtype(self) -> np.dtype[Any]:
        """Of a row, little-endian."""
        return np.dtype([(name, kind) for name, kind, _, _ in self.fields])

    @cached_property
    def message_dtype(self) -> np.dtype[Any]:
        """Of a whole message record inside a chunk."""
        return layout.message_dtype(self.dtype)

    @property
    def definition(self) -> str:
        """The schema's text: one line per field with its type, unit and meaning."""
        lines = [f"{line}\n" for line in self.constants]
        for name, kind, unit, meaning in self.fields if not self.text else ():
            lines.append(f"{_cdr_type(kind)} {name}  # [{unit or '-'}] {meaning}\n")
        return self.text or "".join(lines)

    @property
    def units(self) -> dict[str, str]:
        """The channel's metadata."""
        return {f"unit.{name}": unit for name, _, unit, _ in self.fields}


CONTROL = TelemetryChannel(
    "/scissorcal/control",
    "scissorcal/msg/Control",
    (
        ("sequence", "<u4", "", "of the sample at the same tick"),
        ("flags", "<u4", "", "of the hybrid law and of the mode CONTROL"),
        ("stage", "<i4", "", "index of the path's point that is passed next"),
        ("contour", "<u4", "", "number of the contour in force; 0: none yet"),
        ("force", "<f4", "N", "pressing force, from the balance of the opening axis"),
        ("force_sd", "<f4", "N", "its standard deviation"),
        ("force_wanted", "<f4", "N", "force that the path asks for"),
        ("force_aim", "<f4", "N", "the same behind its slew; 0 while nothing is pressed"),
        ("gap", "<f4", "m", "of the tip above the surface; below 0: pressed in"),
        ("gap_rate", "<f4", "m/s", "its rate"),
        ("place", "<f4", "m", "of the tip along the surface"),
        ("place_wanted", "<f4", "m", "of the path"),
        ("tip_x", "<f4", "m", "of the tip in the rig's frame"),
        ("tip_y", "<f4", "m", "of the tip in the rig's frame"),
        ("contour_age", "<f4", "s", "since the last contour came"),
        ("index", "<f4", "", "ticks of the path that were passed"),
    ),
)
"""Telemetry of the mode CONTROL: the bytes of sc_control_sample, which a test compares."""

SOURCES = ("picture", "contact")
OUTCOMES = ("used", "refused", "restarted", "waiting", "too late", "no contact")
STATES = ("waiting", "fused", "pictures", "contacts", "coasting")
PICTURE_STATES = ("seen", "ambiguous", "blank", "no target", "no pose")
"""Words of the numbers in these channels, in their order."""


def _constants(name: str, words: tuple[str, ...]) -> tuple[str, ...]:
    named = (word.upper().replace(" ", "_") for word in words)
    return tuple(f"uint32 {name}_{word}={number}" for number, word in enumerate(named))


POSE = TelemetryChannel(
    "/scissorcal/plate/pose",
    "scissorcal/msg/PlatePose",
    (
        ("sequence", "<u4", "", "counts the rows that the filter was given"),
        ("source", "<u4", "", "what the row was: SOURCE_..."),
        ("outcome", "<u4", "", "what became of it: OUTCOME_..."),
        ("state", "<u4", "", "what the pose rests on: STATE_..."),
        ("time_s", "<f8", "s", "of the pose, by the rig's clock (the camera's without a rig)"),
        ("row_time_s", "<f8", "s", "of the picture's exposure or the contact"),
        ("quaternion", "(4,)<f8", "", "of the plate in the rig's frame: w, x, y, z"),
        ("translation", "(3,)<f8", "m", "of the plate's origin"),
        ("covariance", "(36,)<f8", "", "of a rotation vector (rad), then translation (m), by rows"),
        ("rates", "(6,)<f8", "", "turn (rad/s), then velocity (m/s)"),
        ("nis", "<f8", "", "normalised innovation squared of the row; NaN where there is none"),
        ("contact_offset", "<f8", "m", "slow error of the tip's place"),
        ("compliance", "<f8", "m/N", "of plate and tip"),
        ("compliance_sd", "<f8", "m/N", "its standard deviation"),
        ("contact_point", "(3,)<f8", "m", "tip in the rig's frame; NaN for a picture"),
        ("contact_force", "<f8", "N", "along the plate's normal; NaN for a picture"),
    ),
    (
        *_constants("SOURCE", SOURCES),
        *_constants("OUTCOME", OUTCOMES),
        *_constants("STATE", STATES),
    ),
)
"""What the filter knows after each row that it was given."""

PICTURE = TelemetryChannel(
    "/scissorcal/plate/picture",
    "scissorcal/msg/PlatePicture",
    (
        ("sequence", "<u4", "", "number of the picture"),
        ("state", "<u4", "", "STATE_..."),
        ("corners", "<u4", "", "of the target that were seen"),
        ("target", "<u4", "", "0: none, 1: plate board, 2: plate strip"),
        ("camera_time_s", "<f8", "s", "clock of the camera; NaN where it has none"),
        ("time_s", "<f8", "s", "of the exposure, by the rig's clock (the camera's without a rig)"),
        ("odds", "<f8", "", "of the pose against the second one that a plane allows"),
        ("rms_px", "<f8", "px", "error of the corners"),
        ("quaternion", "(4,)<f8", "", "as measured: w, x, y, z; NaN where there is none"),
        ("translation", "(3,)<f8", "m", "of the plate's origin"),
        ("noise", "(36,)<f8", "", "covariance of what is new in this picture, by rows"),
        ("other_quaternion", "(4,)<f8", "", "of the second pose"),
        ("other_translation", "(3,)<f8", "m", "of the second pose"),
    ),
    _constants("STATE", PICTURE_STATES),
)
"""What each picture shows by itself; the computer's time is that of its arrival."""

_NAMES = 24

_RULE = 80 * "="

FRAME = TelemetryChannel(
    "/scissorcal/plate/frame",
    "foxglove_msgs/msg/FrameTransform",
    (
        ("sec", "<i4", "s", ""),
        ("nanosec", "<u4", "ns", ""),
        ("names", f"S{_NAMES}", "", "both frames' names, as CDR has strings"),
        ("translation", "(3,)<f8", "m", ""),
        ("rotation", "(4,)<f8", "", "x, y, z, w"),
    ),
    text=f"""builtin_interfaces/Time timestamp
string parent_frame_id
string child_frame_id
geometry_msgs/Vector3 translation
geometry_msgs/Quaternion rotation
{_RULE}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
{_RULE}
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
{_RULE}
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
""",
)
"""The plate's frame as Foxglove shows it in its 3D panel."""

CHANNELS = {channel.topic: channel for channel in (CONTROL, POSE, PICTURE, FRAME)}
"""Known channels by topic; a reader leaves others out."""


def _cdr_type(kind: str) -> str:
    """The type of a field as the schema writes it.

    >>> _cdr_type("(3,)<f8")
    'float64[3]'
    """
    base, shape = np.dtype(kind).base, np.dtype(kind).shape
    return layout.CDR_TYPES[base.str] + (f"[{shape[0]}]" if shape else "")


def rows_of(channel: TelemetryChannel, messages: NDArray[np.void]) -> NDArray[np.void]:
    """Rows (n,) of messages, with ``host_time_ns`` before the channel's own fields."""
    named = [("host_time_ns", "<i8"), *((name, kind) for name, kind, _, _ in channel.fields)]
    rows = np.empty(len(messages), dtype=np.dtype(named))
    rows["host_time_ns"] = messages["log_time"]
    for name in channel.dtype.names or ():
        rows[name] = messages["row"][name]
    return rows


def frame_rows(
    parent: str, poses: NDArray[np.void], times_ns: NDArray[np.int64]
) -> NDArray[np.void]:
    """FRAME rows (n,) of POSE rows: the frame "plate" in ``parent`` ("rig" or "camera")."""
    rows = np.zeros(len(poses), dtype=FRAME.dtype)
    rows["sec"], rows["nanosec"] = np.divmod(times_ns, 1_000_000_000)
    rows["names"] = _cdr_names(parent, "plate")
    rows["translation"] = poses["translation"]
    rows["rotation"] = poses["quaternion"][:, [1, 2, 3, 0]]
    return rows


def _cdr_names(*names: str) -> bytes:
    """Strings as CDR has them: length with the final zero, at multiples of 4 bytes; then to 8."""
    encoded = b""
    for name in names:
        encoded += bytes(-len(encoded) % 4)
        encoded += struct.pack("<I", len(name) + 1) + name.encode() + b"\0"
    if not _NAMES - 8 < len(encoded) <= _NAMES:
        raise ValueError(f"names of frames take {_NAMES} bytes, not {len(encoded)}: {names}")
    return encoded
