"""Make a recording of arrays and of tables in memory, by the rules of an import."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from scissorcal.errors import InputError, check_known
from scissorcal.recording.header import Joint
from scissorcal.recording.importing import ImportOptions, recording_of_table
from scissorcal.recording.layout import MEASURED, column_name
from scissorcal.recording.recording import Recording
from scissorcal.recording.table import SHEET, Column, Table, find_column, quantity

if TYPE_CHECKING:
    import pandas as pd

CHANNELS = {
    "time_s": "time",
    "opening_rad": "opening",
    "opening_m": "opening",
    "torque_Nm": "motor_torque",
    "force_N": "motor_torque",
    "handle_force_N": "handle_force",
    "advance_m": "advance",
    SHEET: SHEET,
}
"""Arguments of `Recording.from_arrays` that are arrays, and the channel of each."""
OPTIONS = ("kind", "handle_radius_m", "min_travel", "allow_gaps", "notes")
KINDS = ("friction", "friction-advance", "cut")


def recording_from_arrays(
    named: Mapping[str, ArrayLike | None], more: Mapping[str, Any]
) -> Recording:
    """Make a recording of arrays by their argument's name; see `Recording.from_arrays`."""
    for name in more:
        check_known("argument of Recording.from_arrays", name, (*CHANNELS, *OPTIONS))
    given = {n: v for n, v in {**named, **more}.items() if n in CHANNELS and v is not None}
    options = {name: value for name, value in more.items() if name in OPTIONS}
    columns: dict[str, Column] = {}
    if np.ndim(given.get(SHEET, ())) == 0:
        given[SHEET] = np.full(np.shape(given.get("time_s", ())), given[SHEET])
    for name, values in given.items():
        channel = CHANNELS[name]
        if channel in columns:
            raise InputError(
                f"{columns[channel].heading} and {name} are one channel of joints of two kinds: "
                "give one of them."
            )
        columns[channel] = Column(name, np.asarray(values, dtype=np.float64))
    linear = "opening_m" in given
    other = "torque_Nm" if linear else "force_N"
    if other in given:
        raise InputError(
            f"{other} is not measured at a {'linear' if linear else 'rotary'} joint: give "
            "opening_rad with torque_Nm, or opening_m with force_N."
        )
    return _recording(columns, Joint("linear" if linear else "rotary"), options)


def recording_from_pandas(
    table: "pd.DataFrame", columns: Mapping[str, str] | None, more: Mapping[str, Any]
) -> Recording:
    """Make a recording of a table in memory; see `Recording.from_pandas`."""
    for name in more:
        check_known("argument of Recording.from_pandas", name, (*OPTIONS, "joint"))
    options = dict(more)
    headings = [str(heading) for heading in table.columns]
    linear = "opening_m" in headings if columns is None else False
    joint = options.pop("joint", "linear" if linear else "rotary")
    check_known("kind of joint", joint, ("rotary", "linear"))
    wanted = _usual_columns(headings, Joint(joint)) if columns is None else dict(columns)
    found = {}
    for channel, heading in wanted.items():
        check_known("channel", channel, ("time", *MEASURED, SHEET))
        place = find_column(Path("the table"), headings, heading, channel)
        values = np.asarray(table.iloc[:, place], dtype=np.float64)
        found[channel] = Column(headings[place], values)
    return _recording(found, Joint(joint), options)


def _usual_columns(headings: list[str], joint: Joint) -> dict[str, str]:
    usual = {"time": "time_s", SHEET: SHEET}
    usual |= {name: column_name(name, joint) for name in MEASURED}
    return {channel: name for channel, name in usual.items() if name in headings}


def _recording(
    columns: Mapping[str, Column], joint: Joint, options: Mapping[str, Any]
) -> Recording:
    _refuse_unsuitable(columns)
    options = dict(options)
    notes = tuple(options.pop("notes", ()))
    check_known("kind of recording", options.get("kind", "friction"), KINDS)
    chosen = ImportOptions(joint=joint, **options)
    table = Table(Path("the arrays"), columns)
    quantities = {channel: quantity(table, channel, None, None, joint) for channel in columns}
    if "motor_torque" not in columns and not chosen.handle_radius_m > 0.0:
        raise InputError(
            "No torque is given: give torque_Nm (force_N of a linear joint), or handle_force_N "
            "with handle_radius_m."
        )
    recording = recording_of_table(table, quantities, None, chosen)
    return replace(recording, notes=(*notes, *recording.notes))


def _refuse_unsuitable(columns: Mapping[str, Column]) -> None:
    """InputError for channels that are missing, of unequal shapes, or not finite."""
    for channel, argument in (("time", "time_s"), ("opening", "opening_rad or opening_m")):
        if channel not in columns:
            raise InputError(f"No {channel} is given: give {argument}.")
    shape = columns["time"].values.shape
    if len(shape) != 1 or shape[0] < 2:
        raise InputError(
            f"{columns['time'].heading} has shape {shape}; a motion has one dimension and at least "
            "two samples."
        )
    for heading, values in columns.values():
        if values.shape != shape:
            raise InputError(
                f"{heading} has shape {values.shape} and {columns['time'].heading} {shape}: give "
                "arrays of one length."
            )
        if not np.all(np.isfinite(values)):
            row = int(np.argmin(np.isfinite(values)))
            raise InputError(
                f"{heading} is {values[row]} in row {row + 1}: leave such rows out, and allow gaps "
                "(allow_gaps=True)."
            )
