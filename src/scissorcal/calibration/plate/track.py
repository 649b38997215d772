"""A track: the plate's pose from picture to picture, one line of JSON for each."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, TypeAdapter

from scissorcal.vision.geometry.camera import Camera
from scissorcal.vision.geometry.pose import Pose
from scissorcal.vision.geometry.rig_frame import RigPose
from scissorcal.vision.track import STATES, State, Tracked


class PoseRecord(BaseModel):
    """A pose T_a_b; ``covariance`` over a rotation vector in a's axes (rad), then metres."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    quaternion: tuple[float, float, float, float] = Field(description="w, x, y, z; w >= 0")
    translation_m: tuple[float, float, float]
    covariance: tuple[tuple[float, ...], ...] | None = None


class TrackHead(BaseModel):
    """First line of a track: what it is of, and in which frame its poses are."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    format: Literal["scissorcal-track/1"] = "scissorcal-track/1"
    source: str = Field(description="camera's number or video file")
    started_utc: str
    frame: Literal["camera", "rig"] = Field(description="poses map the plate's frame into this one")
    camera_inputs_hash: str


class TrackRow(BaseModel):
    """One picture. ``pose`` is null in a drop-out; ``other`` is the second pose that a plane
    allows, ``odds`` those of the first against it, null where there is none."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    number: int
    time_s: float = Field(description="since the first picture")
    state: State
    target: str | None = None
    corners: int = 0
    rms_px: float | None = None
    odds: float | None = None
    pose: PoseRecord | None = None
    other: PoseRecord | None = None


@dataclass(frozen=True)
class TrackSummary:
    """How a track went. ``states`` counts pictures, ``longest_gap_s`` is the longest time between
    two poses (or to either end); sd are medians over the poses, of their worst axis."""

    path: Path
    frame: Literal["camera", "rig"]
    pictures: int
    poses: int
    states: dict[State, int]
    longest_gap_s: float
    seconds: float
    travel_mm: float
    sd_mm: float
    sd_deg: float

    @property
    def drop_outs(self) -> int:
        return self.pictures - self.poses


def track_row(seen: Tracked, camera: Camera, back: Pose, rig: RigPose | None) -> TrackRow:
    """The line of one picture; ``back`` is T_target_plate, ``rig`` takes poses to its frame."""
    found = seen.found
    if found is None:
        return TrackRow(
            number=seen.number, time_s=seen.time_s, state=seen.state, corners=seen.corners
        )

    pose = (rig.holds(found, camera) if rig else found.pose).after(back)
    other = None
    if found.other:
        known = replace(rig.camera_rig, covariance=None).inverse() if rig else None
        other = (known.after(found.other) if known else found.other).after(back)
    return TrackRow(
        number=seen.number,
        time_s=seen.time_s,
        state=seen.state,
        target=seen.board.name if seen.board else None,
        corners=seen.corners,
        rms_px=found.rms_px,
        odds=min(found.odds, 1e12) if found.other else None,
        pose=_pose_record(pose),
        other=_pose_record(other) if other else None,
    )


def track_schema() -> dict[str, Any]:
    """JSON schema of a track's lines: the first is a head, each other one a row."""
    schema: dict[str, Any] = TypeAdapter(TrackHead | TrackRow).json_schema()
    dialect = "https://json-schema.org/draft/2020-12/schema"
    return {"$schema": dialect, "$id": "track.schema.json", **schema}


def track_summary(path: Path, head: TrackHead, rows: Iterable[TrackRow]) -> TrackSummary:
    """Count a track's drop-outs by cause, and summarise the standard deviations of its poses."""
    rows = tuple(rows)
    posed = [row for row in rows if row.pose]
    marks = [rows[0].time_s, *(row.time_s for row in posed), rows[-1].time_s]
    spread = [_worst(row.pose) for row in posed if row.pose]
    places = np.array([row.pose.translation_m for row in posed if row.pose])
    return TrackSummary(
        path=path,
        frame=head.frame,
        pictures=len(rows),
        poses=len(posed),
        states={state: sum(row.state == state for row in rows) for state in STATES},
        longest_gap_s=float(np.diff(marks).max()),
        seconds=rows[-1].time_s - rows[0].time_s,
        travel_mm=float(1e3 * np.linalg.norm(places - places[0], axis=1).max()),
        sd_mm=float(np.median([mm for mm, _ in spread])),
        sd_deg=float(np.median([deg for _, deg in spread])),
    )


def why_no_pose(rows: Sequence[TrackRow]) -> str:
    """Sentence that says why none of the pictures gave a pose."""
    if not rows:
        return "The camera gave no picture."
    counts = {state: sum(row.state == state for row in rows) for state in STATES}
    causes = ", ".join(f"in {n} {STATES[state]}" for state, n in counts.items() if n)
    return f"None of {len(rows)} pictures gave a pose of the plate's target ({causes})."


def _worst(pose: PoseRecord) -> tuple[float, float]:
    sd = np.sqrt(np.diag(np.array(pose.covariance)))
    return float(1e3 * sd[3:].max()), float(np.degrees(sd[:3].max()))


def _pose_record(pose: Pose) -> PoseRecord:
    """A pose as files hold it."""
    rows = pose.covariance
    return PoseRecord(
        quaternion=pose.quaternion,
        translation_m=pose.translation_m,
        covariance=None if rows is None else tuple(tuple(row) for row in rows.tolist()),
    )
