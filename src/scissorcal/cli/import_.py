"""``scissorcal import``"""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from scissorcal.cli.opening import open_workspace, writes_in
from scissorcal.cli.options import Folder
from scissorcal.cli.output import Answer, command
from scissorcal.errors import InputError

if TYPE_CHECKING:
    from scissorcal.recording import Recording

_CAMERA_FILES = (".yaml", ".yml", ".xml")


def _per_channel(short: str, long: str, help_text: str) -> Any:
    return typer.Option(short, long, metavar="CHANNEL=...", help=help_text)


File = Annotated[Path, typer.Argument(dir_okay=False, help="The log, or a camera's file.")]
Columns = Annotated[
    list[str] | None, _per_channel("-c", "--column", "Which column holds a channel.")
]
Units = Annotated[list[str] | None, _per_channel("-u", "--unit", "The unit of a channel's column.")]
Scales = Annotated[
    list[str] | None, _per_channel("-s", "--scale", "The factor of a channel's column.")
]
RateHz = Annotated[
    float | None,
    typer.Option("--rate-hz", help="Samples per second, if there is no time column."),
]
JointKind = Annotated[
    Literal["rotary", "linear"] | None, typer.Option(help="The recipe's if not given.")
]
Kind = Annotated[Literal["friction", "cut"], typer.Option(help="What was recorded.")]
HandleRadiusMm = Annotated[float | None, typer.Option(help="The recipe's if not given.")]
MinTravel = Annotated[float | None, typer.Option(help="Least travel of a stroke (rad, or m).")]
AllowGaps = Annotated[bool, typer.Option("--allow-gaps", help="Keep gaps in time, with a note.")]
Delimiter = Annotated[str | None, typer.Option(help="What separates the columns of a CSV file.")]
Output = Annotated[Path | None, typer.Option(help="Write here, without a workspace.")]


@command
def import_(
    file: File,
    columns: Columns = None,
    units: Units = None,
    scales: Scales = None,
    rate_Hz: RateHz = None,
    joint: JointKind = None,
    kind: Kind = "friction",
    handle_radius_mm: HandleRadiusMm = None,
    min_travel: MinTravel = None,
    allow_gaps: AllowGaps = False,
    delimiter: Delimiter = None,
    output: Output = None,
    folder: Folder = None,
) -> Answer:
    """Import a log from FILE: CSV, Parquet or MATLAB .mat; or a camera from .yaml, .yml, .xml.

    A camera file is one of OpenCV, ROS (camera_info) or Kalibr (camchain), and takes no option but
    --workspace.

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
    from scissorcal.recording.table import column_of

    workspace = None if output else open_workspace(folder)
    rig = workspace.recipe().rig if workspace else None
    radius_mm = handle_radius_mm if handle_radius_mm or not rig else rig.handle_radius_mm
    recording = import_table(
        file,
        columns={name: column_of(at) for name, at in _pairs("column", columns)},
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
    return _answer(recording, path, shown, rig.joint if rig else recording.joint.kind)


def _answer(recording: "Recording", path: Path, shown: str, planned: str) -> Answer:
    """What was imported; a note where the recipe plans for another joint than was recorded."""
    joint = recording.joint
    notes = list(recording.notes)
    if planned != joint.kind:
        notes.append(
            f'The recipe has a {planned} joint: set joint = "{joint.kind}" in its '
            f"[rig] to plan for a {joint.kind} one."
        )
    lines = [
        f"{shown}: {len(recording.samples)} samples, {recording.duration_s:.1f} s, "
        f"{len(recording.strokes)} strokes, {joint.kind} joint",
        *(f"note: {sentence}" for sentence in notes),
    ]
    result = {
        "recording": path,
        "kind": recording.kind,
        "joint": joint.kind,
        "position_unit": joint.position_unit,
        "effort_unit": joint.effort_unit,
        "samples": len(recording.samples),
        "duration_s": recording.duration_s,
        "strokes": recording.strokes,
        "notes": notes,
    }
    return Answer(result, "\n".join(lines), files=[path])


def _import_camera(file: Path, folder: Path | None) -> Answer:
    from scissorcal.cli.fit_camera import camera_table
    from scissorcal.workday.engine import Engine
    from scissorcal.workday.runs.camera import import_camera

    with writes_in(folder, "scissorcal import") as workspace:
        fit, read, path = import_camera(Engine.of(workspace), file)
    camera = fit.camera
    text = (
        f"{workspace.relative(path)}: camera of {camera.width} x {camera.height} from {file.name} "
        f"({read.style})\n{camera_table(fit)}"
    )
    result = {"camera": camera, "style": read.style, "rms_px": read.rms_px, "fit": path}
    return Answer(result, text, fit.verdicts, files=[path])


def _pairs(option: str, given: Sequence[str] | None) -> list[tuple[str, str]]:
    """Read CHANNEL=... words; a channel may be given once."""
    pairs: list[tuple[str, str]] = []
    for word in given or ():
        channel, equals, value = word.partition("=")
        if not equals or not channel.strip() or not value.strip():
            raise InputError(
                f"--{option} {word!r} is not of the form CHANNEL=..., as in opening=angle."
            )
        if channel.strip() in [known for known, _ in pairs]:
            raise InputError(f"--{option} {channel.strip()} is given twice; give it once.")
        pairs.append((channel.strip(), value.strip()))
    return pairs
