"""The blade: edge and taper with their bands, nicks, candidate families, photographs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from scissorcal.calibration.edge.result import Band, BladeFit, BladeResult, SeenPair
from scissorcal.report.numbers import finite, short, significant
from scissorcal.report.panel import (
    Axis,
    Chart,
    Look,
    Panel,
    Picture,
    Row,
    Value,
    absent,
    band,
    count,
    curve,
    number,
    percent_of,
    points,
    words,
)

PART = "blade"
WIDEST_PX = 1600
"""A blade is long and its edge thin, so its pictures are larger than others."""
MOST_POINTS = 600
TALLEST = 4.0
"""Residuals beyond this multiple of their 90 % size are drawn at the rim."""
LOOKS: tuple[Look, ...] = ("blue", "vermillion", "green", "purple")
FAMILIES = {"line": "a line", "arc": "an arc", "cubic": "a cubic", "spline": "a spline"}
SHOWN = {
    "offset_m": ("offset", 1e3, "mm", "lengths"),
    "taper_rad": ("taper", float(np.degrees(1.0)), "°", "°"),
    "curvature_per_m": ("curvature", 1.0, "1/m", "1/length"),
    "bend_per_m2": ("bend", 1.0, "1/m^2", "1/length^2"),
    "spline_m_": ("spline weight ", 1e6, "µm", "lengths"),
}
"""How a parameter of the edge is shown: words, factor from SI, unit, and unit without a scale."""


def blade_panels(result: BladeResult, files: Sequence[Path]) -> tuple[Panel, ...]:
    """The panels on a blade, or on both."""
    panels: list[Panel] = []
    for fit in result.blades:
        one = len(result.blades) == 1
        where = PART if one else f"{PART}-{fit.name}"
        which = "" if one else f", {fit.name} blade"
        panels += [
            _shape(fit, where, which),
            _nicks(fit, where, which),
            _candidates(fit, where, which),
            _photographs(fit, where, which),
        ]
    if result.openings:
        rows = tuple(
            Row(
                seen.source,
                (
                    words("opening", "closed")
                    if not finite(seen.opening_rad)
                    else number("opening", np.degrees(seen.opening_rad), "°"),
                    *_lengths(seen),
                ),
            )
            for seen in result.openings
        )
        caption = (
            "Angle between the centrelines of both blades; the shorter one's share of the longer "
            "one's length as seen, with the least tilt of the camera that would explain it; where "
            "the shadow falls, counted from between the tips."
        )
        panels.append(Panel(f"{PART}-openings", PART, "Openings", rows=rows, caption=caption))
    if files:
        pictures = tuple(_picture(result, path) for path in files)
        title = "The edge over the photographs"
        panels.append(Panel(f"{PART}-pictures", PART, title, pictures=pictures))
    return tuple(panels)


def _lengths(seen: SeenPair) -> tuple[Value, ...]:
    """Both blades' lengths against each other, and the lamp, where they were measured."""
    if not seen.length_ratio_sd > 0.0:
        return ()
    ratio = 100.0 * float(np.exp(-abs(seen.length_log_ratio)))
    lamp = seen.lamp_deg
    return (
        number("shorter blade", ratio, "%", sd=ratio * seen.length_ratio_sd),
        number("tilt", seen.tilt_deg, "°", digits=2),
        words("shadow", "not seen") if lamp is None else number("shadow", lamp, "°", digits=3),
    )


def _shape(fit: BladeFit, where: str, which: str) -> Panel:
    edge_posterior = fit.edge_posterior
    sds = np.sqrt(np.maximum(np.diag(edge_posterior.covariance), 0.0))
    rows = []
    for name, mean, sd in zip(edge_posterior.names, edge_posterior.mean, sds, strict=True):
        stem = next((stem for stem in SHOWN if name.startswith(stem)), "")
        said, factor, unit, per_length = SHOWN.get(stem, (name, 1.0, "", ""))
        if not fit.metric:
            factor, unit = (factor, unit) if unit == "°" else (1.0, per_length)
        label = said + name.removeprefix(stem) if stem else said
        rows.append(Row(label, (number("mean", factor * mean, unit, sd=factor * sd),)))
    charts = (_edge(fit, where), _residuals(fit, where), _taper(fit, where))
    note = (
        "e(s) is the offset of the edge from the blade's centreline at distance s from the pivot; "
        "the taper is its slope."
    )
    return Panel(
        f"{where}-shape", PART, f"The edge{which}", _precision(fit), tuple(rows), charts,
        notes=(note,), caption=f"Parameters of the {fit.family}.",
    )  # fmt: skip


def _precision(fit: BladeFit) -> str:
    family = FAMILIES.get(fit.family, fit.family)
    offset, taper = (np.ravel(b.sd)[np.isfinite(np.ravel(b.sd))] for b in (fit.offset, fit.taper))
    if not len(offset) or not len(taper):
        return f"The edge is {family}."
    said = (
        f"The edge is {family}, its taper known to "
        f"{significant(float(np.degrees(taper.max())), 2)}° (sd) or better"
    )
    if not fit.metric:
        return (
            f"{said}. Its size is not known: lengths are in blade lengths, and a cut cannot be "
            "fitted with it."
        )
    pivot = significant(1e6 * (finite(fit.pivot_sd) or 0.0), 2)
    said += (
        f", its offset to {significant(1e6 * float(offset.max()), 2)} µm, of which {pivot} µm come "
        "from the pivot"
    )
    heights = np.ravel(fit.height.sd) if fit.height is not None else np.zeros(0)
    heights = heights[np.isfinite(heights)]
    if len(heights):
        said += (
            f". Over the scene its height is known to "
            f"{significant(1e6 * float(heights.max()), 2)} µm or better"
        )
    return said + "."


def _nicks(fit: BladeFit, where: str, which: str) -> Panel:
    title = f"Nicks{which}"
    if not fit.nicks:
        return absent(f"{where}-nicks", PART, title, "No nick was found in the edge.")
    size, unit = _unit(fit)
    rows = tuple(
        Row(
            f"nick {place}",
            (
                number("from the pivot", size * nick.station_m, unit),
                number("width", size * nick.width_m, unit, digits=2),
                number("depth", size * nick.depth_m, unit, digits=2),
                words("seen in", nick.source),
            ),
        )
        for place, nick in enumerate(fit.nicks, start=1)
    )
    caption = "Metal missing from the edge. Nicks are left out of the fitted edge."
    return Panel(f"{where}-nicks", PART, title, rows=rows, caption=caption)


def _candidates(fit: BladeFit, where: str, which: str) -> Panel:
    best = max((r.evidence for r in fit.candidates if finite(r.evidence) is not None), default=None)
    micro, small = _small_unit(fit)
    rows = tuple(
        Row(
            candidate.family,
            (
                number("log evidence", candidate.evidence, digits=5),
                number("from the best", None if best is None else candidate.evidence - best),
                number("roughness beyond it", micro * candidate.roughness_m, small, digits=2),
                number("photographs differ by", micro * candidate.between_m, small, digits=2),
                number("noise / shot noise", candidate.noise_factor, digits=2),
                words("outcome", "✓ used" if candidate.chosen else "✗ not used"),
            ),
            marked=candidate.chosen,
        )
        for candidate in fit.candidates
    )
    caption = (
        "The simplest first. The richest of line, arc and cubic that the photographs do not "
        "exclude is used, since a bend that is not allowed for would make the band too narrow; a "
        "spline only where it is clearly better."
    )
    title = f"Candidate families{which}"
    return Panel(f"{where}-candidates", PART, title, rows=rows, caption=caption)


def _photographs(fit: BladeFit, where: str, which: str) -> Panel:
    size, unit = _unit(fit)
    micro, small = _small_unit(fit)
    rows = tuple(
        Row(
            view.source,
            (
                count("points", view.points),
                number("blur", view.blur_px, "px", digits=2),
                percent_of("spoilt", view.spoilt_share),
                number("length", size * view.length, unit, digits=4),
                number("from the joint edge", micro * view.away, small, sd=micro * view.away_sd),
                words("scale and place", view.seen),
            ),
        )
        for view in sorted(fit.photographs, key=lambda one: -abs(finite(one.away) or 0.0))
    )
    seen = {view.seen for view in fit.photographs}
    notes = tuple(note for note in fit.notes if note not in seen)
    caption = "From the one farthest from the joint edge; ± is what that may be (sd)."
    title = f"Photographs of the blade{which}"
    return Panel(f"{where}-views", PART, title, rows=rows, notes=notes, caption=caption)


def _edge(fit: BladeFit, where: str) -> Chart:
    size, unit = _unit(fit)
    station = size * np.asarray(fit.station)
    mean = size * np.ravel(fit.offset.mean)
    at = [size * nick.station_m for nick in fit.nicks]
    series = [*_banded(fit.offset, station, size, "edge")]
    if at:
        series.append(points("nicks", at, np.interp(at, station, mean), "orange"))
    caption = (
        f"From {short(float(mean[0]))} to {short(float(mean[-1]))} {unit} along "
        f"{short(float(station[-1] - station[0]))} {unit}; {len(at) or 'no'} "
        f"nick{'' if len(at) == 1 else 's'}. The next chart shows the band (5 to 95 %)."
    )
    x, y = Axis("s, from the pivot", unit), Axis("e, offset", unit)
    return Chart(f"{where}-edge", f"Edge of the {_whose(fit)}", x, y, tuple(series), caption)


def _residuals(fit: BladeFit, where: str) -> Chart:
    """Each photograph's points from the mean edge, with the band of the edge."""
    size, unit = _unit(fit)
    micro, small = _small_unit(fit)
    station = size * np.asarray(fit.station)
    mean = np.ravel(fit.offset.mean)
    low, high = (micro * (np.ravel(q) - mean) for q in (fit.offset.q05, fit.offset.q95))
    left = [micro * np.array(view.residual, dtype=np.float64) for view in fit.photographs]
    every = np.abs(np.concatenate(left)) if left else np.zeros(0)
    rim = TALLEST * float(np.quantile(every, 0.9)) if len(every) else float("inf")
    thin = max(len(every) // MOST_POINTS, 1)
    series = [band("90 % of the edge", station, low, high)]
    for place, (view, own) in enumerate(zip(fit.photographs, left, strict=True)):
        x = size * np.array(view.station, dtype=np.float64)
        kept = np.clip(own, -rim, rim)[::thin]
        look = LOOKS[place % len(LOOKS)]
        series.append(points(view.source, x[::thin], kept, look, toggle=True))
    usual = significant(float(np.sqrt(np.mean(every**2))), 2) if len(every) else "not available"
    reach = significant(finite(np.nanmax(0.5 * (high - low))), 2)
    caption = (
        f"Points of {len(fit.photographs)} photographs (rms {usual} {small}) and the band of the "
        f"edge (5 to 95 %), which includes what all photographs share: at most ± {reach} {small}."
    )
    beyond = int(np.sum(every > rim))
    if beyond:
        caption += f" {beyond} points lie beyond the rim."
    if not len(every):
        caption += " The points were not kept: run scissorcal fit blade --force."
    x_axis, y_axis = Axis("s, from the pivot", unit), Axis("from the mean edge", small)
    title = f"Points of the {_whose(fit)}"
    return Chart(f"{where}-residuals", title, x_axis, y_axis, tuple(series), caption)


def _taper(fit: BladeFit, where: str) -> Chart:
    size, unit = _unit(fit)
    degrees = float(np.degrees(1.0))
    station = size * np.asarray(fit.station)
    first, last = degrees * np.ravel(fit.taper.mean)[[0, -1]]
    caption = (
        f"From {short(float(first))}° near the pivot to {short(float(last))}° at the tip; the "
        "shade holds it with 90 % probability."
    )
    series = tuple(_banded(fit.taper, station, degrees, "taper"))
    x, y = Axis("s, from the pivot", unit), Axis("taper", "°")
    return Chart(f"{where}-taper", f"Taper of the {_whose(fit)}", x, y, series, caption)


def _banded(found: Band, station: np.ndarray, scale: float, name: str) -> tuple:  # type: ignore[type-arg]
    low, high, mean = (scale * np.ravel(values) for values in (found.q05, found.q95, found.mean))
    return band(f"90 % of the {name}", station, low, high, "blue"), curve(
        name, station, mean, "blue"
    )


def _picture(result: BladeResult, path: Path) -> Picture:
    names = list(dict.fromkeys(v.source for fit in result.blades for v in fit.photographs))
    name = next((name for name in names if path.stem.endswith(Path(name).stem)), path.stem)
    nicks = sum(name in nick.source for fit in result.blades for nick in fit.nicks)
    return Picture(
        path.name,
        f"The edge over {name}",
        "Orange: outline of what is dark, with shadows; violet: back and end of the metal; green: "
        "fitted edge, with residuals enlarged as written on it; cross and line: pivot and "
        "centreline; rings: nicks.",
        f"Photograph {name} with the outline of the blade, the fitted edge, the pivot and the "
        f"centreline drawn on it; {nicks or 'no'} nick{'' if nicks == 1 else 's'} marked.",
        WIDEST_PX,
    )


def _unit(fit: BladeFit) -> tuple[float, str]:
    return (1e3, "mm") if fit.metric else (1.0, "lengths")


def _small_unit(fit: BladeFit) -> tuple[float, str]:
    return (1e6, "µm") if fit.metric else (1e3, "lengths/1000")


def _whose(fit: BladeFit) -> str:
    return "blade" if fit.name == "blade" else f"{fit.name} blade"
