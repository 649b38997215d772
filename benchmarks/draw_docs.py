"""Draw the four drawings of the documentation as SVG: scissors, stroke, data flow, loop.

    python -m benchmarks.draw_docs [--out docs/pictures]

Angles, lengths and torques come from scissorcal.model, so that a drawing shows what the code
computes. The same code gives the same bytes; tests/test_docs.py compares them.
"""

import argparse
from collections.abc import Callable
from pathlib import Path

from benchmarks.drawings.canvas import Drawing
from benchmarks.drawings.diagrams import dataflow, loop
from benchmarks.drawings.scissors import geometry
from benchmarks.drawings.stroke import stroke

PICTURES: dict[str, Callable[[], Drawing]] = {
    "scissors": geometry,
    "stroke": stroke,
    "dataflow": dataflow,
    "loop": loop,
}


def main() -> None:
    """Write every drawing to the folder."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--out", type=Path, default=Path("docs/pictures"))
    arguments = parser.parse_args()
    arguments.out.mkdir(parents=True, exist_ok=True)
    for name, draw in PICTURES.items():
        (arguments.out / f"{name}.svg").write_text(draw().svg(), encoding="utf-8")


if __name__ == "__main__":
    main()
