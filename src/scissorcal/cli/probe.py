"""``scissorcal device probe``"""

from pathlib import Path
from typing import Annotated

import typer

from scissorcal.cli.options import RIG, Folder, Yes, options_of
from scissorcal.cli.output import Answer, command, note
from scissorcal.workday.options import RigOptions


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
      No fault found.
    \b
      The rig as it was probed: scissorcal-sim office-paper, probed at 2026-11-22T09:15:00+00:00.
                        value
        torque zero     0.033 +- 0.067 (-0.077 to 0.143) mN m
        ...
    """
    from scissorcal.cli.live_view import LiveView
    from scissorcal.cli.opening import open_workspace
    from scissorcal.device.probe.probe import ProbeRefusedError
    from scissorcal.recipe.load import load_recipe
    from scissorcal.report import panel_text
    from scissorcal.report.subjects.closing import rig_panel
    from scissorcal.workday.runs.probe import probe_device

    workspace = None if recipe else open_workspace(folder)
    given = workspace.recipe() if workspace else load_recipe(recipe or Path())
    try:
        with LiveView(ask=not yes) as view:
            result = probe_device(given, rig, view.operator, workspace=workspace)
    except ProbeRefusedError as error:
        note(panel_text(rig_panel(error.result)))
        raise
    files = [workspace.probe_path] if workspace else []
    text = f"No fault found.\n\n{panel_text(rig_panel(result))}"
    return Answer(result.as_dict(), text, result.verdicts, files)
