"""Open a workspace for a command: found upward, interrupted captures recovered first."""

from pathlib import Path
from typing import TYPE_CHECKING

from scissorcal.cli.output import note

if TYPE_CHECKING:
    from scissorcal.workday.workspace import Workspace


def open_workspace(folder: Path | None) -> "Workspace":
    """Find the workspace that ``folder`` (or where you stand) lies in.

    Captures that were interrupted are finished first, and what became of them is said on stderr.
    Raises MissingError where there is no workspace.
    """
    from scissorcal.workday.recordings import recover_recordings
    from scissorcal.workday.workspace import find_workspace

    workspace = find_workspace(folder)
    for sentence in recover_recordings(workspace):
        note(sentence)
    return workspace
