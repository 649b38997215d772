"""``scissorcal plan``"""

from typing import TYPE_CHECKING, Annotated

import typer

from scissorcal.cli.opening import open_workspace
from scissorcal.cli.options import Folder
from scissorcal.cli.output import Answer, command, table

if TYPE_CHECKING:
    from scissorcal.workday.plan import Plan
    from scissorcal.workday.runs.design import CaptureDesign
    from scissorcal.workday.workspace import Workspace

Explain = Annotated[
    bool,
    typer.Option(
        "--explain",
        help="Design the captures: what each stroke is expected to do to the band of the scene's "
        "torque, per minute at the rig.",
    ),
]


@command
def plan(explain: Explain = False, folder: Folder = None) -> Answer:
    """Show the state of every step that the scene requires, and the next command.

    missing: not there. incomplete: a capture lacks what the recipe plans. stale: made from other
    inputs than there are now. failed: a check failed. unverified: no verification yet. done: none
    of these.

    \b
    Example:
      $ scissorcal plan
      paper-80gsm:
      ...
      fit cut           missing     not there yet         response and toughness
      ...
      next: scissorcal capture friction --device PORT

    With --explain it designs the shortest captures that are expected to bring the band of the
    torque within the scene's tolerance, from the fits that there are or the recipe's priors.
    'scissorcal capture' takes them where the recipe lists none (capture.plan).
    """
    from scissorcal.workday.plan import make_plan

    workspace = open_workspace(folder)
    design = _designed(workspace) if explain else None
    found = make_plan(workspace)
    result = {
        "recipe": found.recipe,
        "workspace": workspace.root,
        "steps": found.steps,
        "tables": found.tables,
        "left_out": found.left_out,
        "scene_choice": found.choice.model_dump() if found.choice else None,
        "notes": found.notes,
        "probe": found.probe,
        "costs": found.costs,
        "next_command": found.next_command,
        "design": design or found.design,
    }
    files = [workspace.design_path] if design else []
    return Answer(result, _text(found, design), files=files)


def _designed(workspace: "Workspace") -> "CaptureDesign":
    from scissorcal.workday.runs.design import design_captures

    return design_captures(workspace)


def _text(found: "Plan", design: "CaptureDesign | None") -> str:
    rows = [["step", "state", "found", "needed for"]]
    rows += [[step.name, step.state, step.found, step.why] for step in found.steps]
    lines = [f"{found.recipe}:", "", table(rows), ""]
    if found.tables:
        lines.append("tables to build: " + ", ".join(item.name for item in found.tables))
    lines += [f"left out: {item.name}, as {item.why}" for item in found.left_out]
    lines += found.choice.sentences if found.choice else ()
    lines += [f"capture {cost.kind} takes {cost.sentence}" for cost in found.costs]
    lines += [f"note: {note}" for note in found.notes]
    if design:
        lines += ["", *_explained(design)]
    elif found.design:
        lines.append(f"captures: {found.design.sentence}")
    lines += [f"probe: {found.probe}", "", f"next: {found.next_command or 'nothing is left to do'}"]
    return "\n".join(lines)


def _explained(design: "CaptureDesign") -> list[str]:
    """The table of what each addition is expected to do."""
    head = ["capture", "adds", "min", "in all", "places within", "band", "gain/min"]
    rows = [head]
    rows += [
        [
            row.capture,
            row.what,
            f"{row.minutes:.2f}",
            f"{row.total_minutes:.2f}",
            f"{100 * row.within[0]:.0f} -> {100 * row.within[1]:.0f} %",
            f"{100 * row.band[0]:.3g} -> {100 * row.band[1]:.3g} %",
            f"{row.gain_per_min:.3g}",
        ]
        for row in design.rows
    ]
    lines = [table(rows), ""] if design.rows else []
    lines.append(design.sentence)
    lines.append(
        f'With capture.plan = "listed" captures take {design.listed_minutes:.1f} min and are '
        f"expected to bring {100 * design.listed_within:.0f} % of the places within."
    )
    return [*lines, *(f"assumed: {sentence}" for sentence in design.assumed)]
