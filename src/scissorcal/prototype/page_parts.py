"""Parts of what a page is told: rows of tables, sliders, draws, bands, strokes, hands, layers."""

import base64
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike
from pydantic import BaseModel, ConfigDict

from scissorcal.model.plate_pieces import Layer, Outline

DECIMALS = 4
"""Of a place in mm: as the page reads outlines of a file."""

Contours = tuple[tuple[tuple[float, float], ...], ...]
"""Closed contours; inside is what lies within an odd number of them."""


class Part(BaseModel):
    """Base of everything that a page is told: frozen, and without numbers that JSON lacks."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class Numbers(Part):
    """An array of float32, little-endian, row by row."""

    shape: tuple[int, ...]
    base64: str

    @classmethod
    def of(cls, values: ArrayLike) -> "Numbers":
        """Pack an array; ValueError where a number is not finite in float32.

        >>> Numbers.of([1.0, 2.0])
        Numbers(shape=(2,), base64='AACAPwAAAEA=')
        """
        array = np.asarray(values, dtype="<f4")
        if not np.isfinite(array).all():
            raise ValueError("a page shows finite numbers only")
        return cls(shape=array.shape, base64=base64.b64encode(array.tobytes()).decode())


class Rows(Part):
    """Tables at n sets of parameters: by table (n, 2, knots), values and slopes; numbers (n,).

    ``tables`` of "mean_energy" are (n, 1, knots). A table that none of the sets changes is left
    out.
    """

    tables: dict[str, Numbers]
    fracture_energy: Numbers
    kappa: Numbers
    rate_damping: Numbers


class Slider(Part):
    """One parameter: SI values; times ``scale`` they are in ``unit``.

    ``nodes`` are its values at which ``rows`` were evaluated, the others as fitted; ``column`` is
    its place among the values of a draw.
    """

    name: str
    column: int
    meaning: str
    unit: str
    scale: float
    value: float
    sd: float
    q05: float
    q95: float
    nodes: Numbers
    rows: Rows


class Draws(Part):
    """Draws of the posterior: values (draws, sliders) in SI, and the law at each."""

    values: Numbers
    rows: Rows


class Band(Part):
    """The 90 % interval of the torque (N m) on a grid (openings, contacts), for one direction.

    ``rate`` is the opening rate in rad/s at which it was evaluated, below 0 where closing. Without
    ``friction`` it is of the material alone, as a measured stroke is.
    """

    rate: float
    friction: bool
    opening: Numbers
    contact: Numbers
    low: Numbers
    high: Numbers


class Stroke(Part):
    """A measured stroke (n,): opening in rad, contact in m, torque of the material in N m.

    The fit has taken the rig's friction off, and has averaged over pieces of the path.
    """

    recording: str
    kind: str
    opening: Numbers
    contact: Numbers
    torque: Numbers


class State(Part):
    """What is to be known of a package: a label of one or two words, and the sentence behind it."""

    label: str
    sentence: str


class PosePart(Part):
    """Where the plate stands, in the rig's frame."""

    position_m: tuple[float, float, float]
    rotation_vector_rad: tuple[float, float, float]


class Hand(Part):
    """A recorded hand to replay (n,): time in s from 0, opening in rad, advance in m."""

    name: str
    time: Numbers
    opening: Numbers
    advance: Numbers


class RegionPart(Part):
    """A part of a layer with another toughness."""

    toughness_ratio: float
    outline: Contours


class LayerPart(Part):
    """One layer; ``holes`` are taken off its ``outline``."""

    name: str
    thickness_mm: float
    toughness_ratio: float
    outline: Contours
    holes: tuple[Contours, ...]
    regions: tuple[RegionPart, ...]


class LayersPart(Part):
    """All layers of a plate, and where its line of the cut is."""

    cut_line_mm: float
    layers: tuple[LayerPart, ...]


def layers_part(cut_line_mm: float, layers: Sequence[Layer]) -> LayersPart:
    """What the page is told of a plate whose outlines its recipe does not hold itself.

    >>> layer = Layer("sheet", 1e-4, 1.0, Outline((np.array([[0, 0], [0.08, 0], [0, 0.02]]),)))
    >>> layers_part(5.0, [layer]).layers[0].outline
    (((0.0, 0.0), (80.0, 0.0), (0.0, 20.0)),)
    """
    return LayersPart(cut_line_mm=cut_line_mm, layers=tuple(_layer_part(layer) for layer in layers))


def _layer_part(layer: Layer) -> LayerPart:
    return LayerPart(
        name=layer.name,
        thickness_mm=round(1e3 * layer.thickness_m, 9),
        toughness_ratio=layer.toughness_ratio,
        outline=_contours(layer.outline),
        holes=tuple(_contours(hole) for hole in layer.holes),
        regions=tuple(
            RegionPart(toughness_ratio=region.toughness_ratio, outline=_contours(region.outline))
            for region in layer.regions
        ),
    )


def _contours(outline: Outline) -> Contours:
    return tuple(
        tuple((x, y) for x, y in np.round(1e3 * contour, DECIMALS).tolist())
        for contour in outline.contours
    )
