"""A workspace's track: the plate's pose from picture to picture, a line of JSON for each."""

import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TextIO

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from scissorcal.errors import InputError
from scissorcal.vision.targets.boards import PLATE_BOARD, PLATE_STRIP
from scissorcal.vision.track import STATES, State, Tracked, track
from scissorcal.workday.runs.camera import require_camera
from scissorcal.workday.runs.plate import plate_target, workspace_rig
from scissorcal.workday.workspace import Workspace

if TYPE_CHECKING:
    from scissorcal.vision.geometry.camera import Camera
    from scissorcal.vision.geometry.pose import Pose
    from scissorcal.vision.geometry.rig_frame import RigPose
    from scissorcal.vision.live import Frame

Progress = Callable[[float, str], None]


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


def track_plate(
    workspace: Workspace,
    frames: Iterable["Frame"],
    source: str,
    *,
    seconds: float | None = None,
    progress: Progress | None = None,
) -> TrackSummary:
    """Follow the plate from picture to picture into captures/track-<stamp>.jsonl.

    A line is written, and given to the operating system, as soon as its picture is located, so that
    a killed track ends with its last whole line. Poses are in the rig's frame where its card tells
    all of it. Ends after ``seconds``, with the pictures, or by an interrupt from the keyboard.
    Raises InputError, and keeps nothing, where no picture showed the target.
    """
    fitted = require_camera(workspace)
    recipe = workspace.recipe()
    located = workspace_rig(workspace, fitted.camera, recipe)
    rig = None if located is None or located.untold else located
    back = plate_target(recipe).inverse()
    head = TrackHead(
        source=Path(source).name,
        started_utc=datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ"),
        frame="rig" if rig else "camera",
        camera_inputs_hash=fitted.inputs_hash,
    )
    workspace.captures_dir.mkdir(parents=True, exist_ok=True)
    path = _new_path(workspace)
    rows: list[TrackRow] = []
    counted = _counted(frames, seconds, rows, progress)
    try:
        with path.open("x", encoding="utf-8") as file:
            _append(file, head)
            try:
                for seen in track(counted, (PLATE_BOARD, PLATE_STRIP), fitted.camera):
                    rows.append(_row(seen, fitted.camera, back, rig))
                    _append(file, rows[-1])
            except KeyboardInterrupt:
                pass
    finally:
        if not any(row.pose for row in rows):
            path.unlink(missing_ok=True)
    if not any(row.pose for row in rows):
        raise InputError(f"{source}: {_why_nothing(rows)} Nothing was kept.")
    return summary(path, head, rows)


def read_track(path: Path) -> tuple[TrackHead, tuple[TrackRow, ...]]:
    """Read a track; a last line that was cut short is left out. Raises InputError."""
    try:
        lines = path.read_text("utf-8").splitlines(keepends=True)
        whole = [line for line in lines if line.endswith("\n")]
        head = TrackHead.model_validate_json(whole[0] if whole else "")
        return head, tuple(TrackRow.model_validate_json(line) for line in whole[1:])
    except (OSError, UnicodeDecodeError, json.JSONDecodeError, ValidationError) as error:
        why = str(error).splitlines()[0]
        raise InputError(f"{path} is not a track of scissorcal, or it is damaged: {why}.") from None


def track_schema() -> dict[str, Any]:
    """JSON schema of a track's lines: the first is a head, each other one a row."""
    from pydantic import TypeAdapter

    schema: dict[str, Any] = TypeAdapter(TrackHead | TrackRow).json_schema()
    dialect = "https://json-schema.org/draft/2020-12/schema"
    return {"$schema": dialect, "$id": "track.schema.json", **schema}


def summary(path: Path, head: TrackHead, rows: Iterable[TrackRow]) -> TrackSummary:
    """Count a track's drop-outs by what they came from, and say how well its poses are known."""
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


def _counted(
    frames: Iterable["Frame"],
    seconds: float | None,
    rows: list[TrackRow],
    progress: Progress | None,
) -> Iterable["Frame"]:
    """Pictures up to the time asked for, saying now and then how it goes."""
    for frame in frames:
        if seconds is not None and frame.time_s >= seconds:
            return
        if progress:
            share = frame.time_s / seconds if seconds else 0.0
            done = frame.number / frame.count if frame.count else share
            lost = sum(row.pose is None for row in rows)
            last = f"{STATES[rows[-1].state]}; " if rows else ""
            progress(done, f"picture {frame.number}: {last}{lost} drop-outs so far")
        yield frame


def _row(seen: Tracked, camera: "Camera", back: "Pose", rig: "RigPose | None") -> TrackRow:
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
        pose=_record(pose),
        other=_record(other) if other else None,
    )


def _record(pose: "Pose") -> PoseRecord:
    rows = None if pose.covariance is None else tuple(map(tuple, pose.covariance.tolist()))
    return PoseRecord(quaternion=pose.quaternion, translation_m=pose.translation_m, covariance=rows)


def _append(file: TextIO, line: BaseModel) -> None:
    file.write(line.model_dump_json() + "\n")
    file.flush()


def _worst(pose: PoseRecord) -> tuple[float, float]:
    sd = np.sqrt(np.diag(np.array(pose.covariance)))
    return float(1e3 * sd[3:].max()), float(np.degrees(sd[:3].max()))


def _why_nothing(rows: list[TrackRow]) -> str:
    if not rows:
        return "there was not one picture."
    counts = {state: sum(row.state == state for row in rows) for state in STATES}
    told = ", ".join(f"in {n} {STATES[state]}" for state, n in counts.items() if n)
    return f"none of {len(rows)} pictures gave a pose of the plate's target ({told})."


def _new_path(workspace: Workspace) -> Path:
    stamp = datetime.now(UTC).strftime("%Y%m%dT%H%M%SZ")
    path = workspace.captures_dir / f"track-{stamp}.jsonl"
    number = 1
    while path.exists():
        number += 1
        path = workspace.captures_dir / f"track-{stamp}-{number}.jsonl"
    return path
