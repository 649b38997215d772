"""Gains of the hybrid law: what is chosen, what is refused, and by which figure."""

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scissorcal.control import (
    ContactGains,
    ContactLoop,
    HybridGains,
    approach_speed,
    choose_gains,
    contact_decays,
    contact_gains,
    friction_rates,
)
from scissorcal.control.gains import TOUCH_FORCE_N
from scissorcal.device import Axis, Gains, loop_margins
from scissorcal.errors import InputError
from scissorcal.kernel import HybridConfig
from tests.control.loop_poles import contact_decay

LOOP = ContactLoop(3e3, 0.05, 0.0, 1e-3, 1.5e-3, 1e-3, rate_cutoff_Hz=400.0, step_m=3.4e-6)
HARD = ContactLoop(1e4, 0.055, 0.0, 0.0, 1.5e-3, 1e-3, 400.0, stiffness_factor=1.0, mass_factor=1.0)
"""10 N/mm at the tip of a blade that is answered at once by a motor of 1.5 ms, exactly known."""


def test_damping_against_hard_material_hangs_on_the_rates_filter() -> None:
    """About 240/s behind 400 Hz; behind 100 Hz, where the phase is 88 degrees, next to none."""
    fast, slow = (
        contact_gains([replace(HARD, rate_cutoff_Hz=cutoff)]) for cutoff in (400.0, 100.0)
    )
    assert fast[0].contact_kd == pytest.approx(240.0, rel=0.1)
    assert slow[0].contact_kd < 0.2 * fast[0].contact_kd
    assert slow[1] < 0.2 * fast[1]
    assert HARD.phase_deg == pytest.approx(59.0, abs=1.0)
    assert replace(HARD, rate_cutoff_Hz=100.0).phase_deg == pytest.approx(88.0, abs=1.0)


def test_damping_that_is_too_late_excites() -> None:
    late = replace(HARD, delay_s=2e-3, viscous_N_s_per_m=1.0)
    assert late.phase_deg > 90.0
    decays = contact_decays(late, [ContactGains(kd, 0.0) for kd in (0.0, 20.0, 60.0)])
    assert decays[0] > 0.0 > decays[2]
    assert np.all(np.diff(decays) < 0.0)


def test_no_finer_grid_finds_better_gains() -> None:
    gains, decay = contact_gains([LOOP])
    kd, ki = np.meshgrid(np.linspace(0.0, 400.0, 41), np.geomspace(1.0, 100.0, 41))
    every = [ContactGains(*pair) for pair in zip(kd.ravel(), ki.ravel(), strict=True)]
    assert decay >= contact_decays(LOOP, every).max() - 1e-2
    assert decay == pytest.approx(contact_decay(LOOP, gains))


LOOPS = {
    "stiffness": st.floats(1e2, 1e5),
    "mass": st.floats(0.02, 2.0),
    "delay_ms": st.floats(0.0, 5.0),
    "tick_us": st.sampled_from([250, 500, 1000, 2000]),
    "cutoff": st.sampled_from([0.0, 100.0, 400.0]),
}


def try_gains(stiffness: float, mass: float, delay_ms: float, tick_us: int, cutoff: float) -> None:
    """Gains hold at every corner, or are refused with a figure that holds."""
    late = (1e-3 * delay_ms, 1.5e-3, 1e-6 * tick_us)
    loop = ContactLoop(stiffness, mass, 0.2, *late, cutoff)
    try:
        gains = choose_gains([loop], peak_N=2.0)
    except InputError as refusal:
        softer = re.search(r"a stiffness of at most ([\d.e+-]+) N/mm", str(refusal))
        sooner = re.search(r"a delay of at most ([\d.e+-]+) ms", str(refusal))
        if softer:
            assert 1e3 * float(softer[1]) <= stiffness
            choose_gains([replace(loop, stiffness_N_per_m=1e3 * float(softer[1]))], peak_N=2.0)
        if sooner:
            assert float(sooner[1]) <= delay_ms
            choose_gains([replace(loop, delay_s=1e-3 * float(sooner[1]))], peak_N=2.0)
        return
    contact = ContactGains(gains.contact_kd, gains.force_ki, gains.force_kp)
    assert contact_decay(loop, contact) == pytest.approx(gains.decay_per_s)
    assert gains.decay_per_s >= 4.0
    assert contact_decay(loop, ContactGains(gains.normal_kd, 0.0), gains.normal_kp) > 0.0
    axis = Axis(1.0, 0.0, 0.0, late[0] + late[1], late[2], 0.0, cutoff, 1.0, loop.mass_factor)
    assert loop_margins(axis, Gains(gains.path_kp, gains.path_kd, gains.path_ki)).enough
    HybridConfig(
        axes=2,
        force_most=5.0,
        friction_rate=(0.1, 0.1),
        effort_limit=(1.0, 1.0),
        **gains.settings(),
    )


@settings(max_examples=2)
@given(**LOOPS)
def test_gains_hold_at_every_corner_or_are_refused_with_a_figure_that_holds(**of: Any) -> None:
    try_gains(**of)


@pytest.mark.slow
@settings(max_examples=15)
@given(**LOOPS)
def test_gains_of_more_loops_hold_or_are_refused_with_a_figure_that_holds(**of: Any) -> None:
    try_gains(**of)


def test_what_cannot_be_held_is_refused_with_the_figures_that_could() -> None:
    with pytest.raises(InputError) as refused:
        choose_gains([replace(LOOP, stiffness_N_per_m=5e3)], peak_N=1.0)
    said = str(refused.value)
    assert "against 5 N/mm with 0.05 kg along the normal" in said
    assert "an effort acts 1 ms and the motor's 1.5 ms after the measurement" in said
    assert re.search(r"What would do: a stiffness of at most 4\.\d N/mm or a delay of", said)
    with pytest.raises(InputError, match="Neither softer material nor a shorter delay"):
        choose_gains([replace(HARD, stiffness_N_per_m=1e9)], peak_N=1.0)


HEAVY = ContactLoop(1e4, 1.0, 0.0, 1e-3, 1e-3, 1e-3, 400.0, surface_cutoff_Hz=100.0)


def test_of_proportional_answers_the_largest_is_taken_that_keeps_three_quarters_of_the_decay() -> (
    None
):
    asked = (0.0, 0.5, 1.0, 2.0)
    decays = {kp: contact_gains([HEAVY], force_kp=kp)[1] for kp in asked}
    enough = [kp for kp in asked if decays[kp] >= 0.75 * max(decays.values())]
    chosen = choose_gains([HEAVY], peak_N=1.0, force_kp=asked)
    assert chosen.force_kp == max(enough) > 0.0
    assert max(enough) < max(asked)
    assert chosen.decay_per_s == pytest.approx(decays[chosen.force_kp])
    assert choose_gains([HEAVY], peak_N=1.0, force_kp=(0.5,)).force_kp == 0.5


@pytest.mark.parametrize("asked", [(1.0,), (1.0, 2.0)])
def test_a_proportional_answer_that_no_gains_hold_is_refused_and_named(
    asked: tuple[float, ...],
) -> None:
    with pytest.raises(InputError, match="no force_kp"):
        choose_gains([replace(LOOP, stiffness_N_per_m=2e3)], peak_N=1.0, force_kp=asked)


def test_the_worst_of_several_loops_decides() -> None:
    heavy, light = replace(LOOP, mass_kg=0.2), replace(LOOP, mass_kg=0.045)
    both = choose_gains([heavy, light], peak_N=1.0)
    alone = choose_gains([heavy], peak_N=1.0)
    assert both.decay_per_s < alone.decay_per_s
    assert both.phase_deg == light.phase_deg
    assert both.approach_speed == pytest.approx(alone.approach_speed)
    with pytest.raises(ValueError, match="one loop or more"):
        choose_gains([], peak_N=1.0)


def test_a_coarse_encoder_lowers_the_gains_or_is_refused() -> None:
    fine = choose_gains([LOOP], peak_N=1.0)
    coarse = choose_gains([replace(LOOP, step_m=1e-4)], peak_N=1.0)
    assert coarse.contact_kd < fine.contact_kd
    assert coarse.path_kp < fine.path_kp
    impulse = LOOP.mass_kg * coarse.contact_kd * 1e-4 * 0.72
    assert 0.5 < impulse * (1.25 * 1.15 * 3e3 / 0.05) ** 0.5 / LOOP.most_per_count_N < 1.05
    with pytest.raises(InputError, match=r"counts of 1e\+04 um.*finer encoder"):
        choose_gains([replace(LOOP, step_m=1e-2, viscous_N_s_per_m=30.0)], peak_N=1.0)


def test_the_approach_is_as_fast_as_its_peak_allows() -> None:
    speed = approach_speed([LOOP], 1.0)
    hardest = (1.25 * 3e3 * 1.15 * 0.05) ** 0.5
    assert speed * hardest + TOUCH_FORCE_N == pytest.approx(1.0)
    with pytest.raises(InputError, match=r"noticed at 0\.2 N"):
        approach_speed([LOOP], 0.2)


def test_without_damping_the_bands_of_friction_are_as_wide_as_for_one_per_second() -> None:
    gains = HybridGains(0.0, 0.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1e-2, 4.0, 120.0)
    assert friction_rates(gains, (2e-4,), (5e-3,)) == pytest.approx((25.0,))
