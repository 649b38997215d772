"""``scissorcal render``"""

import math
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from scissorcal.cli.opening import open_workspace
from scissorcal.cli.options import (
    Baud,
    Device,
    Folder,
    PlateCamera,
    Realtime,
    Seed,
    TrustedKey,
    Yes,
    positive,
)
from scissorcal.cli.output import Answer, command, note, table
from scissorcal.cli.tracked import tracked_facts

if TYPE_CHECKING:
    from scissorcal.workday.runs.render import Rendered


@command
def render(
    device: Device,
    package_path: Annotated[
        Path | None,
        typer.Option("--package", help="The package to render; the workspace's if not given."),
    ] = None,
    seconds: Annotated[
        float, typer.Option(callback=positive, help="How long to render, by the rig's clock.")
    ] = 30.0,
    strokes: Annotated[int, typer.Option(min=1, help="Strokes of the virtual hand.")] = 4,
    rate_rad_per_s: Annotated[
        float, typer.Option(callback=positive, help="Speed of the virtual hand.")
    ] = 0.3,
    camera: PlateCamera = "none",
    taps: Annotated[
        float,
        typer.Option(
            min=0.0,
            metavar="SECONDS",
            help="Before rendering, with the motors off: tap the plate with the blade's tip, at "
            "several places, so that contact tells its height.",
        ),
    ] = 0.0,
    accept_derated: Annotated[
        bool,
        typer.Option(
            "--accept-derated",
            help="Render although what is felt differs from the package by more than the scene's "
            "tolerance; result and recording state that a person accepted it.",
        ),
    ] = False,
    allow_mismatch: Annotated[
        bool,
        typer.Option(
            "--allow-mismatch",
            help="Render a package of another rig (radius, joint, limits, serial number) or a "
            "stale one; what differs is said and recorded.",
        ),
    ] = False,
    trusted_key: TrustedKey = None,
    no_record: Annotated[bool, typer.Option("--no-record", help="Keep no recording.")] = False,
    realtime: Realtime = False,
    yes: Yes = False,
    seed: Seed = 0,
    baud: Baud = None,
    folder: Folder = None,
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
    from scissorcal.package.keys import read_public_keys
    from scissorcal.render import VirtualStrokes
    from scissorcal.workday.runs.render import (
        package_warnings,
        render_workspace,
    )

    workspace = open_workspace(folder)
    trusted = read_public_keys(trusted_key) if trusted_key else None
    for sentence in package_warnings(workspace, package_path):
        note(sentence)
    with LiveView(ask=not yes) as view:
        rendered = render_workspace(
            workspace,
            device,
            package_path=package_path,
            seconds=seconds,
            strokes=VirtualStrokes(strokes, rate_rad_per_s),
            record=not no_record,
            seed=seed,
            baud=baud,
            realtime=realtime,
            progress=view.show,
            confirm=view.confirm,
            say=note,
            camera=camera,
            taps_s=taps,
            accept_derated=accept_derated,
            allow_mismatch=allow_mismatch,
            trusted=trusted,
        )
    result = asdict(rendered.result)
    verdicts = rendered.result.verdicts
    if rendered.tracked:
        verdicts += rendered.tracked.verdicts
    del result["verdicts"]
    files = [rendered.recording] if rendered.recording else []
    facts = {"rig": rendered.rig, "tracked": tracked_facts(rendered.tracked)}
    return Answer({**result, **facts}, _text(rendered), verdicts, files)


def _text(rendered: "Rendered") -> str:
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
