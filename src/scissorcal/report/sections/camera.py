"""The camera: its parameters, its views from the worst, and how far its projection is known."""

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
from scissorcal.report.reduce import Array
from scissorcal.report.sections.camera_facts import CameraSection, UncertaintyMap
from scissorcal.report.svg import BLUE, INK, PANEL, Svg, finish, new_axes

ANCHOR = "camera"
LEVELS_PX = tuple(m * 10.0**e for e in range(-4, 3) for m in (1.0, 2.0, 5.0))
MOST_LEVELS = 6


def camera_pictures(section: CameraSection, files: Sequence[Path]) -> tuple[PictureFile, ...]:
    """The pictures to show: residuals over the picture, then the worst photographs with theirs."""
    found = [_picture(section, path) for path in files]
    return tuple(picture for picture in found if picture is not None)


def show_camera(section: CameraSection, pictures: Sequence[Picture]) -> tuple[Panel, ...]:
    """The panels on a camera."""
    panels = [_parameters(section)]
    if section.rungs:
        panels.append(_rungs(section))
    if section.uncertainty is not None:
        panels.append(_uncertainty(section, section.uncertainty))
    if section.views:
        panels.append(_views(section, pictures))
    return tuple(panels)


def _picture(section: CameraSection, path: Path) -> PictureFile | None:
    if path.stem == "residuals":
        return PictureFile(
            path,
            "Residuals of all corners",
            "Arrows run from where the fit has a corner to where it was seen, much enlarged; "
            "arrows of neighbours that point alike would be a lens that the model does not follow.",
            f"Residual arrows of the corners of {len(section.views)} photographs, where they stand "
            "in the picture.",
        )
    parts = path.stem.split("-", 2)
    if parts[0] != "worst" or len(parts) < 3 or not parts[1].isdigit():
        return None
    place = int(parts[1])
    if not 0 < place <= len(section.views):
        return None
    view = section.views[place - 1]
    rank = "The worst photograph" if place == 1 else f"Number {place} from the worst"
    return PictureFile(
        path,
        f"{rank}: {view.name}",
        f"Residuals at its {view.corners} corners, rms {significant(view.rms_px, 2)} px; red ones "
        "are three times as long as the middle one.",
        f"Photograph {view.name} of the {section.board} with an arrow for the residual of each of "
        f"{view.corners} corners; rms {significant(view.rms_px, 2)} px.",
    )


def _parameters(section: CameraSection) -> Panel:
    fx = section.parameters[0].value or float("nan")
    across = 2.0 * np.degrees(np.arctan(0.5 * section.width_px / fx))
    source = f"from {len(section.views)} photographs of the {section.board}"
    if section.origin == "imported":
        source = "brought in from a file"
    lead = (
        f"A camera of {section.width_px} × {section.height_px} pixels that sees "
        f"{short(float(across))}° across, {source}. Distortion: {section.rung}.",
    )
    rows = tuple(
        Row(
            (
                f"{row.name}, {row.meaning}" + (f" [{row.unit}]" if row.unit else ""),
                with_decimals(row.value, decimals_for(row.sd, row.value)),
                _sd_words(row.sd),
            )
        )
        for row in section.parameters
    )
    table = Table(
        "Parameters with their standard deviation.",
        columns("Parameter", "Value", "Sd"),
        rows,
    )
    return Panel(f"{ANCHOR}-parameters", "Parameters", lead, _precision(section), (), table)


def _sd_words(sd: Number) -> str:
    if sd is None:
        return "not stated"
    return significant(sd, 2) if sd else "held"


def _precision(section: CameraSection) -> str:
    focal = section.parameters[0]
    if not focal.sd or not focal.value:
        return "Nobody said how well this camera is known, so that all else counts it as exact."
    words = f"The focal length is known to {percent(focal.sd / focal.value)} (sd)"
    bulge = max((abs(value) for value in section.bulge_mm if value is not None), default=0.0)
    words += f"; corners were found to {significant(section.noise_px, 2)} px"
    if section.stretch and section.stretch > 1.05:
        words += (
            f", and standard deviations were widened {short(section.stretch)} times because "
            "the errors within a photograph go together"
        )
    if bulge > 0.05:
        words += f"; the board is bent by {significant(bulge, 2)} mm"
    return words + "."


def _rungs(section: CameraSection) -> Panel:
    rows = tuple(
        Row(
            (
                row.name,
                str(row.free),
                significant(row.unseen_px),
                f"{with_decimals(row.behind, 2)} ± {with_decimals(row.behind_se, 2)}",
                "✓ used" if row.chosen else "≈ alike" if row.equivalent else "✗ told apart",
            )
        )
        for row in section.rungs
    )
    heads = columns(
        "Distortion", "Free parameters", "Rms unseen [px]", "Behind the best", "=Outcome"
    )
    table = Table(
        "Simplest first, compared on held-out photographs; behind the best in their log density. "
        "The simplest that is not distinguishable from the best is used.",
        heads,
        rows,
    )
    return Panel(f"{ANCHOR}-rungs", "Distortion models compared", table=table)


def _uncertainty(section: CameraSection, places: UncertaintyMap) -> Panel:
    x, y = _array(places.x_px), _array(places.y_px)
    sd = _array(places.sd_px).reshape(len(y), len(x))
    inside = np.array(places.inside, dtype=np.bool_).reshape(sd.shape)
    seen = sd[inside & np.isfinite(sd)]
    worst = f", at most {significant(float(seen.max()), 2)} px" if len(seen) else ""
    middle = significant(float(np.median(seen)), 2) if len(seen) else "not available"
    figures = [
        _contours(
            section,
            sd,
            "sd",
            "Uncertainty of a projected point",
            f"Numbers on the lines are its standard deviation in px: {middle} px in the median"
            f"{worst} where corners were seen (dashed).",
        )
    ]
    finding = (
        f"Corners were seen in {percent(section.region_share)} of the picture; outside the dashed "
        "outline the camera is a guess."
    )
    cross = section.cross_validation
    if places.difference_px and cross is not None:
        figures.append(
            _contours(
                section,
                np.where(inside, _array(places.difference_px).reshape(sd.shape), np.nan),
                "halves",
                "Difference of two halves",
                f"How far the cameras of two halves of the photographs are apart, in px: "
                f"{significant(cross.rms_px, 2)} px (rms) where corners were seen.",
            )
        )
    if cross is not None:
        finding += (
            f" Two halves of the photographs, fitted apart, differ by "
            f"{significant(cross.rms_px, 2)} px (rms) where {significant(cross.claimed_px, 2)} px "
            f"is claimed; that much or more has a probability of {significant(cross.p_value, 2)}."
        )
    lead = (
        "A rotation of the camera is taken out of both, since each use of it finds its own pose.",
    )
    title = "How far the projection is known"
    return Panel(f"{ANCHOR}-uncertainty", title, lead, finding, tuple(figures))


def _contours(section: CameraSection, values: Array, name: str, title: str, caption: str) -> Svg:
    assert section.uncertainty is not None
    figure, axes = new_axes(PANEL)
    x, y = _array(section.uncertainty.x_px), _array(section.uncertainty.y_px)
    known = values[np.isfinite(values)]
    levels = [v for v in LEVELS_PX if known.size and known.min() < v < known.max()]
    step = -(-len(levels) // MOST_LEVELS) if levels else 1
    if levels:
        shown = np.ma.masked_invalid(values)
        lines = axes.contour(x, y, shown, levels=levels[::step], colors=INK, linewidths=1.0)
        axes.clabel(lines, fmt=lambda value: short(value, 2), fontsize=7.5, colors=INK)
    outline = np.array(section.region_px, dtype=np.float64).reshape(-1, 2)
    closed = np.vstack([outline, outline[:1]])
    axes.plot(*closed.T, color=BLUE, lw=1.4, ls="--")
    axes.set_xlim(0.0, section.width_px)
    axes.set_ylim(section.height_px, 0.0)
    axes.grid(visible=False)
    axes.set_xticks([tick for tick in axes.get_xticks() if 0.0 <= tick < 0.97 * section.width_px])
    axes.set_xlabel("across [px]")
    axes.set_ylabel("down [px]")
    return finish(figure, f"{ANCHOR}-{name}", title, caption)


def _views(section: CameraSection, pictures: Sequence[Picture]) -> Panel:
    rows = tuple(
        Row(
            (
                view.name,
                significant(view.rms_px),
                significant(view.worst_px),
                str(view.corners),
                significant(view.square_px, 2),
                significant(view.distance_m),
                with_decimals(view.tilt_deg, 0),
            ),
            marked=view.outlying,
        )
        for view in section.views
    )
    heads = columns(
        "Photograph",
        "Rms [px]",
        "Worst corner [px]",
        "Corners",
        "Square [px]",
        "Distance [m]",
        "Tilt [°]",
    )
    odd = [view.name for view in section.views if view.outlying]
    finding = (
        f"{', '.join(odd)} fit{'s' if len(odd) == 1 else ''} far worse than the others: look at "
        "them, and leave them out if something moved or the board was bent."
        if odd
        else "No photograph stands out from the others."
    )
    table = Table("Photographs of the board, from the worst.", heads, rows)
    return Panel(f"{ANCHOR}-views", "Photographs", (), finding, (), table, pictures=tuple(pictures))


def _array(values: Sequence[Number]) -> Array:
    return np.array(values, dtype=np.float64)
