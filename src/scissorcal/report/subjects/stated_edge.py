"""The edge that a recipe states by points: the points, and the curve that follows them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from scissorcal.recipe.edge import edge_sentence, stated_curve
from scissorcal.report.panel import Axis, Chart, Panel, Row, count, curve, number, points, words

if TYPE_CHECKING:
    from scissorcal.recipe.schema import Recipe

ID, PART, TITLE = "scene-edge", "scene", "The edge of the recipe"
STATIONS = 301
CAPTIONS = {
    "recipe": "The points of the recipe, and the curve that model, fits and package use.",
    "photographs": (
        "The points of the recipe, and the curve that plans the captures; model, fits and package "
        "use the edge of the photographs."
    ),
}
"""By the source of the edge."""


def stated_edge_panel(recipe: Recipe) -> Panel:
    """Family, number of points and misfit, and a picture of both."""
    stated = stated_curve(recipe.rig.edge)
    given = np.array(recipe.rig.edge.points_mm)
    edge = stated.edge
    station = np.linspace(min(edge.spline_start_m, 0.0), edge.length_m, STATIONS)
    row = Row(
        "edge",
        (
            words("family", recipe.rig.edge.family),
            count("points", len(given)),
            count("cubics", stated.pieces),
            number("largest misfit", 1e6 * stated.misfit_m, "um", digits=2),
            number("length", 1e3 * edge.length_m, "mm", digits=4),
            number("sd of the offset", recipe.rig.edge.offset_sd_mm, "mm"),
            number("sd of the taper", recipe.rig.edge.taper_sd_deg, "deg"),
        ),
    )
    chart = Chart(
        "scene-edge-curve",
        "Edge by points",
        Axis("s, from the pivot", "mm"),
        Axis("e(s), from the centreline", "mm"),
        (
            curve("edge", 1e3 * station, 1e3 * edge.offset_at(station), "blue"),
            points("points of the recipe", given[:, 0], given[:, 1], "ink"),
        ),
        CAPTIONS[recipe.rig.edge.source],
    )
    said = edge_sentence(recipe.rig.edge, recipe.rig.joint)
    return Panel(ID, PART, TITLE, said, (row,), (chart,))
