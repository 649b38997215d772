"""Layers on the line of a cut: exact pieces, heights and toughness."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scissorcal.model.plate_pieces import (
    Layer,
    LayerPiece,
    Outline,
    Region,
    layer_pieces,
    spans_on_line,
)
from tests.model import golden_outlines
from tests.model.drawn import assert_pieces, golden_cases, pieces_of


def test_the_golden_vectors_are_those_of_the_closed_forms() -> None:
    stored = golden_outlines.FILE.read_text(encoding="utf-8")
    assert golden_outlines.text() == stored, "run: python -m tests.model.golden_outlines"


@pytest.mark.parametrize("case", golden_cases(), ids=lambda case: case["title"])
def test_golden_outlines_have_their_pieces(case: dict[str, Any]) -> None:
    try:
        found = pieces_of(case["drawn"])
    except ValueError:
        found = None
    assert_pieces(found, case)


def box(begin: float, end: float, low: float = -10.0, high: float = 10.0) -> Outline:
    """A rectangle in mm."""
    return Outline((1e-3 * np.array([[begin, low], [end, low], [end, high], [begin, high]]),))


def sheet(outline: Outline, **more: object) -> Layer:
    return Layer("sheet", 1e-4, 1.0, outline, **more)  # type: ignore[arg-type]


def ends(pieces: tuple[LayerPiece, ...]) -> list[tuple[float, float]]:
    return [(round(one.begin_m * 1e3, 9), round(one.end_m * 1e3, 9)) for one in pieces]


def test_a_hole_parts_a_sheet() -> None:
    found = layer_pieces([sheet(box(0, 80), holes=(box(30, 40),))], 0.0)
    assert ends(found) == [(0.0, 30.0), (40.0, 80.0)]


def test_a_hole_beside_the_line_does_not() -> None:
    found = layer_pieces([sheet(box(0, 80), holes=(box(30, 40, 1, 5),))], 0.0)
    assert ends(found) == [(0.0, 80.0)]


def test_holes_that_overlap_are_one_gap() -> None:
    found = layer_pieces([sheet(box(0, 80), holes=(box(30, 40), box(35, 50)))], 0.0)
    assert ends(found) == [(0.0, 30.0), (50.0, 80.0)]


@pytest.mark.parametrize(("line", "inside"), [(0.0, True), (10.0, False), (-1e-9, False)])
def test_an_edge_on_the_line_belongs_to_what_is_above(line: float, inside: bool) -> None:
    assert bool(spans_on_line(box(0, 80, 0, 10), line * 1e-3)) == inside


def test_plates_that_meet_on_the_line_are_cut_once() -> None:
    above, below = box(0, 80, 0, 10), box(0, 80, -10, 0)
    assert len(spans_on_line(above, 0.0)) + len(spans_on_line(below, 0.0)) == 1


def test_a_line_through_corners() -> None:
    diamond = Outline((1e-3 * np.array([[0, 0], [5, -5], [10, 0], [5, 5]]),))
    assert np.array(spans_on_line(diamond, 0.0)) == pytest.approx(np.array([[0.0, 0.01]]))
    assert spans_on_line(diamond, 5e-3) == ()


def test_neighbours_of_one_layer_merge_and_layers_do_not() -> None:
    two = Outline((*box(0, 10).contours, *box(10, 20).contours))
    assert ends(layer_pieces([sheet(two)], 0.0)) == [(0.0, 20.0)]
    layers = [sheet(box(0, 10)), Layer("next", 1e-4, 1.0, box(10, 20))]
    found = layer_pieces(layers, 0.0)
    assert ends(found) == [(0.0, 10.0), (10.0, 20.0)]
    assert [one.top_m for one in found] == [1e-4, 1e-4]


def test_a_layer_lies_on_the_highest_below_it() -> None:
    layers = [
        sheet(box(0, 80)),
        Layer("patch", 2e-4, 1.0, box(20, 40)),
        Layer("top", 3e-4, 1.0, box(30, 60)),
    ]
    found = layer_pieces(layers, 0.0)
    assert [one.top_m for one in found] == pytest.approx([1e-4, 3e-4, 6e-4])
    assert [one.upper_face_m(2) for one in found] == pytest.approx([5e-5, 1.5e-4, 3e-4])
    assert [one.upper_face_m(1) for one in found] == pytest.approx([1e-4, 3e-4, 6e-4])


def test_regions_are_strips_of_one_piece() -> None:
    regions = (Region(box(50, 60), 2.0), Region(box(60, 65), 2.0), Region(box(70, 90), 0.5))
    (piece,) = layer_pieces([sheet(box(0, 80), regions=regions)], 0.0)
    found = [(round(one.end_m * 1e3, 9), one.toughness_ratio) for one in piece.strips]
    assert found == [(50.0, 1.0), (65.0, 2.0), (70.0, 1.0), (80.0, 0.5)]


def test_regions_that_overlap_on_the_line_are_refused() -> None:
    regions = (Region(box(10, 30), 2.0), Region(box(20, 40), 3.0))
    with pytest.raises(ValueError, match='regions of the layer "sheet" overlap'):
        layer_pieces([sheet(box(0, 80), regions=regions)], 0.0)


def test_a_region_within_another_is_refused() -> None:
    regions = (Region(box(10, 60), 2.0), Region(box(20, 30), 3.0), Region(box(40, 50), 4.0))
    with pytest.raises(ValueError, match="overlap"):
        layer_pieces([sheet(box(0, 80), regions=regions)], 0.0)


def test_a_layer_that_the_line_misses_is_refused() -> None:
    with pytest.raises(ValueError, match='misses the layer "sheet"'):
        layer_pieces([sheet(box(0, 80, 1, 5))], 0.0)


@given(
    holes=st.lists(st.tuples(st.floats(-5, 85), st.floats(0.0, 20.0)), max_size=6),
    regions=st.lists(st.floats(0.1, 10.0), max_size=4),
)
def test_material_is_neither_made_nor_lost(
    holes: list[tuple[float, float]], regions: list[float]
) -> None:
    cut = tuple(box(begin, begin + width + 0.1) for begin, width in holes)
    bands = tuple(Region(box(20 * i, 20 * i + 10), r) for i, r in enumerate(regions))
    try:
        found = layer_pieces([sheet(box(0, 80), holes=cut, regions=bands)], 0.0)
    except ValueError:
        found = ()
    x = np.linspace(0.0005, 79.9995, 4001)
    solid = np.ones(x.shape, dtype=bool)
    for begin, width in holes:
        solid &= ~((x >= begin) & (x <= begin + width + 0.1))
    ours = np.zeros(x.shape, dtype=bool)
    for one in found:
        ours |= (x >= one.begin_m * 1e3) & (x <= one.end_m * 1e3)
        assert one.begin_m < one.strips[0].end_m
        assert np.all(np.diff([strip.end_m for strip in one.strips]) > 0.0)
    near = np.zeros(x.shape, dtype=bool)  # within 0.02 mm of a border either is right
    for begin, width in holes:
        near |= (np.abs(x - begin) < 0.02) | (np.abs(x - begin - width - 0.1) < 0.02)
    assert np.array_equal(ours[~near], solid[~near])
