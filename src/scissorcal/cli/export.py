"""``scissorcal export``"""

from pathlib import Path
from typing import Annotated, Literal

import typer

from scissorcal.cli.output import Answer, command


@command
def export(
    recording: Annotated[
        Path, typer.Argument(dir_okay=False, help="A recording (.mcap), or fits/camera.nc.")
    ],
    table: Annotated[Path, typer.Argument(dir_okay=False, help="The file to write.")],
    overwrite: Annotated[
        bool, typer.Option("--overwrite", help="Replace TABLE if it exists.")
    ] = False,
    channel: Annotated[
        str,
        typer.Option(
            metavar="NAME",
            help="What of the recording: sample, or what stands beside the samples, such as pose "
            "and picture of a track, or control. Samples if not given, poses where there are none.",
        ),
    ] = "",
    style: Annotated[
        Literal["opencv", "ros"], typer.Option(help="Format of a camera's file.")
    ] = "opencv",
) -> Answer:
    """Write RECORDING as TABLE: Parquet or CSV, by its suffix. Units stand in the headings.

    Where RECORDING is the camera of a workspace (fits/camera.nc), write it as a camera file for
    OpenCV (.yml, .xml) or ROS (.yaml).

    \b
    Example:
      $ scissorcal export captures/friction-20261121T131415Z.mcap friction.parquet
      friction.parquet: 24841 rows
      ...
      $ scissorcal export captures/track-20261121T160312Z.mcap poses.csv --channel pose
      poses.csv: 21 rows
      $ scissorcal export fits/camera.nc camera.yaml --style ros
      camera.yaml: camera of 640 x 480 for ROS
    """
    if recording.suffix == ".nc":
        return _export_camera(recording, table, style, overwrite)
    if recording.suffix == ".jsonl":
        return _export_lines(recording, table, overwrite)
    from scissorcal.recording import export_channel, export_table, read_recording

    read = read_recording(recording)
    beside = {topic.rpartition("/")[2]: rows for topic, rows in read.beside.items()}
    name = channel or ("sample" if len(read.samples) or "pose" not in beside else "pose")
    if name == "sample":
        path = export_table(read, table, overwrite=overwrite)
        rows = len(read.samples)
    else:
        path = export_channel(recording, name, table, overwrite=overwrite)
        rows = beside[name]
    shown = {other: count for other, count in beside.items() if other not in (name, "frame")}
    others = [f"{other} ({count} rows)" for other, count in shown.items()]
    lines = [f"{path}: {rows} rows", *(f"note: {sentence}" for sentence in read.notes)]
    if others and not channel:
        lines.append(f"--channel writes what else it has: {', '.join(others)}")
    result = {"table": path, "channel": name, "rows": rows, "notes": read.notes}
    return Answer(result, "\n".join(lines), files=[path])


def _export_lines(track: Path, table: Path, overwrite: bool) -> Answer:
    from scissorcal.calibration.plate.track_lines import export_track_lines

    rows = export_track_lines(track, table, overwrite=overwrite)
    return Answer({"table": table, "rows": rows}, f"{table}: {rows} rows", files=[table])


def _export_camera(
    fit: Path, file: Path, style: Literal["opencv", "ros"], overwrite: bool
) -> Answer:
    from scissorcal.calibration import load
    from scissorcal.calibration.camera.result import CameraFit
    from scissorcal.errors import InputError, OtherKindError
    from scissorcal.vision.camera_files import write_camera_file

    try:
        camera = load(fit, CameraFit).camera
    except OtherKindError as error:
        raise OtherKindError(fit, error.found, "a recording or a camera fit") from None
    if file.exists() and not overwrite:
        raise InputError(f"{file} already exists: name another file, or give --overwrite.")
    write_camera_file(camera, file, style)
    words = "OpenCV" if style == "opencv" else "ROS"
    text = f"{file}: camera of {camera.width} x {camera.height} for {words}"
    return Answer({"file": file, "style": style, "camera": camera}, text, files=[file])
