"""The sampled loop of pressing: its poles against closed forms, and against the C law in time."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from scissorcal.control import (
    ContactGains,
    ContactLoop,
    contact_gains,
)
from tests.control.loop_poles import contact_decay, contact_poles
from tests.control.plant import Blade, Disc, Plant
from tests.control.rig import loop_of, mass_at, resting
from tests.control.steering import Known, Steering
from tests.kernel.golden_hybrid import hybrid_config

FAST = ContactLoop(3e3, 0.05, 4.0, 0.0, 0.0, 1e-6, rate_cutoff_Hz=0.0)
"""So fast a tick that the loop is the continuous one."""


@pytest.mark.parametrize("damping", [0.0, 40.0])
def test_a_fast_tick_gives_the_printed_equations_poles(damping: float) -> None:
    """m s^3 + b s^2 + k s + k k_I, with b of mechanism and law together."""
    gains = ContactGains(damping, 30.0)
    poles = contact_poles(FAST, gains)
    found = np.log(poles[np.abs(poles) > 0.5]) / FAST.tick_s
    whole = FAST.viscous_N_s_per_m + FAST.mass_kg * damping
    stiffness = FAST.stiffness_N_per_m
    printed = np.roots([FAST.mass_kg, whole, stiffness, stiffness * gains.force_ki])
    assert np.sort_complex(found) == pytest.approx(np.sort_complex(printed), rel=2e-3)


def test_a_proportional_answer_stiffens_the_printed_equation() -> None:
    """m s^3 + b s^2 + k (1 + k_P) s + k k_I."""
    poles = contact_poles(FAST, ContactGains(40.0, 30.0, 1.5))
    found = np.log(poles[np.abs(poles) > 0.5]) / FAST.tick_s
    whole = FAST.viscous_N_s_per_m + FAST.mass_kg * 40.0
    printed = np.roots([FAST.mass_kg, whole, 2.5 * 3e3, 3e3 * 30.0])
    assert np.sort_complex(found) == pytest.approx(np.sort_complex(printed), rel=2e-3)


@pytest.mark.parametrize("stated", [0.67, 1.0, 1.5])
def test_a_felt_surface_changes_the_damping_by_the_error_of_the_compliance(stated: float) -> None:
    """Far below its cutoff the damping is kd times stated over true compliance."""
    loop = replace(FAST, surface_cutoff_Hz=3e3)
    loop = replace(loop, stiffness_N_per_m=3e3 / stated)
    told = replace(loop, stiffness_factor=1.0, mass_factor=1.0)
    found = contact_decay(told, ContactGains(40.0, 2.0))
    same = contact_decay(replace(told, surface_cutoff_Hz=0.0), ContactGains(40.0, 2.0))
    assert found == pytest.approx(same, rel=1e-3)
    wrong = replace(loop, stiffness_factor=stated if stated >= 1.0 else 1.0 / stated)
    ratios = (1.0, wrong.stiffness_factor, 1.0 / wrong.stiffness_factor)
    each = [
        contact_decay(
            replace(
                loop,
                stiffness_N_per_m=ratio * loop.stiffness_N_per_m,
                surface_cutoff_Hz=0.0,
                stiffness_factor=1.0,
                mass_factor=1.0,
            ),
            ContactGains(40.0 * ratio, 2.0),
        )
        for ratio in ratios
    ]
    assert contact_decay(replace(wrong, mass_factor=1.0), ContactGains(40.0, 2.0)) == (
        pytest.approx(min(each), rel=0.02)
    )


def test_the_printed_law_is_stable_below_damping_over_mass_alone() -> None:
    onset = brentq(lambda gain: contact_decay(alone(FAST), ContactGains(0.0, gain)), 1.0, 500.0)
    assert onset == pytest.approx(FAST.viscous_N_s_per_m / FAST.mass_kg, rel=1e-3)


def alone(loop: ContactLoop) -> ContactLoop:
    """The loop with stiffness and mass as stated."""
    return replace(loop, stiffness_factor=1.0, mass_factor=1.0)


@settings(max_examples=40)
@given(
    stiffness=st.floats(1e1, 1e6),
    mass=st.floats(1e-3, 1e2),
    delay_ms=st.floats(0.0, 9.0),
    lag_ms=st.sampled_from([0.0, 0.3, 3.0]),
    tick_us=st.sampled_from([250, 1000, 4000]),
    cutoff=st.sampled_from([0.0, 30.0, 400.0]),
    sensor=st.sampled_from([0.0, 50.0]),
)
def test_decay_is_that_of_the_worst_corner(
    stiffness: float,
    mass: float,
    delay_ms: float,
    lag_ms: float,
    tick_us: int,
    cutoff: float,
    sensor: float,
) -> None:
    """At extremes too, and the law's own mass stays the stated one at each corner."""
    late = (1e-3 * delay_ms, 1e-3 * lag_ms, 1e-6 * tick_us)
    loop = ContactLoop(stiffness, mass, 0.5, *late, cutoff, sensor)
    gains = ContactGains(50.0, 5.0)
    if math.sqrt(1.25 * 1.15 * stiffness / mass) * loop.tick_s >= math.pi:
        assert contact_decay(loop, gains) == -math.inf
        return
    worst = min(
        -math.log(
            np.abs(
                contact_poles(
                    replace(loop, stiffness_N_per_m=stiffer, mass_kg=heavier),
                    # acceleration per rate times the mass that the law takes it for
                    ContactGains(50.0 * mass / heavier, 5.0),
                )
            ).max()
        )
        / loop.tick_s
        for stiffer, heavier in loop.corners
    )
    assert contact_decay(loop, gains) == pytest.approx(worst, rel=1e-6, abs=1e-6)


CASES = {
    "no delay": (0.0, Disc(stiffness=1e4), Blade(delay_s=0.0), 400.0),
    "a tick late": (0.0, Disc(stiffness=3e3), Blade(delay_s=1e-3), 400.0),
    "coupled axes": (0.4, Disc(stiffness=3e3), Blade(delay_s=1e-3), 400.0),
    "part of a tick, slow sensor": (
        0.3,
        Disc(stiffness=3e3),
        Blade(delay_s=0.4e-3, force_lag_s=1e-3),
        200.0,
    ),
    "late, slow filter": (0.2, Disc(stiffness=1e3), Blade(delay_s=2.3e-3, lag_s=1e-3), 100.0),
}
FELT = {
    "no delay": (200.0, 0.0),
    "a tick late": (100.0, 0.1),
    "part of a tick, slow sensor": (100.0, 0.1),
}
"""Cutoff (Hz) of a surface's rate that is felt, and force_kp."""
QUICK = [("late, slow filter", (0.0, 0.0)), ("part of a tick, slow sensor", (100.0, 0.1))]
"""What the default suite tries: between them they have each kind of delay and of feeling."""


@pytest.mark.parametrize(
    ("title", "felt"),
    [
        pytest.param(title, felt, marks=() if (title, felt) in QUICK else pytest.mark.slow)
        for title, felt in [*((title, (0.0, 0.0)) for title in CASES), *FELT.items()]
    ],
)
def test_the_c_law_becomes_unstable_where_the_poles_say(
    title: str, felt: tuple[float, float]
) -> None:
    """On the plant in substeps, at 5 % below and above the integral gain of the unit circle."""
    opening, disc, blade, cutoff = CASES[title]
    blade = replace(blade, dry=(0.0, 0.0), viscous=(0.0, 0.0), step=(0.0, 0.0))
    mass, (surface, force_kp) = mass_at(blade, opening), felt
    loop = alone(loop_of(blade, disc, mass, rate_cutoff_Hz=cutoff, surface_cutoff_Hz=surface))
    chosen = contact_gains([loop], force_kp=force_kp)[0]

    def growth(gain: float) -> float:
        return -contact_decay(loop, replace(chosen, force_ki=gain))

    onset = brentq(growth, chosen.force_ki, 500.0)
    for share in (0.95, 1.05):
        gains = replace(chosen, force_ki=share * onset)
        rate = swing_growth(blade, disc, opening, gains, (cutoff, surface))
        assert (rate > 0.0) == (share > 1.0), (share, rate)
        if opening == 0.0 and share < 1.0:  # axes that do not meet: nothing but this loop
            assert rate == pytest.approx(growth(share * onset), rel=0.03)


def swing_growth(
    blade: Blade, disc: Disc, opening: float, gains: ContactGains, cutoffs: tuple[float, float]
) -> float:
    """Growth (1/s) of the force's swing, pressing at 2 N on a disc so large that it is flat."""
    lever, radius = blade.length * math.cos(opening), 20.0
    top = blade.length * math.sin(opening) + 2.0 / disc.stiffness
    disc = replace(disc, radius=radius, centre=(lever, top - radius))
    plant = Plant(blade, disc, place=[opening, 0.0])
    plant.effort = (-2.0 * lever, 0.0)
    plant.state[4:6] = plant.effort
    plant.state[8] = plant.force()
    plant.state[2] = 2e-4 / lever  # a small kick along the normal
    plant.state[3] = plant.state[2] * blade.length * math.sin(opening)
    config = hybrid_config(
        contact_kd=gains.contact_kd,
        force_kp=gains.force_kp,
        force_ki=gains.force_ki,
        surface_cutoff_Hz=cutoffs[1],
        force_slew=1e6,
        friction_share=0.0,
        path_kp=400.0,
        path_kd=40.0,
        path_ki=0.0,
        integral_most=100.0,
        effort_limit=(50.0, 50.0),
    )
    run = Steering(plant, config, Known(rate_cutoff_Hz=cutoffs[0])).run(2.0, resting())
    off = np.abs(run["force"] - 2.0)
    return math.log(off[-400:].max() / off[600:1000].max()) / 1.0
