"""Conversion of a column's numbers to SI: units, newtons per volt and the like, and size."""

import math
import re
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from scissorcal.aliases import Array
from scissorcal.errors import InputError
from scissorcal.recipe.units import conversion, parse_unit, split_unit
from scissorcal.recipe.unlikely import EVERYDAY, MARGIN
from scissorcal.recording.layout import unit_of
from scissorcal.recording.recording import Joint
from scissorcal.recording.table import Table, in_brackets, shortened

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
    target = "s" if channel == "time" else unit_of(channel, joint)
    factor = 1.0 if scale is None else _scale_factor(table, channel, scale)
    heading_unit = _unit_in(column.heading)
    stated = heading_unit if unit is None else unit
    heading = shortened(column.heading)
    by = repr(heading)
    if scale is not None:
        by += f" times {factor:.9g}" if _is_number(scale) else f" times {scale} = {factor:.9g}"
    if stated is None and scale is None:
        raise InputError(
            f"{table.path}, column {heading!r}: its unit is not known. State it, for "
            f"example {channel}={_plain(target)}."
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
    name, force = _of_force(_plain(stated)) if "N" in target else (_plain(stated), 1.0)
    unit, si = parse_unit(name), parse_unit(_plain(target))
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
        turned = parse_unit(_plain(unit_of(channel, other)))
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
    if heading is None or stated is None or parse_unit(_plain(heading)) is None:
        return ""
    if parse_unit(_plain(heading)) == parse_unit(_plain(stated)):
        return ""
    return (
        f"Column {shortened(table.columns[channel].heading)!r} was read in {stated}, as stated, "
        f"although its heading has {heading}."
    )


def _unit_in(heading: str) -> str | None:
    """Return the unit that a heading names, in brackets or after its last words."""
    parts = in_brackets(heading)
    if parts:
        text = parts[1].strip()[: LONGEST_UNIT + 1]
        known = _is_raw(text) or parse_unit(_of_force(_plain(text))[0])
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
    known = parse_unit(_plain(unit))
    return known is not None and {name for name, _ in known.dimension} & {"V", "A"} != set()


def _plain(unit: str) -> str:
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
