"""Where the plate stands: its pose with standard deviations, the second pose, its photographs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scissorcal.calibration.plate.result import PlateFit
from scissorcal.report.numbers import (
    Number,
    decimals_for,
    finite,
    finite_each,
    percent,
    short,
    significant,
    with_decimals,
)
from scissorcal.report.panel import Panel, Row, Table, columns
from scissorcal.report.pictures import Picture, PictureFile
from scissorcal.vision.geometry.pose import Pose, difference

ANCHOR = "plate"
MOVED = 3.0
"""A photograph whose rms under the common pose exceeds its own by this factor stands out."""
CERTAIN = 1e6


@dataclass(frozen=True)
class PoseFacts:
    """A pose T_a_b: quaternion (w, x, y, z), translation, rotation vector; the covariance is over
    a small rotation in a's axes (rad) and the translation (m), empty where nobody said."""

    quaternion: tuple[Number, ...]
    translation_m: tuple[Number, ...]
    rotation_vector_rad: tuple[Number, ...]
    covariance: tuple[tuple[Number, ...], ...]


@dataclass(frozen=True)
class PlateViewRow:
    """One photograph: rms under the common pose and under its own, ambiguity of its own pose, and
    how far that lies from the common one."""

    name: str
    corners: int
    used: int
    rms_px: Number
    rms_alone_px: Number
    side_px: Number
    distance_m: Number
    tilt_deg: Number
    ambiguity: Number
    away_deg: Number
    away_mm: Number


@dataclass(frozen=True)
class PlateHalves:
    """How far poses of two halves of the corners lie apart; ``square`` in units of their claims."""

    rotation_deg: Number
    translation_mm: Number
    square: Number


@dataclass(frozen=True)
class PlateSection:
    """What is said of the plate; ``camera_plate`` takes its frame into the camera's, ``other`` is
    the second pose that a plane allows, ``rig_plate`` takes it into the rig's frame."""

    target: str
    camera_plate: PoseFacts
    other: PoseFacts | None
    other_apart_deg: Number
    odds: Number
    ambiguity: Number
    rig_plate: PoseFacts | None
    views: tuple[PlateViewRow, ...]
    halves: PlateHalves | None
    rms_px: Number
    noise_px: Number
    inputs_hash: str
    pictures: tuple[str, ...]


def take_plate(fit: PlateFit, pictures: Sequence[Path]) -> PlateSection:
    """Gather the facts on a plate's fit."""
    halves = fit.halves
    apart = None
    if fit.other is not None:
        turn = difference(fit.camera_plate, fit.other)[:3]
        apart = float(np.degrees(np.linalg.norm(turn)))
    return PlateSection(
        fit.target,
        _pose(fit.camera_plate),
        None if fit.other is None else _pose(fit.other),
        finite(apart),
        finite(fit.odds),
        finite(fit.ambiguity),
        None if fit.rig_plate is None else _pose(fit.rig_plate),
        tuple(
            PlateViewRow(
                view.name,
                view.corners,
                view.used,
                finite(view.rms_px),
                finite(view.rms_alone_px),
                finite(view.side_px),
                finite(view.distance_m),
                finite(view.tilt_deg),
                finite(view.ambiguity),
                finite(view.away_deg),
                finite(view.away_mm),
            )
            for view in sorted(fit.views, key=lambda view: -view.rms_px)
        ),
        None
        if halves is None
        else PlateHalves(
            finite(halves.rotation_deg), finite(halves.translation_mm), finite(halves.square)
        ),
        finite(fit.rms_px),
        finite(fit.noise_px),
        fit.inputs_hash,
        tuple(path.name for path in pictures),
    )


def plate_pictures(section: PlateSection, files: Sequence[Path]) -> tuple[PictureFile, ...]:
    """The pictures to show: each photograph with its residuals, the worst first."""
    ranked = []
    for path in files:
        place = next(
            (
                number
                for number, view in enumerate(section.views)
                if path.stem.endswith(Path(view.name).stem)
            ),
            None,
        )
        if place is None:
            continue
        view = section.views[place]
        picture = PictureFile(
            path,
            f"Residuals of {view.name}",
            f"Arrows run from where the common pose has a corner to where it was seen, enlarged as "
            f"the bar says; x, y, z are the plate's axes; rms {significant(view.rms_px, 2)} px.",
            f"Photograph {view.name} of the plate with an arrow for the residual of each of "
            f"{view.corners} corners of the {section.target}; rms "
            f"{significant(view.rms_px, 2)} px.",
        )
        ranked.append((place, picture))
    return tuple(picture for _, picture in sorted(ranked, key=lambda pair: pair[0]))


def show_plate(section: PlateSection, pictures: Sequence[Picture]) -> tuple[Panel, ...]:
    """The panels on a plate's pose."""
    return (_poses(section), _views(section, pictures))


def _pose(pose: Pose) -> PoseFacts:
    rows = () if pose.covariance is None else pose.covariance.tolist()
    return PoseFacts(
        finite_each(pose.quaternion, 9),
        finite_each(pose.translation_m, 9),
        finite_each(pose.rotation_vector, 9),
        tuple(finite_each(row) for row in rows),
    )


def _poses(section: PlateSection) -> Panel:
    known = [("Before the camera", section.camera_plate)]
    if section.rig_plate is not None:
        known.append(("In the rig's frame", section.rig_plate))
    shown = [(name, _columns(pose, spread=True)) for name, pose in known]
    if section.other is not None:
        shown.append(("Second pose, before the camera", _columns(section.other, spread=False)))
    places = [f"{axis} [mm]" for axis in "xyz"]
    turns = [f"turn about {axis} [°]" for axis in "xyz"]
    rows = tuple(
        Row((name, *(cells[number] for _, cells in shown)))
        for number, name in enumerate((*places, *turns))
    )
    table = Table(
        "Position of the plate's frame, and its rotation vector; ± is the standard deviation, for "
        "a turn that of a small one about that axis.",
        columns("Component", *(name for name, _ in shown)),
        rows,
    )
    lead = [
        f"The pose is of one plate at rest in {len(section.views)} "
        f"photograph{'s' if len(section.views) != 1 else ''} of the {section.target}; x runs along "
        "the cut from the plate's near edge, z out of its upper face.",
    ]
    lead += [
        f"{name} its quaternion (w, x, y, z) is "
        f"{', '.join(with_decimals(value, 5) for value in pose.quaternion)}."
        for name, pose in known
    ]
    if section.rig_plate is None:
        lead.append(
            "The rig's frame is not known to the camera, so the plate is known before the camera "
            "only: run `scissorcal capture plate --stances FILE` with photographs of the card on "
            "the rig, then `scissorcal fit plate`."
        )
    return Panel(f"{ANCHOR}-pose", "Pose", tuple(lead), _finding(section), (), table)


def _columns(pose: PoseFacts, *, spread: bool) -> list[str]:
    covariance = np.array(pose.covariance, dtype=np.float64)
    sd = np.sqrt(np.maximum(np.diag(covariance), 0.0)) if covariance.size else np.full(6, np.nan)
    cells = []
    for values, size, sds in (
        (pose.translation_m, 1e3, sd[3:]),
        (pose.rotation_vector_rad, 180.0 / np.pi, sd[:3]),
    ):
        for value, own in zip(values, sds, strict=True):
            shown = finite(size * own) if spread else None
            number = None if value is None else size * value
            text = with_decimals(number, decimals_for(shown, number))
            if shown is not None:
                text += f" ± {significant(shown, 2)}"
            cells.append(text)
    return cells


def _finding(section: PlateSection) -> str:
    if section.other is None:
        words = "A plane allows no second pose here."
    else:
        odds = section.odds or 0.0
        said = f"more than {CERTAIN:,.0f}".replace(",", " ") if odds > CERTAIN else short(odds)
        words = (
            f"A plane allows a second pose, turned by {short(section.other_apart_deg)}° against "
            f"the first; the photographs speak for the first with odds of {said} to 1 (rms errors "
            f"{short(section.ambiguity)} to 1)."
        )
    words += f" Corners lie {significant(section.noise_px, 2)} px (sd) from where the pose has them"
    if section.halves is not None:
        words += (
            f"; poses of two halves of them differ by "
            f"{significant(section.halves.rotation_deg, 2)}° and "
            f"{significant(section.halves.translation_mm, 2)} mm"
        )
    return words + "."


def _views(section: PlateSection, pictures: Sequence[Picture]) -> Panel:
    rows = tuple(
        Row(
            (
                view.name,
                significant(view.rms_px, 2),
                significant(view.rms_alone_px, 2),
                f"{view.used} of {view.corners}",
                significant(view.side_px, 2),
                significant(view.distance_m),
                with_decimals(view.tilt_deg, 0),
                _large(view.ambiguity),
                f"{significant(view.away_deg, 2)}°, {significant(view.away_mm, 2)} mm",
            ),
            marked=(view.rms_px or 0.0) > MOVED * (view.rms_alone_px or float("inf")),
        )
        for view in section.views
    )
    heads = columns(
        "Photograph",
        "Rms [px]",
        "Rms alone [px]",
        "Corners used",
        "Side [px]",
        "Distance [m]",
        "Tilt [°]",
        "Ambiguity",
        "Own pose away by",
    )
    used = sum(view.used for view in section.views)
    seen = sum(view.corners for view in section.views)
    lead = (
        f"{used} of {seen} corners were used ({percent(used / seen if seen else None)}). Alone "
        "means under the photograph's own pose in place of the common one. Ambiguity is the ratio "
        "of the rms errors of the two poses that a plane allows, by the photograph alone: near 1 "
        "it cannot tell them apart.",
    )
    table = Table("Photographs of the plate, from the worst.", heads, rows)
    return Panel(f"{ANCHOR}-views", "Photographs", lead, table=table, pictures=tuple(pictures))


def _large(value: Number) -> str:
    if value is not None and value > CERTAIN:
        return "> 10⁶"
    return short(value)
