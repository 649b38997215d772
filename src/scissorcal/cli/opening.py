"""Open a workspace for a command; interrupted captures are recovered first."""

import contextlib
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from scissorcal.cli.output import note, works_in

if TYPE_CHECKING:
    from scissorcal.workday.workspace import Workspace


def open_workspace(folder: Path | None) -> "Workspace":
    """Find the workspace that contains ``folder`` (default: the current folder).

    Captures that were interrupted are recovered first, and reported on stderr; other files that a
    killed command left half-written are removed. Raises MissingError where there is no workspace.
    """
    from scissorcal.workday.recordings import recover_recordings
    from scissorcal.workday.workspace import find_workspace

    workspace = find_workspace(folder)
    works_in(workspace)
    workspace.remove_left_over()
    for sentence in recover_recordings(workspace):
        note(sentence)
    return workspace


@contextlib.contextmanager
def writes_in(folder: Path | None, command: str) -> "Iterator[Workspace]":
    """Open a workspace and hold it for ``command``, which writes results.

    Raises InputError where another command holds it.
    """
    from scissorcal.workday.lock import writing

    workspace = open_workspace(folder)
    with writing(workspace, command, note):
        yield workspace
