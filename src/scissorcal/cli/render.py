"""``scissorcal render``"""

import math
from dataclasses import asdict
from typing import TYPE_CHECKING

import typer

from scissorcal.cli.opening import open_workspace
from scissorcal.cli.options import (
    NO_RECORD,
    PLATE_CAMERA,
    RIG,
    TRUSTED_KEY,
    Folder,
    Yes,
    options_of,
    positive,
)
from scissorcal.cli.output import Answer, command, note, table
from scissorcal.workday.options import RenderOptions, RigOptions

if TYPE_CHECKING:
    from scissorcal.render import RenderResult
    from scissorcal.workday.runs.at_rig import RigRun


_OPTIONS = {
    "package_path": typer.Option(
        "--package", help="The package to render; the workspace's if not given."
    ),
    "seconds": typer.Option(callback=positive, help="How long to render, by the rig's clock."),
    "strokes": typer.Option(min=1, help="Strokes of the virtual hand."),
    "rate_rad_per_s": typer.Option(callback=positive, help="Speed of the virtual hand."),
    "camera": PLATE_CAMERA,
    "taps_s": typer.Option(
        "--taps",
        min=0.0,
        metavar="SECONDS",
        help="Before rendering, with the motors off: tap the plate with the blade's tip, at "
        "several places, so that contact tells its height.",
    ),
    "accept_derated": typer.Option(
        "--accept-derated",
        help="Render although what is felt differs from the package by more than the scene's "
        "tolerance; result and recording state that a person accepted it.",
    ),
    "allow_mismatch": typer.Option(
        "--allow-mismatch",
        help="Render a package of another rig (radius, joint, limits, serial number) or a "
        "stale one; what differs is said and recorded.",
    ),
    "on_device": typer.Option(
        "--on-device",
        help="Load the package into the device, which then renders by itself: what is felt lags by "
        "one tick, whatever this computer does, and this computer watches and records.",
    ),
    "trusted_key": TRUSTED_KEY,
    "no_record": NO_RECORD,
}


@command
@options_of({**RIG, **_OPTIONS})
def render(
    rig: RigOptions, options: RenderOptions, yes: Yes = False, folder: Folder = None
) -> Answer:
    """Render the cut on a rig: hold the handles and close them.

    The loop runs in C, in a separate process, within the recipe's limits. With --device sim a
    virtual hand makes the strokes, in virtual time unless --realtime is given. With --camera a
    plate whose pose the scene estimates may move while it is cut. What the rig cannot render
    stably is rendered softer; exit code 3 where that is felt beyond the scene's tolerance.

    \b
    Example:
      $ scissorcal render --device sim
      rendered 4 strokes in 15.9 s on scissorcal-sim office-paper
      ...
      0 frames missed, 0 garbled, 0 stalls, 0 faults; 0.0 % of the frames at a limit
      ...
    """
    from scissorcal.cli.live_view import LiveView
    from scissorcal.workday.runs.render import package_warnings, render_workspace

    workspace = open_workspace(folder)
    for sentence in package_warnings(workspace, options.package_path):
        note(sentence)
    with LiveView(ask=not yes) as view:
        rendered = render_workspace(workspace, rig, options, view.operator)
    return Answer(rendered.facts, _text(rendered), rendered.verdicts, rendered.files)


def _text(rendered: "RigRun[RenderResult]") -> str:
    result = rendered.result
    lines = [f"rendered {result.strokes} strokes in {result.seconds:.1f} s on {rendered.rig}"]
    if result.latency is not None:
        at = result.latency
        rows = [["latency (us)", "p50", "p99", "p99.9", "worst"]]
        rows.append(["", *(f"{value:.0f}" for value in (at.p50, at.p99, at.p999, at.worst))])
        lines += ["", table(rows, right=[1, 2, 3, 4])]
    lines += ["", result.lag.sentence]
    if result.rights is not None:
        lines.append(result.rights.sentence)
    lines += [
        "",
        f"{result.misses} frames missed, {result.garbled} garbled, {result.stalls} stalls, "
        f"{result.faults} faults; {100 * result.limited_share:.1f} % of the frames at a limit",
        f"largest torque {result.largest_torque_Nm:.3g} N m",
        result.admission.summary,
        *([result.plate.summary] if result.plate else []),
        *([rendered.tracked.sentence] if rendered.tracked else []),
        "",
    ]
    ledger = [["energy", "mJ"]]
    ledger += [
        [name.removesuffix("_J"), f"{value * 1e3:.2f}"]
        for name, value in asdict(result.ledger).items()
        if name.endswith("_J") and math.isfinite(value)
    ]
    ledger.append(["energy error", f"{1e3 * max(result.ledger.created_J, 0.0):.2f}"])
    lines.append(table(ledger, right=[1]))
    if result.warnings:
        lines += ["", *(f"note: {warning}" for warning in result.warnings)]
    return "\n".join(lines)
