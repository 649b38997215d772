"""Read a joint's log: which column is what, in which unit, found from the headings."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Literal

import numpy as np

from scissorcal.errors import InputError
from scissorcal.identify.words import as_of_a_joint
from scissorcal.recipe.units import parse_unit
from scissorcal.recording import (
    ImportOptions,
    Joint,
    Recording,
    import_table,
    read_headings,
    read_recording,
    unit_in,
)
from scissorcal.recording.table import find_column

CHANNELS = {
    "time": "time",
    "position": "opening",
    "effort": "motor_torque",
    "load": "handle_force",
}
"""Channels of a joint's log, and what a recording calls them."""

_NAMES = {
    "time": r"time|t|stamp|timestamp|clock|zeit",
    "position": r"position|pos|angle|theta|phi|q|qm|opening|encoder|displacement|stroke|travel",
    "effort": r"effort|torque|tau|force|trq|tq|moment",
    "load": r"load",
}
"""Words of headings by channel, without digits at their end."""
_OTHER = (
    r"vel|velocity|speed|rate|qd|dq|qdot|dot|acc|accel|acceleration|cmd|command|commanded|des|"
    r"desired|ref|reference|target|setpoint|goal|error|temp|temperature|voltage|current|qdd|ddq"
)
"""Words by which a column is something else: a rate, a command, a current."""
_LENGTH, _ANGLE = {("m", 1)}, {("rad", 1)}


@dataclass(frozen=True)
class LogOptions:
    """What a log does not say of itself, by channel: ``columns``, ``units``, ``scales``.

    Channels are time, position, effort, and load (what the far end of the joint works against).
    ``kind`` is that of the joint where no unit of the position says it.
    """

    columns: Mapping[str, str | int] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    scales: Mapping[str, str | float] = field(default_factory=dict)
    kind: Literal["rotary", "linear"] | None = None
    rate_Hz: float | None = None
    allow_gaps: bool = False
    delimiter: str | None = None


def read_log(path: Path, options: LogOptions = LogOptions()) -> Recording:
    """Read the log of one joint as a recording; what is not stated is found from the headings.

    A recording (.mcap) is taken as it is. Raises InputError, naming file, place and remedy, where a
    column is missing or several could be meant, and where a unit is not known.
    """
    with as_of_a_joint():
        stored = path.suffix == ".mcap"
        recording = read_recording(path) if stored else _table(path, options)
        _refuse_constant(path, recording)
    return recording


def _table(path: Path, options: LogOptions) -> Recording:
    headings = read_headings(path, options.delimiter)
    if len(headings) < 2:
        raise InputError(
            f"{path} has one column ({', '.join(map(repr, headings)) or 'none'}), and a joint's "
            "log has at least position and effort. Export both into one table, with the time."
        )
    _refuse_unknown(options)
    columns = _columns(path, headings, options)
    kind = options.kind or _kind(path, headings, columns, options)
    units = dict(options.units)
    named = {CHANNELS[name]: column for name, column in columns.items()}
    if kind == "rotary" and "load" in columns:  # read as the force on a lever of 1 m
        stated = units.get("load") or unit_in(_heading(path, headings, columns["load"]))
        if stated:
            units["load"] = re.sub(r"(?<=N)[ _*]?m$", "", stated)
    return import_table(
        path,
        columns=named,
        units={CHANNELS[name]: unit for name, unit in units.items()},
        scale={CHANNELS[name]: scale for name, scale in options.scales.items()},
        rate_Hz=options.rate_Hz,
        options=ImportOptions(
            joint=Joint(kind),
            handle_radius_m=1.0 if "load" in columns else float("nan"),
            allow_gaps=options.allow_gaps,
            delimiter=options.delimiter,
        ),
    )


def _refuse_unknown(options: LogOptions) -> None:
    for name in (*options.columns, *options.units, *options.scales):
        if name not in CHANNELS:
            raise InputError(f"{name!r} is not a channel. Channels are {', '.join(CHANNELS)}.")


def _columns(path: Path, headings: list[str], options: LogOptions) -> dict[str, str | int]:
    """The column of each channel: as stated, else the only one whose heading says it."""
    columns = dict(options.columns)
    taken = {_number(path, headings, column) for column in columns.values()}
    for channel in CHANNELS:
        if channel in columns or (channel == "time" and options.rate_Hz is not None):
            continue
        places = [
            place
            for place, heading in enumerate(headings)
            if place not in taken and _says(heading, channel)
        ]
        if len(places) > 1:
            raise InputError(_which(path, headings, places, channel))
        if places:
            columns[channel] = headings[places[0]] if path.suffix == ".mat" else places[0]
            taken.add(places[0])
        elif channel != "load":
            raise InputError(_none(path, headings, channel))
    return columns


def _says(heading: str, channel: str) -> bool:
    """Whether a heading names a channel.

    >>> _says("joint_1 position [deg]", "position"), _says("q_des", "position"), _says("q2", "time")
    (True, False, False)
    """
    words = _words(heading)
    if any(re.fullmatch(_OTHER, word) for word in words):
        return False
    return any(re.fullmatch(_NAMES[channel], word) for word in words)


def _words(heading: str) -> list[str]:
    """Words of a heading, in lower case and without digits; its unit is left out."""
    plain = re.sub(r"[\[(].*", "", heading)
    parted = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", plain)
    words = [word.rstrip("0123456789").lower() for word in re.split(r"[^A-Za-z0-9]+", parted)]
    return [word for word in words if word]


def _which(path: Path, headings: list[str], places: list[int], channel: str) -> str:
    listed = ", ".join(repr(headings[place]) for place in places[:12])
    joints = "; a log is of one joint" if channel in ("position", "effort") else ""
    return (
        f"{path}: {len(places)} columns could be the {channel}: {listed}{joints}. Name one with "
        f"-c {channel}={_word(headings[places[0]], places[0])}."
    )


def _none(path: Path, headings: list[str], channel: str) -> str:
    listed = ", ".join(repr(heading) for heading in headings[:20])
    rate = ", or give the rate with --rate-hz" if channel == "time" else ""
    return (
        f"{path}: no heading says which column is the {channel}; its columns are {listed}. Name it "
        f"with -c {channel}=COLUMN (a heading, or a number from 0){rate}."
    )


def _word(heading: str, place: int) -> str:
    """A column as the command line takes it."""
    return heading if re.fullmatch(r"[\w.\[\]]+", heading) else str(place)


def _number(path: Path, headings: list[str], column: str | int) -> int | None:
    if path.suffix == ".mat":
        return headings.index(str(column)) if str(column) in headings else None
    return find_column(path, headings, column, "a channel")


def _heading(path: Path, headings: list[str], column: str | int) -> str:
    number = _number(path, headings, column)
    return str(column) if number is None else headings[number]


def _kind(
    path: Path, headings: list[str], columns: Mapping[str, str | int], options: LogOptions
) -> Literal["rotary", "linear"]:
    """Whether the joint turns or slides, by the unit of its position or else of its effort."""
    for channel, of_linear in (("position", _LENGTH), ("effort", {("N", 1)})):
        heading = _heading(path, headings, columns[channel])
        stated = options.units.get(channel) or unit_in(heading) or ""
        unit = parse_unit(re.sub(r"[\s*.]", "", stated).replace("°", "deg"))
        if unit is None:
            continue
        dimension = set(unit.dimension)
        if channel == "position" and dimension in (_LENGTH, _ANGLE):
            return "linear" if dimension == of_linear else "rotary"
        if channel == "effort" and ("N", 1) in dimension:
            return "linear" if dimension == of_linear else "rotary"
    raise InputError(
        f"{path}: the unit of the position {_heading(path, headings, columns['position'])!r} "
        "is not known, so whether the joint turns or slides is not either. State it: "
        "-u position=deg, -u position=mm (or, with a scale, --joint)."
    )


def _refuse_constant(path: Path, recording: Recording) -> None:
    for channel in ("position", "effort"):
        values = np.asarray(recording.samples[CHANNELS[channel]], dtype=np.float64)
        if channel == "effort" and not np.isnan(recording.handle_radius_m):
            values = recording.drive_effort
        if len(values) and float(np.ptp(values)) == 0.0:
            raise InputError(
                f"{path}: the {channel} is {values[0]:.6g} in every row, so that nothing follows "
                f"from it. Name another column with -c {channel}=COLUMN, or log the joint while it "
                "moves."
            )


def named(recording: Recording) -> Recording:
    """The recording under its file's name alone: a page tells nothing of the disk."""
    return replace(recording, source=Path(recording.source).name)
