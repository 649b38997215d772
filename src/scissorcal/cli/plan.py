"""``scissorcal plan``"""

from typing import TYPE_CHECKING

from scissorcal.cli.opening import open_workspace
from scissorcal.cli.options import Folder
from scissorcal.cli.output import Answer, command, table

if TYPE_CHECKING:
    from scissorcal.workday.plan import Plan


@command
def plan(folder: Folder = None) -> Answer:
    """Show the state of every step that the scene requires, and the next command.

    missing: not there. incomplete: a capture lacks what the recipe plans. stale: made from other
    inputs than there are now. failed: a check failed. unverified: no trust check yet. done: none
    of these.

    \b
    Example:
      $ scissorcal plan
      paper-80gsm:
      ...
      fit cut           missing     not there yet         response and toughness
      ...
      next: scissorcal capture friction --device PORT
    """
    from scissorcal.workday.plan import make_plan

    workspace = open_workspace(folder)
    found = make_plan(workspace)
    result = {
        "recipe": found.recipe,
        "workspace": workspace.root,
        "steps": found.steps,
        "tables": found.tables,
        "left_out": found.left_out,
        "notes": found.notes,
        "next_command": found.next_command,
    }
    return Answer(result, _text(found))


def _text(found: "Plan") -> str:
    rows = [["step", "state", "found", "needed for"]]
    rows += [[step.name, step.state, step.found, step.why] for step in found.steps]
    lines = [f"{found.recipe}:", "", table(rows), ""]
    if found.tables:
        lines.append("tables to build: " + ", ".join(item.name for item in found.tables))
    lines += [f"left out: {item.name}, as {item.why}" for item in found.left_out]
    lines += [f"note: {note}" for note in found.notes]
    lines += ["", f"next: {found.next_command or 'nothing is left to do'}"]
    return "\n".join(lines)
