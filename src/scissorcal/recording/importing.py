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
    continued,
    jumps_in,
    lone_excursion,
    marks_in,
    overflows,
)
from scissorcal.recording.import_clock import continue_clock, set_clock, set_times
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
    Quantity,
    Table,
    describe,
    quantity,
    sheets_of,
    size_note,
)
from scissorcal.recording.table_file import read_table, refuse_no_table

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
        set_times(samples, np.rint(samples["sequence"] * (1e6 / rate_Hz)).astype(np.int64))
    else:
        table, wrapped = continue_clock(table, quantities["time"].factor)
        sentences += wrapped
        set_clock(samples, table, quantities["time"].factor, allow_gaps=options.allow_gaps)
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
    where = table.places(places)
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
            f"{table.places(jumps)}, and by {others:.3g} {unit} at most elsewhere. If this is no "
            "motion (a sensor of an unknown period, or one that lost its place), correct or remove "
            "those rows: strokes are found from it."
        )
    elif lone is not None and np.all(whole[max(lone - 1, 0) : lone + 1]):
        sentences.append(
            f"The opening is {factor * position[lone]:.6g} {unit} at {table.places([lone])} "
            "alone, farther from the samples before and after than it goes anywhere else. If this "
            "is no motion, remove that row: strokes are found from it."
        )
    for channel in ("motor_torque", "handle_force"):
        if channel in table.columns:
            bits, places = overflows(table.columns[channel].values)
            if bits:
                sentences.append(
                    f"{channel} jumps between the ends of a counter of {bits} bits at "
                    f"{table.places(places)}: negative numbers read without their sign, or "
                    "numbers too large for it. Export them as signed numbers, or of more bits."
                )
    return sentences


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
