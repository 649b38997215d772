"""The physics in 50 digits against closed forms, which it does not use."""

import numpy as np
import pytest
from scipy.interpolate import BSpline

from scissorcal.bench.extremes.exact_blade import Blade
from scissorcal.bench.extremes.exact_laws import Exponential, FormulaEdge, Power, mp, root


def bow(offset="0", tangent="0", curvature="0", bend="0") -> FormulaEdge:
    return FormulaEdge(tuple(mp.mpf(number) for number in (offset, tangent, curvature, bend)))


def blade(**changes) -> Blade:
    fields = {
        "edge": bow(),
        "response": Power(mp.mpf(2), mp.mpf("1.6"), mp.mpf("3e-4")),
        "moving": 2,
        "upper_face": mp.mpf("5e-3"),
        "toughness": mp.mpf("0.5"),
        "kappa": mp.mpf(1),
        "closure": "work",
        "damping": mp.mpf(0),
        "tip": mp.mpf("0.2"),
        "parallel": mp.mpf("1e-9"),
    }
    return Blade(**(fields | changes))


@pytest.mark.parametrize("opening", ["0.1", "0.7", "1.3"])
def test_a_straight_edge_through_the_pivot_has_a_closed_torque(opening):
    """tau = J_c h x_c / sin(theta) where both blades move, whatever the response."""
    theta = mp.mpf(opening)
    turned = blade().turned(theta)
    start, least = turned.over(mp.mpf("1e-4"))
    assert start is not None
    assert least == pytest.approx(float(mp.cos(theta / 2)))
    rests, before_tip, rises = turned.rests(start, 1)
    assert before_tip
    assert not rises
    closed = mp.mpf("0.5") * rests.x / mp.sin(theta)
    assert abs(turned.torque(rests, mp.mpf(0)) / closed - 1) < mp.mpf(10) ** -40


def test_torque_is_the_gradient_of_the_energy():
    edge = bow("-0.008", "0.03", "2", "5")
    for response in (
        Power(mp.mpf(2), mp.mpf("0.5"), mp.mpf("3e-4")),
        Exponential(mp.mpf(2), mp.mpf(8), mp.mpf("3e-4")),
    ):
        law = blade(edge=edge, response=response, upper_face=mp.mpf("5e-4"))

        def stored(theta, law=law):
            return law.moving * law.response.energy(law.turned(theta).over(mp.mpf("0.02"))[0].depth)

        theta, step = mp.mpf("0.4"), mp.mpf(10) ** -12
        turned = law.turned(theta)
        gradient = -(stored(theta + step) - stored(theta - step)) / (2 * step)
        torque = turned.torque(turned.over(mp.mpf("0.02"))[0], mp.mpf(0))
        assert abs(torque / gradient - 1) < mp.mpf(10) ** -14


def test_the_mean_of_a_ripple_is_that_of_its_closed_form():
    law = blade(kappa=mp.mpf("0.2"))
    turned = law.turned(mp.mpf("0.5"))
    n, kappa = mp.mpf("1.6"), mp.mpf("0.2")
    share = (1 - kappa ** ((n + 1) / n)) / ((n + 1) * (1 - kappa ** (1 / n)))
    target = turned.target(turned.spot(mp.mpf("0.01")), None)
    assert abs(target / (law.toughness * share) - 1) < mp.mpf(10) ** -40


def test_an_edge_that_leans_back_has_no_place_over_a_contact():
    upright = blade(moving=1).turned(mp.mpf(2))
    assert upright.over(mp.mpf("0.01"))[0] is None
    bent = blade(moving=1, edge=bow(curvature="100")).turned(mp.mpf("0.5"))
    near, far = bent.over(mp.mpf("0.005"))[0], bent.over(mp.mpf("0.05"))[0]
    assert near is not None
    assert far is None


def test_an_edge_with_weights_is_a_b_spline_that_goes_on_straight():
    weights = [0.5, -1.0, 3.0, 0.25, 2.0, -0.75]
    knots = 1.0 + 2.0 * np.arange(-3, 7)
    spline = BSpline(knots, weights, 3)
    edge = FormulaEdge(bow().polynomial, tuple(map(mp.mpf, weights)), mp.mpf(1), mp.mpf(2))
    assert edge.breaks == (1, 3, 5, 7)
    for place in (1.0, 1.5, 4.0, 5.0, 6.9):
        offset, slope = edge.at(mp.mpf(place))
        assert float(offset) == pytest.approx(float(spline(place)), rel=1e-12)
        assert float(slope) == pytest.approx(float(spline.derivative()(place)), rel=1e-9)
    for end, beyond in ((1.0, -3.0), (7.0, 9.5)):
        offset, slope = edge.at(mp.mpf(beyond))
        tilt = float(spline.derivative()(end))
        assert float(slope) == pytest.approx(tilt, rel=1e-9)
        assert float(offset) == pytest.approx(float(spline(end)) + tilt * (beyond - end), rel=1e-9)


def test_breaks_stand_only_where_the_cubic_changes():
    weights = [mp.mpf(0)] * 9 + [mp.mpf(1)] + [mp.mpf(0)] * 9
    edge = FormulaEdge(bow().polynomial, tuple(weights), mp.mpf(0), mp.mpf(1))
    assert edge.breaks == (6, 7, 8, 9, 10)


def test_a_root_is_found_in_all_digits():
    assert abs(root(lambda x: x * x - 2, mp.mpf(0), mp.mpf(2)) - mp.sqrt(2)) < mp.mpf(10) ** -43
    with pytest.raises(ValueError, match="no change of sign"):
        root(lambda x: x * x + 1, mp.mpf(0), mp.mpf(2))


@pytest.mark.parametrize("kind", [Power, Exponential])
def test_the_inverse_of_a_response(kind):
    law = kind(mp.mpf(2), mp.mpf("1.6"), mp.mpf("3e-4"))
    for delta in np.geomspace(1e-12, 1e-3, 7):
        there = mp.mpf(float(delta))
        assert abs(law.inverse(law.at(there)) / there - 1) < mp.mpf(10) ** -35
