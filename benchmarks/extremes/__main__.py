"""Every law and every cell at the extremes; the tables and pictures of docs/extremes.md.

    python -m benchmarks.extremes             # say what is found
    python -m benchmarks.extremes --write     # and write it into docs/
    python -m benchmarks.extremes --size 0.02 --seed 7

A whole run takes some 4 minutes of processor time; ``--size`` multiplies the number of states, and
below a tenth slow cells are left out. Exit code 3 says that something was wrong.
tests/bench/extremes/test_page.py holds the tables to a small run.
"""

import argparse
import math
import sys
from collections import Counter
from pathlib import Path

from benchmarks.extremes.cells import Cell, Found, all_cells, try_cell
from benchmarks.extremes.charts import sweep_chart
from benchmarks.extremes.quantities import QUANTITIES
from benchmarks.extremes.study import Extent, planned, try_state

from scissorcal.bench.extremes.compare import OUTCOMES, Judgement
from scissorcal.bench.extremes.states import State
from scissorcal.report.extremes import map_chart, refusals_panel, totals_panel
from scissorcal.report.numbers import short
from scissorcal.report.panel import Row, panel_text
from scissorcal.report.trade import standalone_svg

DOCS = Path(__file__).parents[2] / "docs"
PAGE = DOCS / "extremes.md"
PICTURES = DOCS / "pictures"
SWEEPS = ("indentation", "thickness", "opening", "table_size")
MAPS = (("kernel", "thickness", "indentation"), ("model", "opening", "curvature"))

Answers = list[tuple[State, Judgement]]
Cells = list[tuple[Cell, Found]]


def run(extent: Extent, seed: int) -> tuple[Answers, Cells]:
    """Try all states and cells of a run."""
    cells = [cell for cell in all_cells() if extent.slow or not cell.slow]
    answers = [(state, a) for state in planned(extent, seed) for a in try_state(state)]
    return answers, [(cell, try_cell(cell, seed)) for cell in cells]


def tables_of(answers: Answers, cells: Cells, seed: int) -> dict[str, str]:
    """The marked tables of docs/extremes.md in Markdown, by the name of their mark."""
    outcomes = [found.outcome for _, found in cells]
    totals, refusals = totals_panel(answers, outcomes), refusals_panel(answers)
    ranges = [
        [_plain(q.name), "" if q.unit == "1" else q.unit, _span(q.everyday), _span(q.extreme),
         q.what]
        for q in QUANTITIES.values()
    ]  # fmt: skip
    states = len({id(state) for state, _ in answers})
    sentence = f"{totals.sentence[0].lower()}{totals.sentence[1:]}"
    return {
        "EXTREMES_SENTENCE": f"{states} states and {len(cells)} cells were tried: {sentence} "
        f"Seed {seed}.",
        "EXTREMES_RANGES": _markdown(
            ["quantity", "unit", "everyday", "extreme", "what it is"], ranges
        ),
        "EXTREMES_TOTALS": _markdown(
            ["", "states", *OUTCOMES, "torque, median relative error", "largest", "roundings"],
            [_total(row) for row in totals.rows],
        ),
        "EXTREMES_CELLS": _markdown(
            ["cell", "what is extreme", "stated", "found", "error"],
            [
                [cell.name, cell.extreme, cell.stated, found.outcome,
                 f"{found.error:.1e}" if math.isfinite(found.error) else ""]
                for cell, found in cells
            ],
        ),
        "EXTREMES_REFUSALS": _markdown(
            ["", "sentence", "states", "where it begins"],
            [
                [row.name.partition(", ")[2], row.note, *(str(v) for v in row.values)]
                for row in refusals.rows
            ],
        ),
    }  # fmt: skip


def write(answers: Answers, cells: Cells, seed: int) -> None:
    """Write tables and pictures into docs/. ValueError where the page has no place for one."""
    text = PAGE.read_text(encoding="utf-8")
    for name, table in tables_of(answers, cells, seed).items():
        head, mark, rest = text.partition(f"<!-- {name} -->\n")
        _, end, tail = rest.partition(f"<!-- end of {name} -->")
        if not (mark and end):
            raise ValueError(f"{PAGE} has no place for {name}")
        text = f"{head}{mark}{table}\n{end}{tail}"
    PAGE.write_text(text, encoding="utf-8")
    for name in SWEEPS:
        drawn = standalone_svg(sweep_chart(name, answers))
        (PICTURES / f"extremes-{name}.svg").write_text(drawn, encoding="utf-8")
    for subject, *pair in MAPS:
        chosen = [a for a in answers if a[1].subject == subject and a[0].swept == tuple(pair)]
        drawn = standalone_svg(map_chart(chosen))
        (PICTURES / f"extremes-{subject}-{pair[0]}.svg").write_text(drawn, encoding="utf-8")


def main(arguments: list[str]) -> int:
    """Run as a program; returns the exit code."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.extremes")
    parser.add_argument("--write", action="store_true")
    parser.add_argument("--size", type=float, default=1.0)
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args(arguments)
    answers, cells = run(Extent.of_size(options.size), options.seed)
    if options.write:
        write(answers, cells, options.seed)
    of = Counter(found.outcome for _, found in cells)
    print(panel_text(totals_panel(answers, [found.outcome for _, found in cells])))
    print(f"{len(cells)} cells: {dict(of)}")
    print("\n".join(f"wrong: {c.name}: {f.sentence}" for c, f in cells if f.outcome == "wrong"))
    wrong = [row for row in refusals_panel(answers).rows if row.marked]
    print("\n".join(f"{row.name}: {row.note}" for row in wrong))
    return 3 if wrong or of["wrong"] else 0


def _total(row: Row) -> list[str]:
    numbers = {value.name: value.number for value in row.values}
    counts = [str(numbers[name]) for name in ("states", *OUTCOMES)]
    errors = [numbers[name] for name in ("torque, median relative", "torque, relative")]
    roundings = numbers["roundings"]
    shown = ["" if error is None else f"{error:.1e}" for error in errors]
    return [row.name, *counts, *shown, "" if roundings is None else f"{roundings:g}"]


def _span(ends: tuple[float, float]) -> str:
    return f"{short(ends[0])} to {short(ends[1])}"


def _plain(name: str) -> str:
    return name.replace("_", " ")


def _markdown(heads: list[str], rows: list[list[str]]) -> str:
    lines = [heads, ["---"] * len(heads), *rows]
    return "\n".join(
        "| " + " | ".join(cell.replace("|", "/") for cell in row) + " |" for row in lines
    )


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
