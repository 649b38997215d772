"""The clock of an imported log: continued where its counter begins again, and refused with gaps."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from scissorcal.errors import InputError
from scissorcal.recording.faulty_values import COUNTERS, continued_clock
from scissorcal.recording.recording import gap_cost
from scissorcal.recording.strokes import GAP_FACTOR
from scissorcal.recording.table import Column, Table, shortened

LONGEST_S = 1e9
"""31 years: no log lasts so long."""


def set_clock(samples: NDArray[np.void], table: Table, factor: float, *, allow_gaps: bool) -> None:
    """Set clocks and sequence from the time column; InputError if it repeats, falls or has gaps."""
    values = table.columns["time"].values
    seconds = (values - values[0]) * factor
    if not np.abs(seconds).max() < LONGEST_S:
        heading = shortened(table.columns["time"].heading)
        raise InputError(
            f"{table.path}, column {heading!r} spans more than 30 years. Check the unit of time."
        )
    microseconds = np.rint(seconds * 1e6).astype(np.int64)
    steps = np.diff(microseconds)
    bad = np.flatnonzero(steps <= 0)
    if len(bad):
        raise InputError(_not_a_clock(table, values * factor, int(bad[0]) + 1))
    usual = float(np.median(steps))
    gaps = np.flatnonzero(steps > GAP_FACTOR * usual)
    if len(gaps) and not allow_gaps:
        row = int(gaps[0]) + 1
        raise InputError(
            f"{table.place(row, 'time')}: {steps[gaps[0]] * 1e-6:.6g} s since the row "
            f"before, where {usual * 1e-6:.6g} s are usual ({len(gaps)} such gaps in all, the "
            f"longest {steps.max() * 1e-6:.6g} s). Allow gaps (--allow-gaps) to keep them, "
            "with a note, or export the log without gaps. "
            f"{gap_cost(microseconds * 1e-6).sentence}"
        )
    counts = np.maximum(1, np.rint(steps / usual)).astype(np.int64)
    samples["sequence"] = np.concatenate([[0], np.cumsum(counts)]) % 2**32
    set_times(samples, microseconds)


def set_times(samples: NDArray[np.void], microseconds: NDArray[np.int64]) -> None:
    """Set the device's and the host's clock, which are one in an imported log."""
    samples["device_time_us"] = microseconds
    samples["host_time_ns"] = microseconds * 1000


def continue_clock(table: Table, factor: float) -> tuple[Table, list[str]]:
    """The table with a clock that goes on where its counter begins again, and a sentence on it."""
    clock = table.columns["time"]
    values, places, period = continued_clock(clock.values, factor)
    if not len(places):
        return table, []
    begins = "0" if clock.values.min() >= 0.0 else f"{-0.5 * period:.10g}"
    bits = math.log2(period)
    length = f"2^{bits:.0f}" if bits in COUNTERS else f"{period * factor:.10g} s"
    sentence = (
        f"The clock begins at {begins} again at {table.places(places)}, after {length}: it was "
        "continued."
    )
    continued_time = {"time": Column(clock.heading, values)}
    return replace(table, columns={**table.columns, **continued_time}), [sentence]


def _not_a_clock(table: Table, seconds: NDArray[np.float64], row: int) -> str:
    before, here = seconds[row - 1], seconds[row]
    if 0.0 < here * len(seconds) < LONGEST_S and np.all(seconds == here):
        return (
            f"{table.place(row, 'time')}: {here:.9g} s stands in every row: the clock stands, or "
            "the column has the time from one row to the next. If rows are that far apart, leave "
            f"the column out and give the rate: --rate-hz {1.0 / here:.6g}."
        )
    if here < before:
        return (
            f"{table.place(row, 'time')}: time decreases from {before:.9g} s to {here:.9g} s. "
            "Sort the rows by time, or split the table there."
        )
    return (
        f"{table.place(row, 'time')}: the time {here:.9g} s is repeated. Remove the repeated "
        "row; if time has too few digits (1 us is needed), give the rate instead."
    )
