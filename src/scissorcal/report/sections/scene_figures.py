"""Figures of the rendered torque over the scene: along each axis, and where data support it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from scissorcal.calibration.result import FitResult
from scissorcal.recipe.schema import Recipe
from scissorcal.report.numbers import percent, short
from scissorcal.report.panel import Panel, Row, Table, columns
from scissorcal.report.reduce import thinned
from scissorcal.report.sections.law import named
from scissorcal.report.sections.scene_torque import (
    Along,
    SceneTorque,
    TorqueSlice,
    findings,
)
from scissorcal.report.svg import (
    BLUE,
    GREEN,
    INK,
    MUTED,
    PANEL,
    VERMILLION,
    Svg,
    finish,
    label_lines,
    new_axes,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes

ANCHOR = "scene"
LOOKS = ((BLUE, "o"), (VERMILLION, "^"), (GREEN, "s"))
DOTS = 160
NEAR = 0.07
"""Measured torque is drawn beside a slice within this share of each range held."""

AXES: dict[Along, tuple[str, float, str]] = {
    "opening": ("opening [°]", float(np.rad2deg(1.0)), "opening"),
    "opening_rate": ("rate [rad/s], closing is negative", 1.0, "rate"),
    "contact": ("contact [mm]", 1e3, "contact"),
}


def show_scene(section: SceneTorque, recipe: Recipe, fits: Sequence[FitResult]) -> Panel:
    """The panel: findings, torque along opening, rate and contact, the map of support."""
    title = "Rendered torque over the scene"
    if section.missing or section.grid is None:
        return Panel(ANCHOR, title, (section.missing,))
    cut = named(fits, "cut")
    assert cut is not None
    names: tuple[Along, ...] = ("opening", "opening_rate", "contact")
    figures = [_draw_along(section, name, recipe, cut) for name in names]
    figures.append(_draw_support(section))
    friction = "with friction, as the scene asks" if section.with_friction else "without friction"
    lead = (
        f"What a loop would render from these fits, {friction}. The shade holds it with "
        f"{percent(section.confidence)} probability; where none is seen, it is narrower than the "
        "line. Lines are full where data lie nearby and "
        "dashed where the model goes on alone. Marks are measured: by what they differ from the "
        "model where they were taken, they lie off the line.",
    )
    return Panel(ANCHOR, title, lead, findings(section), tuple(figures), _table(section))


def _table(section: SceneTorque) -> Table:
    found = []
    for cut in section.slices:
        torque = np.array(cut.torque, dtype=np.float64)
        half = 0.5 * (np.array(cut.band_high, dtype=np.float64) - np.array(cut.band_low, float))
        if not np.any(np.isfinite(torque)):
            continue
        at = int(np.nanargmax(np.abs(torque)))
        share = half[at] / abs(torque[at]) if torque[at] else None
        found.append(
            Row(
                (
                    f"over {AXES[cut.along][2]}, {_held(cut)}",
                    short(float(torque[at])),
                    percent(share),
                    percent(float(np.mean(cut.supported))),
                )
            )
        )
    heads = columns("Along", "Largest torque [N m]", "Band there, ±", "Has data")
    return Table("The slices that are drawn.", heads, tuple(found))


def _held(cut: TorqueSlice) -> str:
    words = []
    if cut.opening is not None:
        words.append(f"{short(float(np.rad2deg(cut.opening)))}° open")
    if cut.opening_rate is not None:
        words.append(f"{short(cut.opening_rate, 2)} rad/s")
    if cut.contact is not None:
        words.append(f"contact {short(1e3 * cut.contact)} mm")
    return ", ".join(words)


def _draw_along(section: SceneTorque, along: Along, recipe: Recipe, fit: FitResult) -> Svg:
    figure, axes = new_axes(PANEL)
    label, scale, word = AXES[along]
    cuts = [cut for cut in section.slices if cut.along == along]
    ends = []
    for cut, (colour, marker) in zip(cuts, LOOKS, strict=False):
        x = scale * np.array(cut.x, dtype=np.float64)
        y, low, high = (
            np.array(v, dtype=np.float64) for v in (cut.torque, cut.band_low, cut.band_high)
        )
        _put_dots(axes, along, cut, recipe, fit, (colour, marker), scale)
        for way in (x < 0, x >= 0) if along == "opening_rate" else (np.ones(len(x), bool),):
            axes.fill_between(x[way], low[way], high[way], color=colour, alpha=0.25, lw=0)
            axes.plot(x[way], y[way], color=colour, lw=0.9, dashes=(3, 2))
            full = np.where(np.array(cut.supported)[way], y[way], np.nan)
            axes.plot(x[way], full, color=colour, lw=1.9)
        ends.append((x, y, cut.label, colour))
    label_lines(axes, ends)
    axes.axhline(0, color=MUTED, lw=0.8)
    axes.set_xlabel(label)
    axes.set_ylabel("torque [N m]")
    held = _held_by_all(cuts[0])
    caption = f"Labels name the {'contact' if along == 'opening' else 'opening'}; {held}."
    supported = float(np.mean([np.mean(cut.supported) for cut in cuts]))
    reading = f"{caption} {percent(supported)} of what is drawn has data nearby."
    return finish(figure, f"{ANCHOR}-{word}", f"Rendered torque over the {word}", caption, reading)


def _held_by_all(cut: TorqueSlice) -> str:
    if cut.along == "opening_rate":
        return f"contact {short(1e3 * (cut.contact or 0.0))} mm, or where the crack stands"
    return f"closing at {short(abs(cut.opening_rate or 0.0), 2)} rad/s"


def _put_dots(
    axes: Axes,
    along: Along,
    cut: TorqueSlice,
    recipe: Recipe,
    fit: FitResult,
    look: tuple[str, str],
    scale: float,
) -> None:
    """Measured minus model of samples near a slice, set on the slice."""
    series, scene = fit.series, recipe.scene
    near = np.isfinite(series.measured) & np.isfinite(series.predicted)
    for name, span in (("opening", scene.opening_rad), ("contact", scene.contact_m)):
        held = getattr(cut, name)
        if held is not None:
            near &= np.abs(getattr(series, name) - held) <= NEAR * (span[1] - span[0])
    if cut.opening_rate is not None:
        near &= series.opening_rate < 0
    some = thinned(np.flatnonzero(near), DOTS // 3)
    where = getattr(series, along)[some]
    x, y = (np.array(v, dtype=np.float64) for v in (cut.x, cut.torque))
    line = np.interp(where, x, y, left=np.nan, right=np.nan)
    colour, marker = look
    dots = line + series.measured[some] - series.predicted[some]
    axes.plot(scale * where, dots, marker, color=colour, ms=2.8, mew=0, alpha=0.6)


def _draw_support(section: SceneTorque) -> Svg:
    """Where data support the torque of a closing motion: full, open, or crossed marks."""
    grid = section.grid
    assert grid is not None
    shape = (len(grid.opening), len(grid.opening_rate), len(grid.contact))
    torque, low, high = (
        np.array(v, dtype=np.float64).reshape(shape)
        for v in (grid.torque, grid.band_low, grid.band_high)
    )
    pace = shape[1] // 4
    supported = np.array(grid.supported).reshape(shape)[:, pace]
    touching = np.array(grid.touching).reshape(shape)[:, pace]
    share = 0.5 * (high - low)[:, pace] / np.maximum(np.abs(torque[:, pace]), 1e-12)
    known = np.isfinite(torque[:, pace])
    felt = known & (np.abs(torque[:, pace]) >= 0.05 * (section.largest or 0.0))
    wide = felt & (share > (section.tolerance or np.inf))
    x, y = np.meshgrid(
        np.rad2deg(np.array(grid.opening, dtype=np.float64)),
        1e3 * np.array(grid.contact, dtype=np.float64),
        indexing="ij",
    )
    figure, axes = new_axes(PANEL)
    kinds = (
        ("data nearby", known & touching & supported & ~wide, "o", BLUE, BLUE),
        ("no data, within tolerance", known & touching & ~supported & ~wide, "o", "none", INK),
        ("friction alone", known & ~touching & ~wide, ".", MUTED, MUTED),
        ("wider than tolerance", wide, "x", VERMILLION, VERMILLION),
    )
    for name, here, marker, fill, edge in kinds:
        axes.plot(
            x[here],
            y[here],
            marker,
            ms=3.5 if marker == "." else 6.5,
            mew=1.3,
            mfc=fill,
            mec=edge,
            ls="none",
            label=name,
        )
    axes.margins(0.06)
    axes.set_xlabel("opening [°]")
    axes.set_ylabel("contact [mm]")
    rate = short(abs(grid.opening_rate[pace] or 0.0), 2)
    counts = ", ".join(f"{name}: {int(here.sum())}" for name, here, *_ in kinds)
    caption = (
        f"Closing at {rate} rad/s. Full marks have data nearby, open ones none; at points the edge "
        "is off the material and only friction is felt; a cross means that the band is wider than "
        f"the tolerance. Of {int(known.sum())} places, {counts}."
    )
    return finish(figure, f"{ANCHOR}-support", "Where data support the torque", caption)
