"""The page of `summarise`: force or torque over the angle, by direction, and what it adds up to."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import TYPE_CHECKING

import numpy as np

from scissorcal.calibration.stroke_intervals import LEAST_PLATEAU, Interval, Plateau
from scissorcal.report.html import panels_page
from scissorcal.report.numbers import shown_place
from scissorcal.report.panel import (
    Axis,
    Chart,
    Look,
    Panel,
    Row,
    Series,
    Value,
    band,
    curve,
    number,
    points,
    words,
)

if TYPE_CHECKING:
    from scissorcal.aliases import Array
    from scissorcal.calibration.stroke_intervals import Curves
    from scissorcal.calibration.summary import Difference, LogSummary

PART = "summary"
LEAST_SHARE = 0.5
"""Of a stroke's travel; below it no work per length is stated."""
LOOKS: dict[str, Look] = {"closing": "closing", "opening": "opening"}


@dataclass(frozen=True)
class Shown:
    """All that the page shows. ``against`` is "blank" or "other", as the second log was given.

    ``unit`` is that of the resistance, ``place`` that of the opening in SI ("rad" or "m");
    ``cut_length_m`` the length that one stroke cuts, where it was stated; ``notes`` are those of
    reading the logs.
    """

    log: LogSummary
    second: LogSummary | None
    against: str
    apart: Difference | None
    plateau: Plateau | None
    slope: Interval
    friction: Interval | None
    unit: str
    place: str
    cut_length_m: float | None
    created: datetime
    version: str
    notes: tuple[str, ...] = ()

    @property
    def has_work(self) -> bool:
        """A force over an angle has none: without its lever it is no torque."""
        return not (self.unit == "N" and self.place == "rad")


def summary_page(shown: Shown, panels: Sequence[Panel]) -> str:
    """The offline page of `summary_panels`."""
    against = f", against {shown.second.source}" if shown.second else ""
    return panels_page(
        "Force over angle" if shown.unit == "N" else "Torque over angle",
        f"{shown.log.source}{against}",
        panels,
        made=(shown.created, shown.version),
        findings=(panels[0].sentence,),
    )


def summary_panels(shown: Shown) -> list[Panel]:
    """The panels in order: figures, curves, second log, strokes one by one, what is missing."""
    found = [_figures(shown), _curves(shown)]
    if shown.apart is not None:
        found.append(_difference(shown, shown.apart))
    return [*found, _strokes(shown), _missing(shown)]


def _figures(shown: Shown) -> Panel:
    log, place = shown.log, _place_unit(shown)
    sense = "positive: resists" if log.signed else "sign as recorded, not determined"
    rows = [_row("closing, mean", log.mean, shown.unit, f"over the range, {sense}")]
    if shown.has_work:
        rows.append(_row("work of a closing stroke", log.work, "J"))
        rows += _per_length(shown, log.work)
    if shown.plateau:
        rows += _plateau(shown, shown.plateau, "plateau, closing")
    slope = _times(shown.slope, _per(shown))
    rows.append(_row("slope, closing", slope, f"{shown.unit}/{place}"))
    if shown.friction:
        rows.append(
            _row(
                "half of closing minus opening",
                shown.friction,
                shown.unit,
                "friction, where no material is between the blades",
            )
        )
    if log.drift:
        rows.append(_row("drift from stroke to stroke", log.drift, shown.unit))
    for one in log.speeds:
        speed = _in_shown(shown, one.speed)
        rows.append(_row(f"{one.kind} at {speed:.3g} {place}/s", one.level, shown.unit))
    return Panel(
        "figures",
        PART,
        "Figures",
        _sentence(shown),
        rows=tuple(rows),
        notes=_notes(shown),
        caption=(
            "Means over strokes with 90 % intervals by Student's t; a stroke is the unit. The ends "
            "of a plateau: 5 % and 95 % of draws of the strokes with replacement."
        ),
    )


def _plateau(shown: Shown, plateau: Plateau, name: str) -> list[Row]:
    """How high a plateau is and where it begins and ends; none where it is not determined."""
    if not plateau.determined:
        return []
    rows, strokes = [_row(name, plateau.level, shown.unit)], plateau.level.strokes
    ends = (("from", plateau.low, plateau.low_ends), ("to", plateau.high, plateau.high_ends))
    for word, end, spread in ends:
        low, high = spread or (None, None)
        found = Interval(end, low, high, strokes)
        place = _times(found, 1.0 / _per(shown))
        rows.append(_row(f"{name}: {word}", place, _place_unit(shown)))
    return rows


def _on_plateau(plateau: Plateau | None) -> list[str]:
    if plateau is None or plateau.determined:
        return []
    return [
        f"Whether there is a plateau is not determined: in {1.0 - (plateau.share or 0.0):.0%} of "
        "the draws of these strokes there is none. Record more strokes."
    ]


def _sentence(shown: Shown) -> str:
    count = shown.log.mean.strokes
    ends = [_in_shown(shown, float(end)) for end in (shown.log.places[0], shown.log.places[-1])]
    sentence = (
        f"{count} closing strokes from {ends[0]:.3g} to {ends[1]:.3g} {_place_unit(shown)}: "
        f"a mean of {_words(shown.log.mean, shown.unit)}"
    )
    if shown.apart is None:
        return f"{sentence}."
    what = "more than the blank" if shown.against == "blank" else "more than the other log"
    sentence += f"; {_words(shown.apart.mean, shown.unit)} {what}"
    if shown.apart.excludes_zero is None:
        return f"{sentence} (fewer than 3 strokes: no interval)."
    leaves = "does not contain 0" if shown.apart.excludes_zero else "contains 0"
    return f"{sentence}: the interval {leaves}."


def _per_length(shown: Shown, work: Interval) -> list[Row]:
    """Work over the length that is cut within the range: as much of it as of a stroke's travel."""
    if not shown.cut_length_m or shown.log.share < LEAST_SHARE:
        return []
    within_m = shown.cut_length_m * shown.log.share
    note = (
        f"{1e3 * within_m:.3g} mm of {1e3 * shown.cut_length_m:.3g}: the range is "
        f"{shown.log.share:.0%} of a stroke, which cuts alike at every opening"
    )
    return [_row("work per length of cut", _times(work, 1.0 / within_m), "J/m", note)]


def _notes(shown: Shown) -> tuple[str, ...]:
    found = [*shown.notes, *_on_plateau(shown.plateau)]
    if shown.cut_length_m and shown.log.share < LEAST_SHARE:
        found.append(
            f"The range is {shown.log.share:.0%} of a closing stroke of {shown.log.source}: how "
            "much of the cut's length falls within it is not known, so there is no work per "
            "length. Compare with strokes over the same range."
        )
    for log in (shown.log, *((shown.second,) if shown.second else ())):
        found += _on_sign(shown, log)
        if log.left_out:
            found.append(f"{log.source}: {log.left_out} strokes do not reach over the range.")
        if log.holed:
            found.append(
                f"{log.source}: {log.holed} strokes have a hole of {LEAST_PLATEAU:.0%} of the "
                "range or more, and are left out."
            )
        if log.mean.low is None:
            found.append(f"{log.source}: fewer than 3 closing strokes, so there is no interval.")
    return tuple(found)


def _on_sign(shown: Shown, log: LogSummary) -> list[str]:
    """What decided the sign, where it was changed or is not determined."""
    what = "closing minus opening" if log.opening else "the closing strokes' mean"
    as_recorded = f"{what} is {_words(log.sign, shown.unit)} as recorded (99.8 %)"
    if log.turned:
        return [
            f"{log.source}: the sign was changed, so that what resists closing is positive: "
            f"{as_recorded}."
        ]
    if log.signed:
        return []
    return [
        f"{log.source}: which sign resists closing is not determined, and the sign is as recorded: "
        f"{as_recorded}. If it is the wrong way round, give the scale -1 (-s CHANNEL=-1); to have "
        "it determined, record more strokes in both directions."
    ]


def _curves(shown: Shown) -> Panel:
    charts = [_chart("curves", shown, shown.log)]
    if shown.second:
        charts.append(_chart("second-curves", shown, shown.second))
    return Panel(
        "curves",
        PART,
        "Curves by direction",
        charts=tuple(charts),
        caption="Lines: means over strokes. Bands: 10 % and 90 % quantiles over strokes.",
    )


def _chart(id_: str, shown: Shown, log: LogSummary) -> Chart:
    series = _curve(shown, log.closing)
    if log.opening:
        series += _curve(shown, log.opening)
    return Chart(
        id_,
        f"Strokes of {log.source}",
        Axis("opening", _place_unit(shown)),
        Axis("resistance", shown.unit),
        tuple(series),
        caption="Lines: means over strokes; bands: 10 % to 90 % of the strokes.",
    )


def _curve(shown: Shown, found: Curves) -> list[Series]:
    x, look = _places(shown), LOOKS[found.kind]
    low, high = found.envelope
    return [
        band(f"{found.kind}, 10 to 90 %", x, low, high, look),
        curve(f"{found.kind}, mean", x, found.mean, look),
    ]


def _difference(shown: Shown, apart: Difference) -> Panel:
    x = _places(shown)
    name = "log minus blank" if shown.against == "blank" else "first minus second"
    series = [curve(name, x, apart.curve, "blue")]
    if apart.low is not None and apart.high is not None:
        series.insert(0, band("90 % interval, pointwise", x, apart.low, apart.high, "blue"))
    rows = [_row("mean", apart.mean, shown.unit)]
    if shown.has_work:
        rows.append(_row("work of a closing stroke", apart.work, "J"))
        rows += _per_length(shown, apart.work)
    if apart.plateau:
        rows += _plateau(shown, apart.plateau, "plateau")
    rows.append(
        _row("slope", _times(apart.slope, _per(shown)), f"{shown.unit}/{_place_unit(shown)}")
    )
    return Panel(
        "difference",
        PART,
        "Log minus blank" if shown.against == "blank" else "First log minus second",
        rows=tuple(rows),
        notes=tuple(_on_plateau(apart.plateau)),
        charts=(
            Chart(
                "difference-chart",
                f"Closing: {name}",
                Axis("opening", _place_unit(shown)),
                Axis("resistance", shown.unit),
                tuple(series),
            ),
        ),
        caption="Closing strokes; 90 % intervals by Welch's t over strokes.",
    )


def _strokes(shown: Shown) -> Panel:
    series = []
    logs: tuple[tuple[LogSummary | None, Look], ...] = (
        (shown.log, "blue"),
        (shown.second, "orange"),
    )
    for log, look in logs:
        if log is None:
            continue
        values = log.closing.work if shown.has_work else log.closing.values.mean(axis=1)
        series.append(points(log.source, np.arange(1, len(values) + 1), values, look))
    what, unit = ("work", "J") if shown.has_work else ("mean resistance", shown.unit)
    chart = Chart(
        "strokes-chart",
        f"Closing strokes one by one: {what}",
        Axis("closing stroke"),
        Axis(what, unit),
        tuple(series),
    )
    return Panel("strokes", PART, "Strokes one by one", charts=(chart,))


def _missing(shown: Shown) -> Panel:
    needs = []
    if not shown.has_work:
        needs.append(("work", "the lever of the force: --handle-radius-mm"))
    if shown.against != "blank":
        needs.append(("friction apart from cutting", "a log of empty strokes: --blank LOG"))
    if shown.log.opening is None:
        needs.append(("friction from the log itself", "opening strokes as well as closing ones"))
    if shown.has_work and not shown.cut_length_m:
        needs.append(("work per length of cut", "that length: --cut-length-mm"))
    needs.append(
        (
            "toughness, response to indentation, sharpness of the edge",
            "a calibration: the blades' geometry, empty sweeps at several speeds, and cuts at "
            "several places of the sheet ('scissorcal init', then 'scissorcal plan')",
        )
    )
    return Panel(
        "missing",
        PART,
        "What more would need",
        rows=tuple(Row(name, (words("needs", what),)) for name, what in needs),
    )


def _row(name: str, found: Interval, unit: str, note: str = "") -> Row:
    value: Value = number("mean", found.value, unit, low=found.low, high=found.high)
    return Row(name, (value, Value("strokes", found.strokes)), note)


def _words(found: Interval, unit: str) -> str:
    return f"{number('', found.value, unit, low=found.low, high=found.high)} {unit}"


def _times(found: Interval, factor: float) -> Interval:
    ends = [None if end is None else factor * end for end in (found.low, found.high)]
    return Interval(factor * found.value, ends[0], ends[1], found.strokes)


def _place_unit(shown: Shown) -> str:
    return shown_place(shown.place)[1]


def _per(shown: Shown) -> float:
    """From a slope per rad (or m) to one per deg (or mm)."""
    return 1.0 / shown_place(shown.place)[0]


def _in_shown(shown: Shown, value: float) -> float:
    return value / _per(shown)


def _places(shown: Shown) -> Array:
    return np.asarray(shown.log.places / _per(shown))
