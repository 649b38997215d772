"""``scissorcal bench extremes``"""

from dataclasses import replace
from pathlib import Path
from typing import Annotated

import typer

from scissorcal.cli.opening import open_workspace
from scissorcal.cli.options import Folder, Seed
from scissorcal.cli.output import Answer, command
from scissorcal.cli.progress import progress


@command
def extremes(
    package_path: Annotated[
        Path | None,
        typer.Option("--package", help="The package to try; the workspace's if not given."),
    ] = None,
    size: Annotated[
        float,
        typer.Option(min=0.01, max=100.0, help="Number of states, as a multiple of the usual one."),
    ] = 1.0,
    output: Annotated[
        Path, typer.Option("--output", "-o", help="Folder for extremes.html and extremes.json.")
    ] = Path("bench"),
    seed: Seed = 0,
    folder: Folder = None,
) -> Answer:
    """Show where your package, and the model under it, stops being right.

    Three things are compared with a second writing of the equations in 50 digits, from the scene
    to the absurd: the float64 model with its own law, a step of the float32 kernel with its own
    tables, and the torque that the package renders with the law, within the package's stated
    bound. Energy is balanced over long strokes. A number that is neither right to its stated error
    nor refused fails the run (exit code 3). Maps and tables stand in extremes.html.

    Without --package it takes the package of the workspace: 'scissorcal package build' makes it.

    \b
    Example:
      $ scissorcal bench extremes --size 0.1
      Largest errors: Of 337 answers 235 are right to their stated error, 29 refused in a sentence,
      73 marked as not to be used, 0 not compared, and 0 wrong.
      ...
    """
    from scissorcal.package import open_package
    from scissorcal.report.panel import panels_text
    from scissorcal.workday.runs.bench_extremes import run_extremes

    if package_path is None:
        workspace = open_workspace(folder)
        package_path = workspace.package_path(workspace.recipe())
    package = open_package(package_path, warn=False)
    with progress() as tell:
        panels, files = run_extremes(package, output, size=size, seed=seed, progress=tell)
    verdicts = panels[0].verdicts
    text = panels_text([replace(panels[0], verdicts=()), *(p for p in panels[1:] if not p.charts)])
    return Answer({"panels": panels}, text, verdicts, files)
