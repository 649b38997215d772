"""A drawn plate: its pieces on the line of the cut, and what of them was measured."""

from __future__ import annotations

from typing import TYPE_CHECKING

from scissorcal.recipe.plate_layers import plate_sentence
from scissorcal.report.panel import Axis, Chart, Look, Panel, Row, Series, curve, number, words

if TYPE_CHECKING:
    from scissorcal.model.plate_pieces import LayerPiece
    from scissorcal.recipe.schema import Recipe

ID, PART, TITLE = "scene-plate", "scene", "The plate as drawn"
LOOKS: tuple[Look, ...] = ("blue", "vermillion", "green", "purple", "orange", "ink")


def layers_panel(recipe: Recipe, pieces: tuple[LayerPiece, ...]) -> Panel:
    """Piece by piece, in a table and in a picture of the line of the cut."""
    return Panel(
        ID,
        PART,
        TITLE,
        plate_sentence(recipe.plate, recipe.material.name, recipe.material.thickness_mm, pieces),
        tuple(_row(index, piece) for index, piece in enumerate(pieces, 1)),
        (_chart(pieces),),
        notes=(
            "Fits, trust checks, torque and band of this report are those of the uniform sheet; "
            "no trust check covers the plate.",
        ),
        caption="A piece is a stretch of one layer without a gap; x = 0 is where the cut begins.",
    )


def _row(index: int, piece: LayerPiece) -> Row:
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


def _chart(pieces: tuple[LayerPiece, ...]) -> Chart:
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
