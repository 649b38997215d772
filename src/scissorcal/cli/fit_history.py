"""``scissorcal fit log`` and ``scissorcal fit restore``."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from scissorcal.cli.opening import open_workspace, writes_in
from scissorcal.cli.options import Folder
from scissorcal.cli.output import Answer, command, table

if TYPE_CHECKING:
    from scissorcal.workday.history import Version

What = Literal["camera", "blade", "plate", "friction", "friction-advance", "cut"]


@command
def log(
    what: Annotated[What | None, typer.Argument(help="One fit; all if not given.")] = None,
    folder: Folder = None,
) -> Answer:
    """List the versions of each fit, the newest first; * marks the one in use.

    \b
    Example:
      $ scissorcal fit log friction
      version                               model                                   checks
      friction-20261122T143201Z-1f2e3d4c *  stribeck + angle, symmetric (standard)  passed
      friction-20261121T091500Z-9a8b7c6d    coulomb + viscous, symmetric (draft)    failed: k-hat
    """
    from scissorcal.workday.engine import Engine
    from scissorcal.workday.history import versions

    found = versions(Engine.of(open_workspace(folder)), what or "")
    rows = [["version", "model", "checks"]]
    for version in found:
        checks = f"failed: {', '.join(version.failed)}" if version.failed else "passed"
        checks += ", trust check kept" if version.verified and not version.current else ""
        rows.append([version.name + (" *" if version.current else ""), version.label, checks])
    text = table(rows) if found else "There is no fit yet: run 'scissorcal fit'."
    return Answer({"versions": found}, text)


@command
def restore(
    version: Annotated[
        str,
        typer.Argument(
            help="Name of a version, or how it begins; or a file (.nc) in which a fit was kept "
            "because the workspace could not be written."
        ),
    ],
    folder: Folder = None,
) -> Answer:
    """Put an earlier version of a fit back in use; the one in use is kept as a version.

    Results that were made from the fit in use are stale afterwards.

    \b
    Example:
      $ scissorcal fit restore friction-20261121T091500Z
      fits/friction.nc: friction-20261121T091500Z-9a8b7c6d is in use again
      kept: fits/history/friction-20261122T143201Z-1f2e3d4c
      next: scissorcal fit cut
    """
    from scissorcal.workday.elsewhere import put_in_place
    from scissorcal.workday.engine import Engine
    from scissorcal.workday.history import restore as restore_version
    from scissorcal.workday.plan import make_plan

    found: Version | None = None
    with writes_in(folder, "scissorcal fit restore") as workspace:
        engine = Engine.of(workspace)
        if version.endswith(".nc"):
            step, before = put_in_place(engine, Path(version))
            path, said = engine.file(step.name), f"{Path(version).name} is in use"
        else:
            found, before = restore_version(engine, version)
            path, said = engine.file(f"fit {found.what}"), f"{found.name} is in use again"
    lines = [f"{workspace.relative(path)}: {said}"]
    lines += [f"kept: {workspace.relative(before)}"] if before else []
    next_command = make_plan(workspace).next_command
    lines += [f"next: {next_command}"] if next_command else []
    result = {"version": found, "fit": path, "kept": before, "next_command": next_command}
    return Answer(result, "\n".join(lines), files=[path])
