"""``scissorcal capture``"""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from scissorcal.cli.lazy import group
from scissorcal.cli.opening import open_workspace
from scissorcal.cli.options import Axis, Baud, Device, Folder, Realtime, Seed, Yes, positive
from scissorcal.cli.output import Answer, command, note
from scissorcal.errors import InputError, ScissorcalError
from scissorcal.verdicts import STATED, TORQUE, Check, Status, Verdict

if TYPE_CHECKING:
    from scissorcal.recipe.requirements import CaptureKind
    from scissorcal.recording.until import UntilMark
    from scissorcal.workday.runs.capture import Captured, Until
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
}
UNTIL_TOLERANCE = Check(
    "capture until tolerance",
    f"{TORQUE}share of the felt places whose band is within the scene's tolerance, as it ended",
    at_least=STATED,
)


@group(_COMMANDS)
def capture() -> None:
    """Record friction or cuts from a rig, or take in photographs.

    \b
    Example:
      $ scissorcal capture friction --device sim
      captures/friction-20261121T131435Z.mcap: 109187 samples from scissorcal-sim office-paper
      ...
    """


Designed = Annotated[
    bool | None,
    typer.Option(
        "--designed/--as-in-recipe",
        help="Capture the strokes that narrow the torque's band the most for their time, or those "
        "that the recipe lists; by default as its capture.plan says.",
    ),
]


UntilTolerance = Annotated[
    bool,
    typer.Option(
        "--until-tolerance",
        help="Fit after each stroke, choose the next one by what it is worth, and end when the "
        "torque's band over the scene is within its tolerance.",
    ),
]

AtLeast = Annotated[
    int,
    typer.Option(
        "--at-least",
        metavar="N",
        min=0,
        help="With --until-tolerance: go on until there are N strokes (pairs of sweeps).",
    ),
]

MaxMinutes = Annotated[
    float | None,
    typer.Option(
        "--max-minutes",
        metavar="MIN",
        callback=positive,
        help="With --until-tolerance: take no stroke that ends after so many planned minutes "
        "(motion, and the time that the recipe gives a person); the first part always runs. By "
        "default those that the recipe's list takes.",
    ),
]


YesLong = Annotated[
    bool,
    typer.Option(
        "--yes-long", help="A capture of more than 4 hours is meant; at most 24 are possible."
    ),
]


@command
def friction(
    device: Device,
    axis: Axis = "opening",
    designed: Designed = None,
    until_tolerance: UntilTolerance = False,
    at_least: AtLeast = 0,
    max_minutes: MaxMinutes = None,
    realtime: Realtime = False,
    yes: Yes = False,
    yes_long: YesLong = False,
    seed: Seed = 0,
    baud: Baud = None,
    folder: Folder = None,
) -> Answer:
    """Record empty closing and opening at several speeds, then excited motion for the inertia.

    Keep the space between the blades empty: the motors move them. --axis advance moves the sledge
    instead, forward and backward, the blades open. With --until-tolerance, friction
    ends where it takes half of the scene's tolerance, or, where the material is fitted already,
    where both together are within it.

    \b
    Example:
      $ scissorcal capture friction --device sim
      captures/friction-20261121T132036Z.mcap: 109195 samples from scissorcal-sim office-paper
      80 of 80 cells filled
      ...
      $ scissorcal capture friction --axis advance --device sim
      captures/friction-advance-20261121T132136Z.mcap: 92951 samples from scissorcal-sim ...
      64 of 64 cells filled
      ...
    """
    rig = _Rig(device, seed, realtime, baud)
    if axis == "advance":
        if designed is not None or until_tolerance or at_least or max_minutes is not None:
            raise InputError(
                "The sledge's capture takes the speeds that capture.friction_advance lists: leave "
                "out --designed, --as-in-recipe, --until-tolerance and its options."
            )
        return _capture(
            "friction-advance", rig, _How(False, None, None), yes=yes, long=yes_long, folder=folder
        )
    how = _How(False, designed, _until(until_tolerance, at_least, max_minutes, designed))
    return _capture("friction", rig, how, yes=yes, long=yes_long, folder=folder)


@command
def cut(
    device: Device,
    hand: Annotated[
        bool, typer.Option("--hand", help="Motor off: a person (or the virtual hand) cuts.")
    ] = False,
    designed: Designed = None,
    until_tolerance: UntilTolerance = False,
    at_least: AtLeast = 0,
    max_minutes: MaxMinutes = None,
    realtime: Realtime = False,
    yes: Yes = False,
    yes_long: YesLong = False,
    seed: Seed = 0,
    baud: Baud = None,
    folder: Folder = None,
) -> Answer:
    """Record strokes through fresh sheets at the recipe's speeds, or presses.

    Asks for a fresh sheet where one is needed; a virtual rig loads its own. --until-tolerance needs
    the fit of friction; Ctrl-C ends it, and what was recorded stays. Exit code 3: the tolerance was
    not reached, and the last line says why.

    \b
    Example:
      $ scissorcal capture cut --device sim
      captures/cut-20261121T132227Z.mcap: 72842 samples from scissorcal-sim office-paper
      24 of 24 cells filled
      ...
      $ scissorcal capture cut --device sim --until-tolerance
      ...
      7 strokes, 1.7 planned min: band within 7 % at 96 % of felt places (median 1.5 %); tolerance
      reached at 95 % confidence
    """
    rig = _Rig(device, seed, realtime, baud)
    how = _How(hand, designed, _until(until_tolerance, at_least, max_minutes, designed))
    return _capture("cut", rig, how, yes=yes, long=yes_long, folder=folder)


@dataclass(frozen=True)
class _Rig:
    device: str
    seed: int
    realtime: bool
    baud: int | None


@dataclass(frozen=True)
class _How:
    hand: bool
    designed: bool | None
    until: "Until | None"


def _until(
    wanted: bool, at_least: int, max_minutes: float | None, designed: bool | None
) -> "Until | None":
    """What --until-tolerance and its options ask for; None without it. InputError where at odds."""
    from scissorcal.workday.runs.capture import Until

    if not wanted:
        if at_least or max_minutes is not None:
            raise InputError(
                "--at-least and --max-minutes bound a capture until the tolerance: add "
                "--until-tolerance, or leave them out."
            )
        return None
    if designed is not None:
        raise InputError(
            "--until-tolerance chooses each stroke while it captures: leave out --designed and "
            "--as-in-recipe."
        )
    return Until(at_least, max_minutes)


def _capture(
    kind: "CaptureKind",
    rig: _Rig,
    how: _How,
    *,
    yes: bool,
    long: bool,
    folder: Path | None,
) -> Answer:
    from scissorcal.cli.live_view import LiveView
    from scissorcal.workday.runs.capture import capture_advance_into, capture_into

    workspace = open_workspace(folder)
    before = set(workspace.recordings(kind))
    try:
        with LiveView(ask=not yes, listed=how.until is None) as view:
            if kind == "friction-advance":
                captured = capture_advance_into(
                    workspace,
                    rig.device,
                    seed=rig.seed,
                    baud=rig.baud,
                    realtime=rig.realtime,
                    long=long,
                    progress=view.show,
                    confirm=view.confirm,
                    say=note,
                )
            else:
                captured = capture_into(
                    workspace,
                    kind,
                    rig.device,
                    hand=how.hand,
                    designed=how.designed,
                    until=replace(how.until, tell=view.approach) if how.until else None,
                    seed=rig.seed,
                    baud=rig.baud,
                    realtime=rig.realtime,
                    long=long,
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
    return Answer(
        _facts(captured),
        _text(workspace, captured),
        verdicts=[_verdict(kind, captured.until)] if captured.until else (),
        files=[captured.path],
    )


def _verdict(kind: str, mark: "UntilMark") -> Verdict:
    """Whether the tolerance was reached; exit code 3 where it was not."""
    status: Status = "pass" if mark.reached else "fail"
    verdict = UNTIL_TOLERANCE.verdict(status, mark.within, mark.sentence, threshold=mark.needed)
    return verdict.of(f"capture.{kind}")


def _text(workspace: "Workspace", captured: "Captured") -> str:
    from scissorcal.device.recorder import unloaded_sentence

    report = captured.report
    lines = [
        f"{workspace.relative(captured.path)}: {report.sample_count} samples from {captured.rig}",
        captured.until.sentence if captured.until else report.coverage.sentence(),
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
    per_s, unit = ("rad_per_s", "rad") if grid.axis.channel == "opening" else ("m_per_s", "m")
    return {
        "recording": captured.path,
        "rig": captured.rig,
        "samples": report.sample_count,
        "coverage": {
            "share": grid.share,
            "directions": grid.directions,
            f"speeds_{per_s}": grid.speeds,
            f"{grid.axis.channel}_cells_{unit}": grid.cells,
            "seconds": grid.seconds,
            "needed_s": grid.needed_s,
            "sentence": grid.sentence(),
        },
        "tally": report.tally,
        "motion": report.motion,
        "unloaded_strokes": [stroke.index for stroke in report.empty],
        "until": captured.until,
    }
