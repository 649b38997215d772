"""``scissorcal recording list``, ``exclude`` and ``include``."""

from typing import Annotated

import typer

from scissorcal.cli.opening import open_workspace
from scissorcal.cli.options import Folder
from scissorcal.cli.output import Answer, command, table

Name = Annotated[str, typer.Argument(help="File name of a recording, as 'recording list' shows.")]


@command
def list_(folder: Folder = None) -> Answer:
    """List the recordings of friction and cuts: used, excluded, or why not used.

    Below, what the recipe plans and the recordings lack.

    \b
    Example:
      $ scissorcal recording list
      recording                       seconds  use       why
      friction-20261121T131435Z.mcap    109.2  used
      cut-20261121T132227Z.mcap          72.8  excluded  the sheet was torn
      ...
    """
    from scissorcal.workday.engine import Engine
    from scissorcal.workday.recordings import RecordingRow

    workspace = open_workspace(folder)
    engine = Engine.of(workspace)
    found: list[RecordingRow] = []
    lacking = {}
    for kind in ("friction", "cut"):
        rows = engine.recordings(kind)
        found += rows
        used = [row for row in rows if row.use == "used"]
        if used:
            lacking[kind] = engine.missing(kind, used)
    engine.index.save()
    lines = [["recording", "seconds", "use", "why"]]
    lines += [[row.path.name, f"{row.seconds:.1f}", row.use, row.why] for row in found]
    text = table(lines, right=[1]) if found else "There is no recording of friction or a cut yet."
    text += "".join(
        f"\ncapture {kind} lacks: {sentence}" for kind in lacking for sentence in lacking[kind]
    )
    return Answer({"recordings": found, "lacking": lacking}, text)


@command
def exclude(
    name: Name,
    why: Annotated[str, typer.Option(help="The reason, shown wherever the data are listed.")],
    folder: Folder = None,
) -> Answer:
    """Do not use a recording in fits. The file stays as it is; fits that used it become stale.

    \b
    Example:
      $ scissorcal recording exclude cut-20261121T132227Z.mcap --why "the sheet was torn"
      captures/cut-20261121T132227Z.mcap is excluded: the sheet was torn
    """
    from scissorcal.workday.recordings import exclude_recording

    workspace = open_workspace(folder)
    path = exclude_recording(workspace, name, why)
    text = f"{workspace.relative(path)} is excluded: {why.strip()}"
    return Answer({"recording": path, "why": why}, text, files=[workspace.exclusions_path])


@command
def include(name: Name, folder: Folder = None) -> Answer:
    """Use an excluded recording in fits again.

    \b
    Example:
      $ scissorcal recording include cut-20261121T132227Z.mcap
      captures/cut-20261121T132227Z.mcap is used again
    """
    from scissorcal.workday.recordings import include_recording

    workspace = open_workspace(folder)
    path = include_recording(workspace, name)
    text = f"{workspace.relative(path)} is used again"
    return Answer({"recording": path}, text, files=[workspace.exclusions_path])
