"""The slope that admission asks for: against closed forms, the model, and the proved bound."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from scissorcal.errors import InputError
from scissorcal.kernel import Kernel, ModelTables, Piece, PiecesModel, Strip, Table
from scissorcal.model import Cutting, Edge, Response, torque_at
from scissorcal.package import LayerSlopes, Tangent
from scissorcal.render.admission import admit
from scissorcal.render.admission_rule import allowed_stiffness
from scissorcal.render.derating import LEAST_FACTOR, needs_of, needs_on
from tests.kernel.zoo import (
    BLADE_LENGTH,
    EDGE_OFFSET,
    EDGE_TAPER,
    REFERENCE,
    arc_edge,
    make_tables,
    power_response,
)
from tests.render.test_admission import ASKED, HAND, LIMIT, RATE, RIG

FORCE, EXPONENT = 2.0, 1.5


def stiffer(times: float, **changes: object) -> ModelTables:
    """Paper that yields by a share of the indentation at the same forces."""
    soft = power_response(FORCE, EXPONENT, 2e-3, 200)
    response = Table(soft.x / times, soft.y, soft.slope * times)
    return make_tables(response=response, **changes)


def in_closed_form(tables: ModelTables, times: float, opening: float, contact: float) -> float:
    """- d(tau)/d(theta) of a straight edge and g = F (times delta / d)^n, the crack held.

    tau = g L with L = x + y t; by theta at a held x, of one of m blades:
    y' = L / m, t' = (1 + t^2) / m for a straight edge, delta' = - L / m.
    """
    m = tables.moving_blades
    beta = opening / m
    t = math.tan(beta + math.atan(EDGE_TAPER))
    station = (contact + EDGE_OFFSET * math.sin(beta)) / (
        math.cos(beta) - EDGE_TAPER * math.sin(beta)
    )
    y = station * math.sin(beta) + (EDGE_OFFSET + EDGE_TAPER * station) * math.cos(beta)
    lever = contact + y * t
    depth = tables.upper_face - y
    force = FORCE * (times * depth / REFERENCE) ** EXPONENT
    stiff = force * EXPONENT / depth
    return (stiff * lever**2 - force * (lever * t + y * (1.0 + t**2))) / m


@pytest.mark.parametrize("times", [1.0, 10.0, 50.0])
def test_the_slope_is_the_closed_form_of_paper_and_of_what_is_stiffer(times: float) -> None:
    """A difference over a milliradian is 1.02, 1.4 and 7 times too low for these."""
    tables = stiffer(times)
    needs = needs_of(tables, LIMIT)
    exact = in_closed_form(tables, times, needs.opening, needs.contact)
    assert needs.stiffness == pytest.approx(exact, rel=1e-3)
    kernel = Kernel(replace(tables, kappa=1.0))
    kernel.reset(needs.contact)
    here, there = (kernel.step(needs.opening + step, 0.0, 0.0).torque for step in (0.0, 1e-3))
    over_a_milliradian = (here - there) / 1e-3
    assert needs.stiffness > {1.0: 1.02, 10.0: 1.4, 50.0: 6.0}[times] * over_a_milliradian


@pytest.mark.parametrize("times", [1.0, 10.0, 50.0])
@pytest.mark.parametrize("closure", ["work", "eq4"])
def test_what_is_found_is_just_below_what_is_proved(times: float, closure: str) -> None:
    """For a sheet, for the same one as a piece, and for a stack of two."""
    tables = stiffer(times, closure=closure)
    sheet = Piece(0.0, tables.upper_face, 1.0, (Strip(0.2, tables.fracture_energy),))
    proved = LayerSlopes(tables, LIMIT, [sheet]).bound("opening").value
    assert 0.98 * proved < needs_of(tables, LIMIT).stiffness <= 1.001 * proved
    assert 0.97 * proved < needs_on(tables, LIMIT, [sheet]).found <= 1.001 * proved
    double = replace(sheet, scale=2.0, strips=(Strip(0.2, 2.0 * tables.fracture_energy),))
    assert 1.9 * proved < needs_on(tables, LIMIT, [double]).found <= 2.002 * proved


@given(
    times=st.floats(0.1, 100.0),
    exponent=st.floats(1.0, 4.0),
    offset_mm=st.floats(-10.0, -3.0),
    opening=st.floats(0.15, 0.9),
    depth_share=st.floats(0.02, 0.9),
    closure=st.sampled_from(["work", "eq4"]),
    moving=st.sampled_from([1, 2]),
    curvature=st.sampled_from([0.0, -2.0, 1.5]),
)
def test_the_tangent_is_the_models_derivative_anywhere(
    times: float,
    exponent: float,
    offset_mm: float,
    opening: float,
    depth_share: float,
    closure: str,
    moving: int,
    curvature: float,
) -> None:
    """Against central differences of the analytic model in float64, over 1e-5 of the indentation.

    The table has 200 knots, so its slope is that of the law to some 1e-3 of it.
    """
    last = 2e-3 / times
    soft = power_response(FORCE, exponent, 2e-3, 200)
    tables = make_tables(
        edge=arc_edge(curvature, offset_mm * 1e-3),
        response=Table(soft.x / times, soft.y, soft.slope * times),
        closure=closure,
        moving_blades=moving,
        upper_face=1e-3,
        fracture_energy=0.0,
        opening_max=1.2,
    )
    family = "arc" if curvature else "line"
    edge = Edge(
        family,
        offset_m=offset_mm * 1e-3,
        taper_rad=math.atan(EDGE_TAPER),
        length_m=BLADE_LENGTH,
        curvature_per_m=curvature,
    )
    height = 1e-3 - depth_share * last
    station = float(edge.station_at_height(height, opening / moving))
    assume(0.005 < station < BLADE_LENGTH)
    beta = opening / moving
    contact = station * math.cos(beta) - float(edge.offset_at(station)) * math.sin(beta)
    response = Response("power", FORCE, exponent, REFERENCE / times)
    law = Cutting(edge, response, moving, 1e-3, None, closure=closure)  # type: ignore[arg-type]
    step = 1e-5 * depth_share * last / contact
    above, below = (float(torque_at(law, opening + by, contact)) for by in (step, -step))
    expected = (below - above) / (2.0 * step)
    kernel = Kernel(tables)
    kernel.reset(contact)
    steps = kernel.step_many([opening], 0.0, 0.0)
    found = Tangent(tables).at(np.array([float(np.float32(opening))]), steps)
    # float32 rounds the edge's height by some 4e-9 m, which moves the indentation by that
    moved = 4e-9 / (depth_share * last) * max(exponent, 1.0)
    assert found[0] == pytest.approx(expected, rel=5e-3 + 4.0 * moved)


def test_blades_that_touch_nothing_have_no_slope() -> None:
    tables = make_tables(fracture_energy=0.0)
    kernel = Kernel(tables)
    kernel.reset(0.05)
    assert Tangent(tables).at(np.array([0.9]), kernel.step_many([0.9], 0.0, 0.0)).tolist() == [0.0]


def test_a_place_just_within_the_limit_counts() -> None:
    """A pad that is pressed until the limit is reached is stiffest there."""
    pad = make_tables(fracture_energy=0.0, upper_face=1e-3, response=power_response(knots=60))
    for limit in (0.05, 0.2, 0.8):
        proved = 0.0
        for contact in np.linspace(pad.contact_min, pad.contact_max, 24):
            kernel = Kernel(pad)
            openings = np.linspace(pad.opening_min, pad.opening_max, 20_001)
            kernel.reset(float(contact))
            steps = kernel.step_many(openings, 0.0, 0.0)
            within = steps["torque"] <= limit
            slopes = Tangent(pad).at(openings, steps)
            proved = max(proved, float(slopes[within].max(initial=0.0)))
        assert needs_of(pad, limit).stiffness == pytest.approx(proved, rel=2e-3)


def test_less_than_a_twentieth_of_the_true_slope_is_refused() -> None:
    """By the secant these left 10 and 50 times as much of themselves as they did."""
    held = allowed_stiffness(RIG, HAND, 1.5)
    for times in (1.0, 2.0, 5.0, 10.0, 20.0, 50.0):
        tables = stiffer(times)
        needed = needs_of(tables, LIMIT).stiffness
        if held < LEAST_FACTOR * needed:
            with pytest.raises(InputError, match="less than 5% of the elastic slope"):
                admit(tables, RIG, ASKED)
        else:
            found = admit(tables, RIG, ASKED)
            assert found.rendered >= LEAST_FACTOR * needed
    assert held < LEAST_FACTOR * needed, "the stiffest is refused"
    assert RATE <= 1.5


def test_pieces_in_a_strip_add_up_their_tangents() -> None:
    tables = stiffer(10.0)
    plate = [
        Piece(0.0, tables.upper_face, 1.0, (Strip(0.2, 0.6),)),
        Piece(0.0, 1.5 * tables.upper_face, 0.5, (Strip(0.2, 0.3),)),
    ]
    model = PiecesModel(replace(tables, render_friction=False), plate)
    model.step(tables.opening_max, 0.0, -0.06)
    closing = np.linspace(tables.opening_max, 0.3, 2000)
    model.step_many(closing, 0.0, -0.016)
    step = 1e-7
    torque = [model.step(0.3 + by, 0.0, -0.016).torque for by in (0.0, 400 * step)]
    assert needs_on(tables, LIMIT, plate).found > 0.9 * (torque[0] - torque[1]) / (400 * step)
