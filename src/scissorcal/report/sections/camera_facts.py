"""What is known of a camera, as facts: parameters, views, uncertainty over the picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scissorcal.calibration.camera.result import CameraFit
from scissorcal.report.numbers import Number, finite, finite_each
from scissorcal.vision.geometry.camera import PARAMETERS

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
"""Further numbers that the distortion of a camera from elsewhere may have."""


@dataclass(frozen=True)
class CameraParameter:
    """One parameter; ``sd`` is zero where it was held, None where nobody said."""

    name: str
    meaning: str
    unit: str
    value: Number
    sd: Number


@dataclass(frozen=True)
class CameraRung:
    """A distortion model: rms on photographs left out, and how far behind the best by photograph
    (log-likelihood, with its standard error)."""

    name: str
    free: int
    unseen_px: Number
    behind: Number
    behind_se: Number
    equivalent: bool
    chosen: bool


@dataclass(frozen=True)
class CameraView:
    """One photograph of the board."""

    name: str
    corners: int
    rms_px: Number
    worst_px: Number
    square_px: Number
    distance_m: Number
    tilt_deg: Number
    outlying: bool


@dataclass(frozen=True)
class TwoHalves:
    """The cameras of two halves of the photographs: their difference, what is claimed, chance."""

    rms_px: Number
    claimed_px: Number
    p_value: Number


@dataclass(frozen=True)
class UncertaintyMap:
    """Over places ``x_px`` by ``y_px``, row by row of y: standard deviation of a projected point,
    difference of two halves, and whether corners were seen about."""

    x_px: tuple[Number, ...]
    y_px: tuple[Number, ...]
    sd_px: tuple[Number, ...]
    difference_px: tuple[Number, ...]
    inside: tuple[bool, ...]


@dataclass(frozen=True)
class CameraSection:
    """What is said of the camera; ``views`` from the worst, ``region_px`` where corners were seen.

    ``pictures`` are the names of the files that the fit drew.
    """

    origin: str
    board: str
    rung: str
    width_px: int
    height_px: int
    parameters: tuple[CameraParameter, ...]
    rungs: tuple[CameraRung, ...]
    views: tuple[CameraView, ...]
    cross_validation: TwoHalves | None
    noise_px: Number
    stretch: Number
    bulge_mm: tuple[Number, ...]
    region_px: tuple[tuple[Number, ...], ...]
    region_share: Number
    uncertainty: UncertaintyMap | None
    inputs_hash: str
    pictures: tuple[str, ...]
    notes: tuple[str, ...]


def take_camera(fit: CameraFit, pictures: Sequence[Path]) -> CameraSection:
    """Gather the facts on a camera's fit."""
    camera = fit.camera
    sd = np.full(len(PARAMETERS), np.nan)
    if camera.covariance is not None:
        sd = np.sqrt(np.maximum(np.diag(camera.covariance), 0.0))
    values = (camera.fx, camera.fy, camera.cx, camera.cy, *camera.distortion)
    names = (*PARAMETERS, *RATIONAL)[: len(values)]
    meanings = (*MEANINGS, *(("radial distortion, below the line", ""),) * len(RATIONAL))
    sd = np.pad(sd, (0, len(values) - len(sd)), constant_values=np.nan)
    views = sorted(fit.views, key=lambda view: -view.rms_px)
    cross = fit.cross
    return CameraSection(
        fit.origin,
        fit.board,
        fit.rung,
        camera.width,
        camera.height,
        tuple(
            CameraParameter(name, meaning, unit, finite(value), finite(spread))
            for name, (meaning, unit), value, spread in zip(
                names, meanings[: len(values)], values, sd, strict=True
            )
        ),
        tuple(
            CameraRung(
                str(row["name"]),
                int(row["free"]),
                finite(row["unseen_px"]),
                finite(row["behind"]),
                finite(row["behind_se"]),
                bool(row["equivalent"]),
                bool(row["chosen"]),
            )
            for row in fit.rungs
        ),
        tuple(
            CameraView(
                view.name,
                view.corners,
                finite(view.rms_px),
                finite(view.worst_px),
                finite(view.square_px),
                finite(view.distance_m),
                finite(view.tilt_deg),
                view.outlying,
            )
            for view in views
        ),
        None
        if cross is None
        else TwoHalves(finite(cross.rms_px), finite(cross.claimed_px), finite(cross.p_value)),
        finite(fit.noise_px),
        finite(fit.stretch),
        finite_each(fit.bulge_mm),
        tuple(finite_each(place) for place in fit.region.tolist()),
        finite(fit.region_share),
        _map(fit),
        fit.inputs_hash,
        tuple(path.name for path in pictures),
        fit.notes,
    )


def _map(fit: CameraFit) -> UncertaintyMap | None:
    places = fit.pixel_map
    if places is None:
        return None
    apart = places.difference_px
    return UncertaintyMap(
        finite_each(places.x),
        finite_each(places.y),
        finite_each(places.sd_px.ravel(), 4),
        () if apart is None else finite_each(apart.ravel(), 4),
        tuple(bool(value) for value in places.inside.ravel()),
    )
