"""``scissorcal recording``"""

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from scissorcal.cli.lazy import group
from scissorcal.cli.opening import open_workspace, writes_in
from scissorcal.cli.options import Folder
from scissorcal.cli.output import Answer, command, note, table

if TYPE_CHECKING:
    from scissorcal.device.completeness import Completeness
    from scissorcal.recipe.requirements import CaptureKind
    from scissorcal.recording import RecordingSummary

_COMMANDS = {
    "list": ("scissorcal.cli.recording:list_", "All recordings, and whether fits use them."),
    "exclude": ("scissorcal.cli.recording:exclude", "Do not use a recording, with a reason."),
    "include": ("scissorcal.cli.recording:include", "Use an excluded recording again."),
    "show": ("scissorcal.cli.recording:show", "What a recording holds: strokes, ranges, gaps."),
}


@group(_COMMANDS)
def recording() -> None:
    """List, show, exclude and include recordings.

    \b
    Example:
      $ scissorcal recording show captures/friction-20261121T131435Z.mcap
      friction, rotary joint: 109187 samples in 109.2 s at 1000 Hz, nothing missing
      ...
    """


@command
def show(
    path: Annotated[Path, typer.Argument(dir_okay=False, help="The recording (.mcap).")],
) -> Answer:
    """Show what the recording at PATH holds.

    A capture that was interrupted (PATH.part) is recovered first.

    \b
    Example:
      $ scissorcal recording show captures/friction-20261121T131415Z.mcap
      friction, linear joint: 24841 samples in 24.8 s at 1000 Hz, nothing missing
      ...
    """
    from scissorcal.recording import read_recording, recover, summary

    half = path.with_name(path.name + ".part")
    if half.exists():
        for recovered in recover(path.parent):
            note(recovered.sentence)
    found = summary(read_recording(path))
    return Answer({"recording": found}, _text(found))


def _text(found: "RecordingSummary") -> str:
    gaps = found.gaps
    missing = "nothing missing"
    if gaps.missing:
        missing = f"{gaps.missing} frames missing in {gaps.places} places"
    lines = [
        f"{found.kind}, {found.joint} joint: {found.samples} samples in {found.duration_s:.1f} s "
        f"at {found.rate_Hz:.0f} Hz, {missing}",
        "",
    ]
    ranges = [["channel", "unit", "lowest", "highest"]]
    ranges += [
        [channel.channel, channel.unit, f"{channel.low:.6g}", f"{channel.high:.6g}"]
        for channel in found.ranges
    ]
    lines += [table(ranges, right=[2, 3]), ""]
    if found.strokes:
        strokes = [["stroke", "kind", "speed", "sheet", "samples", "travel"]]
        for row in found.strokes:
            stroke = row.stroke
            speed = f"{stroke.speed:.4g}" if stroke.speed == stroke.speed else "-"
            sheet = str(stroke.sheet) if stroke.sheet >= 0 else "-"
            name = [str(stroke.index), stroke.kind, speed, sheet]
            strokes.append([*name, str(row.samples), f"{row.travel:.4g}"])
        lines += [table(strokes, right=[0, 2, 3, 4, 5]), ""]
    if found.beside:
        listed = ", ".join(f"{rows} {topic}" for topic, rows in found.beside.items())
        lines += [f"beside the samples: {listed}", ""]
    lines += [f"note: {sentence}" for sentence in found.notes]
    return "\n".join(lines)


KINDS: "tuple[CaptureKind, ...]" = ("friction", "friction-advance", "cut")
Name = Annotated[str, typer.Argument(help="File name of a recording, as 'recording list' shows.")]


@command
def list_(folder: Folder = None) -> Answer:
    """List the recordings of friction and cuts: used, excluded, or why not used.

    Below, what the recipe plans, what is recorded of it, and what the fit uses: strokes, seconds
    of motion, and ranges of opening with enough of it.

    \b
    Example:
      $ scissorcal recording list
      recording                       seconds  use       why
      friction-20261121T131435Z.mcap    109.2  used
      cut-20261121T132227Z.mcap          72.8  excluded  the sheet was torn
      ...
      friction               of                 planned  recorded  used  motion
      closing at 0.05 rad/s  strokes                  2         2     0
      ...
      closing at 0.05 rad/s  ranges of opening        8         8     0  26.8 s recorded, ...
      ...
    """
    from scissorcal.workday.engine import Engine
    from scissorcal.workday.recordings import RecordingRow

    workspace = open_workspace(folder)
    engine = Engine.of(workspace)
    found: list[RecordingRow] = []
    counted = {}
    for kind in KINDS:
        rows = engine.recordings(kind)
        found += rows
        if any(row.use == "used" for row in rows):
            counted[kind] = engine.completeness(kind)
    engine.index.save()
    lines = [["recording", "seconds", "use", "why"]]
    lines += [[row.path.name, f"{row.seconds:.1f}", row.use, row.why] for row in found]
    text = table(lines, right=[1]) if found else "There is no recording of friction or a cut yet."
    for kind, each in counted.items():
        text += "".join(f"\n\n{part}" for part in _counted(kind, each))
    return Answer({"recordings": found, "completeness": counted}, text)


def _counted(kind: str, found: "Completeness") -> Iterator[str]:
    """The table of what is planned, recorded and used, and what is missing."""
    if found.summary:
        lines = [[kind, "of", "planned", "recorded", "used", "motion"]]
        for row in found.summary:
            counts = [_number(count) for count in (row.planned, row.recorded, row.used)]
            lines.append([row.name, row.unit, *counts, row.motion])
        yield table(lines, right=[2, 3, 4])
    if found.missing:
        yield "\n".join(f"capture {kind} lacks: {sentence}" for sentence in found.missing)


def _number(count: int | None) -> str:
    return "-" if count is None else str(count)


@command
def exclude(
    name: Name,
    why: Annotated[str, typer.Option(help="The reason, shown wherever the data are listed.")],
    folder: Folder = None,
) -> Answer:
    """Do not use a recording in fits. The file stays as it is; fits that used it become stale.

    \b
    Example:
      $ scissorcal recording exclude cut-20261121T132227Z.mcap --why "the sheet was torn"
      captures/cut-20261121T132227Z.mcap is excluded: the sheet was torn
    """
    from scissorcal.workday.recordings import exclude_recording

    with writes_in(folder, "scissorcal recording exclude") as workspace:
        path = exclude_recording(workspace, name, why)
    text = f"{workspace.relative(path)} is excluded: {why.strip()}"
    return Answer({"recording": path, "why": why}, text, files=[workspace.exclusions_path])


@command
def include(name: Name, folder: Folder = None) -> Answer:
    """Use an excluded recording in fits again.

    \b
    Example:
      $ scissorcal recording include cut-20261121T132227Z.mcap
      captures/cut-20261121T132227Z.mcap is used again
    """
    from scissorcal.workday.recordings import include_recording

    with writes_in(folder, "scissorcal recording include") as workspace:
        path = include_recording(workspace, name)
    text = f"{workspace.relative(path)} is used again"
    return Answer({"recording": path}, text, files=[workspace.exclusions_path])
