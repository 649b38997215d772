"""Residuals by stroke, from the worst: what the model misses, and where."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from scissorcal.calibration.result import FitResult
from scissorcal.report.numbers import Number, finite, unit_text, with_unit
from scissorcal.report.reduce import mean, rms, thinned
from scissorcal.report.sections.torque import position_word
from scissorcal.report.sections.torque_figures import label_axes
from scissorcal.report.strokes import StrokeName, StrokeSamples
from scissorcal.report.svg import INK, PANEL, Svg, finish, look_of, new_axes

MOST_BARS = 20
MOST_DOTS = 900


@dataclass(frozen=True)
class StrokeResidual:
    """Measured minus model on one stroke, in the fit's effort unit.

    ``relative_rms`` is over the rms of what was measured; ``largest`` is the residual of greatest
    magnitude, found at ``largest_opening`` and ``largest_time_s`` (on the recording's clock).
    """

    name: StrokeName
    samples: int
    rms: Number
    relative_rms: Number
    bias: Number
    largest: Number
    largest_opening: Number
    largest_time_s: Number


def rank_residuals(fit: FitResult, strokes: Sequence[StrokeSamples]) -> tuple[StrokeResidual, ...]:
    """One row per stroke, the largest rms first; strokes without a finite residual come last."""
    rows = [_row(fit, stroke) for stroke in strokes]
    return tuple(sorted(rows, key=lambda row: -1.0 if row.rms is None else row.rms, reverse=True))


def draw_residuals(
    fit: FitResult,
    strokes: Sequence[StrokeSamples],
    rows: Sequence[StrokeResidual],
    anchor: str,
) -> tuple[Svg, ...]:
    """Bars from the worst stroke, each a link to it; then all residuals over opening and rate."""
    if not any(row.rms is not None for row in rows):
        return ()
    figures = [
        _draw_bars(fit, rows, f"{anchor}-worst"),
        _draw_spread(fit, strokes, "opening", f"{anchor}-residuals"),
    ]
    if fit.what == "friction":
        figures.append(_draw_spread(fit, strokes, "rate", f"{anchor}-residuals-rate"))
    return tuple(figures)


def _row(fit: FitResult, stroke: StrokeSamples) -> StrokeResidual:
    series, at = fit.series, stroke.places
    residual = series.measured[at] - series.predicted[at]
    scale = rms(series.measured[at])
    error = rms(residual)
    known = np.flatnonzero(np.isfinite(residual))
    worst = known[np.argmax(np.abs(residual[known]))] if len(known) else None
    return StrokeResidual(
        stroke.name,
        len(at),
        finite(error),
        finite(error / scale) if scale > 0 else None,
        finite(mean(residual)),
        None if worst is None else finite(residual[worst]),
        None if worst is None else finite(series.opening[at][worst]),
        None if worst is None else finite(series.time_s[at][worst]),
    )


def _draw_bars(fit: FitResult, rows: Sequence[StrokeResidual], anchor: str) -> Svg:
    shown = [row for row in rows if row.rms is not None][:MOST_BARS]
    height = max(1.1 + 0.19 * len(shown), 1.8)
    figure, axes = new_axes((PANEL[0], height))
    for place, row in enumerate(shown):
        colour, _ = look_of(row.name.kind)
        address = f"#{row.name.anchor}"
        axes.barh(place, row.rms or 0.0, height=0.66, color=colour, alpha=0.75, url=address)
        axes.plot(abs(row.bias or 0.0), place, "|", color=INK, ms=8, mew=1.6)
    labels = axes.set_yticks(range(len(shown)), labels=[row.name.label for row in shown])
    for tick, row in zip(labels, shown, strict=True):
        tick.label1.set_url(f"#{row.name.anchor}")
    axes.tick_params(axis="y", length=0)
    axes.grid(axis="y", visible=False)
    axes.set_ylim(len(shown) - 0.4, -0.6)
    axes.set_xlim(left=0)
    axes.locator_params(axis="x", nbins=4)
    axes.set_xlabel(f"rms residual [{unit_text(fit.effort_unit)}]")
    worst = shown[0]
    caption = (
        "Bars are the rms of measured minus model, ticks the size of its mean. A tick at the "
        "bar's end means an offset, a tick near zero scatter or ripple."
    )
    if len(shown) < len(rows):
        caption += f" These are the {len(shown)} worst of {len(rows)} strokes; the table has all."
    reading = f"{caption} Worst: {worst.name.label}, {with_unit(worst.rms, fit.effort_unit)}."
    return finish(figure, anchor, "Strokes from the worst", caption, reading)


def _draw_spread(
    fit: FitResult,
    strokes: Sequence[StrokeSamples],
    against: Literal["opening", "rate"],
    anchor: str,
) -> Svg:
    figure, axes = new_axes(PANEL)
    series = fit.series
    residual = series.measured - series.predicted
    where = series.opening if against == "opening" else series.opening_rate
    kinds = list(dict.fromkeys(stroke.name.kind for stroke in strokes))
    for kind in kinds:
        places = np.concatenate([s.places for s in strokes if s.name.kind == kind])
        some = thinned(places, MOST_DOTS // len(kinds))
        colour, marker = look_of(kind)
        axes.plot(where[some], residual[some], marker, color=colour, ms=2.6, mew=0, alpha=0.65)
    axes.axhline(0, color=INK, lw=1.0)
    word = position_word(fit)
    if against == "opening":
        label_axes(axes, fit, "opening")
    else:
        axes.set_xlabel(f"{word} rate [{fit.position_unit}/s]")
    axes.set_ylabel(f"measured − model [{unit_text(fit.effort_unit)}]")
    over = word if against == "opening" else f"{word} rate"
    caption = "All strokes. A bend or a step that recurs here is structure the model lacks."
    reading = f"{caption} Rms {with_unit(finite(rms(residual)), fit.effort_unit)}."
    return finish(figure, anchor, f"Residuals over the {over}", caption, reading)
