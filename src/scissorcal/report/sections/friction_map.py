"""The friction map: friction over rate and opening, and where empty strokes have been."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from scissorcal.calibration.result import FitResult
from scissorcal.report.numbers import Number, finite_each, percent, short, unit_text, with_unit
from scissorcal.report.panel import Panel
from scissorcal.report.reduce import Array, thinned
from scissorcal.report.sections.friction_curve import friction_of
from scissorcal.report.sections.law import some_draws
from scissorcal.report.sections.torque import position_word
from scissorcal.report.strokes import StrokeSamples
from scissorcal.report.svg import INK, PANEL, Svg, finish, look_of, new_axes

SPEEDS, OPENINGS = 10, 9
MOST_DOTS = 500
LEVELS = 7


@dataclass(frozen=True)
class FrictionMap:
    """Size of friction on a grid: flat arrays, rate slowest; ``rate`` is signed, no rest.

    ``friction`` is the posterior mean of its size, ``sd`` its standard deviation; ``residual`` the
    mean of measured minus model near each place (in the direction of motion), None without data.
    """

    rate: tuple[Number, ...]
    opening: tuple[Number, ...]
    friction: tuple[Number, ...]
    sd: tuple[Number, ...]
    residual: tuple[Number, ...]


def map_friction(fit: FitResult) -> FrictionMap | None:
    """Friction over the rates and openings that were recorded; None for a cut or no numbers."""
    series = fit.series
    known = np.isfinite(series.opening) & np.isfinite(series.opening_rate)
    if fit.what != "friction" or not known.any() or not np.all(np.isfinite(fit.draws)):
        return None
    fastest = float(np.abs(series.opening_rate[known]).max())
    low, high = np.quantile(series.opening[known], [0.005, 0.995])
    if fastest <= 0 or high <= low:
        return None
    slowest = max(float(np.quantile(np.abs(series.opening_rate[known]), 0.01)), 0.01 * fastest)
    speeds = np.geomspace(slowest, fastest, SPEEDS)
    rate = np.concatenate([-speeds[::-1], speeds])
    opening = np.linspace(low, high, OPENINGS)
    places = [values.ravel() for values in np.meshgrid(rate, opening, indexing="ij")]
    curves = np.abs(friction_of(fit, some_draws(fit)[:, :, None], places[1], places[0]))
    residual = _residuals(fit, places[0], places[1], float(high - low) / OPENINGS)
    return FrictionMap(
        finite_each(rate, 5),
        finite_each(opening, 5),
        finite_each(curves.mean(axis=0), 5),
        finite_each(curves.std(axis=0), 3),
        finite_each(residual, 4),
    )


def show_friction_map(
    fit: FitResult, section: FrictionMap | None, strokes: tuple[StrokeSamples, ...], anchor: str
) -> Panel | None:
    """The panel: one map for each direction of motion. None where there is no map."""
    if section is None:
        return None
    where = f"{anchor}-map"
    figures = tuple(_draw(fit, section, strokes, way, where) for way in ("closing", "opening"))
    size, sd = (np.array(v, dtype=np.float64) for v in (section.friction, section.sd))
    share = float(np.max(sd / np.maximum(size, 1e-12)))
    finding = (
        f"Friction runs from {short(float(size.min()))} to "
        f"{with_unit(float(size.max()), fit.effort_unit)} over what was recorded; its standard "
        f"deviation is nowhere above {percent(share)} of it."
    )
    lead = (
        "Lines join places of equal friction; dots are samples, so the map is a guess elsewhere.",
    )
    return Panel(where, "Friction map", lead, finding, figures)


def _residuals(fit: FitResult, rate: Array, opening: Array, reach: float) -> Array:
    series = fit.series
    residual = np.sign(series.opening_rate) * (series.measured - series.predicted)
    found = np.full(len(rate), np.nan)
    for place, (w, theta) in enumerate(zip(rate, opening, strict=True)):
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = series.opening_rate / w
        near = (ratio > 0.7) & (ratio < 1.4) & (np.abs(series.opening - theta) <= reach)
        if np.count_nonzero(near) >= 5:
            found[place] = np.mean(residual[near])
    return found


def _draw(
    fit: FitResult,
    section: FrictionMap,
    strokes: tuple[StrokeSamples, ...],
    way: str,
    anchor: str,
) -> Svg:
    figure, axes = new_axes(PANEL)
    rate, opening = (np.array(v, dtype=np.float64) for v in (section.rate, section.opening))
    size = np.array(section.friction, dtype=np.float64).reshape(len(rate), len(opening))
    sign = -1.0 if way == "closing" else 1.0
    half = sign * rate > 0
    series = fit.series
    moving = [s for s in strokes if s.name.kind != "press"]
    for stroke in moving:
        at = stroke.places[sign * series.opening_rate[stroke.places] > 0]
        some = thinned(at, max(4, MOST_DOTS // max(len(moving), 1)))
        colour, marker = look_of(stroke.name.kind)
        speed = sign * series.opening_rate[some]
        axes.plot(speed, series.opening[some], marker, color=colour, ms=2.2, mew=0, alpha=0.45)
    speed, values = sign * rate[half], size[half].T
    axes.set_xscale("log")
    axes.set_xlim(float(speed.min()), float(speed.max()))
    axes.set_ylim(float(opening.min()), float(opening.max()))
    spread = float(values.max() - values.min())
    if spread > 1e-9 * float(np.abs(values).max()):
        levels = np.linspace(values.min(), values.max(), LEVELS + 2)[1:-1]
        lines = axes.contour(speed, opening, values, levels=levels, colors=INK, linewidths=1.1)
        axes.clabel(lines, fmt=lambda value: short(value, 2), fontsize=7.5, colors=INK)
    word = position_word(fit)
    axes.set_xlabel(f"speed, {_way(fit, way)} [{fit.position_unit}/s]")
    axes.set_ylabel(f"{word} [{fit.position_unit}]")
    ticks = [
        v for v in (0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0) if speed.min() <= v <= speed.max()
    ]
    axes.set_xticks(ticks, labels=[short(v) for v in ticks])
    axes.minorticks_off()
    unit = unit_text(fit.effort_unit)
    slow, fast = (
        float(values[:, np.argmin(speed)].mean()),
        float(values[:, np.argmax(speed)].mean()),
    )
    caption = (
        f"Numbers on the lines are friction in {unit}: {short(slow)} on average where slow, "
        f"{short(fast)} where fast."
    )

    return finish(figure, f"{anchor}-{way}", f"Friction map, {_way(fit, way)}", caption)


def _way(fit: FitResult, way: str) -> str:
    if fit.position_unit == "m":
        return "backward" if way == "closing" else "forward"
    return way
