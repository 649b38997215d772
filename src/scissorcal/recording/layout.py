"""The layout of samples and of further channels: bytes, units and names.

A sample is one MCAP message in the CDR encoding (little-endian, four bytes of encapsulation
header, then the 80 bytes of SAMPLE_DTYPE unchanged: its fields are naturally aligned, so CDR adds
no padding). The schema is a plain message definition, so viewers of CDR plot a recording without
a plug-in and without ROS.
"""

import struct
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from scissorcal.recording.header import Joint

PROFILE = "scissorcal"
TOPIC = "/scissorcal/sample"
SCHEMA_NAME = "scissorcal/msg/Sample"
SCHEMA_ENCODING = "ros2msg"
MESSAGE_ENCODING = "cdr"
CDR_HEADER = b"\x00\x01\x00\x00"

SHEET_NAME = "scissorcal.sheet"
MARK_NAME = "scissorcal.mark"

PART_SUFFIX = ".part"
"""A capture in progress is called ``<name>.mcap.part`` until it is closed."""


class Channel(NamedTuple):
    """One field of a sample: name, type, unit ("position" and "effort" follow the joint), meaning.

    ``measured`` channels are numbers that an imported table may have, and whose range is shown.
    """

    name: str
    dtype: str
    unit: str
    meaning: str
    measured: bool = False


SAMPLE = (
    Channel("sequence", "<u4", "", "counts the device's frames; a jump is a lost frame"),
    Channel("flags", "<u4", "", "state flags of the device"),
    Channel("host_time_ns", "<i8", "ns", "clock of the computer at arrival"),
    Channel("device_time_us", "<i8", "us", "clock of the device, unwrapped"),
    Channel("opening", "<f8", "position", "joint position; grows when the blades open", True),
    Channel("advance", "<f8", "m", "position of the pivot along the cut", True),
    Channel(
        "motor_torque",
        "<f8",
        "effort",
        "effort of the motor; positive when it opens the blades",
        True,
    ),
    Channel("handle_force", "<f8", "N", "positive when the hand closes the handles", True),
    Channel("torque_command", "<f8", "effort", "effort asked of the motor", True),
    Channel("force_command", "<f8", "N", "force asked of the advance motor", True),
    Channel("stroke", "<i4", "", "index into the strokes, -1 between them"),
    Channel(
        "latency_ns", "<u4", "ns", "frame's arrival to command's departure, 0 without a command"
    ),
)
"""The one table of what a sample holds, in the order of its bytes: a new channel is a row here.

The servo loop writes the same bytes (``sc_sample`` in kernel/c/sc_servo.h), which a test compares.
"""

SAMPLE_DTYPE = np.dtype([(channel.name, channel.dtype) for channel in SAMPLE])
"""One sample as in a recording and in the servo loop's ring: 80 bytes, little-endian.

``device_time_us`` is unwrapped (it does not fall back after 2**32 us); ``stroke`` is the index into
the recording's strokes, -1 between them; ``latency_ns`` runs from the state frame's arrival to the
command's departure, 0 where no command was sent.
"""

MEASURED = tuple(channel.name for channel in SAMPLE if channel.measured)
"""Channels with a measured or commanded number."""


def message_dtype(row: np.dtype[Any]) -> np.dtype[Any]:
    """A whole message record inside a chunk, so that NumPy reads a run of them in one sweep."""
    return np.dtype(
        [
            ("opcode", "u1"),
            ("length", "<u8"),
            ("channel", "<u2"),
            ("sequence", "<u4"),
            ("log_time", "<u8"),
            ("publish_time", "<u8"),
            ("cdr_header", "S4"),
            ("row", row),
        ]
    )


MESSAGE_DTYPE = message_dtype(SAMPLE_DTYPE)

CDR_TYPES = {
    "<u4": "uint32",
    "<i4": "int32",
    "<i8": "int64",
    "<f4": "float32",
    "<f8": "float64",
}
_CHANNELS = {channel.name: channel for channel in SAMPLE}


def unit_of(field: str, joint: Joint) -> str:
    """Return the unit of one field of SAMPLE_DTYPE, "" for counters.

    >>> unit_of("motor_torque", Joint("linear"))
    'N'
    """
    unit = _CHANNELS[field].unit
    return {"position": joint.position_unit, "effort": joint.effort_unit}.get(unit, unit)


def column_name(field: str, joint: Joint) -> str:
    """Return the name of a field's column in an exported table, the unit included.

    >>> column_name("motor_torque", Joint()), column_name("host_time_ns", Joint())
    ('motor_torque_Nm', 'host_time_ns')
    """
    unit = unit_of(field, joint).replace(" ", "")
    if not unit or field.endswith(f"_{unit}"):
        return field
    return f"{field}_{unit}"


def message_definition(joint: Joint) -> str:
    """Return the schema's text: one line per field with its type, unit and meaning."""
    return "".join(
        f"{CDR_TYPES[channel.dtype]} {channel.name}  "
        f"# [{unit_of(channel.name, joint) or '-'}] {channel.meaning}\n"
        for channel in SAMPLE
    )


def empty_samples(count: int = 0) -> NDArray[np.void]:
    """Return ``count`` samples of zeros that belong to no stroke, shape (count,)."""
    samples: NDArray[np.void] = np.zeros(count, dtype=SAMPLE_DTYPE)
    samples["stroke"] = -1
    return samples


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
        return message_dtype(self.dtype)

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
    return CDR_TYPES[base.str] + (f"[{shape[0]}]" if shape else "")


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
