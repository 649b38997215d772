"""``scissorcal capture``"""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from scissorcal.cli.lazy import group
from scissorcal.cli.opening import open_workspace
from scissorcal.cli.options import Baud, Device, Folder, Realtime, Seed, Yes
from scissorcal.cli.output import Answer, command, note
from scissorcal.errors import ScissorcalError

if TYPE_CHECKING:
    from scissorcal.recipe.requirements import CaptureKind
    from scissorcal.workday.runs.capture import Captured
    from scissorcal.workday.workspace import Workspace

_PHOTOGRAPHS = "scissorcal.cli.capture_photographs"

_COMMANDS = {
    "friction": ("scissorcal.cli.capture:friction", "Empty strokes, then excited motion."),
    "cut": ("scissorcal.cli.capture:cut", "Strokes through fresh material, or presses."),
    "camera": (
        f"{_PHOTOGRAPHS}:camera",
        "Photographs of the printed camera board.",
    ),
    "blade": (
        f"{_PHOTOGRAPHS}:blade",
        "Photographs of a blade on the printed mat.",
    ),
    "plate": (f"{_PHOTOGRAPHS}:plate", "Photographs of the plate's target."),
    "track": ("scissorcal.cli.capture_track:track", "The plate's pose, picture by picture."),
}


@group(_COMMANDS)
def capture() -> None:
    """Record friction or cuts from a rig, or take in photographs.

    \b
    Example:
      $ scissorcal capture friction --device sim
      captures/friction-20261121T131435Z.mcap: 109187 samples from scissorcal-sim office-paper
      ...
    """


@command
def friction(
    device: Device,
    realtime: Realtime = False,
    yes: Yes = False,
    seed: Seed = 0,
    baud: Baud = None,
    folder: Folder = None,
) -> Answer:
    """Record empty closing and opening at several speeds, then excited motion for the inertia.

    Keep the space between the blades empty: the motors move them.

    \b
    Example:
      $ scissorcal capture friction --device sim
      captures/friction-20261121T132036Z.mcap: 109195 samples from scissorcal-sim office-paper
      80 of 80 cells filled
      ...
    """
    rig = _Rig(device, seed, realtime, baud)
    return _capture("friction", rig, hand=False, yes=yes, folder=folder)


@command
def cut(
    device: Device,
    hand: Annotated[
        bool, typer.Option("--hand", help="Motor off: a person (or the virtual hand) cuts.")
    ] = False,
    realtime: Realtime = False,
    yes: Yes = False,
    seed: Seed = 0,
    baud: Baud = None,
    folder: Folder = None,
) -> Answer:
    """Record strokes through fresh sheets at the recipe's speeds, or presses.

    Asks for a fresh sheet before each stroke; a virtual rig loads its own.

    \b
    Example:
      $ scissorcal capture cut --device sim
      captures/cut-20261121T132227Z.mcap: 72842 samples from scissorcal-sim office-paper
      24 of 24 cells filled
      ...
    """
    rig = _Rig(device, seed, realtime, baud)
    return _capture("cut", rig, hand=hand, yes=yes, folder=folder)


@dataclass(frozen=True)
class _Rig:
    device: str
    seed: int
    realtime: bool
    baud: int | None


def _capture(
    kind: "CaptureKind", rig: _Rig, *, hand: bool, yes: bool, folder: Path | None
) -> Answer:
    from scissorcal.cli.live_view import LiveView
    from scissorcal.workday.runs.capture import capture_into

    workspace = open_workspace(folder)
    before = set(workspace.recordings(kind))
    try:
        with LiveView(ask=not yes) as view:
            captured = capture_into(
                workspace,
                kind,
                rig.device,
                hand=hand,
                seed=rig.seed,
                baud=rig.baud,
                realtime=rig.realtime,
                progress=view.show,
                confirm=view.confirm,
                say=note,
            )
    except BaseException as error:
        kept = sorted(set(workspace.recordings(kind)) - before)
        for path in kept:
            note(f"The samples recorded until then are kept in {workspace.relative(path)}.")
        if isinstance(error, ScissorcalError):
            error.kept = tuple(kept)
        raise
    return Answer(_facts(captured), _text(workspace, captured), files=[captured.path])


def _text(workspace: "Workspace", captured: "Captured") -> str:
    from scissorcal.device.recorder import unloaded_sentence

    report = captured.report
    lines = [
        f"{workspace.relative(captured.path)}: {report.sample_count} samples from {captured.rig}",
        report.coverage.sentence(),
    ]
    tally = report.tally
    if tally.lost or tally.garbled or tally.faults:
        lines.append(
            f"{tally.lost} frames lost in {tally.gaps} gaps, {tally.garbled} garbled, "
            f"{tally.faults} fault{'' if tally.faults == 1 else 's'} latched"
        )
    if tally.faults:
        lines.append("'scissorcal recording show' states when each fault latched, and which it was")
    lines += [unloaded_sentence(stroke) for stroke in report.empty]
    latency = report.motion.latency
    if latency is not None:
        lines.append(
            f"reply to a frame: {latency.p50:.0f} us (p50), {latency.p99:.0f} us (p99), "
            f"{latency.worst:.0f} us (worst)"
        )
    lines.append(report.motion.lag.sentence)
    if report.motion.rights is not None:
        lines.append(report.motion.rights.sentence)
    return "\n".join(lines)


def _facts(captured: "Captured") -> dict[str, Any]:
    report = captured.report
    grid = report.coverage
    return {
        "recording": captured.path,
        "rig": captured.rig,
        "samples": report.sample_count,
        "coverage": {
            "share": grid.share,
            "directions": grid.directions,
            "speeds_rad_per_s": grid.speeds,
            "opening_cells_rad": grid.cells,
            "seconds": grid.seconds,
            "needed_s": grid.needed_s,
            "sentence": grid.sentence(),
        },
        "tally": report.tally,
        "motion": report.motion,
        "unloaded_strokes": [stroke.index for stroke in report.empty],
    }
