"""The edge over the sheet: places, levers and their derivatives against heights by bisection."""

import math

import numpy as np
import pytest

from scissorcal.calibration.cut.geometry import Geometry
from scissorcal.model import Edge, EdgeBelief
from tests.calibration.truth import Truth

TRUTH = Truth()
LINE = Edge("line", TRUTH.edge_offset, TRUTH.taper, 0.075)
ARC = Edge("arc", TRUTH.edge_offset, TRUTH.taper, 0.075, curvature_per_m=1.2)
NAMES = ("offset_m", "taper_rad")
OPENING = np.linspace(0.25, 0.8, 7)


def geometry(edge=LINE, closure="work", names=NAMES, moving=2) -> Geometry:
    covariance = np.diag([5e-5, 1e-3])[: len(names), : len(names)] ** 2
    return Geometry(EdgeBelief(edge, names, covariance), TRUTH.upper_face, moving, 1.5e-4, closure)


def test_indentation_and_lever_are_those_of_heights_by_bisection():
    contact = np.linspace(0.01, 0.05, 7)
    depth, lever = geometry().depth_and_lever(LINE, OPENING, contact)
    for k in range(7):
        height, slope = TRUTH.height(float(contact[k]), float(OPENING[k]) / 2)
        assert depth[k] == pytest.approx(TRUTH.upper_face - height, abs=1e-12)
        assert lever[k] == pytest.approx(contact[k] + height * slope, rel=1e-9)
        assert geometry().slope(OPENING[k], contact[k]) == pytest.approx(slope, rel=1e-9)


def test_the_published_closure_has_the_lever_of_equation_4():
    contact = np.linspace(0.01, 0.05, 7)
    _, lever = geometry(closure="eq4").depth_and_lever(LINE, OPENING, contact)
    assert lever == pytest.approx(contact * math.cos(TRUTH.taper), rel=1e-12)


@pytest.mark.parametrize("edge", [LINE, ARC], ids=["line", "arc"])
@pytest.mark.parametrize("moving", [1, 2])
def test_a_place_has_the_indentation_that_was_asked_for(edge, moving):
    shape = geometry(edge, moving=moving)
    wanted = np.linspace(0.0, 8e-4, 7)
    place = shape.place(OPENING, wanted)
    depth, _ = shape.depth_and_lever(edge, OPENING, place)
    assert depth == pytest.approx(wanted, abs=1e-13)


@pytest.mark.parametrize("edge", [LINE, ARC], ids=["line", "arc"])
def test_nodes_are_expanded_as_differences_say(edge):
    """Places by 0.1 mm, edges by 20 um and 0.5 mrad: errors are of second order."""
    shape = geometry(edge)
    contact = shape.place(OPENING, 3e-4)
    rate = np.full(7, -0.5)
    nodes = shape.nodes(OPENING, rate, contact)
    moved = 1e-4
    depth, lever = shape.depth_and_lever(edge, OPENING, contact + moved)
    assert nodes.depth + nodes.depth_dx * moved == pytest.approx(depth, abs=3e-8)
    assert nodes.lever + nodes.lever_dx * moved == pytest.approx(lever, abs=1e-7)
    away = np.array([2e-5, 5e-4])
    other = shape.belief.with_values(shape.belief.mean + away)
    depth, lever = shape.depth_and_lever(other, OPENING, contact)
    assert nodes.depth + nodes.depth_de @ away == pytest.approx(depth, abs=2e-8)
    assert nodes.lever + nodes.lever_de @ away == pytest.approx(lever, abs=1e-7)
    later, _ = shape.depth_and_lever(edge, OPENING + 1e-6 * rate, contact)
    sinking = (later - nodes.depth) / 1e-6
    assert nodes.sinking == pytest.approx(sinking, rel=1e-3)


@pytest.mark.parametrize("edge", [LINE, ARC], ids=["line", "arc"])
def test_running_cracks_are_expanded_as_differences_say(edge):
    shape = geometry(edge)
    view = shape.running(OPENING)
    deeper = 1e-5
    place = shape.place(OPENING, shape.reference_m + deeper)
    _, lever = shape.depth_and_lever(edge, OPENING, place)
    assert view.lever + view.lever_dd * deeper == pytest.approx(lever, abs=1e-7)
    slope = shape.slope(OPENING, place)
    assert view.slope + view.slope_dd * deeper == pytest.approx(slope, abs=1e-6)
    away = np.array([2e-5, 5e-4])
    other = shape.belief.with_values(shape.belief.mean + away)
    place = shape.place(OPENING, shape.reference_m, other)
    assert view.place + view.place_de @ away == pytest.approx(place, abs=2e-6)
    _, lever = shape.depth_and_lever(other, OPENING, place)
    assert view.lever + view.lever_de @ away == pytest.approx(lever, abs=2e-6)


def test_a_belief_without_parameters_has_no_derivatives():
    nodes = geometry(names=()).nodes(OPENING, np.zeros(7), np.full(7, 0.03))
    assert nodes.depth_de.size == 0
