"""The layout of a sample in a file and in a table: bytes, units and names.

A sample is one MCAP message in the CDR encoding (little-endian, four bytes of encapsulation
header, then the 80 bytes of SAMPLE_DTYPE unchanged: its fields are naturally aligned, so CDR adds
no padding). The schema is a plain message definition, so viewers of CDR plot a recording without
a plug-in and without ROS.
"""

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


def fields() -> tuple[str, ...]:
    """Return the names of SAMPLE_DTYPE's fields, in order."""
    return tuple(_CHANNELS)


def empty_samples(count: int = 0) -> NDArray[np.void]:
    """Return ``count`` samples of zeros that belong to no stroke, shape (count,)."""
    samples: NDArray[np.void] = np.zeros(count, dtype=SAMPLE_DTYPE)
    samples["stroke"] = -1
    return samples
