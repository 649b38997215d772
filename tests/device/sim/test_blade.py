"""The contact law: closed forms, forces as gradients of one energy, and the edge's own solver."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scissorcal.device.sim.blade import APART, blade_on
from tests.device.sim.build import WAVY, specimen

EDGES = {
    "line": {},
    "arc": {"family": "arc", "curvature_per_m": 1.5},
    "hollow arc": {"family": "arc", "curvature_per_m": -0.8},
    "one blade": {"moving": "upper"},
    "wave": WAVY,
    "wave, one blade": WAVY | {"moving": "upper"},
}


@pytest.mark.parametrize("edge", EDGES.values(), ids=EDGES.keys())
@pytest.mark.parametrize("response", ["power", "exponential"])
def test_forces_are_the_gradient_of_the_stored_energy(edge: dict, response: str) -> None:
    blade = blade_on(specimen(blade=edge, material={"response": response}))
    step = 1e-7
    for opening in (0.2, 0.5, 0.8):
        for deeper in (1e-4, 4e-4):
            place = blade.crossing(opening) - deeper / 0.2
            touch = blade.touch(opening, place)
            by_opening = blade.energy(opening + step, place) - blade.energy(opening - step, place)
            by_place = blade.energy(opening, place + step) - blade.energy(opening, place - step)
            assert touch.torque == pytest.approx(-by_opening / (2 * step), rel=1e-5)
            assert touch.drive == pytest.approx(-by_place / (2 * step), rel=1e-5)


def test_the_gradient_holds_while_the_tip_lets_go() -> None:
    blade = blade_on(specimen(blade={"tip_fade_mm": 2.0}))
    step, opening = 1e-8, 0.1396
    for beyond in (-1e-4, 3e-4, 1e-3, 1.7e-3):
        beta = opening / 2
        station = blade.length + beyond
        edge = blade.offset + station * blade.taper
        place = station * math.cos(beta) - edge * math.sin(beta)
        touch = blade.touch(opening, place)
        assert touch.torque > 0
        by_opening = blade.energy(opening + step, place) - blade.energy(opening - step, place)
        by_place = blade.energy(opening, place + step) - blade.energy(opening, place - step)
        assert touch.torque == pytest.approx(-by_opening / (2 * step), rel=1e-4)
        assert touch.drive == pytest.approx(-by_place / (2 * step), rel=1e-4)
    assert blade.touch(opening, place + 5e-4) == APART


@given(
    station=st.floats(0.0, 0.075),
    opening=st.floats(0.01, 0.95),
    curvature=st.floats(-2.0, 3.0),
    taper=st.floats(-5.0, 10.0),
)
def test_the_edge_is_found_where_the_turned_blade_puts_it(
    station: float, opening: float, curvature: float, taper: float
) -> None:
    blade = blade_on(
        specimen(blade={"family": "arc", "curvature_per_m": curvature, "taper_deg": taper})
    )
    beta = opening / 2
    edge = blade.offset + station * math.tan(math.radians(taper)) + curvature * station**2 / 2
    x = station * math.cos(beta) - edge * math.sin(beta)
    y = station * math.sin(beta) + edge * math.cos(beta)
    assert blade.indentation(opening, x) == pytest.approx(blade.upper_face - y, abs=1e-12)


@given(opening=st.floats(0.14, 0.95), curvature=st.floats(-0.5, 3.0))
def test_at_the_crossing_the_edge_just_touches(opening: float, curvature: float) -> None:
    blade = blade_on(specimen(blade={"family": "arc", "curvature_per_m": curvature}))
    assert blade.indentation(opening, blade.crossing(opening)) == pytest.approx(0.0, abs=1e-12)


def test_an_edge_that_never_comes_up_has_no_crossing() -> None:
    blade = blade_on(specimen(blade={"family": "arc", "curvature_per_m": -4.0}))
    assert blade.crossing(0.15) == math.inf
    parallel = blade_on(specimen(blade={"taper_deg": -10.0}))
    assert parallel.crossing(0.15) == math.inf


def test_edges_that_open_towards_the_tip_do_not_advance_the_crack() -> None:
    blade = blade_on(specimen(blade={"taper_deg": -10.0}))
    assert blade.touch(0.15, 0.03).drive < 0.0


@settings(max_examples=300)
@given(
    opening=st.floats(0.002, 1.48),
    contact=st.floats(-0.5, 0.5),
    offset=st.floats(-50, 50),
    taper=st.floats(-20, 20),
    force=st.floats(1e-3, 1e3),
    exponent=st.floats(0.1, 20),
    thickness=st.floats(1e-6, 50),
    response=st.sampled_from(["power", "exponential"]),
)
def test_forces_are_finite_everywhere(
    opening: float,
    contact: float,
    offset: float,
    taper: float,
    force: float,
    exponent: float,
    thickness: float,
    response: str,
) -> None:
    blade = blade_on(
        specimen(
            blade={"offset_mm": offset, "taper_deg": taper},
            mechanism={"opening_range_deg": (0.1, 85.0)},
            material={
                "response": response,
                "response_force_N": force,
                "response_exponent": exponent,
                "thickness_mm": thickness,
            },
        )
    )
    assert all(math.isfinite(value) for value in blade.touch(opening, contact))
    assert math.isfinite(blade.energy(opening, contact))
    assert blade.energy(opening, contact) >= 0.0
