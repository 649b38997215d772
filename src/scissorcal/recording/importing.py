"""Import logs of other programs: CSV, Parquet and MATLAB files become recordings."""

import difflib
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scissorcal.errors import InputError
from scissorcal.recording.faulty_values import (
    COUNTERS,
    continued,
    continued_clock,
    jumps_in,
    lone_excursion,
    marks_in,
    overflows,
)
from scissorcal.recording.layout import MEASURED, empty_samples
from scissorcal.recording.reader import content_hash
from scissorcal.recording.recording import Joint, Kind, Recording, Stroke, gap_cost, gap_note
from scissorcal.recording.strokes import (
    GAP_FACTOR,
    MOST_NOISE_SHARE,
    NOISE_OF_STROKE,
    StrokeThreshold,
    label_strokes,
    noise_of,
    stroke_threshold,
)
from scissorcal.recording.table import (
    SHEET,
    Column,
    Quantity,
    Table,
    describe,
    quantity,
    sheets_of,
    shortened,
    size_note,
)
from scissorcal.recording.table_file import read_table, refuse_no_table

MOST_PLACES = 3
"""Places that a note lists."""
LONGEST_S = 1e9
"""31 years: no log lasts so long."""
SHORT_SHARE, MANY = 0.25, 20
"""More strokes than MANY, half of them shorter than this share of the range, are worth a note."""
NO_SHEET = (
    "No column says which sheet is cut, so the fit of the cut will not take this log: name one "
    "that counts fresh sheets from 0 (-c sheet=COLUMN; sheet= in Python)."
)


@dataclass(frozen=True)
class ImportOptions:
    """What a table does not say of itself, and how strictly it is read.

    ``joint``, ``kind`` and ``handle_radius_m`` (NaN: not known) are the recording's. A stroke
    travels at least ``min_travel`` [rad, or m]; where that is not given, so far that neither noise
    nor steps of the sensor make a stroke (`stroke_threshold`), which a note states.

    A step of more than 1.5 times the usual one is a gap and refused, unless ``allow_gaps`` keeps
    it and notes it. ``delimiter`` is the text's (None: found). The last line of a text file is
    left out where it has no end, unless ``drop_last_line`` is false. ``motion_only`` says that
    neither force nor torque was measured.
    """

    joint: Joint = Joint()
    kind: Kind = "friction"
    handle_radius_m: float = math.nan
    min_travel: float | None = None
    allow_gaps: bool = False
    delimiter: str | None = None
    drop_last_line: bool = True
    motion_only: bool = False


def import_table(
    path: str | Path,
    *,
    columns: Mapping[str, str | int],
    units: Mapping[str, str] | None = None,
    scale: Mapping[str, str | float] | None = None,
    rate_Hz: float | None = None,
    options: ImportOptions = ImportOptions(),
) -> Recording:
    """Read a table as a recording, in SI, with strokes found from the motion.

    ``columns`` says which column holds which channel: ``time``, ``opening``, ``advance``,
    ``motor_torque``, ``handle_force``, ``torque_command``, ``force_command``, and ``sheet``, which
    counts fresh pieces of material from 0 (-1: none is loaded); by heading or by number from 0 (in
    a .mat file by variable: ``q``, ``data.q``, ``X[2]``). ``opening`` is needed, and
    ``motor_torque`` or ``handle_force`` (with ``handle_radius_m``), unless ``motion_only`` says
    that nothing else was measured; and ``time`` or ``rate_Hz``. Channels that are not named are 0,
    which a note says.

    ``units`` are those of the columns (deg, rad, mm, um, N m, mN m, N mm, kN, ms, us, ...), which
    may also stand in the headings; ``scale`` multiplies a column: a number, or single variables
    of the .mat file joined by * and /, as in ``{"motor_torque": "gtau"}`` for a gain in N/V.

    A clock that begins again after a counter's last number, a second, minute, hour or day is
    continued, with a note; so is an angle that begins again after a full turn, or a counter after
    its last number. Other jumps of the opening, and forces that pass a counter's end, are noted.

    Both clocks begin at 0 and are rounded to 1 us. `ImportOptions` has the rest.

    Raises InputError, naming the line (or row), the column and the remedy: text, empty cells, NaN,
    time that repeats or decreases, gaps, unknown columns and units.

    >>> recording = import_table(  # doctest: +SKIP
    ...     "DATA_EMPS.mat",
    ...     columns={"time": "t", "opening": "qm", "motor_torque": "vir"},
    ...     units={"time": "s", "opening": "m", "motor_torque": "V"},
    ...     scale={"motor_torque": "gtau"},
    ...     options=ImportOptions(joint=Joint("linear")),
    ... )
    """
    path, joint = Path(path), options.joint
    units, scale = units or {}, scale or {}
    _check_request(path, columns, (*units, *scale), rate_Hz, options)
    table = read_table(path, columns, options.delimiter, drop_last_line=options.drop_last_line)
    quantities = {
        channel: quantity(table, channel, units.get(channel), scale.get(channel), joint)
        for channel in columns
    }
    digest = content_hash(path)
    source = f"{path.name} (sha256:{digest[:16]})"
    recording = recording_of_table(table, quantities, rate_Hz, options)
    return replace(
        recording,
        source=str(path),
        content_hash=digest,
        notes=(*_general(source, columns, quantities), *recording.notes),
    )


def recording_of_table(
    table: Table,
    quantities: Mapping[str, Quantity],
    rate_Hz: float | None = None,
    options: ImportOptions = ImportOptions(),
) -> Recording:
    """Make a recording of a table's columns by channel, in memory; see `import_table`."""
    joint = options.joint
    samples = empty_samples(table.length)
    for channel in set(table.columns) - {"time", SHEET}:
        samples[channel] = table.columns[channel].values * quantities[channel].factor
    sentences = list(table.notes)
    sentences += _opening_goes_on(samples, table, joint)
    if rate_Hz is not None:
        samples["sequence"] = np.arange(table.length)
        _set_times(samples, np.rint(samples["sequence"] * (1e6 / rate_Hz)).astype(np.int64))
    else:
        table, wrapped = _clock_goes_on(table, quantities["time"].factor)
        sentences += wrapped
        _set_clock(samples, table, quantities["time"].factor, allow_gaps=options.allow_gaps)
    sentences += _note_on_jumps(samples, table, joint)
    strokes, stroke_sentence, odd = _label(samples, joint, options.min_travel, sheets_of(table))
    if options.kind == "cut" and SHEET not in table.columns:
        sentences.append(NO_SHEET)
    sentences += [*odd, *_sizes(samples, quantities, joint)]
    particular = _particular(quantities, samples, sentences)
    return Recording(
        kind=options.kind,
        samples=samples,
        strokes=strokes,
        joint=joint,
        handle_radius_m=options.handle_radius_m,
        notes=(stroke_sentence, *particular),
        particular=particular,
    )


def _check_request(
    path: Path,
    columns: Mapping[str, str | int],
    converted: tuple[str, ...],
    rate_Hz: float | None,
    options: ImportOptions,
) -> None:
    """Check the arguments; ``converted`` are the channels with a unit or scale."""
    wanted = () if options.motion_only else ("motor_torque", "handle_force")
    min_travel = options.min_travel
    known = ("time", *MEASURED, SHEET)
    for name in (*columns, *converted):
        if name not in known:
            near = difflib.get_close_matches(name, known, 1)
            hint = f"Did you mean {near[0]!r}? " if near else ""
            raise InputError(f"{name!r} is not a channel. {hint}Channels are {', '.join(known)}.")
        if name not in columns:
            raise InputError(
                f"A unit or scale is given for {name}, but no column. Name its column."
            )
    refuse_no_table(path)
    if "opening" not in columns:
        raise InputError(f"{path}: no column is given for opening. Name it with -c opening=COLUMN.")
    if wanted and not set(wanted) & set(columns):
        raise InputError(
            f"{path}: no column is given for {' or '.join(wanted)}. Name one of them with "
            "-c CHANNEL=COLUMN."
        )
    if wanted and "handle_force" in columns and not options.handle_radius_m > 0:
        raise InputError(
            f"{path}: handle_force needs the handle radius, which is not known. Give it."
        )
    if ("time" in columns) == (rate_Hz is not None):
        raise InputError(f"{path}: name the column for time, or give the rate, but not both.")
    if rate_Hz is not None and not 0 < rate_Hz <= 1e6:
        raise InputError(f"A rate of {rate_Hz} Hz is not possible; give 1 MHz or less.")
    if min_travel is not None and not 0 < min_travel < math.inf:
        raise InputError(f"A least travel of {min_travel} is not possible; give a positive number.")


def _set_clock(samples: NDArray[np.void], table: Table, factor: float, *, allow_gaps: bool) -> None:
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
    _set_times(samples, microseconds)


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


def _set_times(samples: NDArray[np.void], microseconds: NDArray[np.int64]) -> None:
    samples["device_time_us"] = microseconds
    samples["host_time_ns"] = microseconds * 1000


def _clock_goes_on(table: Table, factor: float) -> tuple[Table, list[str]]:
    """The table with a clock that goes on where its counter begins again, and a sentence on it."""
    clock = table.columns["time"]
    values, places, period = continued_clock(clock.values, factor)
    if not len(places):
        return table, []
    begins = "0" if clock.values.min() >= 0.0 else f"{-0.5 * period:.10g}"
    bits = math.log2(period)
    length = f"2^{bits:.0f}" if bits in COUNTERS else f"{period * factor:.10g} s"
    sentence = (
        f"The clock begins at {begins} again at {_listed(table, places)}, after {length}: it was "
        "continued."
    )
    continued_time = {"time": Column(clock.heading, values)}
    return replace(table, columns={**table.columns, **continued_time}), [sentence]


def _opening_goes_on(samples: NDArray[np.void], table: Table, joint: Joint) -> list[str]:
    """Continue a position that begins again; give a sentence on it. InputError for marks in it."""
    turn = 2.0 * math.pi if joint.kind == "rotary" else None
    position = np.asarray(samples["opening"], dtype=np.float64)
    counts = table.columns["opening"].values
    continued_position, places = continued(position, counts, turn)
    if not len(places):
        _refuse_marks(counts, table)
        return []
    samples["opening"] = continued_position
    where = _listed(table, places)
    return [f"The opening begins again at {where}, after its period: it was continued."]


def _refuse_marks(counts: NDArray[np.float64], table: Table) -> None:
    """Refuse a position with marks of loss: each would be a stroke there and back."""
    marks = marks_in(counts)
    if marks:
        marked = np.flatnonzero(np.isin(counts, marks))
        listed = " or ".join(f"{value:.9g}" for value in marks)
        rows = "1 row" if len(marked) == 1 else f"{len(marked)} rows"
        raise InputError(
            f"{table.place(int(marked[0]), 'opening')}: {listed} stands in {rows} "
            "where nothing leads from or to the other values: a mark of overflow or loss, not a "
            "position. Remove those rows and allow gaps (--allow-gaps), or export the log again."
        )


def _note_on_jumps(samples: NDArray[np.void], table: Table, joint: Joint) -> list[str]:
    """Sentences on a position that jumps, and on forces and torques that pass a counter's end."""
    position = np.asarray(samples["opening"], dtype=np.float64)
    step_us = np.diff(samples["device_time_us"])
    whole = step_us <= GAP_FACTOR * float(np.median(step_us))
    unit = "deg" if joint.kind == "rotary" else "m"
    factor = math.degrees(1.0) if joint.kind == "rotary" else 1.0
    sentences = []
    jumps = jumps_in(position)
    jumps = jumps[whole[jumps - 1]]
    lone = lone_excursion(position) if len(jumps) == 0 else None
    if len(jumps):
        size = factor * float(np.median(np.abs(np.diff(position)[jumps - 1])))
        others = factor * float(np.delete(np.abs(np.diff(position)), jumps - 1).max())
        sentences.append(
            f"The opening jumps by {size:.4g} {unit} from one sample to the next at "
            f"{_listed(table, jumps)}, and by {others:.3g} {unit} at most elsewhere. If this is no "
            "motion (a sensor of an unknown period, or one that lost its place), correct or remove "
            "those rows: strokes are found from it."
        )
    elif lone is not None and np.all(whole[max(lone - 1, 0) : lone + 1]):
        sentences.append(
            f"The opening is {factor * position[lone]:.6g} {unit} at {_listed(table, [lone])} "
            "alone, farther from the samples before and after than it goes anywhere else. If this "
            "is no motion, remove that row: strokes are found from it."
        )
    for channel in ("motor_torque", "handle_force"):
        if channel in table.columns:
            bits, places = overflows(table.columns[channel].values)
            if bits:
                sentences.append(
                    f"{channel} jumps between the ends of a counter of {bits} bits at "
                    f"{_listed(table, places)}: negative numbers read without their sign, or "
                    "numbers too large for it. Export them as signed numbers, or of more bits."
                )
    return sentences


def _listed(table: Table, places: Sequence[int] | NDArray[np.int64]) -> str:
    """The first rows of some, and how many more there are."""
    listed = ", ".join(table.place(int(row)).rpartition(", ")[2] for row in places[:MOST_PLACES])
    more = f" and {len(places) - MOST_PLACES} more" if len(places) > MOST_PLACES else ""
    return listed + more


def _label(
    samples: NDArray[np.void], joint: Joint, min_travel: float | None, sheet: ArrayLike
) -> tuple[tuple[Stroke, ...], str, list[str]]:
    """Label the strokes; give them, how they were found, and sentences on what is odd in them."""
    opening = np.asarray(samples["opening"], dtype=np.float64)
    chosen = stroke_threshold(opening, joint)
    if min_travel is not None:
        chosen = StrokeThreshold(min_travel, "as given")
    labels = label_strokes(opening, samples["device_time_us"] * 1e-6, chosen.travel, sheet=sheet)
    samples["stroke"] = labels.stroke_of_sample
    counts = Counter(stroke.kind for stroke in labels.strokes)
    unit = joint.position_unit
    stroke_sentence = (
        f"{counts['closing']} closing and {counts['opening']} opening strokes were found, of at "
        f"least {chosen.travel:.3g} {unit} ({chosen.reason})."
    )
    sentences, span, noise = [], float(np.ptp(opening)), noise_of(opening)
    if NOISE_OF_STROKE * noise > max(MOST_NOISE_SHARE * span, chosen.travel):
        sentences.append(
            f"The opening goes to and fro by {noise:.3g} {unit} (standard deviation) from sample "
            f"to sample, in a range of {span:.3g} {unit}: strokes found in it may be noise. Check "
            "that the column is of one sensor."
        )
    travels = [np.ptp(opening[labels.stroke_of_sample == label.index]) for label in labels.strokes]
    if len(travels) > MANY and np.median(travels) < SHORT_SHARE * span:
        sentences.append(
            f"Half of the {len(travels)} strokes travel less than {np.median(travels):.3g} {unit}, "
            f"where the range is {span:.3g} {unit}: if these are no strokes of yours, give a "
            "larger --min-travel."
        )
    return labels.strokes, stroke_sentence, sentences


def _sizes(
    samples: NDArray[np.void], quantities: Mapping[str, Quantity], joint: Joint
) -> list[str]:
    """Sentences on channels whose numbers look as in another unit."""
    values = {
        name: np.asarray(samples[name], dtype=np.float64)
        for name in {*quantities} - {"time", SHEET}
    }
    notes = (size_note(name, values[name], joint) for name in sorted(values))
    return [note for note in notes if note]


def _general(
    source: str, columns: Mapping[str, str | int], quantities: Mapping[str, Quantity]
) -> list[str]:
    """How a log was read, alike for all that are read so."""
    missing = [channel for channel in MEASURED if channel not in columns]
    notes = [f"Imported from {source}: {describe(quantities)}."]
    return notes + ([f"Not in the file, and set to 0: {', '.join(missing)}."] if missing else [])


def _particular(
    quantities: Mapping[str, Quantity], samples: NDArray[np.void], sentences: Sequence[str]
) -> tuple[str, ...]:
    """What is particular in a log."""
    notes = [*(entry.note for entry in quantities.values() if entry.note), *sentences]
    if samples["stroke"].max() < 0:
        notes.append("No stroke was found: the joint moves less than the least travel.")
    gaps = gap_note(samples)
    cost = [gap_cost(samples["device_time_us"] * 1e-6).sentence] if gaps else []
    return (*notes, *gaps, *cost)
