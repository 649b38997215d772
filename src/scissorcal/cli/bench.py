"""``scissorcal bench``"""

import re
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from scissorcal.cli.lazy import group
from scissorcal.cli.opening import open_workspace
from scissorcal.cli.options import RIG, Folder, Seed, options_of
from scissorcal.cli.output import Answer, command, note
from scissorcal.cli.progress import progress
from scissorcal.cli.verify import CLUSTER
from scissorcal.errors import InputError
from scissorcal.workday.options import Processes, TradeOptions

if TYPE_CHECKING:
    from scissorcal.bench.trade.result import Trade
    from scissorcal.workday.workspace import Workspace

_COMMANDS = {
    "trade": ("scissorcal.cli.bench:trade", "What accuracy costs, knob by knob."),
    "extremes": ("scissorcal.cli.bench:extremes", "Where numbers stop being right."),
}


@group(_COMMANDS)
def bench() -> None:
    """Measure what accuracy costs, on this computer.

    \b
    Example:
      $ scissorcal bench trade --knob effort
    """


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


_SECONDS = {"s": 1.0, "min": 60.0, "h": 3600.0}
_DURATION = re.compile(r"(\d+(?:\.\d+)?)\s*(s|min|h)\s*")


_OPTIONS = {
    "knobs": typer.Option(
        "--knob", metavar="NAME", help="A knob to measure; repeat the option. All if not given."
    ),
    "force": typer.Option(
        "--force",
        help="Measure again what was measured on the same inputs: the knobs named by --knob alone, "
        "all where none is named.",
    ),
    "seed": RIG["seed"],
    "workers": typer.Option(min=1, help="Processes to measure in; one for each core if not given."),
    "cluster": CLUSTER,
}
Budget = Annotated[
    str | None,
    typer.Option(
        metavar="TIME",
        help='Time for the whole run, such as "3 min" or "90 s"; what does not fit is named.',
    ),
]
OfRecipe = Annotated[
    str | None,
    typer.Option(
        help="A built-in recipe in place of a workspace: its day on the virtual rig is made first, "
        "in the folder bench-NAME (bench-NAME-SEED for a seed above 0), and kept; a budget counts "
        "from there on."
    ),
]
Show = Annotated[bool, typer.Option("--show", help="Print what the last run found; measure none.")]


@command
@options_of(_OPTIONS)
def trade(
    options: TradeOptions,
    processes: Processes,
    budget: Budget = None,
    recipe: OfRecipe = None,
    show: Show = False,
    folder: Folder = None,
) -> Answer:
    """Measure what accuracy costs, on a workspace's own recordings and scene.

    One knob at a time is turned (effort, windows, amount of capture, tables, loop rate,
    candidates, photographs), its cost and its error are measured, and the cheapest setting within
    its part of the scene's tolerance is recommended; then all recommended settings are measured at
    once. Writes bench/trade.html and bench/trade.json.

    Each measurement is stored when it is made: the command can be interrupted and repeated to
    continue, and what failed is then tried again. With --cluster photographs are not measured: they
    are files of this computer.

    \b
    Example:
      $ scissorcal bench trade --knob effort --budget "2 min"
      Effort of the fits: draft is enough: 1.67 s processor time in place of 2.65 s with ...
                                     processor time [s]  worst band error [%]  ...
        draft (recommended, Pareto front)          1.67                  0.14  ...
      ...
    """
    began = time.time()
    from scissorcal.workday.runs.bench import trade_workspace

    if budget is not None:
        options = replace(options, budget_s=seconds_of(budget))
    if recipe is not None and folder is not None:
        raise InputError("--recipe makes another workspace: leave out --workspace.")
    if recipe is not None and show:
        raise InputError("--show reads a workspace: go into the one of --recipe, or leave it out.")
    if show:
        return _stored(open_workspace(folder))
    if recipe is None:
        workspace = open_workspace(folder)
    else:
        workspace = _day(recipe, options.seed)
        began = time.time()
    with progress() as tell:
        found, notes = trade_workspace(workspace, options, processes, tell, began)
    for sentence in notes:
        note(sentence)
    return _answer(found, (workspace.trade_html, workspace.trade_json))


def seconds_of(words: str) -> float:
    """Seconds of a duration in words. Raises InputError where it is none.

    >>> seconds_of("3 min"), seconds_of("1 h 30 min"), seconds_of("90s")
    (180.0, 5400.0, 90.0)
    """
    parts = _DURATION.findall(words)
    seconds = sum(float(number) * _SECONDS[unit] for number, unit in parts)
    if not seconds or _DURATION.sub("", words).strip():
        raise InputError(
            f'--budget {words}: give a time above zero with its unit, such as "3 min" or "90 s".'
        )
    return seconds


def _day(name: str, seed: int) -> "Workspace":
    """The workspace of a built-in recipe with a day on the virtual rig; made where it is not."""
    from scissorcal.recipe.load import recipe_path
    from scissorcal.workday.demo.day import make_day
    from scissorcal.workday.workspace import Workspace, create_workspace, demo_folder

    recipe_path(name)
    folder = Path(f"bench-{name}-{seed}" if seed else f"bench-{name}").absolute()
    workspace = Workspace(folder)
    finished = folder / ".day-finished"
    if finished.is_file():
        return workspace
    workspace = create_workspace(demo_folder(folder), name)
    with progress() as tell:
        make_day(workspace, seed=seed, progress=tell)
    finished.touch()
    return workspace


def _stored(workspace: "Workspace") -> Answer:
    from scissorcal.bench.trade.result import read_trade

    return _answer(read_trade(workspace.trade_json), ())


def _answer(trade: "Trade", files: tuple[Path, ...]) -> Answer:
    from scissorcal.report import panels_text
    from scissorcal.report.trade import trade_panels
    from scissorcal.workday.envelope import plain

    measured, *knobs = trade_panels(trade)
    text = panels_text([*(knob for knob in knobs if knob.rows), measured])
    return Answer({"trade": plain(trade)}, text, files=files)
