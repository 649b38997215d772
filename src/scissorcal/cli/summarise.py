"""``scissorcal summarise``"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from scissorcal.cli.import_ import TABLE, TableOptions, survey_lines
from scissorcal.cli.options import options_of
from scissorcal.cli.output import Answer, command
from scissorcal.errors import InputError

if TYPE_CHECKING:
    from scissorcal.calibration.summary import Effort
    from scissorcal.recording import Recording

_HAND: "Effort" = "handle_force"


@dataclass(frozen=True)
class Logs:
    """The log that is summed up, and a second one that is subtracted or compared with."""

    log: Path
    blank: Path | None = None
    compare: Path | None = None

    @property
    def second(self) -> Path | None:
        """The second log."""
        return self.blank or self.compare


_LOGS = {
    "log": typer.Argument(dir_okay=False, help="A log, or a recording (.mcap)."),
    "blank": typer.Option(dir_okay=False, help="A log of empty strokes, to subtract."),
    "compare": typer.Option(dir_okay=False, help="Another log, to compare with."),
}
_RADIUS = typer.Option(help="Lever of handle_force: with it the force is a torque, and has work.")


@command
@options_of({**_LOGS, **TABLE, "handle_radius_mm": _RADIUS})
def summarise(
    logs: Logs,
    table: TableOptions,
    joint: Annotated[Literal["rotary", "linear"], typer.Option(help="Kind of joint.")] = "rotary",
    cut_length_mm: Annotated[
        float | None, typer.Option(min=0.001, help="Length that one closing stroke cuts.")
    ] = None,
    output: Annotated[Path, typer.Option(dir_okay=False, help="The page.")] = Path("summary.html"),
) -> Answer:
    """Sum up force or torque over angle: curves by direction, work, plateau, slope, friction.

    For an instrumented tool of any kind, without a workspace. Columns, units and scales are those
    of 'scissorcal import', for all logs alike; a recording (.mcap) takes none. The angle falls
    while the tool closes (-s opening=-1 where it grows). Intervals of 90 % are over strokes.

    \b
    Example:
      $ scissorcal summarise cut.csv --blank empty.csv -c time=t_s -c opening=angle_deg \\
          -c handle_force=force_g --handle-radius-mm 60 --cut-length-mm 40
      Figures: 10 closing strokes from 7.5 to 52.5 deg: 0.152 N m (0.149 to 0.155); ...
      ...
      summary.html
    """
    from datetime import UTC, datetime

    import numpy as np

    from scissorcal.calibration.signals.survey import survey
    from scissorcal.calibration.summary import (
        common_places,
        difference,
        effort_unit,
        friction_of,
        plateau_in,
        slope_in,
    )
    from scissorcal.calibration.summary import (
        summarise as sum_up,
    )
    from scissorcal.files import replacing
    from scissorcal.identity import VERSION
    from scissorcal.recording import Joint, read_recording
    from scissorcal.recording.table_file import refuse_no_table
    from scissorcal.report.panel import panels_text
    from scissorcal.report.summary import Shown, summary_page, summary_panels

    _refuse(logs, table, joint, output)
    channels = table.channels

    def read(path: Path) -> "tuple[Recording, Effort]":
        if path.suffix == ".mcap":
            recording = replace(read_recording(path), source=path.name)
            effort: Effort = "motor_torque" if recording.samples["motor_torque"].any() else _HAND
            return recording, effort
        refuse_no_table(path)
        if not {"motor_torque", "handle_force"} & set(channels):
            raise InputError(
                f"{path}: no column is given for the force or torque. Name it with "
                "-c handle_force=COLUMN or -c motor_torque=COLUMN."
            )
        recording = table.read(path, Joint(joint), motion_only=True)
        # A page that is passed on tells nothing of the disk.
        named = replace(recording, source=path.name)
        return named, _HAND if _HAND in channels else "motor_torque"

    log, blank, second_path = logs.log, logs.blank, logs.second
    recording, effort = read(log)
    second, second_effort = read(second_path) if second_path else (None, effort)
    unit = effort_unit(recording, effort)
    if second is not None and second.joint.kind != recording.joint.kind:
        raise InputError(
            f"{log} is of a {recording.joint.kind} joint and {second_path} of a "
            f"{second.joint.kind} one: compare logs of one kind."
        )
    if second is not None and effort_unit(second, second_effort) != unit:
        raise InputError(
            f"{log} is in {unit} and {second_path} in {effort_unit(second, second_effort)}: "
            "compare logs of one quantity (--handle-radius-mm makes a force a torque)."
        )
    pair = [(recording, effort), *([(second, second_effort)] if second is not None else [])]
    places = common_places([logged for logged, _ in pair])
    summary, *rest = sum_up(pair, places)
    other = rest[0] if rest else None
    surveys = [survey(logged, ("opening", used)) for logged, used in pair]
    notes = tuple(
        f"{logged.source}: {said}"
        for (logged, _), look in zip(pair, surveys, strict=True)
        for said in (*_said(logged), *look.notes)
    )
    rng = np.random.default_rng(0)  # one log gives one page
    shown = Shown(
        log=summary,
        second=other,
        against="blank" if blank else "other" if logs.compare else "",
        apart=difference(summary, other, rng) if other else None,
        plateau=plateau_in(summary, rng),
        slope=slope_in(summary),
        friction=friction_of(other if blank and other else summary),
        unit=unit,
        place=recording.joint.position_unit,
        cut_length_m=cut_length_mm * 1e-3 if cut_length_mm else None,
        created=datetime.now(UTC),
        version=VERSION,
        notes=notes,
    )
    panels = summary_panels(shown)
    page = summary_page(shown, panels)
    with replacing(output) as part:
        part.write_text(page, encoding="utf-8")
    sensors = [
        line
        for (logged, _), look in zip(pair, surveys, strict=True)
        for line in (f"Sensors in {logged.source}", *survey_lines(look), "")
    ]
    text = "\n".join([panels_text(panels), "", *sensors])
    looks = [
        {"log": logged.source, "survey": look}
        for (logged, _), look in zip(pair, surveys, strict=True)
    ]
    result = {"panels": panels, "notes": notes, "surveys": looks}
    return Answer(result, f"{text}{output}", files=[output])


def _said(recording: "Recording") -> tuple[str, ...]:
    """What reading a log told, without the sentence that an import begins with: which column."""
    imported = not recording.source.endswith(".mcap")
    return recording.notes[1:] if imported else recording.notes


def _refuse(logs: Logs, table: TableOptions, joint: str, output: Path) -> None:
    """Raise InputError for options that contradict each other."""
    handle_radius_mm = table.handle_radius_mm
    if logs.blank and logs.compare:
        raise InputError("Give --blank or --compare, not both.")
    if handle_radius_mm is not None and not 0.0 < handle_radius_mm < float("inf"):
        raise InputError(
            f"A handle radius of {handle_radius_mm:g} mm is no lever: give a positive length."
        )
    if handle_radius_mm is not None and joint == "linear":
        raise InputError(
            "A linear joint has no lever: leave --handle-radius-mm out, or give --joint rotary."
        )
    for path in (logs.log, logs.blank, logs.compare):
        if path is not None and path.exists() and output.exists() and output.samefile(path):
            raise InputError(f"--output {output} is a log that is read: name another file.")
    if output.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"--output {output} is a page: give it a name that ends in .html.")
