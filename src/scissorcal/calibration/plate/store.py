"""A plate's pose on disk: one JSON file."""

import json
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from scissorcal.calibration.plate.result import Halves, PlateFit, PlateView
from scissorcal.errors import InputError
from scissorcal.verdicts import Verdict
from scissorcal.vision.geometry.pose import Pose

FORMAT: Literal["scissorcal-plate/1"] = "scissorcal-plate/1"
LARGEST_ODDS = 1e12


class PoseRecord(BaseModel):
    """A pose T_a_b; ``covariance`` over a rotation vector in a's axes (rad), then metres."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    quaternion: tuple[float, float, float, float] = Field(description="w, x, y, z; w >= 0")
    translation_m: tuple[float, float, float]
    covariance: tuple[tuple[float, ...], ...] | None = None


class PlateDocument(BaseModel):
    """The file fits/plate.json; see PlateFit for what its members mean."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    format: Literal["scissorcal-plate/1"] = FORMAT
    target: str
    camera_plate: PoseRecord
    other: PoseRecord | None
    odds: float
    ambiguity: float | None = Field(description="null where there is no second pose")
    rig_plate: PoseRecord | None
    views: tuple[PlateView, ...]
    halves: Halves | None
    rms_px: float
    noise_px: float
    verdicts: tuple[Verdict, ...]
    inputs_hash: str
    sources: tuple[str, ...]


def save_plate(fit: PlateFit, path: Path) -> None:
    """Write a plate's pose to ``path``, complete or not at all."""
    document = PlateDocument(
        target=fit.target,
        camera_plate=pose_record(fit.camera_plate),
        other=pose_record(fit.other) if fit.other else None,
        odds=min(fit.odds, LARGEST_ODDS),
        ambiguity=fit.ambiguity if np.isfinite(fit.ambiguity) else None,
        rig_plate=pose_record(fit.rig_plate) if fit.rig_plate else None,
        views=tuple(_storable(view) for view in fit.views),
        halves=fit.halves,
        rms_px=fit.rms_px,
        noise_px=fit.noise_px,
        verdicts=fit.verdicts,
        inputs_hash=fit.inputs_hash,
        sources=fit.sources,
    )
    path.parent.mkdir(parents=True, exist_ok=True)
    part = path.with_name(path.name + ".part")
    part.write_text(document.model_dump_json(indent=1) + "\n", "utf-8")
    part.replace(path)


def load_plate(path: Path) -> PlateFit:
    """Read a plate's pose. Raises InputError where the file is not one."""
    try:
        found = PlateDocument.model_validate_json(path.read_text("utf-8"))
    except (OSError, UnicodeDecodeError, json.JSONDecodeError, ValidationError) as error:
        why = str(error).splitlines()[0]
        raise InputError(
            f"{path} is not a plate's pose of scissorcal, or it is damaged ({why}); remove it and "
            "run 'scissorcal fit plate' again."
        ) from None
    return PlateFit(
        target=found.target,
        camera_plate=pose_of(found.camera_plate),
        other=pose_of(found.other) if found.other else None,
        odds=found.odds,
        ambiguity=float("inf") if found.ambiguity is None else found.ambiguity,
        rig_plate=pose_of(found.rig_plate) if found.rig_plate else None,
        views=found.views,
        halves=found.halves,
        rms_px=found.rms_px,
        noise_px=found.noise_px,
        verdicts=found.verdicts,
        inputs_hash=found.inputs_hash,
        sources=found.sources,
    )


def pose_record(pose: Pose) -> PoseRecord:
    """A pose as files hold it."""
    rows = pose.covariance
    return PoseRecord(
        quaternion=pose.quaternion,
        translation_m=pose.translation_m,
        covariance=None if rows is None else tuple(tuple(row) for row in rows.tolist()),
    )


def pose_of(record: PoseRecord) -> Pose:
    """A pose from what files hold."""
    rows = record.covariance
    covariance = None if rows is None else np.array(rows, dtype=np.float64)
    return Pose(record.quaternion, record.translation_m, covariance)


def _storable(view: PlateView) -> PlateView:
    """A view without infinity, which JSON cannot say: its ambiguity is capped."""
    return replace(view, ambiguity=min(view.ambiguity, LARGEST_ODDS))
