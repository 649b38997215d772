"""The picture of the decision page: torque, friction, the edge; and the bar of errors."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from scissorcal.calibration.result import FitResult
from scissorcal.package.scene_torque import SceneTorque
from scissorcal.report.numbers import finite, percent, with_unit
from scissorcal.report.panel import Axis, Chart, Panel, Series, band, curve, points
from scissorcal.report.strokes import (
    FittedStroke,
    block_means,
    channels_of,
    group_strokes,
    look_of,
    rms,
    thinned,
)
from scissorcal.report.subjects.friction import friction_chart

MOST_DOTS = 500
BLOCKS = 60
THUMBNAIL_PX = 420


def overview_panel(
    fits: Mapping[str, FitResult],
    strokes: Mapping[str, Sequence[FittedStroke]],
    photographed: Sequence[Panel],
    id_: str,
    part: str,
) -> Panel:
    """Torque over the opening, friction beside it, and the edge over its photograph.

    ``fits`` and ``strokes`` are by part, ``photographed`` are the panels of photographs. What is
    not there is left out.
    """
    charts = []
    shown = "cut" if "cut" in fits else next(iter(fits), "")
    if shown and (chart := _torque_chart(fits[shown], strokes[shown], f"{id_}-torque")):
        charts.append(chart)
    if "friction" in fits:
        chart = friction_chart(fits["friction"], strokes["friction"], f"{id_}-friction")
        charts += [_plain(chart)] if chart else []
    edges = (p for panel in photographed if panel.part == "blade" for p in panel.pictures)
    pictures = tuple(
        replace(picture, caption="Green: the fitted edge.", widest_px=THUMBNAIL_PX)
        for picture in list(edges)[:1]
    )
    return Panel(id_, part, "Measured and modelled", charts=tuple(charts), pictures=pictures)


def budget_chart(torque: SceneTorque, id_: str) -> Chart | None:
    """The error of the felt torque as one bar: what the band holds, then what it does not.

    What was not measured and has no bound stands in the caption. None where nothing is felt.
    """
    share = torque.share[np.isfinite(torque.share)]
    if not len(share):
        return None
    held = 100.0 * float(np.median(share))
    bars, end = [_bar("in the band (median place)", 0.0, held, "blue")], held
    unbounded = []
    for name, bound in torque.not_in_band:
        size = finite(bound)
        if size is None:
            unbounded.append(name)
            continue
        bars.append(_bar(f"not in the band, at most: {name}", end, end + 100.0 * size, "orange"))
        end += 100.0 * size
    limit = 100.0 * torque.tolerance
    bars.append(curve("tolerance", [limit, limit], [-0.5, 0.5], "ink", style="dashed"))
    caption = f"Not measured, without a bound: {', '.join(unbounded)}." if unbounded else ""
    return Chart(
        id_,
        "Error of the felt torque",
        Axis("share of the torque", "%", low=0.0, high=1.1 * max(end, limit)),
        Axis("", categories=("error",)),
        tuple(bars),
        caption,
        small=True,
    )


def not_in_band_sentence(torque: SceneTorque) -> str:
    """What the band does not hold, with its bound."""
    if not torque.not_in_band:
        return "Nothing that was not measured is known to exceed the tolerance."
    named = ", ".join(
        f"{name} (no bound)" if finite(share) is None else f"{name} (up to {percent(share)})"
        for name, share in torque.not_in_band
    )
    return f"Not measured, and so not in the band: {named}."


def _bar(name: str, low: float, high: float, look: str) -> Series:
    return Series(name, "bars", (high,), (0.0,), low=(low,), look=look)  # type: ignore[arg-type]


def _torque_chart(fit: FitResult, strokes: Sequence[FittedStroke], id_: str) -> Chart | None:
    """The group of closing strokes with the most samples; any group where nothing closes."""
    groups = [g for g in group_strokes(fit, strokes) if g.against == "opening"]
    closing = [g for g in groups if any(s.kind in ("closing", "press") for s in g.strokes)]
    if not groups:
        return None
    group = max(closing or groups, key=lambda g: len(g.places))
    series, words = fit.series, channels_of(fit)
    drawn: list[Series] = []
    for kind in dict.fromkeys(stroke.kind for stroke in group.strokes):
        places = np.concatenate([s.places for s in group.strokes if s.kind == kind])
        some = thinned(places, MOST_DOTS)
        at = words.scale * series.opening[some]
        drawn.append(points(f"measured {kind}", at, series.measured[some], look_of(kind)))
    for stroke in group.strokes:
        x, y, low, high = (
            block_means(values[stroke.places], BLOCKS)
            for values in (
                words.scale * series.opening, series.predicted, series.band_low, series.band_high
            )
        )  # fmt: skip
        drawn += [band("90 % of the model", x, low, high), curve("model", x, y)]
    residual = finite(rms(series.measured[group.places] - series.predicted[group.places]))
    return Chart(
        id_,
        f"{fit.what.capitalize()}: {group.title}",
        Axis(words.position, words.unit),
        Axis(words.effort, words.effort_unit),
        tuple(drawn),
        f"Measured minus model: {with_unit(residual, fit.effort_unit, 2)} rms.",
        small=True,
    )


def _plain(chart: Chart) -> Chart:
    """The chart small, its series not switched."""
    series = tuple(replace(one, toggle=False) for one in chart.series)
    return replace(chart, title="Law of friction", series=series, small=True)
