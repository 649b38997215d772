"""``scissorcal report``"""

from pathlib import Path
from typing import Literal

import click

from scissorcal.cli.lazy import LazyGroup
from scissorcal.cli.opening import open_workspace
from scissorcal.cli.options import workspace_option
from scissorcal.cli.output import Answer, command

_COMMANDS = {
    "compare": ("scissorcal.cli.report:compare", "Put two runs side by side."),
    "sign": ("scissorcal.cli.report:sign", "Accept or reject what the report shows."),
}


class _ReportGroup(LazyGroup):
    """Refuses options of ``report`` itself in front of a subcommand, where they would be lost."""

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if any(ctx.params.values()):
            raise click.UsageError("Name options after the subcommand, not in front of it.", ctx)
        return super().resolve_command(ctx, args)


@click.group("report", cls=_ReportGroup, lazy=_COMMANDS, invoke_without_command=True)
@click.option("--anew", is_flag=True, help="Write it again although it is signed.")
@workspace_option
@command
def report(anew: bool, folder: Path | None) -> Answer:
    """Write the report: one HTML file that needs no network, and its JSON twin.

    A signed report is left as it is while its fits, recipe and trust checks are; --anew writes it
    all the same, which voids the signature if anything in it changed.

    \b
    Example:
      $ scissorcal report
      report/report.html and report/report.json show 2 fits
      ...
    """
    from scissorcal.workday.runs.report import (
        read_workspace_report,
        reported_fits,
        write_workspace_report,
    )
    from scissorcal.workday.runs.sign import standing_review

    workspace = open_workspace(folder)
    review = None if anew else standing_review(workspace)
    written = read_workspace_report(workspace) if review else write_workspace_report(workspace)
    shown = sorted(reported_fits(workspace))
    names = [workspace.relative(path) for path in (written.html, written.json)]
    text = f"{names[0]} and {names[1]} show {len(shown)} fit{'s' if len(shown) != 1 else ''}"
    files = [written.html, written.json]
    if review:
        files = []
        text += f"; {review.words}, so they were left as they are"
    result = {
        "html": written.html,
        "json": written.json,
        "fits": shown,
        "signed": review.model_dump() if review else None,
    }
    return Answer(result, text, written.verdicts, files)


@click.command("compare")
@click.argument("first", type=click.Path(path_type=Path))
@click.argument("second", type=click.Path(path_type=Path))
@click.option(
    "--output",
    type=click.Path(path_type=Path, file_okay=False),
    default=Path("comparison"),
    show_default=True,
    help="Folder that comparison.html and comparison.json go to.",
)
@command
def compare(first: Path, second: Path, output: Path) -> Answer:
    """Put two runs side by side: parameters, verdicts, hold-out errors, rendered torque.

    Each is a workspace, a report.json or a fit (.nc). Runs of another joint, material, scene or
    law are refused.

    \b
    Example:
      $ scissorcal report compare monday friday
      No parameter differs by more than 3 standard deviations. Rendered torque differs by at ...
      ...
      comparison/comparison.html and comparison/comparison.json show it
    """
    from scissorcal.report import panels_text
    from scissorcal.workday.runs.compare import compare_runs

    done = compare_runs(first, second, output)
    found = done.comparison
    shown = [panel for panel in found.panels if panel.id.endswith("-parameters")]
    text = f"{found.sentence}\n\n{panels_text(shown)}\n\n{done.html} and {done.json} show it"
    result = {
        "first": found.first,
        "second": found.second,
        "sentence": found.sentence,
        "panels": [
            {"id": panel.id, "title": panel.title, "sentence": panel.sentence, "rows": panel.rows}
            for panel in found.panels
        ],
        "html": done.html,
        "json": done.json,
    }
    return Answer(result, text, files=[done.html, done.json])


@click.command("sign")
@click.option("--name", required=True, help="Who reviewed the report.")
@click.option("--decision", type=click.Choice(["accept", "reject"]), required=True)
@click.option("--note", default="", help="Why, or under which condition.")
@workspace_option
@command
def sign(
    name: str, decision: Literal["accept", "reject"], note: str, folder: Path | None
) -> Answer:
    """Sign the report that lies in the workspace: report/signature.json.

    The signature names the report's SHA-256 and the fits that it shows, so it is void once either
    changes. The next package carries it, and rendering warns without it.

    \b
    Example:
      $ scissorcal report sign --name "A. Lovelace" --decision accept --note "edge was reground"
      report/signature.json: accepted by A. Lovelace on 2025-01-31: edge was reground
      next: scissorcal package build
    """
    from scissorcal.workday.runs.sign import sign_report

    workspace = open_workspace(folder)
    review = sign_report(workspace, name, decision, note)
    path = workspace.signature_path
    text = f"{workspace.relative(path)}: {review.words}"
    if decision == "accept":
        text += "\nnext: scissorcal package build"
    return Answer(review.model_dump(), text, files=[path])
