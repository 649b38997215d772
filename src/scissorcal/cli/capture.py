"""``scissorcal capture``"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import typer

from scissorcal.cli.lazy import group
from scissorcal.cli.opening import open_workspace
from scissorcal.cli.options import RIG, Axis, Folder, Yes, options_of, positive
from scissorcal.cli.output import Answer, command, note
from scissorcal.errors import ScissorcalError
from scissorcal.verdicts import STATED, TORQUE, Check, Status, Verdict
from scissorcal.workday.options import CaptureOptions, RigOptions

if TYPE_CHECKING:
    from scissorcal.device.session import Operator
    from scissorcal.recipe.requirements import CaptureKind
    from scissorcal.recording.until import UntilMark
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


_PLANNED = {
    "designed": typer.Option(
        "--designed/--as-in-recipe",
        help="Capture the strokes that narrow the torque's band the most for their time, or those "
        "that the recipe lists; by default as its capture.plan says.",
    ),
    "until_tolerance": typer.Option(
        "--until-tolerance",
        help="Fit after each stroke, choose the next one by what it is worth, and end when the "
        "torque's band over the scene is within its tolerance.",
    ),
    "at_least": typer.Option(
        "--at-least",
        metavar="N",
        min=0,
        help="With --until-tolerance: go on until there are N strokes (pairs of sweeps).",
    ),
    "max_minutes": typer.Option(
        "--max-minutes",
        metavar="MIN",
        callback=positive,
        help="With --until-tolerance: take no stroke that ends after so many planned minutes "
        "(motion, and the time that the recipe gives a person); the first part always runs. By "
        "default those that the recipe's list takes.",
    ),
    "long": typer.Option(
        "--yes-long", help="A capture of more than 4 hours is meant; at most 24 are possible."
    ),
}
_HAND = typer.Option("--hand", help="Motor off: a person (or the virtual hand) cuts.")


@command
@options_of({**RIG, **_PLANNED})
def friction(
    rig: RigOptions,
    options: CaptureOptions,
    axis: Axis = "opening",
    yes: Yes = False,
    folder: Folder = None,
) -> Answer:
    """Record empty closing and opening at several speeds, then excited motion for the inertia.

    Keep the space between the blades empty: the motors move them. --axis advance moves the carriage
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
    from scissorcal.workday.runs.capture import capture_into

    kind: CaptureKind = "friction" if axis == "opening" else "friction-advance"
    workspace = open_workspace(folder)
    with _at_rig(workspace, kind, options, yes) as operator:
        captured = capture_into(workspace, kind, rig, options, operator)
    return _answer(workspace, kind, captured)


@command
@options_of({**RIG, **_PLANNED, "hand": _HAND})
def cut(
    rig: RigOptions, options: CaptureOptions, yes: Yes = False, folder: Folder = None
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
    from scissorcal.workday.runs.capture import capture_into

    workspace = open_workspace(folder)
    with _at_rig(workspace, "cut", options, yes) as operator:
        captured = capture_into(workspace, "cut", rig, options, operator)
    return _answer(workspace, "cut", captured)


@contextmanager
def _at_rig(
    workspace: "Workspace", kind: "CaptureKind", options: CaptureOptions, yes: bool
) -> "Iterator[Operator]":
    """Show a capture to the person at the terminal; say what was kept where it fails."""
    from scissorcal.cli.live_view import LiveView

    before = set(workspace.recordings(kind))
    try:
        with LiveView(ask=not yes, listed=not options.until_tolerance) as view:
            yield view.operator
    except BaseException as error:
        kept = sorted(set(workspace.recordings(kind)) - before)
        for path in kept:
            note(f"The samples recorded until then are kept in {workspace.relative(path)}.")
        if isinstance(error, ScissorcalError):
            error.kept = tuple(kept)
        raise


def _answer(workspace: "Workspace", kind: str, captured: "Captured") -> Answer:
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
