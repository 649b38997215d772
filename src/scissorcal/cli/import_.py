"""``scissorcal import``"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from scissorcal.cli.opening import open_workspace, writes_in
from scissorcal.cli.options import Folder, options_of
from scissorcal.cli.output import Answer, command, table
from scissorcal.cli.progress import progress
from scissorcal.errors import InputError

if TYPE_CHECKING:
    from scissorcal.calibration.signals.survey import Survey
    from scissorcal.recording import Joint, Kind, Recording

_CAMERA_FILES = (".yaml", ".yml", ".xml", ".json", ".ini")
_CAMERA_NAMES = ("cameras.txt", "ost.txt")
"""As COLMAP and camera_calibration of ROS call them."""


@dataclass(frozen=True)
class TableOptions:
    """How a log is read: which columns, in which units, and what is let pass."""

    columns: list[str] | None = None
    units: list[str] | None = None
    scales: list[str] | None = None
    rate_Hz: float | None = None
    handle_radius_mm: float | None = None
    min_travel: float | None = None
    allow_gaps: bool = False
    drop_last_line: bool = True
    delimiter: str | None = None

    @property
    def channels(self) -> dict[str, str | int]:
        """The column of each channel; InputError where one is given twice."""
        from scissorcal.recording.table import column_of

        return {name: column_of(at) for name, at in pairs("column", self.columns)}

    def read(
        self, path: Path, joint: "Joint", kind: "Kind" = "friction", *, motion_only: bool = False
    ) -> "Recording":
        """Read a log as `import_table` does."""
        from scissorcal.recording import ImportOptions, import_table

        radius_mm = self.handle_radius_mm
        return import_table(
            path,
            columns=self.channels,
            units=dict(pairs("unit", self.units)),
            scale=dict(pairs("scale", self.scales)),
            rate_Hz=self.rate_Hz,
            options=ImportOptions(
                joint=joint,
                kind=kind,
                handle_radius_m=radius_mm * 1e-3 if radius_mm else math.nan,
                min_travel=self.min_travel,
                allow_gaps=self.allow_gaps,
                drop_last_line=self.drop_last_line,
                delimiter=self.delimiter,
                motion_only=motion_only,
            ),
        )


def _per_channel(short: str, long: str, help_text: str) -> Any:
    return typer.Option(short, long, metavar="CHANNEL=...", help=help_text)


TABLE = {
    "columns": _per_channel("-c", "--column", "Which column holds a channel."),
    "units": _per_channel("-u", "--unit", "The unit of a channel's column."),
    "scales": _per_channel("-s", "--scale", "The factor of a channel's column."),
    "rate_Hz": typer.Option("--rate-hz", help="Samples per second, if there is no time column."),
    "handle_radius_mm": typer.Option(help="The recipe's if not given."),
    "min_travel": typer.Option(help="Least travel of a stroke (rad, or m)."),
    "allow_gaps": typer.Option("--allow-gaps", help="Keep gaps in time, with a note."),
    "drop_last_line": typer.Option(
        "--drop-last-line/--keep-last-line",
        help="Leave out the last line of a text file where it is not whole.",
    ),
    "delimiter": typer.Option(help="What separates the columns of a CSV file."),
}
JointKind = Annotated[
    Literal["rotary", "linear"] | None, typer.Option(help="The recipe's if not given.")
]
RecordedKind = Annotated[
    Literal["friction", "cut"], typer.Option("--kind", help="What was recorded.")
]
Output = Annotated[Path | None, typer.Option(help="Write here, without a workspace.")]
Files = Annotated[
    list[Path], typer.Argument(dir_okay=False, help="Logs of one layout, or a camera's file.")
]


@command
@options_of(TABLE)
def import_(
    files: Files,
    table: TableOptions,
    joint: JointKind = None,
    kind: RecordedKind = "friction",
    output: Output = None,
    folder: Folder = None,
) -> Answer:
    """Import logs: CSV, Parquet or MATLAB .mat; or a camera from .yaml, .yml, .xml, .json.

    A camera file is one of OpenCV, ROS (camera_info), Kalibr (camchain), VINS, ORB-SLAM or another
    program with the same keys, and takes no option but --workspace.

    For a log, channels are time, opening, advance, motor_torque, handle_force, torque_command,
    force_command, and sheet of a cut, which counts fresh sheets from 0; a column is a heading, a
    number from 0, or a variable of a .mat file (X[2] for its third column). Units may stand in the
    headings; for a linear joint, opening is in metres and motor_torque in newtons. A scale is a
    number or a variable of the file, such as rad per count. Grams, g, are grams of force.

    Several logs of one layout become a recording each. One that cannot be read is named with its
    reason, and the others are imported; the command then ends with 2.

    \b
    Example:
      $ scissorcal import DATA_EMPS.mat -c time=t -c opening=qm -c motor_torque=vir \\
          -u time=s -u opening=m -u motor_torque=V -s motor_torque=gtau --joint linear
      captures/friction-20261121T131415Z.mcap: 24841 samples, 24.8 s, 8 strokes, linear joint
      ...
      $ scissorcal import run*.csv -c time=t_ms -c opening=angle_deg -c handle_force=force_g
      run01.csv: captures/friction-20261121T131502Z.mcap: 6000 samples, 30.0 s, 12 strokes, ...
      ...
      $ scissorcal import left_intrinsics.yml
      fits/camera.nc: camera of 640 x 480 from left_intrinsics.yml (OpenCV)
      ...
    """
    if len(files) == 1 and (
        files[0].suffix.lower() in _CAMERA_FILES or files[0].name in _CAMERA_NAMES
    ):
        return _import_camera(files[0], folder)
    if output and len(files) > 1:
        raise InputError(f"--output names one file, and {len(files)} logs are given.")

    from scissorcal.recording import Joint, write_recording

    workspace = None if output else open_workspace(folder)
    rig = workspace.recipe().rig if workspace else None
    if rig:
        radius_mm = table.handle_radius_mm or rig.handle_radius_mm
        table = replace(table, handle_radius_mm=radius_mm)
    measured = tuple(table.channels)

    def import_one(file: Path) -> tuple["Recording", Answer]:
        recording = table.read(file, Joint(joint or (rig.joint if rig else "rotary")), kind)
        target = output or (workspace.new_recording(kind) if workspace else None)
        assert target is not None
        path = write_recording(recording, target)
        shown = workspace.relative(path) if workspace else str(path)
        planned = rig.joint if rig else recording.joint.kind
        return recording, _answer(recording, path, shown, planned, measured)

    if len(files) == 1:
        return import_one(files[0])[1]
    return _import_all(files, import_one)


def _import_all(
    files: Sequence[Path], import_one: Callable[[Path], tuple["Recording", Answer]]
) -> Answer:
    """Import each log that can be read; raises InputError that names the others."""
    lines, facts, refused = [], [], []
    paths: list[Path] = []
    with progress() as tell:
        for done, file in enumerate(files):
            tell(done / len(files), f"{file.name}")
            try:
                recording, answer = import_one(file)
            except InputError as error:
                refused.append(str(error))
                continue
            first, *_ = answer.text.splitlines()
            lines.append(f"{file.name}: {first}")
            particular = (*recording.particular, *answer.result["survey"].notes)
            lines += [f"  note: {said}" for said in particular]
            facts.append(answer.result)
            paths += answer.files
    if refused:
        refusal = InputError(
            f"{len(refused)} of {len(files)} logs were not imported; the other {len(paths)} were:"
            + "".join(f"\n  {sentence}" for sentence in refused)
        )
        refusal.kept = tuple(paths)
        raise refusal
    lines.append(f"{len(paths)} logs imported; 'scissorcal recording list' shows them")
    return Answer({"imported": facts}, "\n".join(lines), files=paths)


def _answer(
    recording: "Recording", path: Path, shown: str, planned: str, measured: tuple[str, ...]
) -> Answer:
    """What was imported; a note where the recipe plans for another joint than was recorded."""
    from scissorcal.calibration.signals.survey import survey

    joint, notes = recording.joint, list(recording.notes)
    if planned != joint.kind:
        notes.append(
            f'The recipe has a {planned} joint: set joint = "{joint.kind}" in its '
            f"[rig] to plan for a {joint.kind} one."
        )
    sensors = survey(recording, measured)
    notes += sensors.notes
    lines = [
        f"{shown}: {len(recording.samples)} samples, {recording.duration_s:.1f} s, "
        f"{len(recording.strokes)} strokes, {joint.kind} joint",
        *survey_lines(sensors),
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
        "survey": sensors,
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
    lines = [
        f"{workspace.relative(path)}: camera of {camera.width} x {camera.height} from {file.name} "
        f"({read.style})",
        camera_table(fit),
        *(f"note: {sentence}" for sentence in read.notes),
    ]
    result = {
        "camera": camera,
        "style": read.style,
        "rms_px": read.rms_px,
        "fit": path,
        "notes": read.notes,
    }
    return Answer(result, "\n".join(lines), fit.verdicts, files=[path])


def pairs(option: str, given: Sequence[str] | None) -> list[tuple[str, str]]:
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


def survey_lines(found: "Survey") -> list[str]:
    """Rate and sensors, for people; angles in deg."""
    import math

    gaps = found.gaps
    lost = f"{gaps.missing} samples missing in {gaps.places} gaps" if gaps.places else "no gap"
    head = (
        f"rate: {found.rate_Hz:.4g} Hz; {found.interval_low_ms:.4g} to "
        f"{found.interval_high_ms:.4g} ms between samples (5 to 95 %), longest "
        f"{found.longest_ms:.4g} ms; {lost}"
    )
    rows = [["sensor", "unit", "step", "lowest", "highest", "cut off low", "high", "dead band"]]
    for one in found.sensors:
        unit, factor = ("deg", 180.0 / math.pi) if one.unit == "rad" else (one.unit, 1.0)
        values = [f"{factor * value:.4g}" for value in (one.low, one.high)]
        step = "constant" if one.constant else f"{factor * one.step:.3g}" if one.step else "none"
        shares = [f"{share:.1%}" for share in (one.at_low, one.at_high, one.dead)]
        rows.append([one.channel, unit, step, *values, *shares])
    return [head, table(rows, right=range(2, 8))]
