"""Further channels of a recording, beside the samples: what a mode says of itself, tick by tick."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

_CDR_TYPES = {"<u4": "uint32", "<i4": "int32", "<f4": "float32", "<f8": "float64"}


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
        return np.dtype(
            [
                ("opcode", "u1"),
                ("length", "<u8"),
                ("channel", "<u2"),
                ("sequence", "<u4"),
                ("log_time", "<u8"),
                ("publish_time", "<u8"),
                ("cdr_header", "S4"),
                ("row", self.dtype),
            ]
        )

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


def _cdr_type(kind: str) -> str:
    """The type of a field as the schema writes it.

    >>> _cdr_type("(3,)<f8")
    'float64[3]'
    """
    base, shape = np.dtype(kind).base, np.dtype(kind).shape
    return _CDR_TYPES[base.str] + (f"[{shape[0]}]" if shape else "")


def rows_of(channel: TelemetryChannel, messages: NDArray[np.void]) -> NDArray[np.void]:
    """Rows (n,) of messages, with ``host_time_ns`` before the channel's own fields."""
    named = [("host_time_ns", "<i8"), *((name, kind) for name, kind, _, _ in channel.fields)]
    rows = np.empty(len(messages), dtype=np.dtype(named))
    rows["host_time_ns"] = messages["log_time"]
    for name in channel.dtype.names or ():
        rows[name] = messages["row"][name]
    return rows
