"""Tracks of lines of JSON, as 'capture track' wrote them before 'track' wrote recordings.

They stay readable: 'scissorcal export' makes a table of one.
"""

import csv
from pathlib import Path
from typing import Any, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError, model_validator

from scissorcal.errors import InputError
from scissorcal.files import replacing
from scissorcal.foreign import read_foreign_text
from scissorcal.foreign.formats import TRACK_LINES
from scissorcal.recipe.euler_angles import (
    EulerAngles,
    Quaternion,
    angles_alone,
    euler_deg,
    one_rotation,
)
from scissorcal.vision.live import State


class TrackPose(BaseModel):
    """A pose T_a_b; ``covariance`` over a rotation vector in a's axes (rad), then metres."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    euler_angles: EulerAngles | None = Field(default=None, description="may stand alone")
    quaternion: Quaternion = Field(default_factory=angles_alone, description="w, x, y, z; w >= 0")
    translation_m: tuple[float, float, float]
    covariance: tuple[tuple[float, ...], ...] | None = None

    @model_validator(mode="after")
    def _is_one_rotation(self) -> "TrackPose":
        one_rotation(self.quaternion, self.euler_angles, "the pose")
        return self


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
    pose: TrackPose | None = None
    other: TrackPose | None = None


def track_schema() -> dict[str, Any]:
    """JSON schema of a track's lines: the first is a head, each other one a row."""
    schema: dict[str, Any] = TypeAdapter(TrackHead | TrackRow).json_schema()
    dialect = "https://json-schema.org/draft/2020-12/schema"
    return {"$schema": dialect, "$id": "track.schema.json", **schema}


def read_track_lines(path: Path) -> tuple[TrackHead, tuple[TrackRow, ...]]:
    """Read a track of lines; a last line that was cut off is left out.

    Raises InputError, with file and line, where it is none.
    """
    first, *lines = read_foreign_text(path, TRACK_LINES).splitlines() or [""]
    try:
        head = TrackHead.model_validate_json(first)
    except ValidationError:
        raise InputError(
            f"{path} is no track: its first line must be an object with the format "
            "scissorcal-track/1."
        ) from None
    rows = []
    for number, line in enumerate(lines, start=2):
        try:
            rows.append(TrackRow.model_validate_json(line))
        except ValidationError as error:
            mistake = error.errors()[0]
            if number == len(lines) + 1 and mistake["type"] == "json_invalid":
                break
            why = f" ({mistake['msg']})" if mistake["type"] == "value_error" else ""
            raise InputError(f"{path}, line {number}: this is no row of a track{why}.") from None
    return head, tuple(rows)


def export_track_lines(path: Path, table: Path, *, overwrite: bool = False) -> int:
    """Write a track of lines as CSV, a row for each picture; returns how many.

    Raises InputError where ``table`` is no .csv or exists already, and as `read_track_lines`.
    """
    if table.suffix.lower() != ".csv":
        raise InputError(f"{table}: a track of lines is written as .csv. Choose that extension.")
    if table.exists() and not overwrite:
        raise InputError(f"{table} exists. Choose another name, or allow overwriting.")
    _, rows = read_track_lines(path)
    with replacing(table) as part, part.open("w", encoding="utf-8", newline="") as file:
        writer = csv.writer(file)
        writer.writerow(_COLUMNS)
        for row in rows:
            pose = row.pose
            numbers: tuple[float | str, ...] = ("",) * 10
            if pose:
                angles = euler_deg(pose.quaternion).tolist()
                numbers = (*pose.quaternion, *pose.translation_m, *angles)
            odds = "" if row.odds is None else row.odds
            writer.writerow([row.number, row.time_s, row.state, row.corners, odds, *numbers])
    return len(rows)


_COLUMNS = (
    *("number", "time_s", "state", "corners", "odds"),
    *(f"quaternion_{part}" for part in "wxyz"),
    *(f"translation_{part}_m" for part in "xyz"),
    *(f"{part}_deg" for part in ("yaw", "pitch", "roll")),
)
