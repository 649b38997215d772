"""The camera: parameters, photographs from the worst, how far its projection is known."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.camera.result import CameraFit, PixelMap
from scissorcal.report.numbers import finite, finite_each, percent, short, significant
from scissorcal.report.panel import (
    Axis,
    Chart,
    Panel,
    Picture,
    Row,
    Series,
    Value,
    count,
    curve,
    number,
    words,
)
from scissorcal.vision.geometry.camera import PARAMETERS

PART = "camera"
MEANINGS = (
    ("focal length, across", "px"),
    ("focal length, down", "px"),
    ("centre, across", "px"),
    ("centre, down", "px"),
    ("radial distortion, r²", ""),
    ("radial distortion, r⁴", ""),
    ("tangential distortion", ""),
    ("tangential distortion", ""),
    ("radial distortion, r⁶", ""),
)
RATIONAL = ("k4", "k5", "k6")
"""Further distortion coefficients of a camera that was calibrated elsewhere."""
BENT_MM = 0.05
MOST_CELLS = 12


def camera_panels(fit: CameraFit, files: Sequence[Path]) -> tuple[Panel, ...]:
    """Parameters, candidate distortion models, uncertainty over the picture, photographs."""
    panels = [_parameters(fit)]
    if fit.candidates:
        panels.append(_candidates(fit))
    if fit.pixel_map is not None:
        panels.append(_uncertainty(fit, fit.pixel_map))
    if fit.views:
        panels.append(_photographs(fit, files))
    return tuple(panels)


def _parameters(fit: CameraFit) -> Panel:
    camera = fit.camera
    values = (camera.fx, camera.fy, camera.cx, camera.cy, *camera.distortion)
    names = (*PARAMETERS, *RATIONAL)[: len(values)]
    meanings = (*MEANINGS, *(("radial distortion, in the denominator", ""),) * len(RATIONAL))
    sd = np.full(len(values), np.nan)
    if camera.covariance is not None:
        known = np.sqrt(np.maximum(np.diag(camera.covariance), 0.0))
        sd[: len(known)] = known
    rows = []
    for name, (meaning, unit), value, spread in zip(
        names, meanings[: len(values)], values, sd, strict=True
    ):
        stated = finite(spread)
        said = "not stated" if stated is None else "" if stated else "held"
        mean = number("value", value, unit, sd=stated or None, digits=4)
        rows.append(Row(name, (words("meaning", meaning), mean, words("remark", said or " "))))
    across = 2.0 * np.degrees(np.arctan(0.5 * camera.width / camera.fx))
    source = f"from {len(fit.views)} photographs of the {fit.board}"
    if fit.origin == "imported":
        source = "imported from a file"
    note = (
        f"{camera.width} × {camera.height} pixels, {short(float(across))}° across, {source}. "
        f"Distortion: {fit.candidate}."
    )
    return Panel(
        f"{PART}-parameters", PART, "Camera parameters", _precision(fit, finite(sd[0])),
        tuple(rows), notes=(note, *fit.notes),
    )  # fmt: skip


def _precision(fit: CameraFit, sd: float | None) -> str:
    if not sd:
        return "The uncertainty of this camera is not stated, so it is taken as exact."
    said = f"The focal length is known to {percent(sd / fit.camera.fx)} (sd)"
    said += f"; corners were found to {significant(finite(fit.noise_px), 2)} px"
    if finite(fit.stretch) and fit.stretch > 1.05:
        said += (
            f", and standard deviations are {short(fit.stretch)} times wider, because errors "
            "within a photograph are correlated"
        )
    bulge = max((abs(value) for value in fit.bulge_mm if np.isfinite(value)), default=0.0)
    if bulge > BENT_MM:
        said += f"; the board is bent by {significant(bulge, 2)} mm"
    return said + "."


def _candidates(fit: CameraFit) -> Panel:
    rows = []
    for row in fit.candidates:
        chosen, alike = bool(row["chosen"]), bool(row["equivalent"])
        outcome = "✓ used" if chosen else "≈ equivalent" if alike else "✗ worse"
        rows.append(
            Row(
                str(row["name"]),
                (
                    count("free parameters", int(row["free"])),
                    number("rms unseen", row["unseen_px"], "px"),
                    number("behind the best", row["behind"], sd=row["behind_se"]),
                    words("outcome", outcome),
                ),
                marked=chosen,
            )
        )
    caption = (
        "Simplest first, compared on hold-out photographs; behind the best in their log density. "
        "The simplest that is not distinguishable from the best is used."
    )
    title = "Candidate distortion models"
    return Panel(f"{PART}-candidates", PART, title, rows=tuple(rows), caption=caption)


def _uncertainty(fit: CameraFit, places: PixelMap) -> Panel:
    inside = np.asarray(places.inside, dtype=np.bool_)
    error = np.where(np.isfinite(places.error_px), places.error_px, np.nan)
    seen = error[inside & np.isfinite(error)]
    middle = significant(float(np.median(seen)), 2) if len(seen) else "not available"
    most = f", at most {significant(float(seen.max()), 2)} px" if len(seen) else ""
    caption = (
        f"Standard error in px: {middle} px (median){most} where corners were seen. Models "
        "that predict unseen photographs as well count by their difference."
    )
    charts = [_map(fit, places, error, "sd", "Uncertainty of a projected point", caption)]
    sentence = (
        f"Corners were seen in {percent(finite(fit.region_share))} of the picture; outside the "
        "dashed outline the camera is extrapolated."
    )
    cross = fit.cross
    if cross is not None:
        sentence += (
            f" Two halves of the photographs, fitted separately, differ by "
            f"{significant(finite(cross.rms_px), 2)} px (rms) where "
            f"{significant(finite(cross.claimed_px), 2)} px is claimed; that much or more has a "
            f"probability of {significant(finite(cross.p_value), 2)}."
        )
        if places.difference_px is not None:
            apart = np.where(inside, places.difference_px, np.nan)
            caption = "Difference in px between the cameras of two halves of the photographs."
            charts.append(_map(fit, places, apart, "halves", "Difference of two halves", caption))
    note = "A rotation of the camera is removed from both, since each use of it fits its own pose."
    title = "How far the projection is known"
    return Panel(f"{PART}-uncertainty", PART, title, sentence, charts=tuple(charts), notes=(note,))


def _map(
    fit: CameraFit, places: PixelMap, values: Array, name: str, title: str, caption: str
) -> Chart:
    """Values over the picture, thinned to what can be read, with the outline of what was seen."""
    steps = [max(1, -(-size // MOST_CELLS)) for size in values.shape]
    shown = values[:: steps[0], :: steps[1]]
    y, x = np.meshgrid(places.y[:: steps[0]], places.x[:: steps[1]], indexing="ij")
    cells = Series(
        title, "cells", finite_each(x.ravel(), 4), finite_each(y.ravel(), 4),
        value=finite_each(shown.ravel(), 3), look="blue",
    )  # fmt: skip
    outline = np.asarray(fit.region, dtype=np.float64).reshape(-1, 2)
    closed = np.vstack([outline, outline[:1]])
    edge = curve("corners seen", closed[:, 0], closed[:, 1], "ink", style="dashed")
    width, height = float(fit.camera.width), float(fit.camera.height)
    across = Axis("across", "px", low=0.0, high=width)
    down = Axis("down", "px", low=0.0, high=height, reverse=True)
    return Chart(f"{PART}-{name}", title, across, down, (cells, edge), caption)


def _photographs(fit: CameraFit, files: Sequence[Path]) -> Panel:
    views = sorted(fit.views, key=lambda view: -view.rms_px)
    rows = tuple(
        Row(
            view.name,
            (
                number("rms", view.rms_px, "px"),
                number("worst corner", view.worst_px, "px"),
                count("corners", view.corners),
                Value("square", finite(view.square_px), "px", digits=2),
                number("distance", view.distance_m, "m"),
                number("tilt", view.tilt_deg, "°", digits=2),
            ),
            marked=view.outlying,
        )
        for view in views
    )
    odd = [view.name for view in views if view.outlying]
    sentence = (
        f"{', '.join(odd)} fit{'s' if len(odd) == 1 else ''} far worse than the others: look at "
        "them, and leave them out if something moved or the board was bent."
        if odd
        else "No photograph differs from the others."
    )
    pictures = [_picture(fit, path) for path in files]
    return Panel(
        f"{PART}-views", PART, "Photographs of the board", sentence, rows,
        pictures=tuple(picture for picture in pictures if picture is not None),
        caption="From the worst.",
    )  # fmt: skip


def _picture(fit: CameraFit, path: Path) -> Picture | None:
    """The picture of all residuals, and those of the worst photographs."""
    if path.stem == "residuals":
        return Picture(
            path.name,
            "Residuals of all corners",
            "Arrows run from the fitted to the seen corner, much enlarged; neighbours that point "
            "alike would show a lens that the model does not follow.",
            f"Residual arrows of the corners of {len(fit.views)} photographs, where they stand in "
            "the picture.",
        )
    parts = path.stem.split("-", 2)
    if parts[0] != "worst" or len(parts) < 3 or not parts[1].isdigit():
        return None
    place = int(parts[1])
    if not 0 < place <= len(fit.views):
        return None
    view = sorted(fit.views, key=lambda one: -one.rms_px)[place - 1]
    rms = significant(finite(view.rms_px), 2)
    rank = "The worst photograph" if place == 1 else f"Number {place} from the worst"
    return Picture(
        path.name,
        f"{rank}: {view.name}",
        f"Residuals at its {view.corners} corners, rms {rms} px; red ones are three times as long "
        "as the median.",
        f"Photograph {view.name} of the {fit.board} with an arrow for the residual of each of "
        f"{view.corners} corners; rms {rms} px.",
    )
