"""Two runs side by side: their panels, row by row."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from datetime import datetime
from typing import Literal

import numpy as np

from scissorcal.errors import InputError
from scissorcal.report.document import ReportDocument
from scissorcal.report.numbers import Number, percent, short, significant
from scissorcal.report.panel import (
    Axis,
    Chart,
    Look,
    Panel,
    Row,
    Series,
    Style,
    Value,
    absent,
    number,
    points,
    words,
)
from scissorcal.report.subjects.closing import FitOrigin
from scissorcal.report.subjects.scene import PART as SCENE
from scissorcal.report.subjects.scene import TITLE as SCENE_TITLE

ComparisonFormat = Literal["scissorcal-comparison/2"]

COMPARISON_FORMAT: ComparisonFormat = "scissorcal-comparison/2"

NOTABLE_SD = 3.0
"""A value has changed where two differ by more than this, in standard deviations."""
REACH = 2.0 * 1.6449
"""Length of a normal's 90 % interval, in standard deviations."""
NOTABLE_SHARE = 0.1
"""Or, where no standard deviation is stated, by more than this share of the larger."""
MOST_ROWS = 60
FELT_SHARE = 0.05
"""Torques below this share of the largest are not held to the tolerance."""
SKIPPED = ("decision", "verdicts", "data", "provenance", "left-out")


@dataclass(frozen=True)
class Side:
    """One of the two: where it comes from, and what it says."""

    source: str
    document: ReportDocument


@dataclass(frozen=True)
class Comparison:
    """Two runs side by side: the parameters, verdicts and torque, then all other panels' rows."""

    format: ComparisonFormat
    created: datetime
    scissorcal_version: str
    first: str
    second: str
    sentence: str
    panels: tuple[Panel, ...]


def compare(first: Side, second: Side, *, created: datetime, version: str) -> Comparison:
    """Put two runs side by side. Raises InputError naming all that makes them incomparable."""
    differences = _incomparable(first.document, second.document)
    if differences:
        raise InputError(
            f"{first.source} and {second.source} cannot be compared: {'; '.join(differences)}. "
            "Compare runs of one joint, material, scene and law; [fit] in the recipe fixes a "
            "candidate."
        )
    torque = _torque(first, second)
    pairs = [(one, two) for one in first.document.panels if (two := second.document.panel(one.id))]
    rows = [_compare_rows(a, b) for a, b in pairs if a.part not in SKIPPED and a.id != "scene-grid"]
    found = [panel for panel in rows if panel is not None]
    found.sort(key=lambda panel: not panel.id.endswith("-parameters"))
    changed = [
        row.name for panel in found if panel.id.endswith("-parameters") for row in panel.rows
        if row.marked
    ]  # fmt: skip
    limit = f"{short(NOTABLE_SD)} standard deviations"
    said = (
        f"{', '.join(dict.fromkeys(changed))} differ by more than {limit}."
        if changed
        else f"No parameter differs by more than {limit}."
    )
    summary = torque.sentence or torque.notes[0]
    return Comparison(
        COMPARISON_FORMAT,
        created,
        version,
        first.source,
        second.source,
        f"{said} {summary} {_alone(first, second)}".strip(),
        (torque, _verdicts(first.document, second.document), *found),
    )


def _incomparable(first: ReportDocument, second: ReportDocument) -> list[str]:
    """What the two must share and do not, each as a clause; empty where they can be compared."""
    found: list[str] = []
    a, b = first.scene, second.scene
    if a is not None and b is not None:
        kinds = {True: "cuts", False: "only presses"}
        for name, one, other in (
            ("the joint", a.joint, b.joint),
            ("the material", first.material, second.material),
            ("the thickness", f"{short(a.thickness_mm)} mm", f"{short(b.thickness_mm)} mm"),
            ("the kind of scene", kinds[a.cut], kinds[b.cut]),
            ("which blades move", a.moving, b.moving),
            ("the closure of the torque", a.closure, b.closure),
        ):
            if one != other:
                found.append(f"{name} differs ({one} against {other})")
    pairs = [
        (x, y) for x in first.provenance.fits for y in second.provenance.fits if x.part == y.part
    ]
    if not pairs:
        found.append("they have no fit of the same kind")
    for x, y in pairs:
        found += _unlike(first, x, second, y)
    return found


def _compare_rows(one: Panel, other: Panel) -> Panel | None:
    """The values of both panels, row by row: the parameters all, of others those that differ.

    Each row has A, B, their difference, and that in standard deviations of independent runs; runs
    that share data differ by less. None where the panels share no row.
    """
    rows: list[Row] = []
    compared = 0
    every = one.id.endswith("-parameters")
    for a in one.rows:
        b = other.row(a.name)
        if b is None:
            continue
        for x in (_centre(a),) if every else a.values:
            y = _centre(b) if every else b.value(x.name if x else "")
            if x is None or y is None:
                continue
            compared += 1
            name = a.name if every else f"{a.name}: {x.name}"
            row = _changed(name, x, y)
            if every or (str(x), x.unit) != (str(y), y.unit):
                rows.append(row)
    if not compared:
        return None
    marked = [row.name for row in rows if row.marked]
    rows.sort(key=lambda row: not (row.marked or every))
    if every:
        limit = f"more than {short(NOTABLE_SD)} standard deviations"
        sentence = (
            f"Changed by {limit}: {', '.join(marked)}."
            if marked
            else f"No parameter has changed by {limit}."
        )
    else:
        sentence = f"{len(rows)} of {compared} values differ, {len(marked)} of them notably."
    caption = (
        f"Notable: beyond {short(NOTABLE_SD)} standard deviations of the difference of independent "
        f"runs or, where none is stated, beyond {percent(NOTABLE_SHARE)}."
    )
    charts = (_changes(rows, f"{one.id}-f"),) if every else ()
    if len(rows) > MOST_ROWS:
        sentence += f" The first {MOST_ROWS} are listed."
    title = f"{one.part.capitalize()}: {one.title}"
    return Panel(
        one.id, one.part, title, sentence, tuple(rows[:MOST_ROWS]),
        tuple(chart for chart in charts if chart is not None), caption=caption,
    )  # fmt: skip


def _unlike(first: ReportDocument, a: FitOrigin, second: ReportDocument, b: FitOrigin) -> list[str]:
    for name, one, other in (
        ("effort", a.effort_unit, b.effort_unit),
        ("position", a.position_unit, b.position_unit),
    ):
        if one != other:
            return [f"the {name} of the {a.fit} fits has other units ({one} against {other})"]
    if a.law != b.law:
        return [f"the {a.fit} fits have other laws ({a.law} against {b.law})"]
    names = []
    for document in (first, second):
        panel = document.panel(f"{a.part}-parameters")
        names.append({row.name for row in panel.rows} if panel else set())
    alone = sorted(names[0] ^ names[1])
    return [f"only one of the {a.fit} fits has the parameters {', '.join(alone)}"] if alone else []


def _centre(row: Row) -> Value | None:
    """A parameter's mean, or its median where only quantiles are stated, with an sd."""
    mean, median = row.value("mean"), row.value("median, 90 %")
    if mean is None or mean.number is not None or median is None:
        return mean
    if median.low is None or median.high is None:
        return median
    return replace(median, sd=float(median.high - median.low) / REACH)


def _changed(name: str, x: Value, y: Value) -> Row:
    if x.number is None or y.number is None or x.unit != y.unit:
        same = str(x) == str(y)
        return Row(name, (words("A", str(x)), words("B", str(y))), marked=not same)
    difference = y.number - x.number
    spread = float(np.hypot(x.sd or 0.0, y.sd or 0.0))
    in_sd = difference / spread if spread > 0 else None
    larger = max(abs(x.number), abs(y.number))
    marked = (
        abs(in_sd) > NOTABLE_SD if in_sd is not None else abs(difference) > NOTABLE_SHARE * larger
    )
    values: tuple[Value, ...] = (
        replace(x, name="A", low=None, high=None),
        replace(y, name="B", low=None, high=None),
        number("B − A", difference, x.unit),
    )
    if in_sd is not None:
        values = (*values, number("in sd", in_sd, digits=2))
    return Row(name, values, marked=marked)


def _changes(rows: Sequence[Row], id_: str) -> Chart | None:
    """B against A in standard deviations, parameter by parameter."""
    shown = [(row, value) for row in rows if (value := row.value("in sd")) is not None]
    if not shown:
        return None
    ends = (-NOTABLE_SD, NOTABLE_SD)
    rim = Series(
        "chance", "bars", (ends[1],) * len(shown), tuple(float(i) for i in range(len(shown))),
        low=(ends[0],) * len(shown), look="muted",
    )  # fmt: skip
    marks = [
        points(
            name,
            [value.number for row, value in shown if row.marked == marked],
            [i for i, (row, _) in enumerate(shown) if row.marked == marked],
            "vermillion" if marked else "blue",
        )
        for name, marked in (("as before", False), ("changed", True))
    ]
    return Chart(
        id_,
        "Parameters, B against A",
        Axis("B − A in standard deviations"),
        Axis("", categories=tuple(row.name for row, _ in shown), reverse=True),
        (rim, *(mark for mark in marks if mark.x)),
        f"Within the bars, up to {short(NOTABLE_SD)}, a difference is chance.",
    )


def _verdicts(first: ReportDocument, second: ReportDocument) -> Panel:
    """Checks of both, those with another outcome first."""
    outcomes = []
    for document in (first, second):
        panel = document.panel("verdicts-all")
        found = panel.verdicts if panel else ()
        outcomes.append({f"{v.scope} {v.check}": v.status.replace("_", " ") for v in found})
    rows = []
    for name in dict.fromkeys([*outcomes[0], *outcomes[1]]):
        a, b = (own.get(name, "not made") for own in outcomes)
        both = all(name in own for own in outcomes)
        rows.append(Row(name, (words("A", a), words("B", b)), marked=both and a != b))
    rows.sort(key=lambda row: not row.marked)
    changed = sum(row.marked for row in rows)
    both_made = set(outcomes[0]) & set(outcomes[1])
    sentence = f"{changed} of {len(both_made)} checks that both made have another outcome."
    if len(rows) > len(both_made):
        sentence += f" {len(rows) - len(both_made)} checks were made by one alone."
    return Panel("verdicts-all", "verdicts", "Verdicts", sentence, tuple(rows))


def _torque(first: Side, second: Side) -> Panel:
    """Rendered torque of B minus A, over the places of the scene that both reach."""
    grids = [side.document.panel("scene-grid") for side in (first, second)]
    for side, grid in zip((first, second), grids, strict=True):
        if grid is None:
            return absent("torque", SCENE, SCENE_TITLE, _no_torque(side))
    scenes = [side.document.scene for side in (first, second)]
    if scenes[0] and scenes[1] and scenes[0].render_friction != scenes[1].render_friction:
        why = "Friction is rendered in one scene only, so the torques are not compared."
        return absent("torque", SCENE, SCENE_TITLE, why)
    assert grids[0] is not None
    assert grids[1] is not None
    others = {row.name: row for row in grids[1].rows}
    pairs = [(row, others[row.name]) for row in grids[0].rows if row.name in others]
    if not pairs:
        why = "The scenes have no place in common: their ranges differ."
        return absent("torque", SCENE, SCENE_TITLE, why)
    a, b = (np.array([_ends(pair[i]) for pair in pairs], dtype=np.float64) for i in (0, 1))
    difference = b[:, 0] - a[:, 0]
    size = np.maximum(np.abs(a[:, 0]), np.abs(b[:, 0]))
    scale = float(size.max())
    felt = size >= FELT_SHARE * scale
    apart = felt & ((a[:, 1] > b[:, 2]) | (b[:, 1] > a[:, 2]))
    tolerance = 0.01 * (scenes[0].tolerance_percent if scenes[0] else 0.0)
    beyond = felt & (np.abs(difference) > tolerance * size)
    shares = [float(np.mean(flags[felt])) if felt.any() else 0.0 for flags in (apart, beyond)]
    at = int(np.argmax(np.abs(difference)))
    most = abs(float(difference[at]))
    sentence = (
        f"Rendered torque differs by at most {significant(most)} N m "
        f"({percent(most / scale if scale else None)} of the largest torque, at "
        f"{pairs[at][0].name}); by more than the tolerance of {percent(tolerance)} at "
        f"{percent(shares[1])} of the places that can be felt, and the bands do not meet at "
        f"{percent(shares[0])}."
    )
    rows = (
        Row("largest difference", (number("B − A", difference[at], "N m"),), pairs[at][0].name),
        Row("root mean square", (number("B − A", np.sqrt(np.mean(difference**2)), "N m"),)),
        Row("mean", (number("B − A", difference.mean(), "N m"),)),
    )
    charts = _overlays(first.document, second.document)
    return Panel("torque", SCENE, SCENE_TITLE, sentence, rows, charts)


def _ends(row: Row) -> tuple[Number, Number, Number]:
    value = row.value("torque")
    return (value.number, value.low, value.high) if value else (None, None, None)


def _no_torque(side: Side) -> str:
    panel = side.document.panel("scene-torque")
    why = panel.notes[0] if panel and panel.notes else "It is a fit alone and has no scene."
    return f"{side.source}: {why}"


def _overlays(first: ReportDocument, second: ReportDocument) -> tuple[Chart, ...]:
    """The charts of both over each other: A blue and full, B vermillion and dashed."""
    panels = [document.panel("scene-torque") for document in (first, second)]
    charts = [{c.id: c for c in panel.charts} if panel else {} for panel in panels]
    found = []
    for id_, chart in charts[0].items():
        if id_ not in charts[1] or id_ == "scene-support":
            continue
        series = [
            replace(
                one, name=f"{side}, {one.name}", look=look, style=style, group=side, toggle=False
            )
            for side, own, look, style in _sides(chart, charts[1][id_])
            for one in own.series
            if one.kind in {"line", "band"}
        ]
        shown = [replace(one, style="full") if one.kind == "band" else one for one in series]
        caption = f"A is full, B dashed. {chart.caption}"
        found.append(replace(chart, series=tuple(shown), caption=caption))
    return tuple(found)


def _sides(a: Chart, b: Chart) -> tuple[tuple[str, Chart, Look, Style], ...]:
    return ("A", a, "blue", "full"), ("B", b, "vermillion", "dashed")


def _alone(first: Side, second: Side) -> str:
    have = [{fit.part for fit in side.document.provenance.fits} for side in (first, second)]
    said = [
        f"Only {name} has a fit of {', '.join(sorted(own))}."
        for name, own in (("A", have[0] - have[1]), ("B", have[1] - have[0]))
        if own
    ]
    return " ".join(said)
