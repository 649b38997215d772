"""Figures of torque against the model: panels of strokes at one speed, and single strokes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Literal

import numpy as np

from scissorcal.calibration.result import FitResult
from scissorcal.report.numbers import finite, significant, unit_text, with_unit
from scissorcal.report.reduce import block_means, limits_of, rms, thinned
from scissorcal.report.sections.torque import (
    StrokeCurve,
    TorqueGroup,
    TorqueSection,
    effort_word,
    position_word,
)
from scissorcal.report.strokes import StrokeSamples
from scissorcal.report.svg import INK, MUTED, PANEL, Svg, finish, look_of, new_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

MOST_DOTS = 600
MOST_STROKES = 12
MOST_PANELS = 12
OPENING_BLOCKS = 100
TIME_BLOCKS = 500

Against = Literal["opening", "time"]


def draw_torque(
    fit: FitResult, strokes: Sequence[StrokeSamples], section: TorqueSection, anchor: str
) -> tuple[Svg, ...]:
    """One panel per group, all over opening with one scale."""
    samples = {stroke.name.anchor: stroke for stroke in strokes}
    over_opening = [group for group in section.groups if group.against == "opening"]
    directed = [samples[c.name.anchor] for group in over_opening for c in group.curves]
    places = [stroke.places for stroke in directed]
    shared = np.concatenate(places) if places else np.zeros(0, np.int64)
    limits = limits_of(fit.series.measured[shared], fit.series.predicted[shared])
    panels = []
    for number, group in enumerate(section.groups[:MOST_PANELS]):
        scale = limits if group.against == "opening" else None
        panels.append(_draw_group(fit, group, samples, f"{anchor}-torque{number}", scale))
    return tuple(panels)


def draw_stroke(
    fit: FitResult, stroke: StrokeSamples, size: tuple[float, float], against: Against, anchor: str
) -> Svg:
    """One stroke alone: dots, model and band."""
    figure, axes = new_axes(size)
    _put_stroke(axes, fit, stroke, against, MOST_DOTS // 3)
    label_axes(axes, fit, against)
    series = fit.series
    residual = series.measured[stroke.places] - series.predicted[stroke.places]
    caption = f"Rms of the difference {with_unit(finite(rms(residual)), fit.effort_unit, 2)}."
    title = f"Measured {effort_word(fit)} and model against {against}, {stroke.name.label}"
    return finish(figure, anchor, title, caption)


def label_axes(axes: Axes, fit: FitResult, against: Against) -> None:
    """Name both axes with their units; an opening in radians also gets degrees on top."""
    axes.set_ylabel(f"{effort_word(fit)} [{unit_text(fit.effort_unit)}]")
    if against == "time":
        axes.set_xlabel("time [s]")
        return
    axes.set_xlabel(f"{position_word(fit)} [{fit.position_unit}]")
    if fit.position_unit == "rad":
        low, high = np.rad2deg(axes.get_xlim())
        step = 10 if high - low < 90 else 30
        if (high - low) / step > 12:
            return
        for degrees in np.arange(np.ceil(low / step) * step, high, step):
            axes.text(
                np.deg2rad(degrees),
                1.015,
                f"{degrees:.0f}°",
                transform=axes.get_xaxis_transform(),
                ha="center",
                va="bottom",
                fontsize=7.5,
                color=MUTED,
            )


def _draw_group(
    fit: FitResult,
    group: TorqueGroup,
    samples: Mapping[str, StrokeSamples],
    anchor: str,
    scale: tuple[float, float] | None,
) -> Svg:
    figure, axes = new_axes(PANEL)
    shown = [group.curves[i] for i in thinned(np.arange(len(group.curves)), MOST_STROKES)]
    dots = MOST_DOTS // max(len(shown), 1)
    for curve in shown:
        _put_stroke(axes, fit, samples[curve.name.anchor], group.against, dots)
    label_axes(axes, fit, group.against)
    if scale:
        axes.set_ylim(*scale)
    caption = _caption(fit, group, len(shown), dots)
    reading = f"Measured {effort_word(fit)} and model band against {group.against}. {caption}"
    return finish(figure, anchor, group.title, caption, reading + _reach(fit, group.curves))


def _put_stroke(
    axes: Axes, fit: FitResult, stroke: StrokeSamples, against: Against, dots: int
) -> None:
    series = fit.series
    some = thinned(stroke.places, dots)
    start = series.time_s[stroke.places[0]]
    where = series.opening if against == "opening" else series.time_s - start
    colour, marker = look_of(stroke.name.kind)
    axes.plot(where[some], series.measured[some], marker, color=colour, ms=2.6, mew=0, alpha=0.65)
    blocks = OPENING_BLOCKS if against == "opening" else TIME_BLOCKS
    x, y, low, high = (
        block_means(values[stroke.places], blocks)
        for values in (where, series.predicted, series.band_low, series.band_high)
    )
    axes.fill_between(x, low, high, color=INK, alpha=0.25, lw=0)
    axes.plot(x, y, color=INK, lw=1.0)


def _reach(fit: FitResult, curves: Sequence[StrokeCurve]) -> str:
    measured = [value for curve in curves for value in curve.measured if value is not None]
    if not measured:
        return ""
    low, high = significant(min(measured)), with_unit(max(measured), fit.effort_unit)
    return f" Measured values run from {low} to {high}."


def _caption(fit: FitResult, group: TorqueGroup, shown: int, dots: int) -> str:
    total = sum(curve.samples for curve in group.curves)
    count = len(group.curves)
    words = [
        f"{count} stroke{'s' if count != 1 else ''}, {total} samples. Measured minus model: "
        f"{with_unit(group.rms, fit.effort_unit, 2)} rms. The band is "
        f"{with_unit(group.median_band_width, fit.effort_unit, 2)} wide (median)."
    ]
    if shown < count:
        words.append(f"{shown} of the strokes are drawn.")
    if any(curve.samples > dots for curve in group.curves):
        words.append("Dots are thinned evenly.")
    return " ".join(words)
