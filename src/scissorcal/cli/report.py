"""``scissorcal report``"""

from pathlib import Path

import click

from scissorcal.cli.opening import open_workspace
from scissorcal.cli.options import workspace_option
from scissorcal.cli.output import Answer, command


@click.command("report")
@workspace_option
@command
def report(folder: Path | None) -> Answer:
    """Write the report: one HTML file that needs no network, and its JSON twin.

    \b
    Example:
      $ scissorcal report
      report/report.html and report/report.json show 2 fits
      ...
    """
    from scissorcal.workday.reports import reported_fits, write_workspace_report

    workspace = open_workspace(folder)
    written = write_workspace_report(workspace)
    shown = sorted(reported_fits(workspace))
    names = [workspace.relative(path) for path in (written.html, written.json)]
    text = f"{names[0]} and {names[1]} show {len(shown)} fit{'s' if len(shown) != 1 else ''}"
    result = {"html": written.html, "json": written.json, "fits": shown}
    return Answer(result, text, written.verdicts, [written.html, written.json])
