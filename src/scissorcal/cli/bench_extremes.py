"""``scissorcal bench extremes``"""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from scissorcal.cli.bench_trade import seconds_of
from scissorcal.cli.options import Seed
from scissorcal.cli.output import Answer, command, table
from scissorcal.cli.progress import progress
from scissorcal.cli.verify import Cluster, Workers
from scissorcal.errors import InputError

if TYPE_CHECKING:
    from scissorcal.bench.extremes.result import CellRow, Total

Budget = Annotated[
    str | None,
    typer.Option(metavar="TIME", help='Time for the whole run, such as "3 min" or "90 s".'),
]
Size = Annotated[
    float,
    typer.Option(min=0.01, max=100.0, help="Number of states, as a multiple of the usual one."),
]
Output = Annotated[
    Path | None,
    typer.Option("--output", "-o", help="Folder for extremes.html and .json; bench if not given."),
]


@command
def extremes(
    budget: Budget = None,
    size: Size = 1.0,
    output: Output = None,
    workers: Workers = None,
    cluster: Cluster = None,
    seed: Seed = 0,
) -> Answer:
    """Try every quantity from the everyday to the absurd, and compare with 50 digits.

    The float64 model and the float32 kernel are compared with an independent reference, one
    quantity at a time, in pairs, and at random in all; energy is balanced over long runs; invalid
    inputs must be refused in a sentence. Needs no workspace. A number that is neither right to its
    stated error nor refused fails the run (exit code 3). Writes extremes.html and extremes.json.

    A full run tries 3,480 states and 203 cells, and takes about 3 minutes on 2 cores. The same seed
    and size try the same states. A run with a budget tries some of everything; a run below a tenth
    of the usual size leaves slow cells out. What was left out is named.

    \b
    Example:
      $ scissorcal bench extremes --size 0.02
      160 of 160 states and 178 of 203 cells were tried: of 658 answers 455 are right to their
      stated error, 158 refused in a sentence, 38 marked as not to be used, 7 not compared, and 0
      wrong.
      ...
    """
    from scissorcal.bench.extremes.study import Extent
    from scissorcal.workday.runs.bench_extremes import run_extremes

    if workers is not None and cluster is not None:
        raise InputError("Give --workers or --cluster, not both: a cluster brings its workers.")
    with progress() as tell:
        found = run_extremes(
            Extent.of_size(size),
            output or Path("bench"),
            seed=seed,
            budget_s=None if budget is None else seconds_of(budget),
            workers=workers,
            cluster=cluster,
            progress=tell,
        )
    result = found.result
    totals = [total for total in result.totals if total.states]
    parts = [result.sentence, _totals(totals), _cells(result.cells)]
    parts += [f"wrong: {one.subject}: {one.sentence}" for one in result.wrong[:5]]
    facts = {
        "sentence": result.sentence,
        "states": result.states,
        "planned": result.planned,
        "seed": result.seed,
        "totals": result.totals,
        "cells": result.cells,
        "left_out": result.left_out,
        "wrong": result.wrong,
    }
    return Answer(facts, "\n\n".join(parts), result.verdicts, (found.html, found.json))


def _totals(totals: "list[Total]") -> str:
    from scissorcal.bench.extremes.result import OUTCOMES

    rows = [["", "states", *OUTCOMES, "torque, median", "largest"]]
    for total in totals:
        torque = next((one for one in total.largest if one.output == "torque"), None)
        rows.append(
            [
                f"{total.subject}, {total.band}",
                *(str(value) for value in (total.states, *total.outcomes.values())),
                "-" if total.median_relative is None else f"{total.median_relative:.1e}",
                "-" if torque is None else f"{torque.relative:.1e}",
            ]
        )
    return table(rows, right=range(1, 9))


def _cells(cells: "tuple[CellRow, ...]") -> str:
    rows = [["cell", "found", "error", "stated"]]
    for cell in cells:
        numbers = [cell.error, cell.allowed]
        rows.append([cell.name, cell.outcome, *("-" if n is None else f"{n:.1e}" for n in numbers)])
    return table(rows, right=(2, 3))
