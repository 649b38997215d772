"""The page of `bench extremes`: where numbers stop being right, and what is said there."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from scissorcal.report.html import made_line, panel_section, parts_nav, prose, whole_page
from scissorcal.report.numbers import Number, short
from scissorcal.report.panel import (
    Axis,
    Chart,
    Look,
    Panel,
    Row,
    Series,
    count,
    number,
    percent_of,
    words,
)

if TYPE_CHECKING:
    from scissorcal.bench.extremes.cells import Outcome
    from scissorcal.bench.extremes.result import ErrorMap, Extremes, Refusal, Sweep, Total
    from scissorcal.bench.extremes.states import State

PART = "extremes"
TITLES = {
    "model": "float64 model against the exact law",
    "kernel": "float32 kernel against its tables in 50 digits",
    "tables": "tables against the exact law",
}
LOOKS: dict[str, Look] = {"model": "blue", "kernel": "vermillion", "tables": "green"}
LEAST_ERROR = 1e-17
"""Errors below are drawn here: no float64 number is closer."""

WRONG: Look = "purple"
"""How states are drawn at which something is wrong."""

MARKED: tuple[tuple[str, tuple[Outcome, ...], float], ...] = (
    ("some refused or marked", ("refused", "flagged", "not compared"), 0.5),
    ("some wrong", ("wrong",), 2.5),
)
"""Marks at the foot of a sweep: name, outcomes, and decades above `LEAST_ERROR`."""


def extremes_page(result: Extremes) -> str:
    """The offline page: totals, findings, cells, sweeps, maps, refusals and ranges."""
    panels = extremes_panels(result)
    made = made_line(result.created.strftime("%Y-%m-%d %H:%M %Z"), result.scissorcal_version)
    budget = "" if result.budget_s is None else f" of {result.budget_s:.0f} s allowed"
    facts = (
        f"{result.states} of {result.planned} planned states, seed {result.seed}, "
        f"{result.seconds:.0f} s{budget} in {result.workers} processes ({result.machine})."
    )
    body = (
        '<main><section id="decision" class="plain"><p class="kicker">Numerical stability</p>'
        f'<h1>The extremes</h1><p class="finding">{prose(result.sentence)}</p>'
        f"<p>{prose(facts)}</p>{made}</section>"
        f"{parts_nav([(panel.id, panel.title) for panel in panels])}"
    )
    body += "".join(panel_section(panel, open_=True) for panel in panels)
    return whole_page("Numerical stability at the extremes", body + "</main>")


def extremes_panels(result: Extremes) -> list[Panel]:
    """The panels of the page, in order."""
    panels = [_totals(result), _wrong(result)] if result.wrong else [_totals(result)]
    panels += [_cells(result), _sweeps(result)]
    panels += [_maps(result, subject) for subject in TITLES]
    return [
        panel
        for panel in (*panels, _refusals(result), _ranges(result))
        if panel.rows or panel.charts or panel.notes
    ]


def sweep_chart(sweep: Sweep) -> Chart:
    """Largest relative error of the torque over one quantity, a line for each subject."""
    series = []
    for subject, look in LOOKS.items():
        points = [p for p in sweep.points if p.subject == subject]
        x = tuple(_place(sweep, p.value) for p in points)
        y = tuple(_drawn(p.largest) for p in points)
        series.append(Series(subject, "line", x, y, look=look))
        series.append(Series(subject, "points", x, y, look=look))
        for name, outcomes, decades in MARKED:
            marked = [p for p in points if any(p.outcomes[o] for o in outcomes)]
            height = LEAST_ERROR * 10.0 ** (decades + 0.5 * list(LOOKS).index(subject))
            is_wrong = outcomes == ("wrong",)
            series.append(
                Series(
                    f"{subject}, {name}" if is_wrong else name,
                    "points",
                    tuple(_place(sweep, p.value) for p in marked),
                    tuple(height for _ in marked),
                    look=WRONG if is_wrong else look,
                    style="full" if is_wrong else "open",
                )
            )
    return Chart(
        f"sweep-{sweep.quantity}",
        _words(sweep.quantity),
        Axis(_words(sweep.quantity), sweep.unit, log=sweep.log),
        Axis("relative error of the torque", log=True, low=LEAST_ERROR, high=10.0),
        tuple(one for one in series if one.x),
    )


def map_chart(found: ErrorMap) -> Chart:
    """Decimal logarithm of the torque's relative error over a pair; dots where it has none."""
    cells = [c for c in found.cells if c.error is not None]
    marks: tuple[tuple[Outcome, Look], ...] = (("refused", "muted"), ("wrong", WRONG))
    places = [sorted({getattr(c, name) for c in found.cells}) for name in ("first", "second")]
    series = [
        Series(
            "log10 of the relative error",
            "cells",
            tuple(float(places[0].index(c.first)) for c in cells),
            tuple(float(places[1].index(c.second)) for c in cells),
            value=tuple(math.log10(max(c.error or 0.0, LEAST_ERROR)) for c in cells),
            look=LOOKS[found.subject],
        ),
        *(
            Series(
                name,
                "points",
                tuple(float(places[0].index(c.first)) for c in found.cells if c.outcome == name),
                tuple(float(places[1].index(c.second)) for c in found.cells if c.outcome == name),
                look=look,
            )
            for name, look in marks
        ),
    ]
    ends = [f"{short(p[0])} to {short(p[-1])}" if p else "" for p in places]
    return Chart(
        f"map-{found.subject}-{found.first}-{found.second}",
        f"{_words(found.first)} and {_words(found.second)}",
        Axis(f"{_words(found.first)}, {ends[0]} (number of the value)", low=-0.6,
             high=len(places[0]) - 0.4),
        Axis(f"{_words(found.second)}, {ends[1]}", low=-0.6, high=len(places[1]) - 0.4),
        tuple(one for one in series if one.x),
    )  # fmt: skip


def _totals(result: Extremes) -> Panel:
    rows = [_total_row(total) for total in result.totals if total.states]
    return Panel(
        "totals",
        PART,
        "Largest errors",
        result.sentence,
        tuple(rows),
        caption=(
            "Largest errors over the states that were right, by output. Near the first contact a "
            "torque is a difference of nearly equal lengths, so its relative error grows without "
            "limit while it is right for a plate that stands a few roundings elsewhere. "
            "Roundings: the largest such displacement that was needed."
        ),
    )


def _total_row(total: Total) -> Row:
    largest = {one.output: one for one in total.largest}
    torque, crack, energy = (largest.get(name) for name in ("torque", "crack", "energy"))
    return Row(
        f"{total.subject}, {total.band}",
        (
            count("states", total.states),
            *(count(name, total.outcomes[name]) for name in total.outcomes),
            number("torque, median relative", total.median_relative, digits=2),
            number("torque, relative", torque.relative if torque else None, digits=2),
            number("torque", torque.absolute if torque else None, "N m", digits=2),
            number("crack", crack.absolute if crack else None, "m", digits=2),
            number("energy", energy.absolute if energy else None, "J", digits=2),
            percent_of("exact to rounding", total.undisplaced),
            number("roundings", total.roundings, digits=2),
        ),
        note=TITLES[total.subject],
    )


def _wrong(result: Extremes) -> Panel:
    rows = [
        Row(
            f"{place + 1}, {one.subject}",
            tuple(
                number(_words(name), value, digits=3) for name, value in one.state.values.items()
            ),
            note=f"{one.sentence} ({_choices(one.state)})",
            marked=True,
        )
        for place, one in enumerate(result.wrong)
    ]
    said = "Numbers that are neither right nor refused."
    if len(rows) < result.wrong_states:
        said += f" The first {len(rows)} of {result.wrong_states} are listed."
    return Panel("wrong", PART, "Wrong", said, tuple(rows))


def _choices(state: State) -> str:
    """What a state has besides its numbers."""
    blades = "both blades move" if state.moving == 2 else "one blade moves"
    cut = "cut" if state.cut else "pressed"
    contact = "contact by indentation" if state.by_depth else "contact as given"
    return f"{state.family} response, {state.closure} closure, {blades}, {cut}, {contact}"


def _cells(result: Extremes) -> Panel:
    rows = [
        Row(
            cell.name,
            (
                words("what is extreme", cell.extreme),
                words("stated", cell.stated),
                words("truth", cell.truth),
                words("found", cell.outcome),
                number("error", cell.error, digits=2),
                number("allowed", cell.allowed, digits=2),
                count("states", cell.states),
            ),
            note=cell.sentence,
            marked=cell.outcome == "wrong",
        )
        for cell in result.cells
    ]
    notes = (f"Not run: {'; '.join(result.left_out)}.",) if result.left_out else ()
    said = "Regions with a stated behaviour each."
    return Panel("cells", PART, "Cells", said, tuple(rows), notes=notes)


def _sweeps(result: Extremes) -> Panel:
    return Panel(
        "sweeps",
        PART,
        "One quantity at a time",
        "Each quantity over its extreme range, all others everyday. Open marks at the foot: some "
        "states at that value were refused, marked as not to be used, or not compared. Purple "
        "diamonds above them: some were wrong.",
        charts=tuple(sweep_chart(sweep) for sweep in result.sweeps),
    )


def _maps(result: Extremes, subject: str) -> Panel:
    return Panel(
        f"maps-{subject}",
        PART,
        f"Pairs: {TITLES[subject]}",
        "Numbers are decimal logarithms of the torque's relative error; dots are refused states, "
        "purple diamonds wrong ones; a blank place has no torque to compare, or was not tried. "
        "Values are spaced evenly in number, from one end of the extreme range to the other.",
        charts=tuple(map_chart(one) for one in result.maps if one.subject == subject and one.cells),
    )


def _refusals(result: Extremes) -> Panel:
    rows = [
        Row(f"{one.subject}, {one.outcome} {place + 1}", (count("states", one.states),
            words("where it begins", _begins(one))), note=one.sentence)
        for place, one in enumerate(result.refusals)
    ]  # fmt: skip
    return Panel(
        "refusals", PART, "Where refusals begin",
        "Each sentence, how often it was given, and the first and last value of each quantity that "
        "got it while all others were everyday.", tuple(rows),
    )  # fmt: skip


def _begins(one: Refusal) -> str:
    spans = [f"{_words(n)} {short(low)} to {short(high)}" for n, (low, high) in one.begins.items()]
    return "; ".join(spans) or "only where several quantities are extreme"


def _ranges(result: Extremes) -> Panel:
    rows = [
        Row(
            _words(one.name),
            (
                words("unit", "" if one.unit == "1" else one.unit),
                words("everyday", _span(one.everyday)),
                words("extreme", _span(one.extreme)),
                words("spacing", one.spacing),
                words("parts", ", ".join(one.parts)),
            ),
            note=one.what,
        )
        for one in result.quantities
    ]
    return Panel("ranges", PART, "Ranges", "Every quantity that is made extreme.", tuple(rows))


def _span(ends: Sequence[float]) -> str:
    return f"{short(ends[0])} to {short(ends[1])}"


def _words(name: str) -> str:
    return name.replace("_", " ")


def _drawn(error: Number) -> Number:
    return None if error is None else min(max(error, LEAST_ERROR), 10.0)


def _place(sweep: Sweep, value: float) -> Number:
    """Where a value stands; on a logarithmic axis 0 stands a decade before the least."""
    if not sweep.log or value > 0.0:
        return value
    least = min((p.value for p in sweep.points if p.value > 0.0), default=1.0)
    return 0.1 * least


def docs_tables(result: Extremes) -> dict[str, str]:
    """The marked tables of docs/extremes.md in Markdown, by the name of their mark."""
    ranges = [
        [
            _words(q.name),
            "" if q.unit == "1" else q.unit,
            _span(q.everyday),
            _span(q.extreme),
            q.what,
        ]
        for q in result.quantities
    ]
    totals = []
    for total in result.totals:
        torque = next((one for one in total.largest if one.output == "torque"), None)
        counts = [str(total.states), *(str(total.outcomes[name]) for name in total.outcomes)]
        roundings = "" if total.roundings is None else f"{total.roundings:g}"
        errors = [total.median_relative, torque.relative if torque else None]
        words_of = ["" if error is None else f"{error:.1e}" for error in errors]
        totals.append([f"{total.subject}, {total.band}", *counts, *words_of, roundings])
    cells = [
        [c.name, c.extreme, c.stated, c.outcome, "" if c.error is None else f"{c.error:.1e}"]
        for c in result.cells
    ]
    refusals = [
        [f"{r.subject}, {r.outcome}", r.sentence, str(r.states), _begins(r)]
        for r in result.refusals
    ]
    return {
        "EXTREMES_SENTENCE": f"{result.sentence} Seed {result.seed}.",
        "EXTREMES_RANGES": _markdown(
            ["quantity", "unit", "everyday", "extreme", "what it is"], ranges
        ),
        "EXTREMES_TOTALS": _markdown(
            ["", "states", *result.totals[0].outcomes, "torque, median relative error", "largest",
             "roundings"], totals,
        ),
        "EXTREMES_CELLS": _markdown(
            ["cell", "what is extreme", "stated", "found", "error"], cells
        ),
        "EXTREMES_REFUSALS": _markdown(["", "sentence", "states", "where it begins"], refusals),
    }  # fmt: skip


def _markdown(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join(
        "| " + " | ".join(cell.replace("|", "/") for cell in row) + " |" for row in lines
    )
