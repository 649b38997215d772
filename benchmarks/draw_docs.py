"""Draw the drawings of the documentation as SVG: scissors, strokes, laws, data flow, builds.

    python -m benchmarks.draw_docs [--out docs/pictures]

Angles, lengths and torques come from scissorcal.model, so that a drawing shows what the code
computes. The same code gives the same bytes; tests/test_docs.py compares them.
"""

import argparse
from collections.abc import Callable
from functools import partial
from pathlib import Path

from benchmarks.drawings import build_wiring, builds
from benchmarks.drawings.canvas import Drawing
from benchmarks.drawings.diagrams import dataflow, loop
from benchmarks.drawings.good_data import camera_places, speeds, strokes
from benchmarks.drawings.laws import friction_law, likelihood, priors, response_laws
from benchmarks.drawings.scissors import geometry
from benchmarks.drawings.stroke import stroke

PICTURES: dict[str, Callable[[], Drawing]] = {
    "scissors": geometry,
    "stroke": stroke,
    "dataflow": dataflow,
    "loop": loop,
    "good-strokes": strokes,
    "good-speeds": speeds,
    "camera-places": camera_places,
    "friction-law": friction_law,
    "response-laws": response_laws,
    "likelihood": likelihood,
    "priors": priors,
    "build-course-mechanics": partial(builds.mechanics, builds.COURSE),
    "build-course-wiring": partial(builds.wiring, build_wiring.COURSE),
    "build-lab-mechanics": partial(builds.mechanics, builds.LAB),
    "build-lab-wiring": partial(builds.wiring, build_wiring.LAB),
    "build-best-mechanics": partial(builds.mechanics, builds.BEST),
    "build-best-wiring": partial(builds.wiring, build_wiring.BEST),
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
