"""The edge over the sheet: places, levers and their derivatives against heights by bisection."""

import math

import numpy as np
import pytest

from scissorcal.calibration.cut.geometry import Geometry
from scissorcal.model import Edge, EdgeDistribution, Response, edge_through
from tests.calibration.truth import Truth

TRUTH = Truth()
LINE = Edge("line", TRUTH.edge_offset, TRUTH.taper, 0.075)
ARC = Edge("arc", TRUTH.edge_offset, TRUTH.taper, 0.075, curvature_per_m=1.2)
NAMES = ("offset_m", "taper_rad")
OPENING = np.linspace(0.25, 0.8, 7)


def geometry(edge=LINE, closure="work", names=NAMES, moving=2) -> Geometry:
    covariance = np.diag([5e-5, 1e-3])[: len(names), : len(names)] ** 2
    return Geometry(
        EdgeDistribution(edge, names, covariance), TRUTH.upper_face, moving, 1.5e-4, closure
    )


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
@pytest.mark.parametrize("moving", [1, 2])
@pytest.mark.parametrize("exponent", [0.4, 0.8, 1.5, 2.5])
@pytest.mark.parametrize("carriage", [-0.05, 0.0, 0.05], ids=["back", "still", "ahead"])
def test_lever_and_mean_force_give_the_mean_torque(edge, moving, exponent, carriage):
    """Against 20,001 points of a segment, whose carriage moves by ``carriage`` m for each rad.

    Exact where the carriage stands, in contact or with any part of the path in the air; where it
    moves, the levers of the path in the air are included in the mean.
    """
    shape = geometry(edge, moving=moving)
    response = Response("power", 5.0, exponent, shape.reference_m)
    limit = 1.3e-2 if carriage else 3e-6
    for deepest in (2e-5, 6e-5, 4e-4):
        turned = 3e-3
        contact = float(shape.place(0.3, deepest))
        opening = np.array([[0.3, 0.3 + turned]])
        ends = np.array([[contact, contact - carriage * turned]])
        span = shape.spans(opening, np.array([0.5]), ends)
        stored = [float(response.energy_at(d)) if d > 0 else 0.0 for d in span.depth[0]]
        force = (stored[1] - stored[0]) / float(np.diff(span.depth[0])[0])
        way = np.linspace(0.0, 1.0, 20001)
        depth, lever = shape.depth_and_lever(
            edge, 0.3 + turned * way, contact - carriage * turned * way
        )
        torque = np.where(depth > 0, response.force_at(np.maximum(depth, 1e-12)), 0.0) * lever
        assert force * span.lever[0] == pytest.approx(np.trapezoid(torque, way), rel=limit)


@pytest.mark.parametrize("edge", [LINE, ARC], ids=["line", "arc"])
def test_segments_are_expanded_as_differences_say(edge):
    """Places by 0.1 mm, edges by 20 um and 0.5 mrad: errors are of second order."""
    shape = geometry(edge)
    opening = np.stack([OPENING, OPENING - 5e-3], axis=1)
    contact = shape.place(OPENING, 3e-4)[:, None] + np.array([0.0, 1e-4])
    rate = np.full(7, -0.5)
    spans = shape.spans(opening, rate, contact)
    moved = 1e-4
    other = shape.spans(opening, rate, contact + moved)
    assert spans.depth + spans.depth_dx * moved == pytest.approx(other.depth, abs=3e-8)
    assert spans.lever + spans.lever_dx * moved == pytest.approx(other.lever, abs=1e-7)
    away = np.array([2e-5, 5e-4])
    edge_off = shape.edge_prior.with_values(shape.edge_prior.mean + away)
    other = geometry(edge_off).spans(opening, rate, contact)
    assert spans.depth + spans.depth_de @ away == pytest.approx(other.depth, abs=2e-8)
    assert spans.lever + spans.lever_de @ away == pytest.approx(other.lever, abs=1e-7)
    middle, where = opening.mean(axis=1), contact.mean(axis=1)
    depth, _ = shape.depth_and_lever(edge, middle, where)
    later, _ = shape.depth_and_lever(edge, middle + 1e-6 * rate, where)
    assert spans.sinking == pytest.approx((later - depth) / 1e-6, rel=1e-3)


def test_equation_4_has_the_mean_of_its_levers():
    shape = geometry(LINE, closure="eq4")
    opening = np.array([[0.3, 0.31]])
    contact = np.array([[0.03, 0.031]])
    _, levers = shape.depth_and_lever(LINE, opening, contact)
    assert shape.spans(opening, np.zeros(1), contact).lever == pytest.approx(levers.mean())


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
    other = shape.edge_prior.with_values(shape.edge_prior.mean + away)
    place = shape.place(OPENING, shape.reference_m, other)
    assert view.place + view.place_de @ away == pytest.approx(place, abs=2e-6)
    _, lever = shape.depth_and_lever(other, OPENING, place)
    assert view.lever + view.lever_de @ away == pytest.approx(lever, abs=2e-6)


@pytest.mark.parametrize("depth", [5e-5, 3e-4, 6e-4])
def test_rests_are_expanded_about_where_they_are(depth):
    """On a wave a line from the reference's place misses by 0.1 mm what the slope there hits."""
    wave = -0.008 + 0.0004 * np.sin(2 * np.pi * np.linspace(0.0, 0.075, 40) / 0.04)
    edge, _ = edge_through(np.stack([np.linspace(0.0, 0.075, 40), wave], axis=1))
    shape = geometry(edge, names=())
    opening = np.linspace(0.25, 0.8, 7)
    true = shape.place(opening, depth)
    view = shape.resting(opening, true)
    assert view.slope == pytest.approx(shape.slope(opening, true), abs=1e-12)
    there = view.place - (depth - shape.reference_m) / view.slope
    assert there == pytest.approx(true, abs=1e-12)
    far = shape.running(opening)
    missed = far.place - (depth - shape.reference_m) / far.slope - true
    assert np.abs(missed).max() > (1e-4 if depth > 5e-4 else 1e-6)


def test_rests_of_a_line_are_where_running_says():
    shape = geometry(LINE)
    at = shape.place(OPENING, 4e-4)
    view, plain = shape.resting(OPENING, at), shape.running(OPENING)
    assert view.place == pytest.approx(plain.place, abs=1e-15)
    assert view.slope == pytest.approx(plain.slope, abs=1e-15)
    unknown = shape.resting(OPENING, np.full(7, np.nan))
    assert np.array_equal(unknown.place, plain.place)
    assert np.array_equal(shape.resting(OPENING, np.full(7, 1.0)).slope, plain.slope)


def test_an_exact_edge_has_no_derivatives():
    opening = np.stack([OPENING, OPENING + 0.01], axis=1)
    spans = geometry(names=()).spans(opening, np.zeros(7), np.full((7, 2), 0.03))
    assert spans.depth_de.size == 0
