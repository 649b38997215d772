"""``scissorcal import``"""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any, Literal

import click

from scissorcal.cli.opening import open_workspace
from scissorcal.cli.options import workspace_option
from scissorcal.cli.output import Answer, command

_CAMERA_FILES = (".yaml", ".yml", ".xml")

Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]


def _map_option(short: str, long: str, target: str, help_text: str) -> Decorator:
    return click.option(short, long, target, multiple=True, metavar="CHANNEL=...", help=help_text)


@click.command("import")
@click.argument("file", type=click.Path(path_type=Path, dir_okay=False))
@_map_option("-c", "--column", "columns", "Which column holds a channel.")
@_map_option("-u", "--unit", "units", "The unit of a column.")
@_map_option("-s", "--scale", "scales", "What multiplies a column.")
@click.option("--rate-hz", "rate_Hz", type=float, help="Samples a second, without a time column.")
@click.option("--joint", type=click.Choice(["rotary", "linear"]), help="The recipe's if not given.")
@click.option("--kind", type=click.Choice(["friction", "cut"]), default="friction")
@click.option("--handle-radius-mm", type=float, help="The recipe's if not given.")
@click.option("--min-travel", type=float, help="Least way of a stroke (rad, or m).")
@click.option("--allow-gaps", is_flag=True, help="Keep gaps in time, with a note.")
@click.option("--delimiter", help="What parts the columns of a CSV file.")
@click.option("--output", type=click.Path(path_type=Path), help="Write here, without a workspace.")
@workspace_option
@command
def import_(
    file: Path,
    columns: tuple[str, ...],
    units: tuple[str, ...],
    scales: tuple[str, ...],
    rate_Hz: float | None,
    joint: Literal["rotary", "linear"] | None,
    kind: Literal["friction", "cut"],
    handle_radius_mm: float | None,
    min_travel: float | None,
    allow_gaps: bool,
    delimiter: str | None,
    output: Path | None,
    folder: Path | None,
) -> Answer:
    """Bring in a log from FILE: CSV, Parquet or MATLAB .mat; or a camera from .yaml, .yml, .xml.

    A camera file is one of OpenCV, ROS (camera_info) or Kalibr (camchain); no option belongs to it
    but --workspace.

    For a log, channels are time, opening, advance, motor_torque, handle_force, torque_command and
    force_command; a column is a heading, a number from 0, or a variable of a .mat file (X[2] for
    its third column). Units may stand in the headings; for a linear joint, opening is in metres
    and motor_torque in newtons. A scale is a number or a variable of the file.

    \b
    Example:
      $ scissorcal import DATA_EMPS.mat -c time=t -c opening=qm -c motor_torque=vir \\
          -u time=s -u opening=m -u motor_torque=V -s motor_torque=gtau --joint linear
      captures/friction-20261121T131415Z.mcap: 24841 samples, 24.8 s, 8 strokes, linear joint
      ...
      $ scissorcal import left_intrinsics.yml
      fits/camera.nc: camera of 640 x 480 from left_intrinsics.yml (OpenCV)
      ...
    """
    import math

    if file.suffix.lower() in _CAMERA_FILES:
        return _import_camera(file, folder)

    from scissorcal.recording import Joint, import_table, write_recording

    workspace = None if output else open_workspace(folder)
    rig = workspace.recipe().rig if workspace else None
    radius_mm = handle_radius_mm if handle_radius_mm or not rig else rig.handle_radius_mm
    recording = import_table(
        file,
        columns={name: int(at) if at.isdigit() else at for name, at in _pairs("column", columns)},
        units=dict(_pairs("unit", units)),
        scale=dict(_pairs("scale", scales)),
        rate_Hz=rate_Hz,
        joint=Joint(joint or (rig.joint if rig else "rotary")),
        kind=kind,
        handle_radius_m=radius_mm * 1e-3 if radius_mm else math.nan,
        min_travel=min_travel,
        allow_gaps=allow_gaps,
        delimiter=delimiter,
    )
    target = output or (workspace.new_recording(kind) if workspace else None)
    assert target is not None
    path = write_recording(recording, target)
    shown = workspace.relative(path) if workspace else str(path)
    notes = list(recording.notes)
    if rig and rig.joint != recording.joint.kind:
        notes.append(
            f"The recipe says {rig.joint} joint: to be asked for what a {recording.joint.kind} one "
            f'needs, set joint = "{recording.joint.kind}" in its [rig].'
        )
    lines = [
        f"{shown}: {len(recording.samples)} samples, {recording.duration_s:.1f} s, "
        f"{len(recording.strokes)} strokes, {recording.joint.kind} joint",
        *(f"note: {sentence}" for sentence in notes),
    ]
    result = {
        "recording": path,
        "kind": kind,
        "joint": recording.joint.kind,
        "position_unit": recording.joint.position_unit,
        "effort_unit": recording.joint.effort_unit,
        "samples": len(recording.samples),
        "duration_s": recording.duration_s,
        "strokes": recording.strokes,
        "notes": notes,
    }
    return Answer(result, "\n".join(lines), files=[path])


def _import_camera(file: Path, folder: Path | None) -> Answer:
    from scissorcal.cli.fit_camera import camera_table
    from scissorcal.workday.runs.camera import import_camera

    workspace = open_workspace(folder)
    fit, read, path = import_camera(workspace, file)
    camera = fit.camera
    text = (
        f"{workspace.relative(path)}: camera of {camera.width} x {camera.height} from {file.name} "
        f"({read.style})\n{camera_table(fit)}"
    )
    result = {"camera": camera, "style": read.style, "rms_px": read.rms_px, "fit": path}
    return Answer(result, text, fit.verdicts, files=[path])


def _pairs(option: str, given: Sequence[str]) -> list[tuple[str, str]]:
    """Read CHANNEL=... words; a channel may be given once."""
    pairs: list[tuple[str, str]] = []
    for word in given:
        channel, equals, value = word.partition("=")
        if not equals or not channel.strip() or not value.strip():
            raise click.BadParameter(
                f"{word!r} is not of the form CHANNEL=..., as in opening=angle.",
                param_hint=f"--{option}",
            )
        if channel.strip() in [known for known, _ in pairs]:
            raise click.BadParameter(
                f"{channel.strip()} is given twice; give it once.", param_hint=f"--{option}"
            )
        pairs.append((channel.strip(), value.strip()))
    return pairs
