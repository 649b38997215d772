"""What derating costs on a drawn plate: against uniform sheets, and against single steps."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scissorcal.errors import InputError
from scissorcal.kernel import ModelTables, Piece, PiecesModel, Strip
from scissorcal.render.admission import admit, rendered_tables
from scissorcal.render.derating import softened
from scissorcal.render.felt_cost import FeltTorque, felt_rates, plate_strokes
from scissorcal.render.result import felt_verdict
from scissorcal.verdicts import TORQUE
from tests.kernel.zoo import make_tables
from tests.render.felt import felt_change
from tests.render.test_admission import ASKED, LIMIT, RIG

FACE, ENERGY = 5e-5, 0.6
TABLES = make_tables()
SOFT = softened(TABLES, 2000.0)


def long_piece(ratio: float = 1.0, scale: float = 1.0, end: float = 0.2) -> Piece:
    return Piece(0.0, FACE, scale, (Strip(end, ratio * scale * ENERGY),))


@pytest.mark.parametrize("ratio", [0.3, 1.0, 3.0])
def test_a_plate_of_one_toughness_costs_what_a_sheet_of_it_does(ratio: float) -> None:
    """A piece that the strokes do not come to the end of, against the uniform sheet's stroke."""
    one, two = (replace(each, fracture_energy=ratio * ENERGY) for each in (TABLES, SOFT))
    sheet = felt_change(one, two, LIMIT)
    assert felt_change(TABLES, SOFT, LIMIT, [long_piece(ratio, end=100.0)]) == pytest.approx(
        sheet, rel=1e-3
    )
    double = [long_piece(ratio, scale=2.0, end=100.0)]
    assert felt_change(TABLES, SOFT, LIMIT, double) == pytest.approx(sheet, rel=1e-3)


def test_a_tougher_plate_costs_more_than_the_uniform_sheet() -> None:
    sheet = felt_change(TABLES, SOFT, LIMIT)
    assert felt_change(TABLES, SOFT, LIMIT, [long_piece(3.0, end=100.0)]) > 3.0 * sheet
    hole = [
        Piece(0.0, FACE, 1.0, (Strip(0.02, ENERGY),)),
        Piece(0.03, FACE, 1.0, (Strip(0.2, ENERGY),)),
    ]
    assert felt_change(TABLES, SOFT, LIMIT, hole) > 2.0 * sheet


def test_nothing_changed_costs_nothing() -> None:
    band = Piece(0.0, FACE, 1.0, (Strip(0.03, ENERGY), Strip(0.04, 3 * ENERGY), Strip(0.2, 0.0)))
    assert felt_change(TABLES, TABLES, LIMIT, [band]) == 0.0
    assert felt_change(TABLES, SOFT, 1e-9, [band]) == 0.0


def test_a_plate_that_is_not_cut_is_pressed_at_each_of_its_edges() -> None:
    pads = [Piece(begin, FACE, 1.0, (Strip(begin + 0.01, 0.0),)) for begin in (0.0, 0.1)]
    strokes = plate_strokes(TABLES, pads)
    middle = 0.5 * (TABLES.contact_min + TABLES.contact_max)
    assert [advance[-1] for _, advance, _ in strokes] == pytest.approx([-middle, 0.1 - middle])
    there = {"fracture_energy": 0.0, "contact_min": middle, "contact_max": middle}
    pad, soft = (replace(each, **there) for each in (TABLES, SOFT))
    assert felt_change(TABLES, SOFT, LIMIT, pads) == pytest.approx(
        felt_change(pad, soft, LIMIT), rel=1e-3
    )


def test_strokes_cut_the_plate_from_end_to_end() -> None:
    plate = [Piece(0.0, FACE, 1.0, (Strip(0.02, ENERGY),)), long_piece(2.0)]
    model = PiecesModel(TABLES, plate)
    for opening, advance, counts in plate_strokes(TABLES, plate):
        before = min(
            crack
            for crack, through in zip(model.cracks, model.cut_through, strict=True)
            if not through
        )
        assert before - advance[-1] == pytest.approx(TABLES.contact_min, abs=1e-6)
        assert opening[counts][0] == TABLES.opening_max
        assert opening[counts][-1] == TABLES.opening_min
        model.step_many(opening, 0.0, advance)
    assert all(model.cut_through)


def by_hand(tables: ModelTables, plate: list[Piece], limit: float) -> np.ndarray:
    """Mean torque in 25 parts of each stroke, by single steps of the core."""
    model = PiecesModel(replace(tables, render_friction=False), plate)
    means = []
    for place in (-0.015, 0.02, 0.06, 0.1):
        model.step(TABLES.opening_max, 0.0, place - 0.05)
        for advance in np.linspace(place - 0.05, place, 300):
            model.step(TABLES.opening_max, 0.0, float(advance))
        closing = np.linspace(TABLES.opening_max, TABLES.opening_min, 2500)
        torque = [min(model.step(float(opening), 0.0, place).torque, limit) for opening in closing]
        means.append(np.reshape(torque, (25, 100)).mean(axis=1))
    return np.concatenate(means)


def test_the_cost_is_what_the_core_renders_less_of_it() -> None:
    """Strokes of other places and lengths, stepped one by one: the cost is near that."""
    plate = [
        Piece(0.0, FACE, 1.0, (Strip(0.03, ENERGY), Strip(0.05, 3 * ENERGY), Strip(0.12, ENERGY))),
        Piece(0.0, 2e-4, 0.5, (Strip(0.12, 0.5 * ENERGY),)),
    ]
    one, two = (by_hand(each, plate, LIMIT) for each in (TABLES, SOFT))
    felt = np.maximum(one, two) > 0.05 * one.max()
    found = np.sqrt(np.mean((two - one)[felt] ** 2) / np.mean(one[felt] ** 2))
    assert felt_change(TABLES, SOFT, LIMIT, plate) == pytest.approx(found, rel=0.25)


def test_admission_states_the_plates_own_cost() -> None:
    plate = (long_piece(3.0),)
    found = admit(TABLES, RIG, ASKED, plate)
    soft = rendered_tables(TABLES, found)
    assert found.derated
    assert found.felt_share == pytest.approx(felt_change(TABLES, soft, LIMIT, plate))
    assert found.felt_sheet_share == pytest.approx(felt_change(TABLES, soft, LIMIT))
    assert found.felt_share > 2.0 * found.felt_sheet_share
    said = found.reasons[1]
    assert f"{found.felt_share:.1%}" in said
    assert f"{found.felt_sheet_share:.1%}" in said
    assert "drawn plate" in said
    assert "drawn plate" in found.summary
    sheet = admit(TABLES, RIG, ASKED)
    assert sheet.felt_share == sheet.felt_sheet_share
    assert "drawn plate" not in sheet.summary + sheet.reasons[1]


def test_friction_near_rest_is_part_of_what_is_felt() -> None:
    """Over twice the width friction turns from one sense to the other: by hand, level by level."""
    air = replace(TABLES, render_friction=True, contact_min=0.07, contact_max=0.0701)
    air = replace(air, fracture_energy=0.0, upper_face=1e-6, opening_min=0.5)
    width, rate = 0.02, 0.5
    felt = FeltTorque(air, LIMIT, (rate,))
    assert felt.change(air) == 0.0
    opening = np.linspace(air.opening_max, air.opening_min, 4000)
    factor = 0.9 + 0.2 * opening
    up, down = 0.010 + 0.004 * rate, 0.012 + 0.006 * rate
    stretch = np.clip(1.0 - (air.opening_max - opening) / width, -1.0, 1.0)
    whole = (down * factor).reshape(25, -1).mean(axis=1)
    built = (-np.where(stretch > 0.0, up, down) * factor * stretch).reshape(25, -1).mean(axis=1)
    expected = np.sqrt(np.mean((built - whole) ** 2) / np.mean(whole**2))
    assert felt.change(air, width) == pytest.approx(expected, rel=1e-4)
    assert expected > 0.2


def test_a_weaker_damper_is_felt_at_the_scenes_rates() -> None:
    oily = replace(TABLES, rate_damping=30.0)
    weaker = replace(oily, rate_damping=10.0)
    slow, fast = (FeltTorque(oily, LIMIT, (rate,)).change(weaker) for rate in (0.05, 1.0))
    assert 0.0 < slow < 0.1 * fast
    assert felt_rates(oily, 0.05, 1.0) == pytest.approx((0.05, 0.05**0.5, 1.0))
    assert felt_rates(oily, 0.0, 0.001) == pytest.approx((0.01, 0.01, 0.01))


@given(stiffer=st.floats(0.5, 3.0), late_ms=st.floats(0.3, 4.0), tolerance=st.floats(0.005, 0.2))
@settings(max_examples=15)
def test_each_felt_cure_brings_the_felt_torque_within_the_tolerance(
    stiffer: float, late_ms: float, tolerance: float
) -> None:
    """Each sentence's own figure, put in alone, is enough; without one nothing is said."""
    response = replace(
        TABLES.response, x=TABLES.response.x / stiffer, slope=stiffer * TABLES.response.slope
    )
    tables = replace(TABLES, response=response, render_friction=True)
    rig = replace(RIG, late_s=late_ms * 1e-3)
    asked = replace(ASKED, tolerance=tolerance)
    try:
        found = admit(tables, rig, asked)
    except InputError:
        return
    assert bool(found.felt_cures) <= found.is_felt
    for cure in found.felt_cures:
        facts, wanted, scene = rig, asked, tables
        if "deg on" in cure:
            from_deg = float(cure.split("openings from ")[1].split(" deg")[0])
            scene = replace(tables, opening_min=np.radians(from_deg))
        elif "contacts up to" in cure:
            to_mm = float(cure.split("contacts up to ")[1].split(" mm")[0])
            scene = replace(tables, contact_max=1e-3 * to_mm)
        elif "delay of" in cure:
            delay = float(cure.split("delay of ")[1].split(" ms")[0]) * 1e-3
            tick = min(rig.tick_s, 2.0 * delay)
            facts = replace(rig, tick_s=tick, late_s=delay - 0.5 * tick)
        elif "more damping" in cure:
            more = float(cure.split(" mN m s/rad more")[0]) * 1e-3
            wanted = replace(asked, hand_damping=asked.hand_damping + more)
        else:
            continue  # friction or an encoder's step, which go together with others
        assert admit(scene, facts, wanted).felt_share <= 1.03 * tolerance, cure


def test_the_verdict_fails_beyond_the_tolerance_and_says_what_cures_it() -> None:
    wide = admit(TABLES, RIG, replace(ASKED, tolerance=0.5))
    assert felt_verdict(wide).status == "pass"
    assert wide.felt_cures == ()
    strict = admit(TABLES, RIG, replace(ASKED, tolerance=0.5 * wide.felt_share))
    verdict = felt_verdict(strict)
    assert (verdict.status, verdict.value) == ("fail", strict.felt_share)
    assert verdict.threshold == strict.tolerance
    assert verdict.guards.startswith(TORQUE)
    assert f"{strict.felt_share:.1%}" in verdict.why
    assert "A delay of" in verdict.why
    assert "--accept-derated" in verdict.why
    accepted = felt_verdict(strict, accepted=True)
    assert accepted.status == "not_evaluated"
    assert accepted.why.startswith("Accepted by a person (--accept-derated)")
    assert (accepted.value, accepted.threshold) == (verdict.value, verdict.threshold)
    assert felt_verdict(wide, accepted=True).status == "pass"
    assert felt_verdict(admit(TABLES, None, ASKED)).status == "not_evaluated"
