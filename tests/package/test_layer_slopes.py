"""Bounds of a plate's slopes: closed forms, the compiled core on random plates, what adds up."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scissorcal.kernel import Kernel, ModelTables, Piece, PiecesModel, StepFlag, Strip, Table
from scissorcal.package.layer_slopes import LayerSlopes
from scissorcal.render import derating
from tests.kernel.zoo import arc_edge, line_edge, make_tables, power_response
from tests.package.random_plates import Steepest, random_case, steepest

FACE, LIMIT = 5e-5, 1.0
TURN_RAD = 1e-4
ROUNDED = 1.002
"""Slopes are differences of the core's float32."""


def whole(tables: ModelTables, scale: float = 1.0) -> Piece:
    """A piece without an end that is the uniform sheet of the tables."""
    energy = scale * tables.fracture_energy
    return Piece(-1.0, tables.upper_face, scale, (Strip(1.0, energy),))


def compare(seed: int) -> Steepest:
    """Each slope that is found on a random plate is within its bound."""
    rng = np.random.default_rng(seed)
    case = random_case(rng)
    slopes, found = LayerSlopes(case.tables, case.limit, case.pieces), steepest(case, rng)
    assert found.opening <= ROUNDED * slopes.bound("opening").value
    assert found.closing <= ROUNDED * slopes.bound("opening").value
    assert found.cross <= ROUNDED * slopes.bound("cross").value
    assert found.advance <= ROUNDED * slopes.bound("advance").value
    return found


@pytest.mark.slow
@settings(max_examples=50)
@given(st.integers(0, 2**32 - 1))
def test_no_slope_of_many_random_plates_is_above_its_bound(seed: int) -> None:
    compare(seed)


def test_no_slope_of_a_dozen_random_plates_is_above_its_bound() -> None:
    """What is compared is not nothing: on half of the plates slopes are found."""
    found = [compare(seed) for seed in range(12)]
    assert np.mean([one.opening > 0.0 for one in found]) > 0.4
    assert any(one.closing > 0.0 for one in found)


def largest_in_the_core(tables: ModelTables) -> float:
    """The largest slope of a uniform sheet at 300 openings and 60 contacts, settled first."""
    kernel, found = Kernel(tables), 0.0
    for opening in np.linspace(tables.opening_min, tables.opening_max - 1e-3, 300):
        turn = float(np.float32(opening + TURN_RAD)) - float(np.float32(opening))
        for contact in np.linspace(tables.contact_min, tables.contact_max, 60):
            kernel.reset(float(contact))
            at = kernel.step(float(opening), 0.0, 0.0)
            opened = kernel.step(float(opening) + TURN_RAD, 0.0, 0.0)
            if 0.0 < at.torque <= LIMIT and at.contact <= tables.contact_max:
                found = max(found, (at.torque - opened.torque) / turn)
    return found


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"moving_blades": 1},
        {"closure": "eq4"},
        {"edge": arc_edge(2.0)},
        {"edge": arc_edge(-1.0, slope=0.08)},
        {"fracture_energy": 6.0, "upper_face": 1e-3},
        {"fracture_energy": 0.01},
        {"response": power_response(exponent=2.5, knots=20)},
    ],
)
def test_the_bound_is_little_above_what_a_sheet_reaches(changes: dict[str, object]) -> None:
    tables = make_tables(**changes)
    found = largest_in_the_core(tables)
    bound = LayerSlopes(tables, LIMIT, [whole(tables)]).bound("opening")
    assert found <= ROUNDED * bound.value
    assert bound.value <= 1.06 * found
    assert tables.opening_min <= bound.opening <= tables.opening_max


def test_a_straight_pad_has_its_closed_form() -> None:
    """Edge through the pivot, one blade, straight response: K = k L^2 - g (L t + phi (1 + t^2))."""
    stiff, face = 2e3, 2e-3
    straight = Table([0.0, 1e-2], [0.0, 1e-2 * stiff], [stiff, stiff])
    tables = make_tables(
        edge=line_edge(0.0, 0.0),
        response=straight,
        moving_blades=1,
        fracture_energy=0.0,
        upper_face=face,
        opening_min=0.02,
        tip_station=0.0601,
    )
    places = np.linspace(tables.contact_min, tables.contact_max, 4000)
    best = 0.0
    for opening in (0.02, 0.021, 0.022, 0.03):
        t = math.tan(opening)
        depth = np.maximum(face - places * t, 0.0)
        lever = places / math.cos(opening) ** 2
        slope = stiff * lever**2 - stiff * depth * (lever * t + places * t * (1.0 + t * t))
        best = max(best, float(np.max(np.where(depth > 0.0, slope, 0.0))))
    bound = LayerSlopes(tables, 1e3, [whole(tables)])
    assert best <= bound.bound("opening").value <= 1.02 * best
    assert bound.bound("advance").value == pytest.approx(
        stiff * _steepest_touch(face) ** 2, rel=0.05
    )
    damped = replace(tables, rate_damping=2.0)
    rate = LayerSlopes(damped, 1e3, [whole(damped)]).bound("rate").value
    t = math.tan(0.02)
    damping = 2.0 * stiff * (face - places * t) * (places * (1.0 + t * t)) ** 2
    assert np.max(damping) <= rate <= 1.06 * np.max(damping)


def _steepest_touch(face: float) -> float:
    """tan of the largest opening at which the blade still touches at the nearest contact."""
    return face / 0.015


def test_pieces_that_overlap_add_up_and_others_do_not() -> None:
    tables = make_tables()
    one = LayerSlopes(tables, LIMIT, [whole(tables)]).bound("opening").value
    twice = LayerSlopes(tables, LIMIT, [whole(tables), whole(tables)]).bound("opening").value
    assert twice == pytest.approx(2.0 * one, rel=1e-9)
    double = LayerSlopes(tables, LIMIT, [whole(tables, 2.0)]).bound("opening").value
    assert double == pytest.approx(twice, rel=0.01)
    begun = Piece(0.0, FACE, 1.0, (Strip(0.02, 0.6),))
    near = Piece(0.0201, FACE, 1.0, (Strip(0.03, 0.6),))
    far = Piece(0.04, FACE, 1.0, (Strip(0.05, 0.6),))
    apart = LayerSlopes(tables, LIMIT, [begun, far]).bound("opening").value
    together = LayerSlopes(tables, LIMIT, [begun, near]).bound("opening").value
    assert apart == pytest.approx(one, rel=1e-9)
    assert one < together <= 2.0 * one + 1e-9


def test_only_the_strips_at_one_place_add_up() -> None:
    """A tough strip far from the layer's own is not pressed together with it."""
    tables = make_tables()
    band = Piece(0.0, FACE, 1.0, (Strip(0.03, 0.6), Strip(0.04, 6.0), Strip(0.1, 0.6)))
    layer = Piece(0.08, FACE, 0.3, (Strip(0.1, 0.18),))
    alone = LayerSlopes(tables, LIMIT, [band]).bound("opening").value
    assert LayerSlopes(tables, LIMIT, [band, layer]).bound("opening").value == alone
    over = replace(layer, begin_m=0.035)
    assert LayerSlopes(tables, LIMIT, [band, over]).bound("opening").value > 1.15 * alone


def test_places_beyond_the_limit_do_not_count() -> None:
    tables = make_tables(fracture_energy=0.0)
    bounds = [
        LayerSlopes(tables, at, [whole(tables)]).bound("opening").value for at in (0.1, 1, 10)
    ]
    assert bounds[0] < bounds[1] < bounds[2]


def test_nothing_that_touches_has_no_slope() -> None:
    tables = make_tables(upper_face=1e-6, opening_min=0.8)
    low = Piece(0.0, 1e-6, 1.0, (Strip(0.1, 0.6),))
    above = replace(tables, edge=line_edge(0.01, 0.0))
    assert LayerSlopes(above, LIMIT, [low]).bound("opening").value == 0.0


def largest_in_a_stroke(tables: ModelTables, pieces: list[Piece], place: float) -> float:
    """The largest slope in one stroke through a fresh plate, at any contact."""
    model = PiecesModel(tables, pieces)
    model.step_many(np.full(200, 1.4), 0.0, np.linspace(place - 0.1, place, 200))
    opening = np.repeat(np.linspace(tables.opening_max - 4e-4, tables.opening_min, 300), 2)
    opening[1::2] += 4e-4
    step = model.step_many(opening, 0.0, place)
    turn = np.diff(opening.astype(np.float32).astype(np.float64).reshape(-1, 2), axis=1)[:, 0]
    torque = step["torque"].astype(np.float64).reshape(-1, 2)
    lost = (step["flags"] & int(StepFlag.INVALID | StepFlag.BEYOND_TIP) != 0).reshape(-1, 2)
    counts = ~lost.any(axis=1) & (torque.max(axis=1) <= 20.0)
    return float(np.max(((torque[:, 0] - torque[:, 1]) / turn)[counts]))


@pytest.mark.parametrize(
    ("kappa", "law", "least", "strips", "layer"),
    [
        (1.0, (1.6, 1.45), 0.136, (Strip(0.0325, 0.43), Strip(0.3, 38.0)), None),
        (1.0, (2.85, 1.27), 0.125, (Strip(0.0574, 0.0335), Strip(0.3, 0.0)), None),
        (0.5, (2.0, 1.0), 0.15, (Strip(0.3, 0.6),), None),
        (1.0, (2.0, 1.0), 0.15, (Strip(0.3, 0.6),), Strip(0.3, 100.0)),
    ],
    ids=["held at a tougher strip", "held at an uncut one", "ripples", "a layer begins beyond"],
)
def test_strokes_that_end_beyond_the_scene_are_within_the_bound(
    kappa: float,
    law: tuple[float, float],
    least: float,
    strips: tuple[Strip, ...],
    layer: Strip | None,
) -> None:
    tables = make_tables(
        response=power_response(*law, 1e-2, 30),
        kappa=kappa,
        opening_min=least,
        contact_max=0.04,
        tip_station=0.075,
    )
    pieces = [Piece(0.0, FACE, 1.0, strips)]
    if layer is not None:
        pieces.append(Piece(0.026, 2.0 * FACE, 1.0, (layer,)))
    found = max(largest_in_a_stroke(tables, pieces, -at) for at in np.linspace(0.016, 0.039, 8))
    assert found <= ROUNDED * LayerSlopes(tables, 20.0, pieces).bound("opening").value


def test_what_is_needed_is_never_below_what_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    tables = make_tables()
    assert derating.needs_on(tables, LIMIT, [whole(tables)]).found > 0.0
    monkeypatch.setattr(derating, "_found_on", lambda *_: 100.0)
    needs = derating.needs_on(tables, LIMIT, [whole(tables)])
    assert needs.stiffness == needs.found == 100.0
    assert derating.stiffness_on(tables, LIMIT, [whole(tables)]) == 100.0
