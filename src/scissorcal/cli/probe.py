"""``scissorcal device probe``"""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from scissorcal.cli.options import RIG, Folder, Yes, options_of
from scissorcal.cli.output import Answer, command, note, table
from scissorcal.workday.options import RigOptions

if TYPE_CHECKING:
    from scissorcal.device.probe.result import ProbeResult

_FACTS = (
    ("breakaway", "breakaway_Nm", 1e3, "mN m"),
    ("encoder step", "encoder_step_rad", 1e6, "urad"),
    ("command to flag", "command_lag_ticks", 1.0, "ticks"),
    ("torque noise (sd)", "torque_noise_Nm", 1e3, "mN m"),
    ("force noise (sd)", "force_noise_N", 1.0, "N"),
    ("largest torque used", "largest_torque_Nm", 1e3, "mN m"),
    ("largest rate seen", "largest_rate_rad_per_s", 1.0, "rad/s"),
)


@command
@options_of(RIG)
def probe(
    rig: RigOptions,
    recipe: Annotated[
        Path | None,
        typer.Option(
            "--recipe", dir_okay=False, help="A recipe file, where there is no workspace."
        ),
    ] = None,
    yes: Yes = False,
    folder: Folder = None,
) -> Answer:
    """Check a rig before its motors run: line, sensors, watchdog, signs, delay, inertia, friction.

    It asks for the blades to be closed and opened by hand, motors off, listens for a second, then
    pushes them each way and lets them swing, within rig.probe. Keep the space between the blades
    empty and let go of the handles when asked. What it finds is kept in device-probe.json; captures
    and renderings probe by themselves where that is missing or old. What no motor may run with is
    refused with its cause, and what it cannot determine with what to do (exit code 4).

    \b
    Example:
      $ scissorcal device probe --device sim
      scissorcal-sim office-paper: no fault found
      ...
    """
    from scissorcal.cli.live_view import LiveView
    from scissorcal.cli.opening import open_workspace
    from scissorcal.device.probe.probe import ProbeRefusedError
    from scissorcal.recipe.load import load_recipe
    from scissorcal.workday.runs.probe import probe_device

    workspace = None if recipe else open_workspace(folder)
    given = workspace.recipe() if workspace else load_recipe(recipe or Path())
    try:
        with LiveView(ask=not yes) as view:
            result = probe_device(given, rig, view.operator, workspace=workspace)
    except ProbeRefusedError as error:
        note(_text(error.result))
        raise
    files = [workspace.probe_path] if workspace else []
    head = f"{result.device}: no fault found\n\n"
    return Answer(result.as_dict(), head + _text(result), result.verdicts, files)


def _text(result: "ProbeResult") -> str:
    """Estimates with their standard deviation, and the facts that people ask for."""
    from scissorcal.recording.probe import ESTIMATES

    rows = [["", "estimate", "sd", ""]]
    for label, name, scale, unit in ESTIMATES:
        estimate = getattr(result, name)
        if estimate is not None:
            rows.append([label, f"{scale * estimate.mean:.4g}", f"{scale * estimate.sd:.2g}", unit])
    facts = result.facts
    for label, name, scale, unit in _FACTS:
        if math.isfinite(facts.get(name, math.nan)):
            rows.append([label, f"{scale * facts[name]:.4g}", "", unit])
    return table(rows, right=[1, 2])
