"""Compare two runs: workspaces, reports' JSON twins, or fits."""

from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING

from scissorcal.errors import MissingError
from scissorcal.foreign import read_foreign, reading
from scissorcal.foreign.formats import REPORT
from scissorcal.identity import VERSION
from scissorcal.workday.engine import Engine
from scissorcal.workday.runs.fit import available, load_result
from scissorcal.workday.workspace import RECIPE_FILE, Workspace, find_workspace

if TYPE_CHECKING:
    from scissorcal.report import Comparison, Side


@dataclass(frozen=True)
class Compared:
    """A comparison and its two files."""

    comparison: "Comparison"
    html: Path
    json: Path


def compare_runs(
    first: Path, second: Path, folder: Path, *, now: datetime | None = None
) -> Compared:
    """Write comparison.html and comparison.json into ``folder``.

    Each side is a workspace, a report.json, or a fit (.nc). Raises MissingError where there is
    nothing, InputError where a file is none of these or the two cannot be compared.
    """
    from scissorcal.report import compare, write_comparison

    sides = [load_side(path) for path in (first, second)]
    found = compare(*sides, created=now or datetime.now(UTC), version=VERSION)
    files = write_comparison(found, folder)
    return Compared(found, files.html, files.json)


def load_side(path: Path) -> "Side":
    """Read one side of a comparison from wherever it lies."""
    from scissorcal.report import Side, read_twin

    if path.is_dir():
        if not (path / RECIPE_FILE).is_file():
            raise MissingError(
                f"{path} has no {RECIPE_FILE}, so it is no workspace: name a workspace, a "
                "report.json or a fit (.nc)."
            )
        source = shown_path(path) if path.name not in ("", "..") else path.resolve().name
        return _side_of_workspace(Workspace(path.absolute()), source)
    if not path.is_file():
        raise MissingError(
            f"{path} does not exist: name a workspace, a report.json or a fit (.nc)."
        )
    if path.suffix == ".nc":
        return _side_of_fit(path)
    remedy = "Run 'scissorcal report' again, or name a workspace or a fit (.nc)."
    with reading(path, REPORT, remedy):
        return Side(shown_path(path), read_twin(read_foreign(path, REPORT)))


def shown_path(path: Path) -> str:
    """The name of a side on a page that goes to others, without the folders above its workspace."""
    if not path.is_absolute():
        return str(path)
    try:
        root = find_workspace(path.parent if path.is_file() else path).root
    except MissingError:
        return path.name
    return str(path.relative_to(root.parent)) if path.is_relative_to(root) else path.name


def _side_of_workspace(workspace: Workspace, source: str) -> "Side":
    from scissorcal.report import Side, document_of

    engine = Engine.of(workspace)
    fits = [
        load_result(engine, what)
        for what in available(engine, ("friction", "friction-advance", "cut"))
    ]
    if not fits:
        raise MissingError(f"{source} has no current fit: run 'scissorcal fit' there first.")
    return Side(source, document_of(engine.recipe, fits))


def _side_of_fit(path: Path) -> "Side":
    """A fit alone: what it is of, its workspace says if it lies in one."""
    from scissorcal.calibration import load_fit
    from scissorcal.report import Side, document_of_fit

    fit = load_fit(path)
    try:
        recipe = find_workspace(path.parent).recipe()
    except MissingError:
        recipe = None
    return Side(shown_path(path), document_of_fit(fit, recipe))
