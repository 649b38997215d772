"""The rendered torque over the scene: along its axes, where data support it, place by place."""

from __future__ import annotations

import numpy as np

from scissorcal.calibration.result import FitResult
from scissorcal.package.scene_torque import Along, Places, SceneTorque
from scissorcal.recipe.schema import Recipe
from scissorcal.report.numbers import finite, percent, short, with_unit
from scissorcal.report.panel import (
    Axis,
    Chart,
    Look,
    Panel,
    Row,
    Series,
    Style,
    absent,
    band,
    curve,
    number,
    percent_of,
    points,
    words,
)
from scissorcal.report.strokes import thinned

PART = "scene"
TITLE = "Rendered torque over the scene"
LOOKS: tuple[Look, ...] = ("blue", "vermillion", "green")
DOTS = 50
NEAR = 0.07
"""Measured torque is drawn beside a slice within this share of each range held."""
DEGREES = float(np.degrees(1.0))
AXES: dict[Along, tuple[str, str, float]] = {
    "opening": ("opening", "°", DEGREES),
    "opening_rate": ("rate", "rad/s", 1.0),
    "contact": ("contact", "mm", 1e3),
}


def scene_panels(
    rendered: SceneTorque | None, why: str, recipe: Recipe, cut: FitResult | None
) -> tuple[Panel, ...]:
    """The slices with the map of support, and the torque at every place of the grid."""
    if rendered is None or cut is None:
        return (absent("scene-torque", PART, TITLE, why),)
    charts = tuple(_along(rendered, along, recipe, cut) for along in AXES)
    friction = "with friction, as the scene asks" if rendered.with_friction else "without friction"
    note = (
        f"What a loop would render from these fits, {friction}. The shade holds it with "
        f"{percent(rendered.confidence)} probability. Lines are full where data lie nearby and "
        "dashed where the model extrapolates. Marks are measured: they lie off the line by their "
        "difference from the model where they were taken."
    )
    rows = tuple(
        _slice_row(along, places)
        for along, slices in rendered.slices.items()
        for places in slices
        if np.any(np.isfinite(places.torque))
    )
    torque = Panel(
        "scene-torque", PART, TITLE, scene_sentence(rendered), rows,
        (*charts, _support(rendered)), notes=(note,), caption="The slices that are drawn.",
    )  # fmt: skip
    return torque, _grid_panel(rendered)


def scene_sentence(scene: SceneTorque) -> str:
    """How well the torque is known over the scene, in words."""
    said = [
        f"The torque is known to within the tolerance of {percent(scene.tolerance)} (with "
        f"{percent(scene.confidence)} probability) at {percent(scene.within_tolerance)} of the "
        f"places that can be felt; {percent(scene.supported)} of them have data nearby."
    ]
    at = scene.worst
    if at is not None:
        grid = scene.grid
        said.append(
            f"It is least certain at {_held(grid, at, ())}: "
            f"{with_unit(finite(grid.torque[at]), 'N m')} ± {percent(scene.share[at])}."
        )
    if scene.not_in_band:
        named = ", ".join(f"{name} up to {percent(share)}" for name, share in scene.not_in_band)
        said.append(
            f"The band does not include what was not measured, as shares of the mean torque: "
            f"{named}. The verdicts say what to measure."
        )
    said += scene.beyond_data
    return " ".join(said)


def _held(places: Places, at: int, without: tuple[Along, ...]) -> str:
    said = []
    for along, (_, unit, scale) in AXES.items():
        if along not in without:
            value = short(finite(scale * getattr(places, along)[at]))
            gap = "" if unit == "°" else " "
            lead = "contact " if along == "contact" else ""
            said.append(f"{lead}{value}{gap}{unit}")
    return ", ".join(said)


def _slice_row(along: Along, places: Places) -> Row:
    torque = places.torque
    at = int(np.nanargmax(np.abs(torque)))
    half = 0.5 * (places.high[at] - places.low[at])
    return Row(
        f"over {AXES[along][0]}, {_held(places, at, (along,))}",
        (
            number("largest torque", torque[at], "N m"),
            percent_of("band there, ±", half / abs(torque[at]) if torque[at] else None),
            percent_of("has data", float(np.mean(places.supported))),
        ),
    )


def _along(scene: SceneTorque, along: Along, recipe: Recipe, cut: FitResult) -> Chart:
    name, unit, scale = AXES[along]
    slices = scene.slices[along]
    series: list[Series] = []
    shown: Along = "contact" if along == "opening" else "opening"
    for places, look in zip(slices, LOOKS, strict=True):
        x = scale * getattr(places, along)
        label = _label(places, shown)
        series.append(_marks(places, along, recipe, cut, look, label))
        for way in (x < 0, x >= 0) if along == "opening_rate" else (np.ones(len(x), bool),):
            full = np.where(places.supported, places.torque, np.nan)
            ends = (places.low[way], places.high[way])
            series.append(band(f"band, {label}", x[way], *ends, look, group=label))
            beyond = curve(f"without data, {label}", x[way], places.torque[way], look,
                           style="dashed", group=label)  # fmt: skip
            series += [beyond, curve(label, x[way], full[way], look, group=label, toggle=True)]
    held = slices[0]
    at = (
        f"contact {short(1e3 * float(held.contact[0]))} mm, or where the crack stands"
        if along == "opening_rate"
        else f"closing at {short(abs(float(held.opening_rate[0])), 2)} rad/s"
    )
    label = "rate (closing is negative)" if along == "opening_rate" else name
    caption = f"By {AXES[shown][0]}; {at}."
    return Chart(
        f"scene-{name}", f"Rendered torque over the {name}", Axis(label, unit),
        Axis("torque", "N m"), tuple(series), caption,
    )  # fmt: skip


def _label(places: Places, shown: Along) -> str:
    name, unit, scale = AXES[shown]
    value = short(float(scale * getattr(places, shown)[0]))
    return f"{name} {value}{'' if unit == '°' else ' '}{unit}"


def _marks(
    places: Places, along: Along, recipe: Recipe, cut: FitResult, look: Look, label: str
) -> Series:
    """Measured minus model of samples near a slice, set on the slice."""
    series, scene = cut.series, recipe.scene
    near = np.isfinite(series.measured) & np.isfinite(series.predicted)
    for name, span in (("opening", scene.opening_rad), ("contact", scene.contact_m)):
        if name != along:
            held = float(getattr(places, name)[0])
            near &= np.abs(getattr(series, name) - held) <= NEAR * (span[1] - span[0])
    if along != "opening_rate":
        near &= series.opening_rate < 0
    some = thinned(np.flatnonzero(near), DOTS)
    where = getattr(series, along)[some]
    line = np.interp(where, getattr(places, along), places.torque, left=np.nan, right=np.nan)
    offset = series.measured[some] - series.predicted[some]
    return points(f"measured, {label}", AXES[along][2] * where, line + offset, look, group=label)


def _support(scene: SceneTorque) -> Chart:
    """Where data support the torque of a closing motion, at one rate of the grid."""
    grid = scene.grid
    rates = np.unique(grid.opening_rate)
    pace = rates[len(rates) // 4]
    here = grid.opening_rate == pace
    share, known = scene.share[here], np.isfinite(grid.torque[here])
    wide = known & (share > scene.tolerance)
    touching, supported = grid.touching[here], grid.supported[here]
    x, y = DEGREES * grid.opening[here], 1e3 * grid.contact[here]
    kinds: tuple[tuple[str, np.ndarray, Look, Style], ...] = (
        ("data nearby", known & touching & supported & ~wide, "blue", "full"),
        ("no data (within tolerance)", known & touching & ~supported & ~wide, "purple", "full"),
        ("friction alone", known & ~touching & ~wide, "muted", "open"),
        ("wider than tolerance", wide, "vermillion", "full"),
    )
    counts = ", ".join(f"{name}: {int(flags.sum())}" for name, flags, *_ in kinds)
    caption = (
        f"Closing at {short(abs(float(pace)), 2)} rad/s. Of {int(known.sum())} places, {counts}. "
        "Where friction acts alone, the edge is off the material."
    )
    series = tuple(
        points(name, x[flags], y[flags], look, style=style, toggle=True)
        for name, flags, look, style in kinds
    )
    axes = (Axis("opening", "°"), Axis("contact", "mm"))
    return Chart("scene-support", "Where data support the torque", *axes, series, caption)


def _grid_panel(scene: SceneTorque) -> Panel:
    grid = scene.grid
    rows = []
    for at in np.flatnonzero(np.isfinite(grid.torque)):
        nearby = "yes" if grid.supported[at] else "no"
        rows.append(
            Row(
                _held(grid, int(at), ()),
                (
                    number("torque", grid.torque[at], "N m", low=grid.low[at], high=grid.high[at]),
                    words("data nearby", nearby),
                    words("edge on the material", "yes" if grid.touching[at] else "no"),
                ),
            )
        )
    caption = (
        f"Torque at each place of a grid over the scene, with the interval that holds it with "
        f"{percent(scene.confidence)} probability. Negative rates close."
    )
    return Panel("scene-grid", PART, "Rendered torque by place", rows=tuple(rows), caption=caption)
