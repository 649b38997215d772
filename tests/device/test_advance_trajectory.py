"""The plan of a capture of the carriage: within the stops, the force and the speeds, or refused."""

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from scissorcal.device.capture import planned
from scissorcal.device.trajectory import (
    ADVANCE_MARGIN_M,
    FORCE_SHARE,
    HEAVIEST_KG,
    LEAST_ACCELERATION,
    LEAST_TRAVEL_M,
    advance_plan,
    largest_acceleration,
    opening_range,
    refuse_without_motor,
)
from scissorcal.errors import InputError
from scissorcal.recipe import builtin_recipe
from tests.device.conftest import IDENTITY
from tests.device.recipes import changed

RECIPE = builtin_recipe("paper-80gsm")
LEAST_FORCE_N = LEAST_ACCELERATION * HEAVIEST_KG / FORCE_SHARE


def test_every_speed_is_swept_both_ways_and_the_mass_is_excited():
    plan = advance_plan(RECIPE, IDENTITY)
    speeds = [1e-3 * v for v in RECIPE.capture.friction_advance.speeds_mm_per_s]
    ways = [(s.kind, pytest.approx(s.speed)) for s in plan.strokes[:-1]]
    assert ways == [(way, v) for v in speeds * 2 for way in ("forward", "backward")]
    assert plan.strokes[-1].kind == "excitation"
    (segment,) = plan.segments
    reference = segment.reference
    for stroke in plan.strokes[:-1]:
        place = reference.advance[reference.stroke == stroke.index]
        rate = np.diff(place) / plan.tick_s
        assert np.ptp(place) == pytest.approx(0.060, abs=1e-4)
        assert np.sign(rate.sum()) == (1 if stroke.kind == "forward" else -1)
        assert np.abs(rate).max() == pytest.approx(stroke.speed, rel=1e-6)
    assert "60 mm" in segment.request
    assert planned(RECIPE, IDENTITY, "friction-advance").strokes == plan.strokes


def test_the_blades_stand_open_and_the_carriage_in_the_middle_of_its_stops():
    reference = advance_plan(RECIPE, IDENTITY).segments[0].reference
    assert np.ptp(reference.opening) == 0.0
    assert reference.opening[0] == opening_range(RECIPE, IDENTITY)[1]
    assert np.all(reference.opening_rate == 0.0)
    middle = 0.5 * (IDENTITY.advance_min + IDENTITY.advance_max)
    assert 0.5 * (reference.advance.min() + reference.advance.max()) == pytest.approx(middle)
    assert reference.advance[-1] == pytest.approx(middle)


@given(
    st.floats(-1.0, 1.0),
    st.floats(0.0, 0.4),
    st.floats(0.1, 100.0),
    st.floats(1.0, 1000.0),
    st.lists(st.floats(20.0, 500.0), min_size=1, max_size=2),
)
def test_a_plan_keeps_to_stops_speeds_and_force_or_is_refused(low, span, force, travel, speeds):
    identity = IDENTITY._replace(advance_min=low, advance_max=low + span, force_limit=force)
    recipe = changed(
        "paper-80gsm",
        capture__friction_advance={
            "travel_mm": travel,
            "speeds_mm_per_s": tuple(speeds),
            "excitation_s": 2.0,
            "repeats": 1,
        },
    )
    room = min(span - 2 * ADVANCE_MARGIN_M, 1e-3 * travel)
    assume(abs(room - LEAST_TRAVEL_M) > 1e-9 and abs(force - LEAST_FORCE_N) > 1e-9)
    if room < LEAST_TRAVEL_M or force < LEAST_FORCE_N:
        with pytest.raises(InputError, match=r"advance_min|travel_mm|too little to accelerate"):
            advance_plan(recipe, identity)
        return
    plan = advance_plan(recipe, identity)
    reference = plan.segments[0].reference
    assert reference.advance.min() >= low + ADVANCE_MARGIN_M - 1e-12
    assert reference.advance.max() <= low + span - ADVANCE_MARGIN_M + 1e-12
    inside = np.where(reference.stroke[1:] >= 0, np.diff(reference.advance) / plan.tick_s, 0.0)
    assert np.abs(inside).max() <= 1e-3 * max(speeds) * (1 + 1e-6)
    excited = reference.advance[reference.stroke == plan.strokes[-1].index]
    bend = np.diff(excited, 2) / plan.tick_s**2
    assert np.abs(bend).max() <= largest_acceleration(recipe, identity) * 1.001


@pytest.mark.parametrize(
    ("identity", "said"),
    [
        (IDENTITY._replace(capabilities=1), "leave out --axis advance"),
        (IDENTITY._replace(force_limit=0.0), "no advance motor"),
    ],
)
def test_a_rig_without_an_advance_motor_is_refused(identity, said):
    with pytest.raises(InputError, match=said):
        refuse_without_motor(identity)


def test_a_rig_with_one_is_not():
    refuse_without_motor(IDENTITY)


@pytest.mark.parametrize(
    ("recipe", "identity", "said"),
    [
        (RECIPE, IDENTITY._replace(advance_min=0.0, advance_max=0.012), "12 mm apart"),
        (RECIPE, IDENTITY._replace(advance_min=0.0, advance_max=0.0), "0 mm apart"),
        (
            changed("paper-80gsm", capture__friction_advance={"travel_mm": 4.0}),
            IDENTITY,
            "travel_mm = 4 is too little",
        ),
        (changed("paper-80gsm", limits={"force_N": 0.1}), IDENTITY, "limits.force_N"),
        (RECIPE, IDENTITY._replace(force_limit=0.1), "the device's force_limit"),
        (changed("paper-80gsm", rig={"joint": "linear"}), IDENTITY, "scissorcal import"),
    ],
)
def test_what_leaves_no_room_or_force_is_refused_with_the_remedy(recipe, identity, said):
    with pytest.raises(InputError, match=said):
        advance_plan(recipe, identity)


def test_a_short_guide_is_swept_as_far_as_it_goes():
    identity = IDENTITY._replace(advance_min=0.0, advance_max=0.04)
    reference = advance_plan(RECIPE, identity).segments[0].reference
    assert (reference.advance.min(), reference.advance.max()) == pytest.approx((0.005, 0.035))


def test_a_shorter_list_takes_less_time():
    less = changed("paper-80gsm", capture__friction_advance={"speeds_mm_per_s": (30.0,)})
    assert advance_plan(less, IDENTITY).duration_s < 0.3 * advance_plan(RECIPE, IDENTITY).duration_s
