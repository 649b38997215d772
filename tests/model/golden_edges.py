"""Golden vectors of edges through points: Python and TypeScript are both held to them.

``python -m tests.model.golden_edges`` writes them anew. What is wanted is not from the code that is
tested: a parabola is its own closed form; any other curve is solved here from scipy's B-splines and
the equations of the residuals, and stays within the stated misfit of the closed form it samples.
"""

import json
from collections.abc import Callable
from operator import itemgetter
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import BSpline

from scissorcal.aliases import Array

FILE = Path(__file__).parents[1] / "golden" / "edges.json"
MOST_PIECES, WANTED_M, LARGEST_M, SMOOTHING = 16, 5e-6, 2e-5, 1e-3
PLACES = 41

Law = Callable[[Array], Array]


def parabola(offset: float, rise: float, curvature: float) -> Law:
    return lambda s: offset + rise * s + 0.5 * curvature * s**2


def wave(height: float, length: float, rise: float = 0.03) -> Law:
    return lambda s: -0.008 + rise * s + height * np.sin(2.0 * np.pi * s / length)


def solved(points: Array, pieces: int) -> tuple[Array, Array]:
    """Uniform knots (from three before the first station) and weights of least squares."""
    start, end = points[0, 0], points[-1, 0]
    width = (end - start) / pieces
    knots = start + width * np.arange(-3, pieces + 4)
    count = pieces + 3
    inner = np.clip(points[:, 0], knots[3], np.nextafter(knots[-4], start))
    design = BSpline.design_matrix(inner, knots, 3).toarray()
    rows = np.vstack([design, SMOOTHING * np.diff(np.eye(count), n=3, axis=0)])
    wanted = np.concatenate([points[:, 1], np.zeros(len(rows) - len(points))])
    system = np.block(
        [[np.eye(len(rows)), rows], [rows.T, np.zeros((count, count))]]
    )  # residuals and weights together
    found = np.linalg.solve(system, np.concatenate([wanted, np.zeros(count)]))
    return knots, found[len(rows) :]


def curve(points: Array, at: Array) -> dict[str, Any]:
    start, end = points[0, 0], points[-1, 0]
    found = []
    for pieces in range(1, min(MOST_PIECES, max(1, len(points) - 3)) + 1):
        spline = BSpline(*solved(points, pieces), 3)
        misfit = float(np.max(np.abs(spline(points[:, 0]) - points[:, 1])))
        found.append((misfit, pieces, spline))
    enough = [one for one in found if one[0] <= WANTED_M]
    misfit, pieces, spline = enough[0] if enough else min(found, key=itemgetter(0))
    assert misfit <= LARGEST_M, "no golden curve is refused"
    inside = np.clip(at, start, end)
    tilt = spline.derivative()(inside)
    offset = spline(inside) + tilt * (at - inside)  # straight on beyond both ends
    return {"pieces": pieces, "offset_m": offset.tolist(), "slope": tilt.tolist()}


def case(title: str, stations: Any, law: Law, exact: bool = False) -> dict[str, Any]:
    """``exact``: the law itself is wanted, from the first station to the last."""
    station = np.asarray(stations, dtype=np.float64)
    points = np.stack([station, law(station)], axis=1)
    start, end = station[0], station[-1]
    at = np.linspace(start, end, PLACES)
    if exact:
        step = 1e-6
        slope = (law(at + step) - law(at - step)) / (2.0 * step)  # exact for a parabola
        found = {"pieces": 1, "offset_m": law(at).tolist(), "slope": slope.tolist()}
    else:
        at = np.concatenate([at, [start - 0.004, end + 0.006]])
        found = curve(points, at)
        assert np.max(np.abs(np.array(found["offset_m"][:PLACES]) - law(at[:PLACES]))) < 5e-5, title
    return {"title": title, "points_m": points.tolist(), "at_m": at.tolist(), **found}


def curves() -> list[dict[str, Any]]:
    even = np.linspace(0.0, 0.075, 30)
    clustered = np.unique(np.concatenate([[0.0, 0.075], 0.03 + 1e-4 * np.arange(12), even[::6]]))
    straight = parabola(-0.008, 0.035, 0.0)
    return [
        case("a line from three points", [0.0, 0.03, 0.075], straight, exact=True),
        case("a line from 200 points", np.linspace(0, 0.075, 200), straight, exact=True),
        case("a parabola", even, parabola(-0.008, 0.02, 1.5), exact=True),
        case("a hollow parabola from before the pivot", np.linspace(-0.01, 0.05, 7),
             parabola(-0.005, 0.1, -2.0), exact=True),
        case("a parabola from clustered stations", clustered, parabola(-0.008, 0.02, 1.5), True),
        case("a long blade, bent", np.linspace(0, 0.5, 25), parabola(-0.02, 0.1, 0.3), exact=True),
        case("a shallow wave", even, wave(0.0004, 0.06)),
        case("a wave of some pieces", np.linspace(0.0, 0.075, 60), wave(0.0005, 0.04)),
        case("a wave from clustered stations", np.sort(np.concatenate([even, clustered + 3e-5])),
             wave(0.0004, 0.06)),
        case("a wave from before the pivot", np.linspace(-0.006, 0.08, 45), wave(0.0003, 0.05)),
        case("as many pieces as there may be", np.linspace(0, 0.12, 200), wave(0.0003, 0.028)),
    ]  # fmt: skip


def refusals() -> list[dict[str, Any]]:
    zigzag = [[float(s), 0.01 * (i % 2)] for i, s in enumerate(np.linspace(0, 0.1, 80))]
    return [
        {"points_m": points, "words": words}
        for points, words in (
            ([[0.0, 0.0], [0.07, 0.0]], "3 to 200"),
            ([[1e-3 * i, 0.0] for i in range(201)], "3 to 200"),
            ([[0.0, 0.0], [0.03, 0.0], [0.03, 0.1]], "rise strictly"),
            ([[0.0, 0.0], [0.05, 0.0], [0.03, 0.1]], "rise strictly"),
            ([[0.01, 0.0], [0.03, 0.0], [0.07, 0.0]], "first station"),
            ([[-0.02, 0.0], [-0.01, 0.0], [0.0, 0.0]], "last above 0"),
            ([[0.0, 0.0], [0.01, 0.1], [0.02, 0.25]], "steeper than 80"),
            (zigzag, "pieces leaves"),
            # few points that many weights would run through, 96 mm away between them
            (
                [
                    [0.0, -8e-3],
                    [1e-3, -7.9e-3],
                    [2e-3, -8e-3],
                    [3e-3, -7.95e-3],
                    [0.07, -5.5e-3],
                    [0.075, -5.4e-3],
                ],
                "3 pieces leaves",
            ),
            ([[0.0, 0.0], [0.01, -0.1], [0.02, -0.25]], "steeper than 80"),
            ([], "3 to 200"),
        )
    ]


def text() -> str:
    vectors = {"format": "scissorcal-golden-edges/1", "cases": curves(), "refused": refusals()}
    found = json.dumps(vectors, allow_nan=False, separators=(",", ":"))
    return found.replace('{"title"', '\n{"title"').replace('{"points_m"', '\n{"points_m"') + "\n"


def golden() -> dict[str, Any]:
    found: dict[str, Any] = json.loads(FILE.read_text(encoding="utf-8"))
    return found


if __name__ == "__main__":
    FILE.write_text(text(), encoding="utf-8")
