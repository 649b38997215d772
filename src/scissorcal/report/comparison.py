"""Two runs side by side: parameters, verdicts, held-out errors, torque over the scene."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Literal

import numpy as np

from scissorcal.errors import InputError
from scissorcal.report.document import FitSection, ReportDocument, SceneFacts
from scissorcal.report.numbers import Number, finite, percent, short, significant
from scissorcal.report.sections.scene_torque import SceneTorque, TorquePlace
from scissorcal.report.sections.verdicts import VerdictRow
from scissorcal.verdicts import Status

ComparisonFormat = Literal["scissorcal-comparison/1"]

COMPARISON_FORMAT: ComparisonFormat = "scissorcal-comparison/1"

NOTABLE_SD = 3.0
"""A parameter has changed where the two differ by more than this, in standard deviations."""


@dataclass(frozen=True)
class Side:
    """One of the two: where it comes from, and what of it is known. ``scene`` None is unknown."""

    source: str
    material: str
    scene: SceneFacts | None
    verdicts: tuple[VerdictRow, ...]
    fits: tuple[FitSection, ...]
    scene_torque: SceneTorque | None


@dataclass(frozen=True)
class ParameterChange:
    """One parameter of both; ``in_sd`` is second minus first over the sd of that difference.

    The two are taken as independent: runs that share data differ by less than that lets expect.
    """

    name: str
    unit: str
    first: Number
    first_sd: Number
    second: Number
    second_sd: Number
    difference: Number
    in_sd: Number
    changed: bool


@dataclass(frozen=True)
class VerdictChange:
    """One check of both; None where a side did not make it."""

    scope: str
    check: str
    first: Status | None
    second: Status | None
    changed: bool


@dataclass(frozen=True)
class FitComparison:
    """A fit that both have. ``same_inputs`` says that recordings, settings and effort are equal."""

    what: str
    rung: str
    effort_unit: str
    efforts: tuple[str, str]
    same_inputs: bool
    parameters: tuple[ParameterChange, ...]
    held_out_median: tuple[Number, Number]
    held_out_worst: tuple[Number, Number]


@dataclass(frozen=True)
class TorqueComparison:
    """Rendered torque of the second minus the first, over the grid of the scene, in N m.

    ``apart`` is the share of places that can be felt at which the two bands do not meet, ``felt``
    the share at which the two differ by more than the scene's tolerance. ``missing`` says why there
    is none.
    """

    missing: str
    sentence: str
    rms: Number
    largest: TorquePlace | None
    largest_difference: Number
    apart: Number
    felt: Number
    difference: tuple[Number, ...]


@dataclass(frozen=True)
class Comparison:
    """Two runs side by side. ``only_first`` and ``only_second`` name fits that one alone has."""

    format: ComparisonFormat
    created: datetime
    scissorcal_version: str
    first: str
    second: str
    sentence: str
    fits: tuple[FitComparison, ...]
    verdicts: tuple[VerdictChange, ...]
    torque: TorqueComparison
    only_first: tuple[str, ...]
    only_second: tuple[str, ...]


def side_of(document: ReportDocument, source: str) -> Side:
    """A report as one side of a comparison."""
    return Side(
        source,
        document.material,
        document.scene,
        document.verdicts.rows,
        document.fits,
        document.scene_torque,
    )


def compare(first: Side, second: Side, *, created: datetime, version: str) -> Comparison:
    """Put two runs side by side. Raises InputError naming all that makes them incomparable."""
    differences = incomparable(first, second)
    if differences:
        raise InputError(
            f"{first.source} and {second.source} cannot be compared: {'; '.join(differences)}. "
            "Compare runs of one joint, material, scene and law; [fit] in the recipe fixes a rung."
        )
    pairs = [(a, b) for a in first.fits for b in second.fits if a.what == b.what]
    fits = tuple(_compare_fits(a, b) for a, b in pairs)
    torque = _compare_torque(first, second)
    have = [{fit.what for fit in side.fits} for side in (first, second)]
    return Comparison(
        COMPARISON_FORMAT,
        created,
        version,
        first.source,
        second.source,
        _sentence(fits, torque),
        fits,
        _compare_verdicts(first.verdicts, second.verdicts),
        torque,
        tuple(sorted(have[0] - have[1])),
        tuple(sorted(have[1] - have[0])),
    )


def incomparable(first: Side, second: Side) -> list[str]:
    """What the two must share and do not, each as a clause; empty where they can be compared."""
    found: list[str] = []
    a, b = first.scene, second.scene
    if a is not None and b is not None:
        words = {True: "cuts", False: "only presses"}
        for name, one, other in (
            ("the joint", a.joint, b.joint),
            ("the material", first.material, second.material),
            ("the thickness", f"{short(a.thickness_mm)} mm", f"{short(b.thickness_mm)} mm"),
            ("the kind of scene", words[a.cut], words[b.cut]),
            ("which blades move", a.moving, b.moving),
            ("the closure of the torque", a.closure, b.closure),
        ):
            if one != other:
                found.append(f"{name} differs ({one} against {other})")
    pairs = [(x, y) for x in first.fits for y in second.fits if x.what == y.what]
    if not pairs:
        found.append("they have no fit of the same kind")
    for x, y in pairs:
        found += _unlike(x, y)
    return found


def _unlike(a: FitSection, b: FitSection) -> list[str]:
    for name, one, other in (
        ("effort", a.effort_unit, b.effort_unit),
        ("position", a.position_unit, b.position_unit),
    ):
        if one != other:
            return [f"the {name} of the {a.what} fits has other units ({one} against {other})"]
    if a.rung != b.rung:
        return [f"the {a.what} fits have other laws ({a.rung} against {b.rung})"]
    have, others = ({p.name: p.unit for p in fit.parameters} for fit in (a, b))
    alone = sorted(set(have) ^ set(others))
    if alone:
        return [f"only one of the {a.what} fits has the parameters {', '.join(alone)}"]
    units = sorted(name for name in have if have[name] != others[name])
    return [f"the {a.what} fits have other units of {', '.join(units)}"] if units else []


def _compare_fits(a: FitSection, b: FitSection) -> FitComparison:
    others = {parameter.name: parameter for parameter in b.parameters}
    rows = []
    for one in a.parameters:
        other = others[one.name]
        difference, in_sd = None, None
        if one.mean is not None and other.mean is not None:
            difference = finite(other.mean - one.mean)
            spread = float(np.hypot(one.sd or 0.0, other.sd or 0.0))
            in_sd = finite((other.mean - one.mean) / spread) if spread > 0 else None
        changed = in_sd is not None and abs(in_sd) > NOTABLE_SD
        values = (one.mean, one.sd, other.mean, other.sd)
        rows.append(ParameterChange(one.name, one.unit, *values, difference, in_sd, changed))
    return FitComparison(
        a.what,
        a.rung,
        a.effort_unit,
        (a.effort, b.effort),
        a.inputs_hash == b.inputs_hash != "",
        tuple(rows),
        (a.held_out.median_relative_rms, b.held_out.median_relative_rms),
        (a.held_out.worst_relative_rms, b.held_out.worst_relative_rms),
    )


def _compare_verdicts(
    first: Sequence[VerdictRow], second: Sequence[VerdictRow]
) -> tuple[VerdictChange, ...]:
    """Checks of both that came out otherwise first."""
    outcomes: list[dict[tuple[str, str], Status]] = [
        {(row.scope, row.check): row.status for row in rows} for rows in (first, second)
    ]
    keys = dict.fromkeys([*outcomes[0], *outcomes[1]])
    found = [
        VerdictChange(*key, (a := outcomes[0].get(key)), (b := outcomes[1].get(key)), a != b)
        for key in keys
    ]
    return tuple(sorted(found, key=lambda row: not row.changed))


def _compare_torque(first: Side, second: Side) -> TorqueComparison:
    a, b = first.scene_torque, second.scene_torque
    missing = _no_torque(first, second)
    if missing or a is None or b is None or a.grid is None or b.grid is None:
        return TorqueComparison(missing, missing, None, None, None, None, None, ())
    one, other = (np.array(grid.torque, dtype=np.float64) for grid in (a.grid, b.grid))
    difference = other - one
    known = np.isfinite(difference)
    scale = max(a.largest or 0.0, b.largest or 0.0)
    felt = known & (np.maximum(np.abs(one), np.abs(other)) >= 0.05 * scale)
    low, high = (
        [np.array(getattr(grid, name), dtype=np.float64) for grid in (a.grid, b.grid)]
        for name in ("band_low", "band_high")
    )
    apart = felt & ((low[0] > high[1]) | (low[1] > high[0]))
    tolerance = (a.tolerance or 0.0) * np.maximum(np.abs(one), np.abs(other))
    more = felt & (np.abs(difference) > tolerance)
    if not known.any():
        why = "Neither scene has a place that both reach."
        return TorqueComparison(why, why, None, None, None, None, None, ())
    at = int(np.nanargmax(np.abs(difference)))
    place = _place(a, at, one[at], difference[at])
    shares = [float(np.mean(flags[felt])) if felt.any() else 0.0 for flags in (apart, more)]
    most = abs(float(difference[at]))
    sentence = (
        f"Rendered torque differs by at most {significant(most)} N m "
        f"({percent(most / scale if scale else None)} of the largest torque); by more than the "
        f"tolerance of {percent(a.tolerance)} at {percent(shares[1])} of the places that can be "
        f"felt, and the bands do not meet at {percent(shares[0])}."
    )
    return TorqueComparison(
        "",
        sentence,
        finite(np.sqrt(np.mean(difference[known] ** 2))),
        place,
        finite(difference[at]),
        shares[0],
        shares[1],
        tuple(finite(value) for value in difference),
    )


def _no_torque(first: Side, second: Side) -> str:
    for side in (first, second):
        if side.scene_torque is None:
            return f"{side.source} is a fit alone, so it has no scene to compare torque over."
        if side.scene_torque.missing or side.scene_torque.grid is None:
            return f"{side.source}: {side.scene_torque.missing}"
    a, b = (side.scene_torque.grid for side in (first, second) if side.scene_torque)
    if a is None or b is None:
        return ""
    for name in ("opening", "opening_rate", "contact"):
        if getattr(a, name) != getattr(b, name):
            return (
                f"The scenes have other ranges of {name.replace('_', ' ')}, so their torques are "
                "not differenced."
            )
    if first.scene and second.scene and first.scene.render_friction != second.scene.render_friction:
        return "Friction is rendered in one scene only, so the torques are not differenced."
    return ""


def _place(torque: SceneTorque, at: int, value: float, difference: float) -> TorquePlace:
    grid = torque.grid
    assert grid is not None
    shape = (len(grid.opening), len(grid.opening_rate), len(grid.contact))
    i, j, k = np.unravel_index(at, shape)
    share = abs(difference / value) if value else None
    return TorquePlace(
        grid.opening[int(i)],
        grid.opening_rate[int(j)],
        grid.contact[int(k)],
        finite(value),
        finite(abs(difference)),
        finite(share),
    )


def _sentence(fits: Sequence[FitComparison], torque: TorqueComparison) -> str:
    changed = [row.name for fit in fits for row in fit.parameters if row.changed]
    if changed:
        words = f"{', '.join(changed)} differ by more than {short(NOTABLE_SD)} standard deviations."
    else:
        words = f"No parameter differs by more than {short(NOTABLE_SD)} standard deviations."
    return f"{words} {torque.sentence}"
