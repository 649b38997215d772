"""Tables of numbers: their columns by name, and what makes SI of them.

Units, newtons per volt and the like, and whether the size of the numbers fits their unit.
"""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array, Integers
from scissorcal.errors import InputError
from scissorcal.recipe.units import conversion, parse_unit, split_unit
from scissorcal.recipe.unlikely import EVERYDAY, MARGIN
from scissorcal.recording.layout import unit_of
from scissorcal.recording.recording import Joint

Wanted = Mapping[str, str | int]
"""Channel to column: the column's heading, or its number from 0."""

LONGEST_COLUMN_NUMBER = 9
"""Digits of a column's number; a longer one is a heading."""

SHOWN = 60
"""Characters of a heading or a line that a sentence shows."""

MOST_PLACES = 3
"""Rows that a sentence lists."""


class Column(NamedTuple):
    """One column with its heading as it stands in the file, shape (N,), not yet converted."""

    heading: str
    values: Array


@dataclass(frozen=True)
class Table:
    """The wanted columns of a file by channel, all of one length, and the file's single numbers.

    ``lines`` has the line number of each row where the file is text, shape (N,). ``notes`` are
    sentences on what was left out.
    """

    path: Path
    columns: Mapping[str, Column]
    scalars: Mapping[str, float] = field(default_factory=dict)
    lines: NDArray[np.int64] | None = None
    notes: tuple[str, ...] = ()

    @property
    def length(self) -> int:
        return max((len(column.values) for column in self.columns.values()), default=0)

    def place(self, row: int, channel: str | None = None) -> str:
        """Name a row (from 0), and a channel's column, as they are found in the file."""
        where = f"line {self.lines[row]}" if self.lines is not None else f"row {row + 1}"
        column = f", column {shortened(self.columns[channel].heading)!r}" if channel else ""
        return f"{self.path}, {where}{column}"

    def places(self, rows: Sequence[int] | NDArray[np.int64]) -> str:
        """Name the first of some rows, without the file, and how many more there are."""
        listed = ", ".join(self.place(int(row)).rpartition(", ")[2] for row in rows[:MOST_PLACES])
        more = f" and {len(rows) - MOST_PLACES} more" if len(rows) > MOST_PLACES else ""
        return listed + more


def shortened(text: str) -> str:
    """A text of a file as a sentence shows it, without what is beyond ``SHOWN`` characters."""
    return text if len(text) <= SHOWN else f"{text[:SHOWN]}..."


def find_column(path: Path, headings: Sequence[str], column: str | int, channel: str) -> int:
    """Return the number of a column given by heading, heading without unit, or number.

    >>> find_column(Path("log.csv"), ["t [s]", "Torque [Nm]"], "torque", "motor_torque")
    1
    """
    if isinstance(column, str):
        for simplify in (str.strip, _plain, _without_unit):
            wanted = simplify(column)
            places = [i for i, heading in enumerate(headings) if simplify(heading) == wanted]
            if len(places) > 1:
                raise InputError(
                    f"{path} has {len(places)} columns called {column!r}. Name the one for "
                    f"{channel} by its number, from 0: {', '.join(map(str, places))}."
                )
            if places:
                return places[0]
    number = column if isinstance(column, int) else column_of(column)
    if isinstance(number, int):
        if 0 <= number < len(headings):
            return number
        raise InputError(
            f"{path} has no column {column} for {channel}: its columns are numbered 0 to "
            f"{len(headings) - 1}."
        )
    listed = ", ".join(repr(shortened(heading)) for heading in headings[:30])
    raise InputError(
        f"{path} has no column {column!r} for {channel}. Name one of these, or its number from 0: "
        f"{listed}."
    )


def column_of(word: str) -> str | int:
    """A column as a person names it: the number that it is, or else a heading.

    >>> column_of(" 12 "), column_of("²"), column_of("q")
    (12, '²', 'q')
    """
    digits = word.strip()
    return int(digits) if digits.isdecimal() and len(digits) <= LONGEST_COLUMN_NUMBER else word


def _plain(heading: str) -> str:
    return " ".join(heading.split()).casefold()


def _in_brackets(heading: str) -> tuple[str, str] | None:
    """A heading that ends in brackets, without them, and what stands in them; None for others.

    >>> _in_brackets("angle (front) [deg] "), _in_brackets("angle")
    (('angle (front) ', 'deg'), None)
    """
    text = heading.rstrip()
    if not text.endswith(("]", ")")):
        return None
    body = text[:-1]
    first = max(body.rfind("]"), body.rfind(")")) + 1
    opening = [at for mark in "[(" if (at := body.find(mark, first)) >= 0]
    return (body[: min(opening)], body[min(opening) + 1 :]) if opening else None


def _without_unit(heading: str) -> str:
    parts = _in_brackets(heading)
    return _plain(parts[0] if parts else heading)


MOST_BEYOND = 0.1
"""Share of the samples that may be marks or spikes: a size is what the others have."""


class _Slip(NamedTuple):
    """A channel's everyday range, the unit that people read, and the smaller one it may be in."""

    quantity: str
    unit: str
    per_si: float
    smaller: str
    factor: float


_SLIPS = {
    "opening": _Slip("opening", "deg", math.degrees(1.0), "deg", math.degrees(1.0)),
    "motor_torque": _Slip("torque_limit", "N m", 1.0, "mN m", 1e3),
    "handle_force": _Slip("force_limit", "N", 1.0, "mN", 1e3),
}


G_N_PER_KG = 9.80665
"""Standard gravity: load cells and servos state grams and kilograms of force."""
_GRAMS = re.compile(r"^(?P<prefix>[km]?)g(?:f)?(?P<length>[cm]?m)?$")
_POUNDS_N = {"lbf": 4.4482216152605, "ozf": 0.27801385095378125}

LONGEST_UNIT = 60
"""Characters of a unit in a heading, where kg_m2_per_s2 has 12."""
COUNTS = ("count", "counts", "tick", "ticks", "lsb", "raw")


class Quantity(NamedTuple):
    """How one channel's column becomes SI: multiply by ``factor``; ``sentence`` describes it."""

    factor: float
    sentence: str
    note: str = ""


SHEET = "sheet"
"""The column that counts fresh pieces of material from 0, -1 where none is loaded."""


def sheets_of(table: Table) -> Integers | int:
    """The sheet that each row is of, -1 without such a column; InputError for what counts none."""
    if SHEET not in table.columns:
        return -1
    values = table.columns[SHEET].values
    wrong = np.flatnonzero((values != np.rint(values)) | (values < -1.0))
    if len(wrong):
        raise InputError(
            f"{table.place(wrong[0], SHEET)}: {values[wrong[0]]:g} counts no sheet: give 0 "
            "for the first fresh piece of material, 1 for the next, -1 where none is loaded."
        )
    return values.astype(np.int64)


def quantity(
    table: Table, channel: str, unit: str | None, scale: str | float | None, joint: Joint
) -> Quantity:
    """Find the factor from a column's numbers to the channel's SI unit.

    ``unit`` is the unit of the column, also once it is multiplied by ``scale``; without it the
    heading's unit counts ("angle [deg]", "angle_deg"). Volts, amperes and counts need
    a scale, which then converts to SI, as does a scale where no unit is known. Raises InputError if
    no unit is known, or one of another kind than the channel.
    """
    column = table.columns[channel]
    if channel == SHEET:
        if unit is not None or scale is not None:
            raise InputError("A sheet is a whole number: give neither a unit nor a scale for it.")
        return Quantity(1.0, f"{channel} is {shortened(column.heading)!r}")
    target = "s" if channel == "time" else unit_of(channel, joint)
    factor = 1.0 if scale is None else _scale_factor(table, channel, scale)
    heading_unit = unit_in(column.heading)
    stated = heading_unit if unit is None else unit
    heading = shortened(column.heading)
    by = repr(heading)
    if scale is not None:
        by += f" times {factor:.9g}" if _is_number(scale) else f" times {scale} = {factor:.9g}"
    if stated is None and scale is None:
        raise InputError(
            f"{table.path}, column {heading!r}: its unit is not known. State it, for "
            f"example {channel}={_unit_word(target)}."
        )
    if stated is None or _is_raw(stated):
        if scale is None:
            raise InputError(
                f"{table.path}, column {heading!r} is in {stated}, and {channel} is in "
                f"{target}. Give a scale for {channel}, in {target} per {stated}."
            )
        return Quantity(factor, f"{channel} [{target}] is {by}")
    return Quantity(
        factor * _conversion(table, channel, stated, target, joint),
        f"{channel} is {by} [{stated}]",
        _contradiction(table, channel, heading_unit, unit),
    )


def _scale_factor(table: Table, channel: str, scale: str | float) -> float:
    """Work out a scale: a number, or numbers and single variables of the file joined by * and /.

    "gtau", "-1*gtau", "gtau/1000". Raises InputError where a name is unknown or the result is
    zero or not finite.
    """
    text = str(scale).replace(" ", "")
    sign = -1.0 if text.startswith("-") else 1.0
    parts = re.split(r"([*/])", text.removeprefix("-"))
    value = sign * _factor(table, channel, parts[0])
    for operator, part in zip(parts[1::2], parts[2::2], strict=True):
        number = _factor(table, channel, part)
        value = value * number if operator == "*" else value / number if number else math.inf
    if not math.isfinite(value) or value == 0:
        raise InputError(
            f"{table.path}: the scale {scale!r} of {channel} is {value}. Give one that is finite "
            "and not zero."
        )
    return value


def _factor(table: Table, channel: str, part: str) -> float:
    try:
        return float(part)
    except ValueError:
        if part in table.scalars:
            return table.scalars[part]
    listed = ", ".join(table.scalars) or "none"
    raise InputError(
        f"{table.path}: the scale of {channel} names {part!r}, which is neither a number nor a "
        f"single number in the file (these are: {listed}). Give a number, or join names and "
        "numbers by * and /."
    )


def _conversion(table: Table, channel: str, stated: str, target: str, joint: Joint) -> float:
    name, force = _of_force(_unit_word(stated)) if "N" in target else (_unit_word(stated), 1.0)
    unit, si = parse_unit(name), parse_unit(_unit_word(target))
    heading = shortened(table.columns[channel].heading)
    if unit is None or si is None:
        raise InputError(
            f"{table.path}, column {heading!r}: {stated!r} is not a known unit. "
            f"{channel} takes {target} and its parts and multiples (m, k, ...)."
        )
    factor = conversion(unit, si)
    if factor is None and channel == "time":  # of every joint alike
        raise InputError(
            f"{table.path}, column {heading!r}: {stated} is not a unit of time. Give a unit such "
            "as s, or name another column."
        )
    if factor is None:
        other = Joint("linear" if joint.kind == "rotary" else "rotary")
        turned = parse_unit(_unit_word(unit_of(channel, other)))
        fits = turned is not None and conversion(unit, turned) is not None
        remedy = f"Set the joint to {other.kind}" if fits else f"Give a unit such as {target}"
        raise InputError(
            f"{table.path}, column {heading!r}: {stated} is not a unit for {channel} of a "
            f"{joint.kind} joint, which is in {target}. {remedy}, or name another column."
        )
    return force * factor


def _of_force(unit: str) -> tuple[str, float]:
    """A unit in newtons for one in grams or pounds of force, and what to multiply it by.

    >>> _of_force("kgcm")
    ('Ncm', 9.80665)
    """
    if unit in _POUNDS_N:
        return "N", _POUNDS_N[unit]
    grams_unit = _GRAMS.match(unit)
    if not grams_unit:
        return unit, 1.0
    grams = {"": 1.0, "k": 1e3, "m": 1e-3}[grams_unit["prefix"]]
    return f"N{grams_unit['length'] or ''}", grams * 1e-3 * G_N_PER_KG


def _contradiction(table: Table, channel: str, heading: str | None, stated: str | None) -> str:
    """A sentence where the heading has another unit than was stated (the stated one is used)."""
    if heading is None or stated is None or parse_unit(_unit_word(heading)) is None:
        return ""
    if parse_unit(_unit_word(heading)) == parse_unit(_unit_word(stated)):
        return ""
    return (
        f"Column {shortened(table.columns[channel].heading)!r} was read in {stated}, as stated, "
        f"although its heading has {heading}."
    )


def unit_in(heading: str) -> str | None:
    """Return the unit that a heading names, in brackets or after its last words."""
    parts = _in_brackets(heading)
    if parts:
        text = parts[1].strip()[: LONGEST_UNIT + 1]
        known = _is_raw(text) or parse_unit(_of_force(_unit_word(text))[0])
        return text if known else None
    heading = heading.strip()[-LONGEST_UNIT:]
    _, unit = split_unit(heading)
    if unit:
        return unit.name
    last = heading.rpartition("_")[2]
    is_force = last != heading and _of_force(last)[0] != last
    return last if is_force else None


def _is_number(scale: str | float) -> bool:
    try:
        float(scale)
    except ValueError:
        return False
    return True


def _is_raw(unit: str) -> bool:
    if unit.strip().lower() in COUNTS:
        return True
    known = parse_unit(_unit_word(unit))
    return known is not None and {name for name, _ in known.dimension} & {"V", "A"} != set()


def _unit_word(unit: str) -> str:
    """Normalise a unit as in names: ``mN m`` and ``mN*m`` are ``mNm``, micro is ``u``."""
    text = re.sub(r"[\s*·⋅.]", "", unit).replace("µ", "u").replace("μ", "u")
    return {"°": "deg", "sec": "s", "msec": "ms"}.get(text, text)


def describe(quantities: Mapping[str, Quantity]) -> str:
    """One sentence on how each channel was converted."""
    return "; ".join(entry.sentence for entry in quantities.values())


def size_note(channel: str, values: Array, joint: Joint) -> str:
    """A sentence where a channel (m,), in SI, is as large as in a smaller unit; else empty.

    Too large is what lies within a factor of 1.5 of the least everyday value written in that unit,
    or beyond, as in a recipe (:mod:`scissorcal.recipe.unlikely`). Of an opening the range counts,
    of others the magnitude. Of a linear joint only the force on the handle is judged.

    >>> size_note("handle_force", np.array([1200.0, 2900.0, 2400.0]), Joint())[:44]
    'handle_force reaches 2900 N, where scissors '
    """
    slip = _SLIPS.get(channel)
    if slip is None or (joint.kind == "linear" and channel != "handle_force"):
        return ""
    everyday = EVERYDAY[slip.quantity]
    tail = 0.5 * MOST_BEYOND
    low, high = np.quantile(values, (tail, 1.0 - tail), method="nearest")
    size = float(high - low if channel == "opening" else max(abs(low), abs(high)))
    if not size >= everyday.low * slip.factor / MARGIN:
        return ""
    verb = "covers" if channel == "opening" else "reaches"
    least, most = (f"{slip.per_si * value:.3g}" for value in everyday.ends)
    return (
        f"{channel} {verb} {slip.per_si * size:.4g} {slip.unit}, where scissors have {least} to "
        f"{most} {slip.unit} ({everyday.why}). If its numbers are in {slip.smaller}, import it "
        f"with -u {channel}={slip.smaller.replace(' ', '')}."
    )
