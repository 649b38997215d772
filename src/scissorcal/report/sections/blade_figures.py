"""Figures of a blade: its edge, what the photographs' points leave over, its taper."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from scissorcal.report.numbers import Number, short, significant
from scissorcal.report.reduce import Array
from scissorcal.report.svg import (
    BLUE,
    GREEN,
    INK,
    ORANGE,
    PANEL,
    PURPLE,
    VERMILLION,
    Svg,
    finish,
    new_axes,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from scissorcal.report.sections.blade_facts import BladeEdge, EdgeBand

LOOKS = ((BLUE, "o"), (VERMILLION, "^"), (GREEN, "s"), (PURPLE, "D"))
"""Colour and marker of the first photographs; further ones take them in turn."""
SIGNS = "●▲■◆"

MOST_POINTS = 600
TALLEST = 4.0
"""Residuals beyond this multiple of their 90 % size are drawn at the rim."""


def draw_edge(edge: BladeEdge, where: str) -> Svg:
    """e(s) with its band and the nicks."""
    figure, axes = new_axes(PANEL)
    size, unit = _unit(edge)
    station = size * _array(edge.station_m)
    _band(axes, station, edge.offset_m, size)
    for number, nick in enumerate(edge.nicks, start=1):
        at = size * (nick.station_m or 0.0)
        place = float(np.interp(at, station, size * _array(edge.offset_m.mean)))
        axes.plot(at, place, "v", color=ORANGE, ms=7, mec=INK, mew=0.6)
        axes.annotate(
            f"nick {number}", (at, place), (0, 7), textcoords="offset points", ha="center",
            color=INK, fontsize=8,
        )  # fmt: skip
    axes.set_xlabel(f"s, from the pivot [{unit}]")
    axes.set_ylabel(f"e, offset [{unit}]")
    ends = size * _array(edge.offset_m.mean)[[0, -1]]
    nicks = len(edge.nicks)
    caption = (
        f"From {short(float(ends[0]))} to {short(float(ends[1]))} {unit} along "
        f"{short(float(station[-1] - station[0]))} {unit}; {nicks or 'no'} "
        f"nick{'' if nicks == 1 else 's'}. The band (5 to 95 %) is seen in the next figure."
    )
    return finish(figure, f"{where}-edge", f"Edge of the {_whose(edge)}", caption)


def draw_residuals(edge: BladeEdge, where: str) -> Svg:
    """Each photograph's points from the mean edge, with the edge's band."""
    figure, axes = new_axes(PANEL)
    size, unit = _unit(edge)
    micro, small = (1e6, "µm") if edge.metric else (1e3, "lengths/1000")
    station = size * _array(edge.station_m)
    mean = _array(edge.offset_m.mean)
    low, high = (micro * (_array(q) - mean) for q in (edge.offset_m.q05, edge.offset_m.q95))
    every = np.abs(np.concatenate([micro * _array(v.residual_m) for v in edge.views] or [mean[:0]]))
    rim = TALLEST * float(np.quantile(every, 0.9)) if len(every) else float("inf")
    thin = max(len(every) // MOST_POINTS, 1)
    beyond = 0
    for number, view in enumerate(edge.views):
        colour, marker = LOOKS[number % len(LOOKS)]
        left = micro * _array(view.residual_m)
        beyond += int(np.sum(np.abs(left) > rim))
        axes.plot(
            size * _array(view.station_m)[::thin],
            np.clip(left, -rim, rim)[::thin],
            marker,
            color=colour,
            ms=3.2,
            mew=0,
            alpha=0.7,
        )
    axes.fill_between(station, low, high, color=INK, alpha=0.22, lw=0)
    axes.axhline(0.0, color=INK, lw=1.2)
    for nick in edge.nicks:
        axes.axvline(size * (nick.station_m or 0.0), color=ORANGE, lw=1.2, ls=":")
    axes.set_xlabel(f"s, from the pivot [{unit}]")
    axes.set_ylabel(f"from the mean edge [{small}]")
    usual = significant(float(np.sqrt(np.mean(every**2))), 2) if len(every) else "not available"
    shown = f"{len(edge.views)} photographs, a mark for each"
    if len(edge.views) <= len(SIGNS):
        shown = ", ".join(
            f"{sign} {view.name}" for sign, view in zip(SIGNS, edge.views, strict=False)
        )
    caption = (
        f"Points of {shown} (rms {usual} {small}), and the edge's band (5 to "
        f"95 %), which also counts what all photographs share: at most ± "
        f"{significant(float(np.nanmax(0.5 * (high - low))), 2)} {small}."
    )
    if beyond:
        caption += f" {beyond} points lie beyond the rim."
    if not len(every):
        caption += " The points were not kept: run scissorcal fit blade --force."
    return finish(figure, f"{where}-residuals", f"Points of the {_whose(edge)}", caption)


def draw_taper(edge: BladeEdge, where: str) -> Svg:
    """alpha(s) with its band."""
    figure, axes = new_axes(PANEL)
    size, unit = _unit(edge)
    station = size * _array(edge.station_m)
    degrees = 180.0 / np.pi
    _band(axes, station, edge.taper_rad, degrees)
    low, high = (degrees * _array(q) for q in (edge.taper_rad.q05, edge.taper_rad.q95))
    room = max(0.5 * float(np.nanmax(high - low)), 0.02)
    axes.set_ylim(float(np.nanmin(low)) - room, float(np.nanmax(high)) + room)
    axes.set_xlabel(f"s, from the pivot [{unit}]")
    axes.set_ylabel("taper [°]")
    ends = degrees * _array(edge.taper_rad.mean)[[0, -1]]
    caption = (
        f"From {short(float(ends[0]))}° near the pivot to {short(float(ends[1]))}° at the tip; the "
        f"shade holds it with 90 % probability."
    )
    return finish(figure, f"{where}-taper", f"Taper of the {_whose(edge)}", caption)


def _band(axes: Axes, station: Array, band: EdgeBand, size: float) -> None:
    low, high = size * _array(band.q05), size * _array(band.q95)
    axes.fill_between(station, low, high, color=BLUE, alpha=0.25, lw=0)
    axes.plot(station, size * _array(band.mean), color=BLUE)


def _unit(edge: BladeEdge) -> tuple[float, str]:
    return (1e3, "mm") if edge.metric else (1.0, "lengths")


def _whose(edge: BladeEdge) -> str:
    return "blade" if edge.name == "blade" else f"{edge.name} blade"


def _array(values: tuple[Number, ...]) -> Array:
    return np.array(values, dtype=np.float64)
