"""The tables and pictures of docs/extremes.md, from the twin of a run of `bench extremes`.

``python -m benchmarks.draw_extremes bench/extremes.json`` writes the marked tables of the page and
docs/pictures/extremes-*.svg. tests/bench/extremes/test_page.py holds the tables to a small run.
"""

import sys
from pathlib import Path

from pydantic import TypeAdapter

from scissorcal.bench.extremes.result import Extremes
from scissorcal.report.extremes import docs_tables, map_chart, sweep_chart
from scissorcal.report.trade import standalone_svg

DOCS = Path(__file__).parents[1] / "docs"
PAGE = DOCS / "extremes.md"
PICTURES = DOCS / "pictures"
SWEEPS = ("indentation", "thickness", "opening", "table_size")
MAPS = (("kernel", "thickness", "indentation"), ("model", "opening", "curvature"))


def draw(twin: Path) -> None:
    """Write tables and pictures from a run's twin."""
    result: Extremes = TypeAdapter(Extremes).validate_json(twin.read_bytes())
    text = PAGE.read_text(encoding="utf-8")
    for name, table in docs_tables(result).items():
        head, mark, rest = text.partition(f"<!-- {name} -->\n")
        _, end, tail = rest.partition(f"<!-- end of {name} -->")
        if not (mark and end):
            raise ValueError(f"{PAGE} has no place for {name}")
        text = f"{head}{mark}{table}\n{end}{tail}"
    PAGE.write_text(text, encoding="utf-8")
    for sweep in result.sweeps:
        if sweep.quantity in SWEEPS:
            path = PICTURES / f"extremes-{sweep.quantity}.svg"
            path.write_text(standalone_svg(sweep_chart(sweep)), encoding="utf-8")
    for found in result.maps:
        if (found.subject, found.first, found.second) in MAPS:
            path = PICTURES / f"extremes-{found.subject}-{found.first}.svg"
            path.write_text(standalone_svg(map_chart(found)), encoding="utf-8")


if __name__ == "__main__":
    draw(Path(sys.argv[1]))
