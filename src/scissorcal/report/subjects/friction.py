"""Friction by itself: the law over the rate with its band, and its map over rate and opening."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from scissorcal.calibration.friction.curve import (
    FrictionMap,
    friction_curve,
    friction_map,
    partial_residuals,
)
from scissorcal.calibration.result import FitResult
from scissorcal.report.numbers import finite, finite_each, percent, short, with_unit
from scissorcal.report.panel import Axis, Chart, Panel, Series, band, curve, points
from scissorcal.report.strokes import FittedStroke, channels_of, kind_word, look_of, thinned

MOST_DOTS = 900


def friction_panel(fit: FitResult, strokes: Sequence[FittedStroke], part: str) -> Panel | None:
    """The law among partial residuals, and its map; None for a cut or without numbers."""
    charts, sentence = [], ""
    law, chart = friction_curve(fit), friction_chart(fit, strokes, f"{part}-friction")
    if law is not None and chart is not None:
        first, last = (with_unit(finite(law.friction[at]), fit.effort_unit) for at in (0, -1))
        sentence = f"Friction at the fastest rates is {first} and {last}."
        charts.append(chart)
    found = friction_map(fit)
    if found is not None:
        low, high = float(found.friction.min()), float(found.friction.max())
        spread = float(np.max(found.sd / np.maximum(found.friction, 1e-12)))
        sentence += (
            f" Over what was recorded its size runs from {short(low)} to "
            f"{with_unit(high, fit.effort_unit)}; its standard deviation is at most "
            f"{percent(spread)} of it."
        )
        charts += [_map(fit, found, way, f"{part}-map-{way}") for way in ("closing", "opening")]
    if not charts:
        return None
    return Panel(f"{part}-law", part, "Friction", sentence.strip(), charts=tuple(charts))


def friction_chart(fit: FitResult, strokes: Sequence[FittedStroke], id_: str) -> Chart | None:
    """The law over the rate among partial residuals; None where a fit has no friction law."""
    law, words = friction_curve(fit), channels_of(fit)
    if law is None:
        return None
    partial, series = partial_residuals(fit), []
    kinds = list(dict.fromkeys(stroke.kind for stroke in strokes))
    for kind in kinds:
        places = np.concatenate([s.places for s in strokes if s.kind == kind])
        some = thinned(places, MOST_DOTS // len(kinds))
        name, rate = kind_word(kind, fit.position_unit), fit.series.opening_rate[some]
        series.append(points(name, rate, partial[some], look_of(kind), toggle=True))
    for way in (law.rate < 0, law.rate > 0):
        series.append(band("90 % of the law", law.rate[way], law.low[way], law.high[way]))
        series.append(curve("law", law.rate[way], law.friction[way]))
    at = with_unit(finite(words.scale * law.opening), words.unit)
    return Chart(
        id_,
        f"Friction over the {words.position} rate",
        Axis(f"{words.position} rate", words.rate_unit),
        Axis(f"friction {words.effort}", fit.effort_unit),
        tuple(series),
        f"The law at {at}. Marks are measured, less the model's inertia and offset.",
    )


def _map(fit: FitResult, found: FrictionMap, way: str, id_: str) -> Chart:
    words = channels_of(fit)
    sign = -1.0 if way == "closing" else 1.0
    half = sign * found.rate > 0
    speed, opening = np.meshgrid(
        sign * found.rate[half], words.scale * found.opening, indexing="ij"
    )
    cells = Series(
        "friction",
        "cells",
        finite_each(speed.ravel(), 4),
        finite_each(opening.ravel(), 4),
        value=finite_each(found.friction[half].ravel(), 4),
        look=look_of(way),
    )
    name = kind_word(way, fit.position_unit)
    return Chart(
        id_,
        f"Friction map, {name}",
        Axis(f"speed, {name}", words.rate_unit, log=True),
        Axis(words.position, words.unit),
        (cells,),
        f"Size of friction by speed and {words.position}; darker is larger.",
    )
