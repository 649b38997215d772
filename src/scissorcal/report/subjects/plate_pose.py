"""Where the plate stands: its pose with standard deviations, the second pose, its photographs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from scissorcal.calibration.plate.result import PlateFit
from scissorcal.recipe.euler_angles import CONVENTION
from scissorcal.report.numbers import finite, percent, short, significant, with_decimals
from scissorcal.report.panel import (
    Panel,
    Picture,
    Row,
    Value,
    number,
    words,
)
from scissorcal.vision.geometry.pose import Pose, difference

PART = "plate"
MOVED = 3.0
"""A photograph is marked whose rms in the common pose exceeds its own by this factor."""
CERTAIN = 1e6


def plate_panels(fit: PlateFit, files: Sequence[Path]) -> tuple[Panel, ...]:
    """The pose, and the photographs that it comes from."""
    return (_pose(fit), _photographs(fit, files))


def _pose(fit: PlateFit) -> Panel:
    known = [("before the camera", fit.camera_plate)]
    if fit.rig_plate is not None:
        known.append(("in the rig's frame", fit.rig_plate))
    shown = [(name, _components(pose, name)) for name, pose in known]
    if fit.other is not None:
        name = "second pose, before the camera"
        shown.append((name, _components(replace(fit.other, covariance=None), name)))
    labels = [*"xyz", "yaw", "pitch", "roll", *(f"turn about {axis}" for axis in "xyz")]
    rows = tuple(
        Row(label, tuple(values[place] for _, values in shown))
        for place, label in enumerate(labels)
    )
    photographs = f"{len(fit.views)} photograph{'s' if len(fit.views) != 1 else ''}"
    notes = [
        f"The pose of one plate at rest in {photographs} of the {fit.target}; x runs along the cut "
        "from the plate's near edge, z out of its upper face."
    ]
    notes += [
        f"Quaternion (w, x, y, z) {name}: "
        f"{', '.join(with_decimals(finite(v), 6) for v in pose.quaternion)}."
        for name, pose in known
    ]
    notes.append(
        f"Yaw, pitch and roll are Euler angles, {CONVENTION}. Where they and the quaternion differ "
        "by rounding, the quaternion counts."
    )
    notes += [
        f"{name[0].upper()}{name[1:]}: {pose.euler_angles.note}"
        for name, pose in known
        if pose.euler_angles.note
    ]
    if fit.rig_plate is None:
        notes.append(
            "The pose in the rig's frame is not known: run `scissorcal capture plate --positions "
            "FILE` with photographs of the card on the rig, then `scissorcal fit plate`."
        )
    caption = (
        "Position of the plate's frame, its Euler angles and its rotation vector; ± is the "
        "standard deviation, for a turn about an axis that of a small one."
    )
    return Panel(
        f"{PART}-pose", PART, "Pose of the plate", _sentence(fit), rows,
        notes=tuple(notes), caption=caption,
    )  # fmt: skip


def _components(pose: Pose, name: str) -> list[Value]:
    sd = np.full(6, np.nan)
    if pose.covariance is not None:
        sd = np.sqrt(np.maximum(np.diag(pose.covariance), 0.0))
    degrees = float(np.degrees(1.0))
    angles = pose.euler_angles
    euler = (angles.yaw_deg, angles.pitch_deg, angles.roll_deg)
    return [
        number(name, scale * value, unit, sd=scale * own, digits=4)
        for values, sds, scale, unit in (
            (pose.translation_m, sd[3:], 1e3, "mm"),
            (euler, angles.sd_deg or (np.nan,) * 3, 1.0, "°"),
            (pose.rotation_vector, sd[:3], degrees, "°"),
        )
        for value, own in zip(values, sds, strict=True)
    ]


def _sentence(fit: PlateFit) -> str:
    if fit.other is None:
        said = "A plane allows no second pose here."
    else:
        turn = difference(fit.camera_plate, fit.other)[:3]
        apart = short(float(np.degrees(np.linalg.norm(turn))))
        odds = (
            f"more than {CERTAIN:,.0f}".replace(",", " ")
            if fit.odds > CERTAIN
            else short(finite(fit.odds))
        )
        said = (
            f"A plane allows a second pose, turned by {apart}°; the photographs favour the first "
            f"with odds of {odds} to 1 (rms errors {short(finite(fit.ambiguity))} to 1)."
        )
    said += (
        f" Corners lie {significant(finite(fit.noise_px), 2)} px (sd) from where the pose has them"
    )
    if fit.halves is not None:
        said += (
            f"; poses of two halves of them differ by "
            f"{significant(finite(fit.halves.rotation_deg), 2)}° and "
            f"{significant(finite(fit.halves.translation_mm), 2)} mm"
        )
    return said + "."


def _photographs(fit: PlateFit, files: Sequence[Path]) -> Panel:
    views = sorted(fit.views, key=lambda view: -view.rms_px)
    rows = tuple(
        Row(
            view.name,
            (
                number("rms", view.rms_px, "px", digits=2),
                number("rms alone", view.rms_alone_px, "px", digits=2),
                words("corners used", f"{view.used} of {view.corners}"),
                number("side", view.side_px, "px", digits=2),
                number("distance", view.distance_m, "m"),
                number("tilt", view.tilt_deg, "°", digits=2),
                _ambiguity(view.ambiguity),
                number("own pose turned by", view.away_deg, "°", digits=2),
                number("own pose moved by", view.away_mm, "mm", digits=2),
            ),
            marked=view.rms_px > MOVED * (view.rms_alone_px or float("inf")),
        )
        for view in views
    )
    used, seen = sum(view.used for view in views), sum(view.corners for view in views)
    note = (
        f"{used} of {seen} corners are used ({percent(used / seen if seen else None)}). Alone is "
        "in the photograph's own pose instead of the common one. Ambiguity is the ratio of the rms "
        "errors of the two poses that a plane allows, by the photograph alone: near 1 they "
        "cannot be separated."
    )
    pictures = [_picture(fit, path) for path in files]
    ranked = sorted((p for p in pictures if p is not None), key=lambda pair: pair[0])
    return Panel(
        f"{PART}-views", PART, "Photographs of the plate", rows=rows, notes=(note,),
        pictures=tuple(picture for _, picture in ranked), caption="From the worst.",
    )  # fmt: skip


def _ambiguity(value: float) -> Value:
    if value > CERTAIN:
        return words("ambiguity", "> 10⁶")
    return number("ambiguity", value)


def _picture(fit: PlateFit, path: Path) -> tuple[int, Picture] | None:
    views = sorted(fit.views, key=lambda view: -view.rms_px)
    for place, view in enumerate(views):
        if path.stem.endswith(Path(view.name).stem):
            rms = significant(finite(view.rms_px), 2)
            return place, Picture(
                path.name,
                f"Residuals of {view.name}",
                "Arrows run from where the common pose has a corner to where it was seen, enlarged "
                f"as the bar says; x, y, z are the plate's axes; rms {rms} px.",
                f"Photograph {view.name} of the plate with an arrow for the residual of each of "
                f"{view.corners} corners of the {fit.target}; rms {rms} px.",
            )
    return None
