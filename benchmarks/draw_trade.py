"""The section of docs/trade.md on a recipe: a run of `bench trade`, drawn and told.

``python -m benchmarks.draw_trade --measure FOLDER --budget "5 min"`` makes or continues in FOLDER a
day of the virtual rig for the recipe of the page, runs `scissorcal bench trade` on it, then writes
the marked section of the page and docs/pictures/trade-*.svg. Without ``--measure``:
``python -m benchmarks.draw_trade WORKSPACE...`` tells and draws what was measured in workspaces.
Figures of the page come from the runs' JSON twins alone.
"""

import argparse
import subprocess
import sys
import textwrap
from collections.abc import Sequence
from pathlib import Path

from scissorcal.bench.trade.point import Curve
from scissorcal.bench.trade.result import Trade, read_trade
from scissorcal.errors import InputError
from scissorcal.report.trade import standalone_svg, trade_chart
from scissorcal.workday.workspace import Workspace

DOCS = Path(__file__).parents[1] / "docs"
RECIPES = ("paper-80gsm",)
MARK = "TRADE_RECIPES"
SEED = 9310
WIDTH = 128


def main(arguments: Sequence[str] | None = None) -> None:
    """Measure where asked to, then write the pictures and the marked section of the page."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("workspaces", nargs="*", type=Path)
    parser.add_argument("--measure", type=Path, metavar="FOLDER")
    parser.add_argument("--budget", default="5 min", help="for each recipe, its day not counted")
    parser.add_argument("--docs", type=Path, default=DOCS)
    chosen = parser.parse_args(arguments)
    workspaces = chosen.workspaces
    if chosen.measure:
        workspaces = [measured(chosen.measure, name, chosen.budget) for name in RECIPES]
    draw([read_trade(Workspace(folder).trade_json) for folder in workspaces], chosen.docs)


def measured(folder: Path, recipe: str, budget: str) -> Path:
    """Run `scissorcal bench trade` on a recipe's day in ``folder``; its workspace."""
    folder.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, "-m", "scissorcal", "bench", "trade", "--recipe", recipe]
    subprocess.run([*command, "--budget", budget, "--seed", str(SEED)], cwd=folder, check=True)
    return folder / f"bench-{recipe}-{SEED}"


def draw(trades: Sequence[Trade], docs: Path = DOCS) -> None:
    """Write a picture for each knob with a diagram, and the marked section of docs/trade.md.

    Pictures of other runs are removed. InputError where there is no run, or the page has no place.
    """
    page = docs / "trade.md"
    head, begin, rest = page.read_text(encoding="utf-8").partition(f"<!-- {MARK} -->\n")
    _, end, tail = rest.partition(f"<!-- end of {MARK} -->")
    if not (trades and begin and end):
        raise InputError(f"There is no run to tell of, or {page} has no place called {MARK}.")
    for old in (docs / "pictures").glob("trade-*.svg"):
        old.unlink()
    for trade in trades:
        for curve in curves_of(trade):
            chart = trade_chart(curve, trade)
            if chart is not None:
                path = docs / "pictures" / picture_of(curve, trade)
                path.write_text(standalone_svg(chart), encoding="utf-8")
    section = "\n".join(section_of(trade) for trade in trades)
    page.write_text(f"{head}{begin}\n{section}\n{end}{tail}", encoding="utf-8")


def section_of(trade: Trade) -> str:
    """What a run found, as a section of the page: how it was made, diagrams, sentences."""
    budget = "" if trade.budget_s is None else f" of {trade.budget_s:.0f} s allowed"
    made = (
        f"{trade.material[0].upper()}{trade.material[1:]}. {trade.measured} measurements, "
        f"{trade.measured_now} of them by the last run in {trade.seconds:.0f} s{budget}, "
        f"{trade.workers} at a time; baseline step {trade.baseline.median:.3g} ms; limit of one "
        f"knob {100.0 * trade.limit:.2g} %. Made {trade.created:%Y-%m-%d}."
    )
    pictures = [
        f"![{trade.recipe_name}, {curve.title}: error over cost](pictures/"
        f"{picture_of(curve, trade)})"
        for curve in curves_of(trade)
        if trade_chart(curve, trade) is not None
    ]
    told = [*trade.sentences]
    told += [
        f"{curve.title}: not measured within the budget: {'; '.join(curve.unmeasured)}."
        for curve in trade.curves
        if curve.unmeasured
    ]
    told += trade.notes
    return "\n".join(
        [f"### {trade.recipe_name}", "", wrapped(made), "", *pictures, ""]
        + [wrapped(sentence, "- ") for sentence in told]
        + [""]
    )


def curves_of(trade: Trade) -> tuple[Curve, ...]:
    """All knobs, and all recommended settings at once."""
    return (*trade.curves, *([trade.together] if trade.together else []))


def picture_of(curve: Curve, trade: Trade) -> str:
    """Name of a picture's file."""
    return f"trade-{trade.recipe_name}-{curve.knob}.svg"


def wrapped(sentence: str, bullet: str = "") -> str:
    """A sentence in lines of the page's width."""
    return textwrap.fill(
        sentence,
        WIDTH,
        initial_indent=bullet,
        subsequent_indent=" " * len(bullet),
        break_long_words=False,
        break_on_hyphens=False,
    )


if __name__ == "__main__":
    main()
