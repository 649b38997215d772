"""A plate as drawn: the recipe's tables of its layers, and the pieces on the line of the cut."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import Field, Strict, model_validator

from scissorcal.errors import InputError
from scissorcal.recipe.drawing import Drawing, read_drawing
from scissorcal.recipe.fields import Finite, Range, Thickness_mm
from scissorcal.recipe.plate_surface import PlateSurface, PlateTracking, Touch
from scissorcal.recipe.priors import Section

if TYPE_CHECKING:
    from scissorcal.model.plate_pieces import Layer, LayerPiece, Outline

MOST_PIECES = 16
MOST_STRIPS = 64
"""What the kernel holds: see :mod:`scissorcal.kernel.plate`."""

MOST_CORNERS = 2000
"""Of all outlines that are written in a recipe; a larger drawing is a file."""

SMALLEST_AREA_MM2 = 1e-4

ONE_MATERIAL = (
    "a plate is of one material, the one of [material] that is captured and fitted; of a layer "
    "thickness_mm and toughness_ratio may differ, and another material needs another workspace, "
    "with its captures and fits: remove material"
)

Place_mm = Annotated[float, Field(ge=-100_000, le=100_000, allow_inf_nan=False)]
Corner = Annotated[tuple[Place_mm, Place_mm], Strict(False)]
Corners = Annotated[tuple[Corner, ...], Strict(False), Field(min_length=3, max_length=1000)]
Ratio = Annotated[float, Field(ge=0.01, le=100, allow_inf_nan=False)]
Id = Annotated[str, Field(min_length=1, max_length=100)]
DrawingName = Annotated[str, Field(min_length=1, max_length=255)]


class DrawnPart(Section):
    """An outline: corners in mm, or a shape of an SVG file beside the recipe.

    ``id`` names the shape; it may be left out where the file has one shape only.
    """

    outline_mm: Corners | None = None
    outline: DrawingName | None = None
    id: Id | None = None

    @model_validator(mode="before")
    @classmethod
    def _is_of_the_material(cls, given: Any) -> Any:
        if isinstance(given, dict) and "material" in given:
            raise ValueError(ONE_MATERIAL)
        return given

    @model_validator(mode="after")
    def _outline_is_written_or_drawn(self) -> DrawnPart:
        if self.outline_mm is not None:
            if self.outline is not None or self.id is not None:
                raise ValueError(
                    "outline_mm gives the corners, outline and id a drawing: keep one of them"
                )
            _refuse_no_area("outline_mm", self.outline_mm)
        if self.outline is not None and Path(self.outline).name != self.outline:
            raise ValueError(
                f'outline = "{self.outline}" must be the name of a file beside the recipe, without '
                "folders"
            )
        return self


class PlateRegion(DrawnPart):
    """A tougher or weaker part of a layer.

    ``toughness_ratio`` is against the calibrated material, in place of the layer's own. With
    ``id`` alone its shape is in the layer's drawing.
    """

    toughness_ratio: Ratio

    @model_validator(mode="after")
    def _has_an_outline(self) -> PlateRegion:
        if self.outline_mm is None and self.outline is None and self.id is None:
            raise ValueError(
                'a region needs outline_mm = [[x, y], ...], or id = "..." of a shape in the '
                "layer's drawing"
            )
        return self


class PlateLayer(DrawnPart):
    """One layer of a drawn plate: its outline, thickness and toughness, holes and regions.

    ``toughness_ratio`` is its toughness against the calibrated material's: declared, not measured.
    ``holes_mm`` are corners, ``holes`` the ids of shapes in its drawing.
    """

    name: Annotated[str, Field(pattern=r"^[A-Za-z0-9][A-Za-z0-9 ._-]{0,63}$")]
    thickness_mm: Thickness_mm
    toughness_ratio: Ratio = 1.0
    holes_mm: Annotated[tuple[Corners, ...], Strict(False), Field(max_length=64)] = ()
    holes: Annotated[tuple[Id, ...], Strict(False), Field(max_length=64)] = ()
    regions: Annotated[tuple[PlateRegion, ...], Strict(False), Field(max_length=64)] = ()

    @model_validator(mode="after")
    def _parts_are_there(self) -> PlateLayer:
        if self.outline_mm is None and self.outline is None:
            raise ValueError(
                f'the layer "{self.name}" needs outline_mm = [[x, y], ...] or outline = "plate.svg"'
            )
        inside = [region for region in self.regions if region.outline is None and region.id]
        if self.outline is None and (self.holes or inside):
            raise ValueError(
                "holes and id name shapes of the layer's drawing: give outline, the SVG file"
            )
        for corners in self.holes_mm:
            _refuse_no_area("holes_mm", corners)
        return self

    @property
    def parts(self) -> tuple[DrawnPart, ...]:
        """Everything of it that may stand in a drawing."""
        return (self, *self.regions)


Layers = Annotated[tuple[PlateLayer, ...], Strict(False), Field(max_length=MOST_PIECES)]


class Plate(Section):
    """What the plate is: its layers as drawn, else a uniform sheet of the material; its target.

    ``layers``, in order from below, are cut along the line y = ``cut_line_mm`` of the drawing; x
    runs along the cut from the near edge. What follows matters where the pose is estimated.
    ``place_mm`` is the pattern's upper left corner as printed, in the plate's frame (x along the
    cut from the near edge, y to the left of the cut, z out of the upper face); ``turn_deg`` turns
    its upper edge from x towards y. The pattern faces up.
    """

    place_mm: Range = (0.0, 0.0)
    turn_deg: Finite = 0.0
    surface: PlateSurface = PlateSurface()
    touch: Touch = Touch()
    tracking: PlateTracking = PlateTracking()
    cut_line_mm: Place_mm = 0.0
    layers: Layers = ()

    @property
    def drawings(self) -> tuple[str, ...]:
        """Names of the files beside the recipe in which the plate is drawn, sorted."""
        parts = (part for layer in self.layers for part in layer.parts)
        return tuple(sorted({part.outline for part in parts if part.outline is not None}))


def refuse_impossible_layers(plate: Plate, plate_pose: str, joint: str) -> None:
    """ValueError for layers that the scene cannot have, or that miss the line of the cut.

    Layers that stand in a drawing are judged where it is read (:func:`plate_pieces`).
    """
    layers = plate.layers
    if not layers:
        if plate.cut_line_mm != 0.0:
            raise ValueError("plate.cut_line_mm needs [[plate.layers]], the plate that is drawn")
        return
    names = [layer.name for layer in layers]
    if len(set(names)) != len(names):
        raise ValueError("plate.layers: two layers have one name; give each its own")
    if plate_pose == "estimated":
        raise ValueError(
            'scene.plate_pose = "estimated" does not go together with plate.layers: a plate that '
            'is tracked is a uniform sheet; set scene.plate_pose = "known"'
        )
    if joint == "linear":
        raise ValueError(
            'plate.layers need blades, and rig.joint = "linear" has none: remove the layers'
        )
    written = [c for one in layers for p in one.parts for c in p.outline_mm or ()]
    written += [corner for one in layers for hole in one.holes_mm for corner in hole]
    if len(written) > MOST_CORNERS:
        raise ValueError(
            f"plate.layers have {len(written)} corners, and a recipe holds {MOST_CORNERS}: draw "
            'them in an SVG file, and name it with outline = "plate.svg"'
        )
    if not plate.drawings:
        _pieces(plate, {})


def drawn_layers(plate: Plate, folder: Path) -> tuple[Layer, ...]:
    """The layers of a plate with all their outlines; none for the uniform sheet.

    ``folder`` is the recipe's, for its drawings. Raises InputError, with the file, where a drawing
    cannot be read, or lacks a shape.
    """
    shapes = {name: read_drawing(folder / name) for name in plate.drawings}
    try:
        return tuple(_layer(layer, shapes) for layer in plate.layers)
    except ValueError as error:
        files = ", ".join(str(folder / name) for name in shapes)
        raise InputError(f"{files}: the plate cannot be drawn: {error}.") from None


def plate_pieces(plate: Plate, folder: Path) -> tuple[LayerPiece, ...]:
    """The pieces of a plate on the line of the cut; none for the uniform sheet.

    ``folder`` is the recipe's, for its drawings. Raises InputError, with the file, where a drawing
    cannot be read, or the layers make no plate that can be cut.
    """
    if not plate.layers:
        return ()
    shapes = {name: read_drawing(folder / name) for name in plate.drawings}
    try:
        return _pieces(plate, shapes)
    except ValueError as error:
        files = ", ".join(str(folder / name) for name in shapes)
        raise InputError(f"{files}: the plate cannot be cut: {error}.") from None


def plate_sentence(
    plate: Plate, material: str, thickness_mm: float, pieces: tuple[LayerPiece, ...]
) -> str:
    """What the plate on the line of the cut is, and what of it is measured, in words.

    ``material`` and ``thickness_mm`` are the captured sheet's. Empty for the uniform sheet.
    """
    if not pieces:
        return ""
    layers, strips = plate.layers, [s for piece in pieces for s in piece.strips]
    ratios = sorted({strip.toughness_ratio for strip in strips})
    thick = sorted({piece.thickness_m * 1e3 for piece in pieces})
    gaps = len(pieces) - len(layers)
    sentence = (
        f"The plate is drawn: {_counted(len(layers), 'layer')} and, on the line of the cut, "
        f"{_counted(len(pieces), 'piece')} with {_counted(gaps, 'gap')} within layers, from "
        f"{min(piece.begin_m for piece in pieces) * 1e3:.4g} to "
        f"{max(piece.end_m for piece in pieces) * 1e3:.4g} mm. Captured and fitted is a uniform "
        f"sheet of {material}, {thickness_mm:g} mm thick; the whole "
        "plate is taken to be of that one material."
    )
    if thick != [thickness_mm]:
        sentence += (
            f" Layers of {', '.join(f'{one:g}' for one in thick)} mm rest on an assumption: "
            "response and fracture energy proportional to the thickness."
        )
    if ratios != [1.0]:
        sentence += (
            f" Toughness ratios of {', '.join(f'{one:g}' for one in ratios)} are declared in the "
            "recipe, not measured."
        )
    return sentence


def _pieces(plate: Plate, shapes: dict[str, Drawing]) -> tuple[LayerPiece, ...]:
    from scissorcal.model.plate_pieces import SMALLEST_M, layer_pieces

    layers = [_layer(layer, shapes) for layer in plate.layers]
    pieces = layer_pieces(layers, plate.cut_line_mm * 1e-3)
    first = min(pieces, key=lambda piece: piece.begin_m)
    if first.begin_m < -SMALLEST_M:
        raise ValueError(
            f'the layer "{first.layer}" begins at x = {first.begin_m * 1e3:.4g} mm; x = 0 is where '
            "the cut begins, so move the drawing to x of 0 and more"
        )
    strips = sum(len(piece.strips) for piece in pieces)
    if len(pieces) > MOST_PIECES or strips > MOST_STRIPS:
        raise ValueError(
            f"on the line of the cut there are {len(pieces)} pieces with {strips} stretches of "
            f"toughness, and a plate holds {MOST_PIECES} and {MOST_STRIPS}: draw fewer holes and "
            "regions"
        )
    return pieces


def _layer(layer: PlateLayer, shapes: dict[str, Drawing]) -> Layer:
    from scissorcal.model.plate_pieces import Layer, Region

    holes = [_written(corners) for corners in layer.holes_mm]
    holes += [_drawn(layer.outline, name, shapes) for name in layer.holes]
    regions = tuple(
        Region(_outline(region, layer.outline, shapes), region.toughness_ratio)
        for region in layer.regions
    )
    outline = _outline(layer, layer.outline, shapes)
    return Layer(
        layer.name, layer.thickness_mm * 1e-3, layer.toughness_ratio, outline, tuple(holes), regions
    )


def _outline(part: DrawnPart, drawing: str | None, shapes: dict[str, Drawing]) -> Outline:
    if part.outline_mm is not None:
        return _written(part.outline_mm)
    return _drawn(part.outline or drawing, part.id, shapes)


def _written(corners: Any) -> Outline:
    import numpy as np

    from scissorcal.model.plate_pieces import Outline

    return Outline((1e-3 * np.array(corners, dtype=np.float64),))


def _drawn(drawing: str | None, name: str | None, shapes: dict[str, Drawing]) -> Outline:
    """A shape of a drawing that was read; ValueError where it is not there, or has no area."""
    assert drawing is not None
    outline: Outline = shapes[drawing].shape(name)
    if outline.area_m2 < SMALLEST_AREA_MM2 * 1e-6:
        raise ValueError(f'{drawing}: the shape "{name or "without id"}" has no area')
    return outline


def _refuse_no_area(key: str, corners: Any) -> None:
    twice = sum(
        a[0] * b[1] - b[0] * a[1] for a, b in zip(corners, (*corners[1:], corners[0]), strict=True)
    )
    if abs(twice) < 2.0 * SMALLEST_AREA_MM2:
        raise ValueError(f"{key}: these corners enclose no area; give them in order along the edge")


def _counted(count: int, word: str) -> str:
    return f"{count} {word}" + ("" if count == 1 else "s")
