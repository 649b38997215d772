"""``scissorcal summarise``"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from scissorcal.cli.import_ import (
    AllowGaps,
    Columns,
    Delimiter,
    DropLastLine,
    MinTravel,
    RateHz,
    Scales,
    Units,
    pairs,
)
from scissorcal.cli.output import Answer, command
from scissorcal.cli.survey import survey_lines
from scissorcal.errors import InputError

if TYPE_CHECKING:
    from scissorcal.calibration.summary import Effort
    from scissorcal.recording import Recording

_HAND: "Effort" = "handle_force"

RadiusMm = Annotated[
    float | None,
    typer.Option(help="Lever of handle_force: with it the force is a torque, and has work."),
]


@command
def summarise(
    log: Annotated[Path, typer.Argument(dir_okay=False, help="A log, or a recording (.mcap).")],
    blank: Annotated[
        Path | None, typer.Option(dir_okay=False, help="A log of empty strokes, to subtract.")
    ] = None,
    compare: Annotated[
        Path | None, typer.Option(dir_okay=False, help="Another log, to compare with.")
    ] = None,
    columns: Columns = None,
    units: Units = None,
    scales: Scales = None,
    rate_Hz: RateHz = None,
    joint: Annotated[Literal["rotary", "linear"], typer.Option(help="Kind of joint.")] = "rotary",
    handle_radius_mm: RadiusMm = None,
    cut_length_mm: Annotated[
        float | None, typer.Option(min=0.001, help="Length that one closing stroke cuts.")
    ] = None,
    min_travel: MinTravel = None,
    allow_gaps: AllowGaps = False,
    drop_last_line: DropLastLine = True,
    delimiter: Delimiter = None,
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
    import math
    from dataclasses import replace
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
    from scissorcal.recording import ImportOptions, Joint, import_table, read_recording
    from scissorcal.recording.table import column_of
    from scissorcal.recording.table_file import refuse_no_table
    from scissorcal.report.summary import Shown, summary_page, summary_panels
    from scissorcal.report.text import panels_text

    _refuse(log, blank, compare, joint, handle_radius_mm, output)
    chosen = {name: column_of(at) for name, at in pairs("column", columns)}
    unit_of, scale_of = dict(pairs("unit", units)), dict(pairs("scale", scales))

    def read(path: Path) -> "tuple[Recording, Effort]":
        if path.suffix == ".mcap":
            recording = replace(read_recording(path), source=path.name)
            effort: Effort = "motor_torque" if recording.samples["motor_torque"].any() else _HAND
            return recording, effort
        refuse_no_table(path)
        if not {"motor_torque", "handle_force"} & set(chosen):
            raise InputError(
                f"{path}: no column is given for the force or torque. Name it with "
                "-c handle_force=COLUMN or -c motor_torque=COLUMN."
            )
        recording = import_table(
            path,
            columns=chosen,
            units=unit_of,
            scale=scale_of,
            rate_Hz=rate_Hz,
            options=ImportOptions(
                joint=Joint(joint),
                handle_radius_m=handle_radius_mm * 1e-3 if handle_radius_mm else math.nan,
                min_travel=min_travel,
                allow_gaps=allow_gaps,
                drop_last_line=drop_last_line,
                delimiter=delimiter,
                motion_only=True,
            ),
        )
        # A page that is passed on tells nothing of the disk.
        named = replace(recording, source=path.name)
        return named, _HAND if _HAND in chosen else "motor_torque"

    second_path = blank or compare
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
    logs = [(recording, effort), *([(second, second_effort)] if second is not None else [])]
    places = common_places([one for one, _ in logs])
    found, *rest = sum_up(logs, places)
    other = rest[0] if rest else None
    surveys = [survey(one, ("opening", used)) for one, used in logs]
    notes = tuple(
        f"{one.source}: {said}"
        for (one, _), seen in zip(logs, surveys, strict=True)
        for said in (*_said(one), *seen.notes)
    )
    rng = np.random.default_rng(0)  # one log gives one page
    shown = Shown(
        log=found,
        second=other,
        against="blank" if blank else "other" if compare else "",
        apart=difference(found, other, rng) if other else None,
        plateau=plateau_in(found, rng),
        slope=slope_in(found),
        friction=friction_of(other if blank and other else found),
        unit=unit,
        place=recording.joint.position_unit,
        cut_length_m=cut_length_mm * 1e-3 if cut_length_mm else None,
        created=datetime.now(UTC),
        version=VERSION,
        notes=notes,
    )
    panels = summary_panels(shown)
    page = summary_page(shown)
    with replacing(output) as part:
        part.write_text(page, encoding="utf-8")
    seen = [
        line
        for (one, _), look in zip(logs, surveys, strict=True)
        for line in (f"Sensors in {one.source}", *survey_lines(look), "")
    ]
    text = "\n".join([panels_text(panels), "", *seen])
    looks = [
        {"log": one.source, "survey": look} for (one, _), look in zip(logs, surveys, strict=True)
    ]
    result = {"panels": panels, "notes": notes, "surveys": looks}
    return Answer(result, f"{text}{output}", files=[output])


def _said(recording: "Recording") -> tuple[str, ...]:
    """What reading a log told, without the sentence that an import begins with: which column."""
    imported = not recording.source.endswith(".mcap")
    return recording.notes[1:] if imported else recording.notes


def _refuse(
    log: Path,
    blank: Path | None,
    compare: Path | None,
    joint: str,
    handle_radius_mm: float | None,
    output: Path,
) -> None:
    """Raise InputError for options that contradict each other."""
    if blank and compare:
        raise InputError("Give --blank or --compare, not both.")
    if handle_radius_mm is not None and not 0.0 < handle_radius_mm < float("inf"):
        raise InputError(
            f"A handle radius of {handle_radius_mm:g} mm is no lever: give a positive length."
        )
    if handle_radius_mm is not None and joint == "linear":
        raise InputError(
            "A linear joint has no lever: leave --handle-radius-mm out, or give --joint rotary."
        )
    for path in (log, blank, compare):
        if path is not None and path.exists() and output.exists() and output.samefile(path):
            raise InputError(f"--output {output} is a log that is read: name another file.")
    if output.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"--output {output} is a page: give it a name that ends in .html.")
