"""``scissorcal recording``"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from scissorcal.cli.lazy import group
from scissorcal.cli.output import Answer, command, note, table

if TYPE_CHECKING:
    from scissorcal.recording import RecordingSummary

_COMMANDS = {
    "list": ("scissorcal.cli.recording_list:list_", "All recordings, and whether fits use them."),
    "exclude": ("scissorcal.cli.recording_list:exclude", "Do not use a recording, with a reason."),
    "include": ("scissorcal.cli.recording_list:include", "Use an excluded recording again."),
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
