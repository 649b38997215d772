"""A drawn plate in a package: its pieces, from the recipe's layers and the fitted energy."""

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated

from pydantic import Field, Strict

from scissorcal.errors import InputError
from scissorcal.kernel import MOST_PIECES, MOST_STRIPS, Piece, Strip
from scissorcal.recipe.priors import Section

if TYPE_CHECKING:
    from scissorcal.model.plate_pieces import LayerPiece
    from scissorcal.package.exact import ExactModel
    from scissorcal.recipe.schema import Recipe

Finite = Annotated[float, Field(allow_inf_nan=False)]
Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]


class StripRecord(Section):
    """Material of a piece up to ``end_m`` along the cut, and the energy that its cut takes."""

    end_m: Finite
    fracture_energy_J_per_m: NonNegative


class PieceRecord(Section):
    """A stretch of material without a gap: see :mod:`scissorcal.kernel.plate`."""

    begin_m: Finite
    upper_face_m: Positive
    scale: Positive
    strips: Annotated[
        tuple[StripRecord, ...], Strict(False), Field(min_length=1, max_length=MOST_STRIPS)
    ]


Pieces = Annotated[
    tuple[PieceRecord, ...], Strict(False), Field(min_length=1, max_length=MOST_PIECES)
]


def piece_records(
    recipe: "Recipe", pieces: Sequence["LayerPiece"], fracture_energy: float
) -> tuple[PieceRecord, ...] | None:
    """The pieces of a drawn plate, None for the uniform sheet.

    ``pieces`` are those of the recipe's layers (`recipe.plate_layers.plate_pieces`),
    ``fracture_energy`` (J/m) the calibrated sheet's, 0 where nothing is cut. The upper face of a
    layer is half the height of the stack up to its top where both blades move, the whole where one
    does. Response and energy are proportional to a layer's thickness: an assumption, as is each
    declared toughness ratio.
    """
    if not pieces:
        return None
    thickness = recipe.material.thickness_mm * 1e-3
    return tuple(
        PieceRecord(
            begin_m=piece.begin_m,
            upper_face_m=piece.upper_face_m(recipe.rig.moving_blades),
            scale=piece.thickness_m / thickness,
            strips=tuple(
                StripRecord(
                    end_m=strip.end_m,
                    fracture_energy_J_per_m=fracture_energy
                    * piece.thickness_m
                    / thickness
                    * strip.toughness_ratio,
                )
                for strip in piece.strips
            ),
        )
        for piece in pieces
    )


def hardest_layer(model: "ExactModel", recipe: "Recipe") -> "tuple[ExactModel, float]":
    """A sheet as tough and as high as any of a drawn plate, and its torque limit.

    As deep as the blades press that one the tables of the response have to reach.
    """
    layers, cutting = recipe.plate.layers, model.cutting
    ratios = [layer.toughness_ratio for layer in layers]
    ratios += [region.toughness_ratio for layer in layers for region in layer.regions]
    thickness = [layer.thickness_mm / recipe.material.thickness_mm for layer in layers]
    energy = None if cutting.fracture_energy is None else max(ratios) * cutting.fracture_energy
    face = max(1.0, sum(thickness)) * cutting.upper_face_m
    sheet = replace(cutting, fracture_energy=energy, upper_face_m=face)
    return replace(model, cutting=sheet), recipe.limits.torque_Nm / min(1.0, *thickness)


def kernel_pieces(records: Sequence[PieceRecord]) -> tuple[Piece, ...]:
    """What the loop steps. Raises InputError for pieces that no plate has."""
    try:
        return tuple(
            Piece(
                record.begin_m,
                record.upper_face_m,
                record.scale,
                tuple(Strip(strip.end_m, strip.fracture_energy_J_per_m) for strip in record.strips),
            )
            for record in records
        )
    except ValueError as error:
        raise InputError(f"The pieces of the plate cannot be rendered: {error}") from error
