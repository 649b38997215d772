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
      $ scissorcal export fits/camera.nc camera.yaml --style ros
      camera.yaml: camera of 640 x 480 for ROS
    """
    if recording.suffix == ".nc":
        return _export_camera(recording, table, style, overwrite)
    from scissorcal.recording import export_table, read_recording

    read = read_recording(recording)
    path = export_table(read, table, overwrite=overwrite)
    text = "\n".join(
        [f"{path}: {len(read.samples)} rows", *(f"note: {sentence}" for sentence in read.notes)]
    )
    result = {"table": path, "rows": len(read.samples), "notes": read.notes}
    return Answer(result, text, files=[path])


def _export_camera(
    fit: Path, file: Path, style: Literal["opencv", "ros"], overwrite: bool
) -> Answer:
    from scissorcal.calibration import load
    from scissorcal.calibration.camera.result import CameraFit
    from scissorcal.errors import InputError
    from scissorcal.vision.camera_files import write_camera_file

    camera = load(fit, CameraFit).camera
    if file.exists() and not overwrite:
        raise InputError(f"{file} already exists: name another file, or give --overwrite.")
    write_camera_file(camera, file, style)
    words = "OpenCV" if style == "opencv" else "ROS"
    text = f"{file}: camera of {camera.width} x {camera.height} for {words}"
    return Answer({"file": file, "style": style, "camera": camera}, text, files=[file])
