"""The model where it used to give numbers that meant nothing, or lost digits."""

import numpy as np
import pytest

from scissorcal.model import Cutting, Edge, Response, edge_height, mean_share, settled_contact
from scissorcal.model.cutting import contact_after_run, torque_at
from scissorcal.package import ExactModel

SOFT = Response("power", 2.0, 1.6, 3e-4)
DEEP_NICK = Edge(
    "spline", -0.008, 0.03, 0.075, spline_m=tuple(6e-3 * (np.arange(63) == 30)), spline_start_m=0.0
)
LINE = Edge("line", -0.008, 0.03, 0.075)


@pytest.mark.parametrize("edge", [LINE, Edge("arc", -0.008, 0.03, 0.075, 3.0), DEEP_NICK])
@pytest.mark.parametrize("blade_angle", [1.6, 2.5])
def test_a_blade_turned_beyond_upright_has_no_height(edge, blade_angle):
    view = edge_height(edge, 0.03, blade_angle)
    assert np.all(np.isnan([view.height, view.slope, view.station, view.lever]))


def test_an_edge_that_leans_back_somewhere_has_no_height_at_that_angle():
    angles = np.array([0.1, 0.9])
    height = edge_height(DEEP_NICK, 0.02, angles).height
    assert np.isfinite(height[0])
    assert np.isnan(height[1])


def test_where_no_edge_stands_there_is_no_torque():
    law = Cutting(LINE, SOFT, 1, 1e-4, 0.5)
    assert np.isnan(torque_at(law, 2.0, 0.03))
    assert np.isnan(torque_at(law, 0.4, np.nan))
    assert np.isnan(ExactModel(law, None).torque(2.0, -0.1, 0.03))
    assert np.isfinite(ExactModel(law, None).torque(0.4, -0.1, 0.03))


def test_halving_finds_the_station_where_newton_runs_away():
    """A nick turns Newton's steps to and fro; x rises along the edge all the same."""
    edge = Edge("spline", 0.0, 0.0, 0.075, spline_m=tuple(2.2e-3 * (np.arange(63) == 30)))
    contact = np.linspace(0.001, 0.06, 2001)
    view = edge_height(edge, contact, 0.65)
    assert 0.0 < np.cos(0.65) - edge.steepest * np.sin(0.65) < 0.1
    assert np.all(np.isfinite(view.station))
    back = view.station * np.cos(0.65) - edge.offset_at(view.station) * np.sin(0.65)
    assert back == pytest.approx(contact, abs=1e-14)


def test_a_bent_edge_whose_crack_runs_to_the_tip_gives_no_torque():
    """Newton used to leave the blade here and report a torque of 5e14 N m."""
    edge = Edge("arc", -3.6e-5, 0.2994, 0.01549, -7.778)
    law = Cutting(edge, Response("exponential", 8.1e-6, 0.5874, 3e-4), 2, 0.0295, 484.0, 0.2121)
    assert float(ExactModel(law, None).torque(0.6657, -19.4, 0.0075)) == 0.0


def test_a_crack_that_bears_its_load_does_not_jump_to_a_rise_farther_out():
    """The release rises again along a hollow edge; what lies farther out pulls no crack."""
    edge = Edge("spline", -0.0002, -0.15, 0.3, spline_m=tuple(0.014 * (np.arange(63) == 31)))
    law = Cutting(edge, Response("power", 0.03, 0.85, 3e-4), 2, 3.8e-3, 0.01)
    opening, start = 0.35, np.linspace(0.01, 0.25, 241)
    after = contact_after_run(law, opening, start)
    view = edge_height(edge, start, opening / 2)
    release = 2 * law.response.force_at(law.upper_face_m - view.height) * np.maximum(view.slope, 0)
    bears = release <= 0.01
    assert 20 < np.sum(bears) < 230
    assert after[bears] == pytest.approx(start[bears])
    assert np.all(after[~bears] > start[~bears])
    assert np.any(start[bears] < settled_contact(law, opening)) or np.any(after > start)


def test_the_mean_of_a_ripple_keeps_its_digits_as_the_ripple_vanishes():
    for family in ("power", "exponential"):
        response = Response(family, 2.0, 1.6, 3e-4)
        for short in (1e-5, 1e-8, 1e-11, 1e-14):
            law = Cutting(LINE, response, 2, 1e-4, 0.5, 1.0 - short)
            half = 0.5 * (1.0 - (1.0 - short))  # g is straight over so short a cycle
            assert float(mean_share(law, 3.0)) == pytest.approx(
                1.0 - half, abs=0.1 * short**2 + 1e-15
            )
    assert float(mean_share(Cutting(LINE, SOFT, 2, 1e-4, 0.5, 1.0), 3.0)) == 1.0


def test_the_energy_of_an_exponential_keeps_its_digits_near_the_first_contact():
    """exp(a) - 1 - a = a^2 / 2 (1 + a / 3 + ...) for small a."""
    response = Response("exponential", 2.0, 1.5, 3e-4)
    for delta in (1e-15, 1e-12, 1e-9):
        a = 1.5 * delta / 3e-4
        series = 0.5 * a**2 * (1.0 + a / 3.0 + a**2 / 12.0)
        expected = 2.0 * 3e-4 / 1.5 * series / np.expm1(1.5)
        assert float(response.energy_at(delta)) == pytest.approx(expected, rel=1e-13)
