"""The material's response: force at the edge against indentation, with the rungs as good."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from scissorcal.calibration import cutting_from
from scissorcal.calibration.result import FitResult
from scissorcal.model import edge_height
from scissorcal.report.numbers import Number, finite, finite_each, percent, short
from scissorcal.report.panel import Panel, absent
from scissorcal.report.reduce import Array, thinned
from scissorcal.report.sections.law import cutting_of, some_draws
from scissorcal.report.svg import (
    BLUE,
    GREEN,
    INK,
    MUTED,
    ORANGE,
    PANEL,
    PURPLE,
    VERMILLION,
    Svg,
    finish,
    label_lines,
    new_axes,
)

POINTS = 60
MOST_DOTS = 400
SUPPORT = (0.01, 0.99)
BEYOND = 1.25
"""The curve is drawn to this many times the deepest indentation that data reach."""
OTHERS = ((VERMILLION, (5, 2)), (GREEN, (1.5, 1.5)), (PURPLE, (6, 2, 1.5, 2)), (ORANGE, (3, 3)))


@dataclass(frozen=True)
class ResponseLine:
    """A rung's response at its best point over the section's indentations, N."""

    name: str
    chosen: bool
    equivalent: bool
    force: tuple[Number, ...]


@dataclass(frozen=True)
class ResponseCurve:
    """Force (N) over ``indentation`` (m): posterior mean with 5 and 95 %, and other rungs.

    Data reach from ``support_low`` to ``support_high`` (m; the inner 98 % of pressed samples).
    ``missing`` says why there is no curve.
    """

    missing: str
    support_low: Number
    support_high: Number
    indentation: tuple[Number, ...]
    force: tuple[Number, ...]
    band_low: tuple[Number, ...]
    band_high: tuple[Number, ...]
    lines: tuple[ResponseLine, ...]
    not_drawn: tuple[str, ...]


NONE = ResponseCurve("", None, None, (), (), (), (), (), ())


def trace_response(fit: FitResult) -> ResponseCurve:
    """The response with its band where data press, and the rungs that cannot be told from it."""
    indentation = _indentations(fit)
    cutting = cutting_of(fit, some_draws(fit)[:, None, :]) if indentation is not None else None
    if indentation is None or cutting is None:
        return _without("The fit holds no usable numbers to draw a response from.")
    pressed = indentation[indentation > 0]
    if len(pressed) < 3:
        return _without("No sample pressed on the material, so nothing is known of its response.")
    low, high = np.quantile(pressed, SUPPORT)
    x = np.linspace(0.0, BEYOND * float(high), POINTS)
    force = cutting.response.force_at(x[None, :])
    band = np.quantile(force, [0.05, 0.95], axis=0)
    lines, missing = [], []
    for rung in fit.rungs:
        values = _force_of(rung, fit, x)
        equivalent = bool(rung.get("equivalent", False))
        chosen = bool(rung.get("chosen", False))
        if values is not None and not chosen:
            lines.append(
                ResponseLine(str(rung["name"]), chosen, equivalent, finite_each(values, 5))
            )
        elif values is None and equivalent and not chosen:
            missing.append(str(rung["name"]))
    return ResponseCurve(
        "",
        finite(low),
        finite(high),
        finite_each(x, 5),
        finite_each(force.mean(axis=0), 5),
        finite_each(band[0], 5),
        finite_each(band[1], 5),
        tuple(lines),
        tuple(missing),
    )


def show_response(fit: FitResult, section: ResponseCurve, anchor: str) -> Panel:
    """The panel: the curve with its rungs among what was measured at the edge."""
    title, where = "Response of the material", f"{anchor}-response"
    if section.missing:
        return absent(where, title, section.missing)
    lead = [
        "Force at the edge against indentation at the crack tip. Measured torque is turned into "
        "force by the lever that the model's crack tip has."
    ]
    alike = [line.name for line in section.lines if line.equivalent]
    if alike:
        lead.append(f"The data cannot tell {', '.join(alike)} from the rung that is used.")
    if section.not_drawn:
        lead.append(
            f"{', '.join(section.not_drawn)} cannot be told apart from it either; this fit keeps "
            "no values of it to draw."
        )
    high = 1e3 * (section.support_high or 0.0)
    finding = (
        f"Data press from {short(1e3 * (section.support_low or 0.0), 2)} to {short(high, 2)} mm; "
        f"there the response is known to ± {percent(_width(section))} (median, 90 %)."
    )
    return Panel(where, title, tuple(lead), finding, (_draw(fit, section, where),))


def _draw(fit: FitResult, section: ResponseCurve, anchor: str) -> Svg:
    figure, axes = new_axes(PANEL)
    x, y, low, high = (
        np.array(v, dtype=np.float64)
        for v in (section.indentation, section.force, section.band_low, section.band_high)
    )
    indentation, force = _indentations(fit), _edge_force(fit)
    if indentation is not None and force is not None:
        pressed = np.flatnonzero((indentation > 0) & (indentation < x[-1]) & np.isfinite(force))
        some = thinned(pressed, MOST_DOTS)
        axes.plot(1e3 * indentation[some], force[some], "o", color=BLUE, ms=2.4, mew=0, alpha=0.5)
    known = (x >= (section.support_low or 0.0)) & (x <= (section.support_high or 0.0))
    axes.fill_between(1e3 * x, low, high, color=INK, alpha=0.25, lw=0)
    axes.plot(1e3 * x, y, color=INK, lw=0.9, dashes=(3, 2))
    axes.plot(1e3 * x, np.where(known, y, np.nan), color=INK, lw=1.9)
    lines = [(1e3 * x[: len(x) * 2 // 3], y[: len(x) * 2 // 3], "used", INK)]
    for line, (colour, dashes) in zip(
        sorted(section.lines, key=lambda line: not line.equivalent), OTHERS, strict=False
    ):
        other = np.array(line.force, dtype=np.float64)
        axes.plot(1e3 * x, other, color=colour, lw=1.3, dashes=dashes)
        word = line.name.partition(",")[0] + (" (as good)" if line.equivalent else "")
        lines.append((1e3 * x, other, word, colour))
    label_lines(axes, lines)
    axes.axvspan(1e3 * (section.support_high or 0.0), 1e3 * x[-1], color=MUTED, alpha=0.12, lw=0)
    axes.set_xlabel("indentation [mm]")
    axes.set_ylabel("force at the edge [N]")
    caption = (
        "Dots are measured, the line is full where they reach and dashed beyond; the shade round "
        "it holds 90 %. On the grey ground there are no data."
    )
    return finish(figure, f"{anchor}-f", "Response with its rungs", caption)


def _without(why: str) -> ResponseCurve:
    return ResponseCurve(why, None, None, (), (), (), (), (), ())


def _width(section: ResponseCurve) -> Number:
    mean, low, high, x = (
        np.array(v, dtype=np.float64)
        for v in (section.force, section.band_low, section.band_high, section.indentation)
    )
    known = (x >= (section.support_low or 0.0)) & (x <= (section.support_high or 0.0)) & (mean > 0)
    return finite(np.median(0.5 * (high - low)[known] / mean[known])) if known.any() else None


def _indentations(fit: FitResult) -> Array | None:
    """Indentation at the model's crack tip (n,), in m; None without a usable fit."""
    cutting = cutting_of(fit)
    if cutting is None or len(fit.series.opening) == 0:
        return None
    beta = fit.series.opening / cutting.moving_blades
    return np.asarray(
        cutting.upper_face_m - edge_height(cutting.edge, fit.series.contact, beta).height
    )


def _edge_force(fit: FitResult) -> Array | None:
    """Measured torque as a force at the edge (n,), in N."""
    cutting = cutting_of(fit)
    if cutting is None:
        return None
    series = fit.series
    view = edge_height(cutting.edge, series.contact, series.opening / cutting.moving_blades)
    taper = cutting.edge.slope_at(view.station)
    lever = view.lever if cutting.closure == "work" else series.contact / np.sqrt(1 + taper**2)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(series.measured / lever)


def _force_of(rung: Mapping[str, Any], fit: FitResult, x: Array) -> Array | None:
    """A compared rung's response, where the fit kept the values that it ended at."""
    values, key = rung.get("values"), rung.get("key")
    if not isinstance(values, Mapping) or not isinstance(key, Mapping):
        return None
    named = {str(name): np.asarray(value) for name, value in values.items()}
    try:
        cutting = cutting_from({**fit.structure, **key}, named)
    except KeyError:
        return None
    return np.asarray(cutting.response.force_at(x))
