"""How one sample stands in the file and in a table: bytes, units and names, all in one place.

A sample is one MCAP message in the CDR encoding (little-endian, four bytes of encapsulation
header, then the 80 bytes of SAMPLE_DTYPE unchanged: its fields are naturally aligned, so CDR adds
no padding). The schema is a plain message definition, so viewers that know CDR plot a recording
without a plug-in and without ROS being installed.
"""

from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from scissorcal.recording.recording import SAMPLE_DTYPE, Joint, Recording

FORMAT: Literal["scissorcal-recording/1"] = "scissorcal-recording/1"
PROFILE = "scissorcal"
TOPIC = "/scissorcal/sample"
SCHEMA_NAME = "scissorcal/msg/Sample"
SCHEMA_ENCODING = "ros2msg"
MESSAGE_ENCODING = "cdr"
CDR_HEADER = b"\x00\x01\x00\x00"

METADATA_NAME = "scissorcal.recording"
NOTE_NAME = "scissorcal.note"
SHEET_NAME = "scissorcal.sheet"

PART_SUFFIX = ".part"
"""A capture in progress is called ``<name>.mcap.part`` until it is closed."""

MESSAGE_DTYPE = np.dtype(
    [
        ("opcode", "u1"),
        ("length", "<u8"),
        ("channel", "<u2"),
        ("sequence", "<u4"),
        ("log_time", "<u8"),
        ("publish_time", "<u8"),
        ("header", "V4"),
        ("sample", SAMPLE_DTYPE),
    ]
)
"""A whole message record inside a chunk, so that NumPy reads a run of them in one sweep."""

_CDR_TYPES = {"<u4": "uint32", "<i4": "int32", "<i8": "int64", "<f8": "float64"}
_FIXED_UNITS = {
    "host_time_ns": "ns",
    "device_time_us": "us",
    "advance": "m",
    "handle_force": "N",
    "force_command": "N",
    "latency_ns": "ns",
}
_MEANINGS = {
    "sequence": "counts the device's frames; a jump is a lost frame",
    "flags": "state flags of the device",
    "host_time_ns": "clock of the computer at arrival",
    "device_time_us": "clock of the device, unwrapped",
    "opening": "joint position; grows when the blades open",
    "advance": "position of the pivot along the cut",
    "motor_torque": "effort of the motor; positive when it opens the blades",
    "handle_force": "positive when the hand closes the handles",
    "torque_command": "effort asked of the motor",
    "force_command": "force asked of the advance motor",
    "stroke": "index into the strokes, -1 between them",
    "latency_ns": "frame's arrival to command's departure, 0 without a command",
}


def unit_of(field: str, joint: Joint) -> str:
    """Return the unit of one field of SAMPLE_DTYPE, "" for counters.

    >>> unit_of("motor_torque", Joint("linear"))
    'N'
    """
    if field == "opening":
        return joint.position_unit
    if field in ("motor_torque", "torque_command"):
        return joint.effort_unit
    return _FIXED_UNITS.get(field, "")


def column_name(field: str, joint: Joint) -> str:
    """Return the name of a field's column in an exported table, the unit included.

    >>> column_name("motor_torque", Joint()), column_name("host_time_ns", Joint())
    ('motor_torque_Nm', 'host_time_ns')
    """
    unit = unit_of(field, joint).replace(" ", "")
    if not unit or field.endswith(f"_{unit}"):
        return field
    return f"{field}_{unit}"


def columns(recording: Recording) -> dict[str, NDArray[Any]]:
    """Return the samples by column, each (N,): the fields by :func:`column_name`, and ``time_s``.

    >>> from scissorcal.recording import Recording
    >>> list(columns(Recording("cut", empty_samples(2))))[3:6]
    ['device_time_us', 'time_s', 'opening_rad']
    """
    found: dict[str, NDArray[Any]] = {}
    for field in fields():
        name = column_name(field, recording.joint)
        found[name] = np.ascontiguousarray(recording.samples[field])
        if field == "device_time_us":
            found["time_s"] = recording.device_time_s
    return found


def message_definition(joint: Joint) -> str:
    """Return the schema's text: one line per field with its type, unit and meaning."""
    lines = []
    for field in fields():
        unit = unit_of(field, joint) or "-"
        kind = _CDR_TYPES[SAMPLE_DTYPE[field].str]
        lines.append(f"{kind} {field}  # [{unit}] {_MEANINGS[field]}")
    return "\n".join(lines) + "\n"


def fields() -> tuple[str, ...]:
    """Return the names of SAMPLE_DTYPE's fields, in order."""
    names = SAMPLE_DTYPE.names
    assert names is not None
    return names


def empty_samples(count: int = 0) -> NDArray[np.void]:
    """Return ``count`` samples of zeros that belong to no stroke, shape (count,)."""
    samples: NDArray[np.void] = np.zeros(count, dtype=SAMPLE_DTYPE)
    samples["stroke"] = -1
    return samples
