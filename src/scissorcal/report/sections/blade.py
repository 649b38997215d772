"""The blade: its edge and taper with their bands, nicks, families compared, photographs."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from scissorcal.report.numbers import (
    Number,
    decimals_for,
    percent,
    short,
    significant,
    with_decimals,
)
from scissorcal.report.panel import Panel, Row, Table, columns
from scissorcal.report.pictures import Picture, PictureFile
from scissorcal.report.sections.blade_facts import BladeEdge, BladeSection, EdgeParameter
from scissorcal.report.sections.blade_figures import draw_edge, draw_residuals, draw_taper

ANCHOR = "blade"
WIDEST_PX = 1400
"""A blade is long and its edge thin, so its pictures are larger than others."""

UNITS = {
    "offset_m": ("offset", 1e3, "mm", "lengths"),
    "taper_rad": ("taper", 180.0 / np.pi, "°", "°"),
    "curvature_per_m": ("curvature", 1.0, "1/m", "1/length"),
    "bend_per_m2": ("bend", 1.0, "1/m²", "1/length²"),
    "spline_m_": ("spline weight ", 1e6, "µm", "lengths"),
}
"""How a parameter of the edge is shown: words, factor from SI, unit, and unit without a scale."""


def blade_pictures(section: BladeSection, files: Sequence[Path]) -> tuple[PictureFile, ...]:
    """The pictures to show: each photograph with the edge laid over it."""
    names = list(dict.fromkeys(view.name for edge in section.edges for view in edge.views))
    found = []
    for path in files:
        name = next((name for name in names if path.stem.endswith(Path(name).stem)), path.stem)
        nicks = sum(name in nick.source for edge in section.edges for nick in edge.nicks)
        found.append(
            PictureFile(
                path,
                f"The edge over {name}",
                "Orange: the blade's outline; green: the fitted edge, with residuals as strokes, "
                "enlarged as written on it; cross and line: pivot and centreline; rings: nicks.",
                f"Photograph {name} with the blade's outline, the fitted edge, the pivot and the "
                f"centreline drawn on it; {nicks or 'no'} nick{'' if nicks == 1 else 's'} marked.",
                WIDEST_PX,
            )
        )
    return tuple(found)


def show_blade(section: BladeSection, pictures: Sequence[Picture]) -> tuple[Panel, ...]:
    """The panels on a blade, or on both."""
    panels: list[Panel] = []
    for edge in section.edges:
        where = ANCHOR if len(section.edges) == 1 else f"{ANCHOR}-{edge.name}"
        which = "" if len(section.edges) == 1 else f", {edge.name} blade"
        panels.append(_shape(edge, where, which))
        panels.append(_nicks(edge, where, which))
        panels.append(_rungs(edge, where, which))
        panels.append(_views(edge, where, which))
    if section.openings:
        panels.append(_openings(section))
    if pictures:
        panels.append(
            Panel(
                f"{ANCHOR}-pictures",
                "The edge over the photographs",
                wide=True,
                pictures=tuple(pictures),
            )
        )
    return tuple(panels)


def _shape(edge: BladeEdge, where: str, which: str) -> Panel:
    table = Table(
        f"Parameters of the {edge.family}.",
        columns("Parameter", "Mean", "Sd"),
        tuple(_parameter(parameter, edge.metric) for parameter in edge.parameters),
    )
    figures = (draw_edge(edge, where), draw_residuals(edge, where), draw_taper(edge, where))
    lead = (
        "e(s) is the edge's offset from the blade's centreline at a distance s from the pivot, "
        "the taper its slope.",
    )
    return Panel(f"{where}-shape", f"The edge{which}", lead, _precision(edge), figures, table)


def _parameter(parameter: EdgeParameter, metric: bool) -> Row:
    """A parameter in millimetres and degrees, or in blade lengths."""
    stem = next((stem for stem in UNITS if parameter.name.startswith(stem)), "")
    words, factor, unit, per_length = UNITS.get(stem, (parameter.name, 1.0, "", ""))
    if not metric:
        factor, unit = (factor, unit) if unit == "°" else (1.0, per_length)
    value, sd = _times(parameter.value, factor), _times(parameter.sd, factor)
    name = words + parameter.name.removeprefix(stem) if stem else words
    name += f" [{unit}]" if unit else ""
    return Row((name, with_decimals(value, decimals_for(sd, value)), significant(sd, 2)))


def _precision(edge: BladeEdge) -> str:
    sd = [value for value in edge.offset_m.sd if value is not None]
    taper = [value for value in edge.taper_rad.sd if value is not None]
    if not sd or not taper:
        return f"The edge is {_a(edge.family)}."
    words = (
        f"The edge is {_a(edge.family)}, its taper known to "
        f"{significant(float(np.degrees(max(taper))), 2)}° (sd) or better"
    )
    if not edge.metric:
        return (
            f"{words}. Its size is not known: lengths are in blade lengths, and a cut cannot be "
            "fitted with it."
        )
    words += (
        f", its offset to {significant(1e6 * max(sd), 2)} µm; "
        f"{significant(1e6 * (edge.pivot_sd_m or 0.0), 2)} µm of that come from the pivot"
    )
    heights = [v for v in edge.height_m.sd if v is not None] if edge.height_m else []
    if heights:
        words += (
            f". Over the scene's openings and contacts its height is known to "
            f"{significant(1e6 * max(heights), 2)} µm or better"
        )
    return words + "."


def _a(family: str) -> str:
    return {"line": "a line", "arc": "an arc", "cubic": "a cubic", "spline": "a spline"}.get(
        family, family
    )


def _nicks(edge: BladeEdge, where: str, which: str) -> Panel:
    title = f"Nicks{which}"
    if not edge.nicks:
        return Panel(f"{where}-nicks", title, ("No nick was found in the edge.",))
    size, unit = (1e3, "mm") if edge.metric else (1.0, "lengths")
    rows = tuple(
        Row(
            (
                f"{number}",
                significant(size * (nick.station_m or 0.0), 3),
                significant(size * (nick.width_m or 0.0), 2),
                significant(size * (nick.depth_m or 0.0), 2),
                nick.source,
            )
        )
        for number, nick in enumerate(edge.nicks, start=1)
    )
    heads = columns("Nick", f"From the pivot [{unit}]", f"Width [{unit}]", f"Depth [{unit}]", "=In")
    caption = "Metal missing from the edge. Nicks are left out of the edge that is fitted."
    return Panel(f"{where}-nicks", title, table=Table(caption, heads, rows))


def _rungs(edge: BladeEdge, where: str, which: str) -> Panel:
    best = max((rung.evidence for rung in edge.rungs if rung.evidence is not None), default=None)
    micro = 1e6 if edge.metric else 1e3
    unit = "µm" if edge.metric else "lengths/1000"
    rows = tuple(
        Row(
            (
                rung.family,
                with_decimals(rung.evidence, 1),
                with_decimals(
                    None if best is None or rung.evidence is None else rung.evidence - best, 1
                ),
                significant(_times(rung.roughness_m, micro), 2),
                significant(_times(rung.between_m, micro), 2),
                significant(rung.noise_factor, 2),
                "✓ used" if rung.chosen else "✗ not used",
            )
        )
        for rung in edge.rungs
    )
    heads = columns(
        "Family",
        "Log evidence",
        "From the best",
        f"Roughness beyond it [{unit}]",
        f"Photographs disagree by [{unit}]",
        "Noise against the light's",
        "=Outcome",
    )
    caption = (
        "From cheap to rich. The richest of line, arc and cubic that the photographs do not refute "
        "is used, since a bend that is not allowed for would make the band too narrow; a spline "
        "only where it is clearly better."
    )
    return Panel(f"{where}-rungs", f"Families compared{which}", table=Table(caption, heads, rows))


def _times(value: Number, factor: float) -> Number:
    return None if value is None else value * factor


def _views(edge: BladeEdge, where: str, which: str) -> Panel:
    size, unit = (1e3, "mm") if edge.metric else (1.0, "lengths")
    micro = 1e6 if edge.metric else 1e3
    small = "µm" if edge.metric else "lengths/1000"
    rows = tuple(
        Row(
            (
                view.name,
                str(view.points),
                significant(view.blur_px, 2),
                percent(view.spoilt_share),
                significant(_times(view.length_m, size), 4),
                f"{short(_times(view.away_m, micro), 2)} ± "
                f"{short(_times(view.away_sd_m, micro), 2)}",
                view.seen,
            )
        )
        for view in sorted(edge.views, key=lambda view: -abs(view.away_m or 0.0))
    )
    heads = columns(
        "Photograph",
        "Points",
        "Blur [px]",
        "Spoilt",
        f"Length [{unit}]",
        f"From the joint edge [{small}]",
        "=Scale and place",
    )
    caption = "Photographs from the one farthest from the joint edge; ± is what that may be (sd)."
    return Panel(
        f"{where}-views", f"Photographs{which}", edge.notes, table=Table(caption, heads, rows)
    )


def _openings(section: BladeSection) -> Panel:
    rows = tuple(
        Row((seen.name, "closed" if not seen.opening_rad else short(np.degrees(seen.opening_rad))))
        for seen in section.openings
    )
    table = Table(
        "Angle between both blades' centrelines.", columns("Photograph", "Opening [°]"), rows
    )
    return Panel(f"{ANCHOR}-openings", "Openings", table=table)
