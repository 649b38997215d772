"""What is stated of a scene beside its fits: a drawn plate, an edge by points, simpler laws."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from scissorcal.calibration.result import FitResult
from scissorcal.package.simplest.record import AspectRecord
from scissorcal.recipe.edge import edge_sentence, stated_curve
from scissorcal.recipe.plate_layers import plate_sentence
from scissorcal.report.numbers import percent
from scissorcal.report.panel import (
    Axis,
    Chart,
    Look,
    Panel,
    Row,
    Series,
    Value,
    count,
    curve,
    number,
    percent_of,
    points,
    words,
)

if TYPE_CHECKING:
    from scissorcal.model.plate_pieces import LayerPiece
    from scissorcal.package.simplest.choice import SceneChoice
    from scissorcal.recipe.schema import Recipe

PART = "scene"
LOOKS: tuple[Look, ...] = ("blue", "vermillion", "green", "purple", "orange", "ink")
STATIONS = 301
CAPTIONS = {
    "recipe": "The points of the recipe, and the curve that model, fits and package use.",
    "photographs": (
        "The points of the recipe, and the curve that plans the captures; model, fits and package "
        "use the edge of the photographs."
    ),
}
"""By the source of the edge."""


def layers_panel(recipe: Recipe, pieces: tuple[LayerPiece, ...]) -> Panel:
    """Piece by piece, in a table and in a picture of the line of the cut."""
    return Panel(
        "scene-plate",
        PART,
        "The plate as drawn",
        plate_sentence(recipe.plate, recipe.material.name, recipe.material.thickness_mm, pieces),
        tuple(_piece_row(index, piece) for index, piece in enumerate(pieces, 1)),
        (_pieces_chart(pieces),),
        notes=(
            "Fits, verifications, torque and band of this report are those of the uniform sheet; "
            "no verification covers the plate.",
        ),
        caption="A piece is a stretch of one layer without a gap; x = 0 is where the cut begins.",
    )


def _piece_row(index: int, piece: LayerPiece) -> Row:
    stretches = [
        f"{strip.toughness_ratio:g} (up to {strip.end_m * 1e3:.4g} mm)" for strip in piece.strips
    ]
    return Row(
        f"piece {index}",
        (
            words("layer", piece.layer),
            number("from", piece.begin_m * 1e3, "mm", digits=4),
            number("to", piece.end_m * 1e3, "mm", digits=4),
            number("thickness", piece.thickness_m * 1e3, "mm"),
            number("height of its top", piece.top_m * 1e3, "mm"),
            words("declared toughness ratio", ", ".join(stretches)),
        ),
    )


def _pieces_chart(pieces: tuple[LayerPiece, ...]) -> Chart:
    ratios = sorted({strip.toughness_ratio for piece in pieces for strip in piece.strips})
    return Chart(
        "scene-plate-line",
        "Pieces on the line of the cut",
        Axis("place along the cut", "mm", low=0.0),
        Axis("height of the top", "mm", low=0.0),
        tuple(_of_ratio(i, ratio, pieces) for i, ratio in enumerate(ratios)),
        "The top of each piece, by its declared toughness against the captured sheet's.",
    )


def _of_ratio(index: int, ratio: float, pieces: tuple[LayerPiece, ...]) -> Series:
    """The tops of all stretches of one toughness, parted by gaps."""
    x, y = [], []
    for piece in pieces:
        begin = piece.begin_m
        for strip in piece.strips:
            if strip.toughness_ratio == ratio:
                x += [begin * 1e3, strip.end_m * 1e3, float("nan")]
                y += [piece.top_m * 1e3, piece.top_m * 1e3, float("nan")]
            begin = strip.end_m
    return curve(f"{ratio:g} times as tough", x[:-1], y[:-1], LOOKS[index % len(LOOKS)])


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
    return Panel("scene-edge", PART, "The edge of the recipe", said, (row,), (chart,))


def simplest_panel(choice: SceneChoice, fits: Sequence[FitResult]) -> Panel:
    """Aspect by aspect: the fitted candidate, the one that is enough, its cost and savings."""
    record = choice.simplification
    rows = tuple(
        _aspect_row(row, choice) for row in record.aspects if row.tried or row.fitted != "none"
    )
    notes = [f"Data, {fit.what}: {fit.selection or fit.candidate}" for fit in fits]
    notes.append(f"Scene: {record.sentence}")
    rest = 1.0 - (record.allowed_share + record.tables_share) / record.tolerance
    notes.append(
        f"The scene's tolerance, {percent(record.tolerance)} of the local torque, is shared: "
        f"{percent(record.allowed_share)} for everything that is left out together, "
        f"{percent(record.tables_share)} for the tables (twice what was found), the rest "
        f"({percent(rest)} of it) for the posterior."
    )
    if record.within_before is not None and record.within_after is not None:
        notes.append(
            f"Posterior band and tables stay within the tolerance at "
            f"{percent(record.within_before)} of the places that can be felt; with what is left "
            f"out, at {percent(record.within_after)}."
        )
    notes.append(
        f"A step of the kernel takes {choice.step_ns_used:.0f} ns with the laws that are used, "
        f"{choice.step_ratio:.2f} of the {choice.step_ns_fitted:.0f} ns of the fitted ones (half "
        f"of the repeats lie within ±{choice.step_spread_ns:.2g} ns), on the computer that worked "
        f"it out. Tables and draws take {record.bytes_after:,} of {record.bytes_before:,} bytes."
    )
    caption = (
        "Costs are differences of the torque to the fitted laws, over the scene, that are not "
        f"exceeded with {percent(record.confidence)} confidence over the posterior; a candidate "
        "that fails at the best point already was judged there alone."
    )
    title = "What the data support, and what the scene needs"
    return Panel(
        "scene-simplest", PART, title, record.sentence, rows, notes=tuple(notes), caption=caption
    )


def _aspect_row(row: AspectRecord, choice: SceneChoice) -> Row:
    judged = row.alone or (row.tried[-1].cost if row.tried else None)
    saved = choice.saving(row.aspect)
    what = "friction" if row.aspect == "friction" else "cut"
    values: list[Value] = [
        words("the data support", row.fitted),
        words("the scene needs", row.used),
        words("judged", row.used if row.omitted else row.tried[-1].name if row.tried else "-"),
    ]
    if judged is not None:
        values += [
            percent_of("worst cost", judged.worst_share),
            percent_of("rms cost", judged.rms_share),
            number("torque", judged.worst_Nm, "N m", digits=2),
            percent_of("confidence", judged.probability),
        ]
    if saved is not None:
        values += [
            count("bytes saved", row.saved_bytes),
            number("step saved", saved.step_ns, "ns", digits=2),
            number("capture saved", saved.capture_s, "s", digits=2),
            count("evaluations of its fit", choice.evaluations.get(what)),
            count("candidates compared", choice.candidates.get(what)),
        ]
    tried = "; ".join(
        f"{candidate.name} {candidate.verdict} ({candidate.cost.words})" for candidate in row.tried
    )
    return Row(row.aspect, tuple(values), note=tried, marked=row.omitted)
