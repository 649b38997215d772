"""A workspace's track: the plate's pose from picture to picture, a line of JSON for each."""

from collections.abc import Callable, Iterable
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from pydantic import BaseModel

from scissorcal.calibration.plate.fit import plate_target
from scissorcal.calibration.plate.track import (
    TrackHead,
    TrackRow,
    TrackSummary,
    track_row,
    track_summary,
    why_no_pose,
)
from scissorcal.errors import InputError
from scissorcal.vision.targets.boards import PLATE_BOARD, PLATE_STRIP
from scissorcal.vision.track import STATES, track
from scissorcal.workday.engine import Engine
from scissorcal.workday.runs.fit import load_result
from scissorcal.workday.runs.plate import locate_workspace_rig
from scissorcal.workday.workspace import Workspace

if TYPE_CHECKING:
    from scissorcal.vision.live import Frame

Progress = Callable[[float, str], None]


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
    engine = Engine.of(workspace)
    fitted = load_result(engine, "camera")
    located = locate_workspace_rig(engine, fitted.camera)
    rig = None if located is None or located.untold else located
    back = plate_target(engine.recipe).inverse()
    head = TrackHead(
        source=Path(source).name,
        started_utc=datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ"),
        frame="rig" if rig else "camera",
        camera_inputs_hash=fitted.inputs_hash,
    )
    workspace.captures_dir.mkdir(parents=True, exist_ok=True)
    path = _new_path(workspace)
    rows: list[TrackRow] = []
    targets, priors = (PLATE_BOARD, PLATE_STRIP), engine.recipe.fit.plate.priors
    counted = _counted(frames, seconds, rows, progress)
    try:
        with path.open("x", encoding="utf-8") as file:
            _append(file, head)
            with suppress(KeyboardInterrupt):
                for seen in track(counted, targets, fitted.camera, priors):
                    rows.append(track_row(seen, fitted.camera, back, rig))
                    _append(file, rows[-1])
    finally:
        if not any(row.pose for row in rows):
            path.unlink(missing_ok=True)
    if not any(row.pose for row in rows):
        raise InputError(f"{source}: {why_no_pose(rows)} Nothing was kept.")
    return track_summary(path, head, rows)


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


def _append(file: TextIO, line: BaseModel) -> None:
    file.write(line.model_dump_json() + "\n")
    file.flush()


def _new_path(workspace: Workspace) -> Path:
    stamp = datetime.now(UTC).strftime("%Y%m%dT%H%M%SZ")
    path = workspace.captures_dir / f"track-{stamp}.jsonl"
    number = 1
    while path.exists():
        number += 1
        path = workspace.captures_dir / f"track-{stamp}-{number}.jsonl"
    return path
