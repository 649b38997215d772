"""Dry friction: it holds, slides at its level, stops in finite time and never chatters."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from scissorcal.device.sim.friction import DryFriction
from tests.device.sim.build import specimen

INERTIA, STEP = 2e-4, 2.5e-4
MOBILITY = STEP / INERTIA
FRICTION = DryFriction.of_joint(specimen().mechanism.friction)


def advance(friction: DryFriction, rate: float, torque: float, place: float = 0.5) -> float:
    return friction.next_rate(place, rate, rate + MOBILITY * torque, MOBILITY, 0.0)


def test_stiction_holds_up_to_breakaway_and_not_beyond() -> None:
    factor = FRICTION.factor(0.5)
    for sign, coulomb in ((1.0, 0.013), (-1.0, 0.015)):
        breakaway = sign * (coulomb + 0.004) * factor
        assert advance(FRICTION, 0.0, 0.999 * breakaway) == 0.0
        assert advance(FRICTION, 0.0, 1.001 * breakaway) * sign > 0.0


def test_stiction_holds_without_creep() -> None:
    rate = place = 0.0
    for _ in range(10_000):
        rate = advance(FRICTION, rate, 0.9 * 0.017 * FRICTION.factor(place), place)
        place += STEP * rate
    assert rate == 0.0
    assert place == 0.0


def test_steady_sliding_has_exactly_the_stated_level() -> None:
    for target in (0.02, 0.05, 0.3, -0.1, -2.0):
        level = FRICTION.sliding(0.5, target)
        rate = advance(FRICTION, target, level)
        assert rate == pytest.approx(target, rel=1e-12)


def test_a_coasting_body_stops_when_and_where_the_closed_form_says() -> None:
    """Pure Coulomb friction: t = I w / F, angle = I w^2 / (2 F)."""
    coulomb = DryFriction((0.015, 0.015), (0.0, 0.0))
    rate, angle, steps = 2.0, 0.0, 0
    while rate != 0.0:
        after = advance(coulomb, rate, 0.0, 0.0)
        angle += STEP * 0.5 * (rate + after)
        rate, steps = after, steps + 1
    assert steps * STEP == pytest.approx(INERTIA * 2.0 / 0.015, abs=STEP)
    assert angle == pytest.approx(INERTIA * 4.0 / 0.03, rel=1e-3)


def test_a_body_on_a_spring_comes_to_rest_and_stays() -> None:
    coulomb = DryFriction((0.015, 0.015), (0.0, 0.0))
    place, rate, rest = 0.05, 0.0, 0
    for _ in range(20_000):
        place += 0.5 * STEP * rate
        rate = advance(coulomb, rate, -5.0 * place, place)
        place += 0.5 * STEP * rate
        rest = rest + 1 if rate == 0.0 else 0
    assert rest > 15_000
    assert abs(5.0 * place) <= 0.015


@given(
    rate=st.floats(-100, 100),
    torque=st.floats(-10, 10),
    coulomb=st.floats(0, 1),
    viscous=st.floats(0, 1),
    stribeck=st.floats(0, 1),
    stribeck_rate=st.floats(1e-3, 10),
    brake=st.floats(0, 1),
)
def test_friction_only_dissipates_energy(
    rate: float,
    torque: float,
    coulomb: float,
    viscous: float,
    stribeck: float,
    stribeck_rate: float,
    brake: float,
) -> None:
    law = DryFriction((coulomb, coulomb), (viscous, viscous), stribeck, stribeck_rate)
    free = rate + MOBILITY * torque
    after = law.next_rate(0.0, rate, free, MOBILITY, brake)
    assert math.isfinite(after)
    assert abs(after) <= abs(free)
    assert after * free >= 0.0
