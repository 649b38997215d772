"""Where a turned edge comes up through a height: closed forms, a search on curves, one root."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from scissorcal.model import Edge
from scissorcal.model.edge_points import LARGEST_MISFIT_M, MOST_POINTS, edge_through

MANY = 60
BETA = np.radians(np.linspace(3.0, 40.0, 60))


@st.composite
def points(draw: st.DrawFn) -> np.ndarray:
    """Points of a smooth edge, 10 to 500 mm long, few or many, evenly spread or clustered.

    Few points state a parabola: they do not show a wave, and the rule refuses what they leave open.
    """
    length = draw(st.floats(0.01, 0.5))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    count = draw(st.sampled_from([3, 4, 12, 60, MOST_POINTS]))
    cluster = draw(st.sampled_from([0.2, 1.0, 5.0]))
    inner = np.sort(rng.uniform(0.0, 0.999, count - 2)) ** cluster
    first = -draw(st.sampled_from([0.0, 0.05, 0.3]))
    share = np.unique(np.concatenate([[first], inner[inner > 1e-7], [1.0]]))
    waves = draw(st.floats(0.1, 1.5))
    size = draw(st.floats(-1.0, 1.0)) * 0.02 / waves if count >= MANY else 0.0
    bend = draw(st.floats(-0.05, 0.05))
    station = length * share
    offset = length * (
        -0.1 + 0.03 * share + bend * share**2 + size * np.sin(2 * np.pi * waves * share)
    )
    return np.stack([station, offset], axis=1)


@given(points())
@settings(max_examples=150)
def test_any_smooth_points_become_an_edge_near_them(given_points: np.ndarray) -> None:
    assume(len(given_points) >= 3)
    edge, misfit = edge_through(given_points)
    station, offset = given_points.T
    assert misfit <= LARGEST_MISFIT_M
    assert np.max(np.abs(edge.offset_at(station) - offset)) == misfit
    assert edge.length_m == station[-1]
    assert 4 <= len(edge.spline_m) <= 19


@given(points(), st.floats(-0.02, 0.02))
@settings(max_examples=150)
def test_at_the_station_the_edge_has_the_height_and_rises(
    given_points: np.ndarray, height: float
) -> None:
    """There, and nowhere else, wherever heights at 4,001 stations leave no doubt.

    Between neighbours, d apart, a curve leaves its chord by m d^2 / 8 at most, m its largest
    second derivative, and where it turns its height changes by m d^2 at most.
    """
    assume(len(given_points) >= 3)
    edge, _ = edge_through(given_points)
    found = edge.station_at_height(height, BETA)
    known = np.isfinite(found)
    at, beta = found[known], BETA[known]
    reached = at * np.sin(beta) + edge.offset_at(at) * np.cos(beta)
    assert reached == pytest.approx(height, abs=1e-13)
    assert np.all(np.sin(beta) + edge.slope_at(at) * np.cos(beta) >= 0.0)
    stations = np.linspace(0.0, edge.length_m, 4001)
    away = np.multiply.outer(np.sin(BETA), stations) - height
    away += np.multiply.outer(np.cos(BETA), edge.offset_at(stations))
    one, next_one = away[:, :-1], away[:, 1:]
    width = (edge.length_m - edge.spline_start_m) / (len(edge.spline_m) - 3)
    turn = np.abs(np.diff(edge.spline_m, 2)).max() * (stations[1] / width) ** 2
    beside = np.minimum(np.abs(one), np.abs(next_one)) > turn / 8.0
    through = np.abs(one - next_one) > turn
    sure = np.all(np.where((one < 0.0) == (next_one < 0.0), beside, through), axis=1)
    rises = np.count_nonzero((one < 0.0) & (next_one >= 0.0), axis=1)
    assert np.array_equal(known[sure], rises[sure] == 1)


@pytest.mark.parametrize("beyond", [1e-6, 1e-8, 1e-10, 1e-12])
def test_a_rise_just_below_a_crest_is_found_and_just_above_it_there_is_none(beyond: float) -> None:
    station = np.linspace(0.0, 0.3, 60)
    wave = 0.004 * np.sin(2.0 * np.pi * 1.3 * station / 0.3)
    offset = -0.03 + 0.05 * station + wave - 0.6 * station**2
    edge, _ = edge_through(np.stack([station, offset], axis=1))
    beta = np.radians(3.0)
    crest = brentq(lambda s: float(edge.slope_at(s)) + np.tan(beta), 0.05, 0.1, xtol=1e-15)
    top = crest * np.sin(beta) + float(edge.offset_at(crest)) * np.cos(beta)
    found = edge.station_at_height([top - beyond, top + beyond], beta)
    assert crest - 0.01 < found[0] < crest
    assert np.isnan(found[1])


EPS, TINY = np.finfo(np.float64).eps, np.finfo(np.float64).tiny


@given(
    st.floats(-0.02, 0.0),
    st.floats(-5.0, 10.0),
    st.floats(-1.5, 3.0),
    st.floats(-0.002, 0.002),
)
@example(offset=-0.001953125, taper=-5.0, curvature=-0.015625, height=-0.001953125)
@example(offset=-0.015625, taper=-4.0, curvature=2.0**-24, height=0.0)
@example(offset=0.0, taper=-4.0, curvature=1.1125369292536007e-308, height=0.0)
def test_lines_and_arcs_are_the_quadratics_root_wherever_it_is(
    offset: float, taper: float, curvature: float, height: float
) -> None:
    """What is left at the root of a s^2 / 2 + b s + c is rounding: with u = eps / 2,

    - the station is the root of a law whose b is off by u and whose a is off by 3 u, itself off
      by 6 u (two products and a sum under the square root, the root, a sum, a quotient). With the
      law's slope a s + b that leaves 3 u |a s^2 / 2| + u |b s| + 6 u (|a s^2| + |b s|);
    - the law's value, summed by Horner, is off by 4 u |a s^2 / 2| + 3 u |b s| + u |c|.

    Together less than 10 eps of the terms' sum; likewise the slope, 6 eps of its own terms. Below
    the smallest normal number, TINY, rounding is no share.
    """
    edge = Edge("arc", offset, float(np.radians(taper)), 0.075, curvature_per_m=curvature)
    found = edge.station_at_height(height, BETA)
    bend = curvature * np.cos(BETA)
    grade = np.sin(BETA) + np.tan(np.radians(taper)) * np.cos(BETA)
    lift = offset * np.cos(BETA) - height
    known = np.isfinite(found)
    never, falls = grade**2 - 2.0 * bend * lift < 0.0, grade <= 0.0
    sure = ~falls | (bend == 0.0) | (abs(bend) > 1e-300)  # else a station may be too large to write
    assert np.array_equal(known[sure], ~(never | falls & (bend == 0.0))[sure])
    a, b, c, at = bend[known], grade[known], lift[known], found[known]
    terms = (0.5 * np.abs(a * at) + np.abs(b)) * np.abs(at) + np.abs(c)
    assert np.all(np.abs((0.5 * (a * at) + b) * at + c) <= 10 * EPS * terms + TINY)
    assert np.all(a * at + b >= -6 * EPS * (np.abs(a * at) + np.abs(b)))


def test_an_arc_that_falls_at_the_pivot_is_found_where_it_rises() -> None:
    arc = Edge("arc", 1e-4, np.radians(-5.0), 0.075, curvature_per_m=3.0)
    cubic = replace(arc, family="cubic")
    found = arc.station_at_height(0.0, BETA[0])
    assert 0.0 < found < arc.length_m
    assert found == pytest.approx(cubic.station_at_height(0.0, BETA[0]), abs=1e-15)


def test_a_cubic_without_bend_is_found_where_its_arc_is() -> None:
    arc = Edge("arc", -0.008, 0.03, 0.075, curvature_per_m=1.0)
    cubic = Edge("cubic", -0.008, 0.03, 0.075, curvature_per_m=1.0)
    exact, found = (edge.station_at_height(5e-5, BETA) for edge in (arc, cubic))
    on_blade = (exact > 0.0) & (exact < 0.075)
    assert np.count_nonzero(on_blade) > 20
    assert found[on_blade] == pytest.approx(exact[on_blade], abs=1e-15)
    assert np.all(np.isnan(found[~on_blade]))


def test_an_edge_that_comes_up_twice_has_no_one_station() -> None:
    hump = (*np.zeros(6), 0.006, *np.zeros(10))
    edge = Edge("spline", -0.008, 0.0, 0.075, spline_m=hump)
    wide, narrow = edge.station_at_height(0.0, np.radians([25.0, 10.0]))
    assert np.isfinite(wide)
    assert np.isnan(narrow)
