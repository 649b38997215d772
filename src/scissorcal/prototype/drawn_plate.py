"""A plate as it was drawn, for the page's designer: outlines in mm."""

from collections.abc import Sequence

import numpy as np

from scissorcal.model.plate_pieces import Layer, Outline
from scissorcal.prototype.arrays import Part

DECIMALS = 4
"""Of a place in mm: as the page reads outlines of a file."""

Contours = tuple[tuple[tuple[float, float], ...], ...]
"""Closed contours; inside is what lies within an odd number of them."""


class DrawnRegion(Part):
    """A part of a layer with another toughness."""

    toughness_ratio: float
    outline: Contours


class DrawnLayer(Part):
    """One layer; ``holes`` are taken off its ``outline``."""

    name: str
    thickness_mm: float
    toughness_ratio: float
    outline: Contours
    holes: tuple[Contours, ...]
    regions: tuple[DrawnRegion, ...]


class DrawnPlate(Part):
    """All layers of a plate, and where its line of the cut is."""

    cut_line_mm: float
    layers: tuple[DrawnLayer, ...]


def drawn_plate(cut_line_mm: float, layers: Sequence[Layer]) -> DrawnPlate:
    """What the page is told of a plate whose outlines its recipe does not hold itself.

    >>> layer = Layer("sheet", 1e-4, 1.0, Outline((np.array([[0, 0], [0.08, 0], [0, 0.02]]),)))
    >>> drawn_plate(5.0, [layer]).layers[0].outline
    (((0.0, 0.0), (80.0, 0.0), (0.0, 20.0)),)
    """
    return DrawnPlate(cut_line_mm=cut_line_mm, layers=tuple(_layer(one) for one in layers))


def _layer(layer: Layer) -> DrawnLayer:
    return DrawnLayer(
        name=layer.name,
        thickness_mm=round(1e3 * layer.thickness_m, 9),
        toughness_ratio=layer.toughness_ratio,
        outline=_contours(layer.outline),
        holes=tuple(_contours(hole) for hole in layer.holes),
        regions=tuple(
            DrawnRegion(toughness_ratio=one.toughness_ratio, outline=_contours(one.outline))
            for one in layer.regions
        ),
    )


def _contours(outline: Outline) -> Contours:
    return tuple(
        tuple((x, y) for x, y in np.round(1e3 * contour, DECIMALS).tolist())
        for contour in outline.contours
    )
