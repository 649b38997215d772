"""The capture's controller: margins against poles and simulation, designs, refusals."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scissorcal.device.capture import servo_config
from scissorcal.device.capture_gains import (
    ADVANCE_MASS_KG,
    TYPICAL,
    CaptureGains,
    Probed,
    capture_gains,
)
from scissorcal.device.control import (
    Axis,
    Gains,
    greatest_fall,
    loop_margins,
    loop_poles,
    open_loop,
    sag,
)
from scissorcal.device.control_design import StribeckFall
from scissorcal.device.paths import PathBuilder
from scissorcal.device.port_motion import open_motion
from scissorcal.errors import DeviceError
from scissorcal.kernel import Identity
from scissorcal.recipe import builtin_recipe
from scissorcal.recording import Estimate, ProbeResult
from tests.device.conftest import IDENTITY
from tests.device.recipes import changed
from tests.strange_device.device import StrangeDevice
from tests.strange_device.faults import Faults
from tests.strange_device.port import VirtualPort

AXIS = Axis(
    inertia=2.1e-4,
    viscous=0.002,
    coulomb=0.015,
    delay_s=1e-3,
    tick_s=1e-3,
    step=4.8e-5,
    rate_cutoff_Hz=120.0,
    most_per_count=0.015,
    inertia_factor=1.0,
)
PROBED = Probed(2.1e-4, 1e-5, 0.002, 0.015, 1e-3)
DELAYS_S = (0.0, 0.4e-3, 1e-3, 2.3e-3, 5e-3)


def steps_of(axis: Axis, gains: Gains, count: int) -> np.ndarray:
    """Place after a step of effort from outside, integrated in substeps with a queue of efforts."""
    fine = 40
    dt = axis.tick_s / fine
    place = rate = seen = last = total = 0.0
    queue = [0.0] * (round(axis.delay_s / dt) + 1)
    passed = 2.0 * math.pi * axis.rate_cutoff_Hz * axis.tick_s
    weight = passed / (1.0 + passed) if axis.rate_cutoff_Hz else 1.0
    effort, places = 0.0, []
    for _ in range(count):
        seen += weight * ((place - last) / axis.tick_s - seen)
        last = place
        total -= axis.tick_s * place
        effort = -gains.kp * place - gains.kd * seen + gains.ki * total
        for _ in range(fine):
            queue.append(effort)
            queue.pop(0)
            push = queue[0] + 1.0
            decay = math.exp(-axis.viscous * dt / axis.inertia)
            before = rate
            rate = push / axis.viscous + (rate - push / axis.viscous) * decay
            place += 0.5 * dt * (before + rate)
        places.append(place)
    return np.array(places)


@pytest.mark.parametrize("delay_s", DELAYS_S)
def test_poles_and_sag_are_those_of_a_simulated_loop(delay_s: float) -> None:
    axis = replace(AXIS, delay_s=delay_s)
    gains = Gains(0.5, 0.015, 2.0)
    slowest = float(np.abs(loop_poles(axis, gains)).max())
    assert slowest < 1.0
    places = steps_of(axis, gains, 1500)
    assert np.abs(places).max() == pytest.approx(sag(axis, gains), rel=0.02)
    swinging = Gains(60.0, 0.6, 200.0)
    assert np.abs(loop_poles(axis, swinging)).max() > 1.0
    assert np.abs(steps_of(axis, swinging, 400)).max() > 10.0 * sag(axis, gains)


AXES = {
    "delay_ms": st.floats(0.0, 6.0),
    "tick_us": st.sampled_from([250, 500, 1000, 2000]),
    "inertia": st.floats(5e-5, 1e-3),
    "size": st.floats(0.05, 0.6),
}


def compare_margins(delay_ms: float, tick_us: int, inertia: float, size: float) -> None:
    """Margins are where poles reach the unit circle."""
    axis = replace(AXIS, delay_s=1e-3 * delay_ms, tick_s=1e-6 * tick_us, inertia=inertia)
    omega = size / (axis.delay_s + 1.5 * axis.tick_s + 1.3e-3)
    shape = Gains(omega / 3.0, 1.0, omega**2 / 40.0)
    factor = 1.0 / abs(complex(open_loop(axis, shape, omega)))
    gains = Gains(*(factor * value for value in (shape.kp, shape.kd, shape.ki)))
    margins = loop_margins(axis, gains)
    if np.abs(loop_poles(axis, gains)).max() >= 1.0:
        assert not margins.stable
        return
    assert margins.crossover_rad_per_s == pytest.approx(omega, rel=0.05)

    def settles(gain: float, late_s: float = 0.0) -> bool:
        one = replace(axis, delay_s=axis.delay_s + late_s)
        more = Gains(*(gain * value for value in (gains.kp, gains.kd, gains.ki)))
        return bool(np.abs(loop_poles(one, more)).max() < 1.0)

    late = math.radians(margins.phase_deg) / omega
    assert settles(1.0, 0.9 * late)
    assert not settles(1.0, 1.15 * late)
    grown, fallen = settles(0.93 * margins.gain), settles(1.07 / margins.gain)
    assert grown
    assert fallen
    assert not (settles(1.1 * margins.gain) and settles(0.9 / margins.gain))


@settings(max_examples=10)
@given(**AXES)
def test_margins_are_where_poles_reach_the_unit_circle(**of: Any) -> None:
    compare_margins(**of)


@pytest.mark.slow
@settings(max_examples=25)
@given(**AXES)
def test_margins_of_more_axes_are_where_poles_reach_the_unit_circle(**of: Any) -> None:
    compare_margins(**of)


@pytest.mark.parametrize(
    ("tick_us", "delay_ms"), [(250, 0.2), (250, 3.0), (500, 1.0), (1000, 0.2), (2000, 3.0)]
)
def test_designs_keep_their_margins(tick_us: int, delay_ms: float) -> None:
    probed = replace(PROBED, delay_s=1e-3 * delay_ms)
    identity = IDENTITY._replace(tick_us=tick_us)
    found = capture_gains(builtin_recipe("paper-80gsm"), identity, "friction", probed)
    verdict = found.verdicts[0]
    assert verdict.status == "pass"
    assert verdict.value is not None
    axis = replace(
        AXIS,
        delay_s=probed.delay_s,
        tick_s=1e-6 * tick_us,
        rate_cutoff_Hz=found.rate_cutoff_Hz,
        inertia_factor=probed.inertia_factor,
    )
    margins = loop_margins(axis, found.opening)
    assert margins.enough
    carriage = replace(axis, inertia=ADVANCE_MASS_KG, viscous=4.0, inertia_factor=2.0)
    assert loop_margins(carriage, found.advance).enough
    assert verdict.value <= margins.phase_deg + 1e-9


def test_what_is_late_is_refused_with_the_delay_that_would_do() -> None:
    recipe = builtin_recipe("paper-80gsm")
    late = replace(PROBED, delay_s=20e-3)
    with pytest.raises(
        DeviceError, match=r"acts 20 ms after .* at most ([\d.]+) ms would do"
    ) as no:
        capture_gains(recipe, IDENTITY, "cut", late)
    enough = 1e-3 * float(str(no.value).split("at most ")[1].split()[0])
    assert 2e-3 < enough < 10e-3
    capture_gains(recipe, IDENTITY, "cut", replace(PROBED, delay_s=0.95 * enough))


@settings(max_examples=15)
@given(
    inertia=st.floats(5e-5, 1e-3),
    spread=st.floats(0.0, 0.4),
    delay_ms=st.floats(0.2, 3.0),
    late_ms=st.floats(0.0, 0.5),
    viscous=st.floats(0.0, 5e-3),
)
def test_margins_hold_over_the_probes_interval(
    inertia: float, spread: float, delay_ms: float, late_ms: float, viscous: float
) -> None:
    """At both ends of ln inertia, mean +- 1.645 sd, and the upper end of the delay."""
    sds = spread * inertia, 1e-3 * late_ms
    probed = Probed(inertia, sds[0], viscous, 0.015, 1e-3 * delay_ms, (), sds[1])
    try:
        found = capture_gains(builtin_recipe("paper-80gsm"), IDENTITY, "friction", probed)
    except DeviceError:
        return
    for end in (-1.645, 1.645):
        axis = replace(
            AXIS,
            inertia=inertia * math.exp(end * spread),
            viscous=viscous,
            delay_s=1e-3 * (delay_ms + 1.645 * late_ms),
            rate_cutoff_Hz=found.rate_cutoff_Hz,
        )
        margins = loop_margins(axis, found.opening)
        assert margins.phase_deg > 44.9
        assert margins.gain > 1.99


def test_sweeps_of_friction_get_damping_and_strokes_of_a_cut_stiffness() -> None:
    recipe = builtin_recipe("paper-80gsm")
    sweeps = capture_gains(recipe, IDENTITY, "friction", PROBED)
    strokes = capture_gains(recipe, IDENTITY, "cut", PROBED)
    assert sweeps.opening.kd > 1.2 * strokes.opening.kd
    assert sweeps.opening.kp < strokes.opening.kp
    axis = replace(AXIS, rate_cutoff_Hz=sweeps.rate_cutoff_Hz)
    assert greatest_fall(axis, sweeps.opening) > 1.3 * greatest_fall(axis, strokes.opening)


@settings(max_examples=10)
@given(level=st.floats(1e-4, 1e-2), rate=st.floats(0.02, 0.3))
def test_a_known_fall_of_friction_is_stood_or_the_slowest_steady_rate_is_said(
    level: float, rate: float
) -> None:
    recipe = builtin_recipe("paper-80gsm")
    probed = replace(PROBED, stribeck=StribeckFall(level, rate))
    found = capture_gains(recipe, IDENTITY, "friction", probed)
    axis = replace(
        AXIS,
        inertia_factor=probed.inertia_factor,
        rate_cutoff_Hz=found.rate_cutoff_Hz,
    )
    stood = greatest_fall(axis, found.opening)
    speeds = np.geomspace(0.01 * rate, 10.0 * rate, 400)
    fall = 2.0 * level * speeds / rate**2 * np.exp(-((speeds / rate) ** 2))
    assert found.steady_from == found.sticks_below
    assert found.steady_from is not None
    assert np.all(fall[speeds >= found.steady_from] <= 1.001 * stood)
    if found.steady_from > 0.0:
        just = speeds[(speeds < found.steady_from) & (speeds > 0.95 * found.steady_from)]
        assert np.all(2.0 * level * just / rate**2 * np.exp(-((just / rate) ** 2)) >= 0.99 * stood)
        assert fall.max() > stood
    verdict = found.verdicts[1]
    assert (verdict.status == "pass") == (found.steady_from <= 0.05)
    assert f"{stood:.2g}" in verdict.why


def test_where_the_fall_is_not_known_the_bound_holds_for_every_stribeck_rate() -> None:
    bound = StribeckFall.within(0.014)
    steady = bound.steady_from(0.05)
    assert steady == pytest.approx(2.0 / math.e * 0.6 * 0.014 / 0.05)
    for rate in np.geomspace(1e-3, 10.0, 60):
        known = StribeckFall(bound.level, float(rate))
        assert known.steady_from(0.05) <= steady * (1.0 + 1e-9)
    found = capture_gains(builtin_recipe("paper-80gsm"), IDENTITY, "friction", PROBED)
    assert found.sticks_below == 0.0
    assert found.verdicts[1].status == "not_evaluated"
    assert "slower ones are tried" in found.verdicts[1].why


def test_facts_of_a_probe_tell_how_friction_falls() -> None:
    facts = {"stribeck_Nm": 4e-3, "stribeck_rate_rad_per_s": 0.07}
    result = ProbeResult("rig", "0", "2026-11-22T20:00:00+00:00", facts=facts)
    probed = Probed.of(result)
    assert probed is not None
    assert probed.stribeck == StribeckFall(4e-3, 0.07)
    part = Probed.of(replace(result, facts={"stribeck_Nm": 4e-3}))
    assert part is not None
    assert part.stribeck is None


@settings(max_examples=15)
@given(delay_ms=st.floats(0.0, 3.0), inertia=st.floats(5e-5, 1e-3), kd=st.floats(0.01, 0.03))
def test_the_greatest_fall_is_where_a_loop_begins_to_swing(
    delay_ms: float, inertia: float, kd: float
) -> None:
    axis = replace(AXIS, delay_s=1e-3 * delay_ms, inertia=inertia)
    gains = Gains(20.0 * kd, kd, 100.0 * kd)
    fall = greatest_fall(axis, gains)
    assert fall <= kd + axis.viscous
    if fall == 0.0:
        return
    for share, settles in ((0.99, True), (1.01, False)):
        fallen = replace(axis, viscous=axis.viscous - share * fall)
        assert (np.abs(loop_poles(fallen, gains)).max() < 1.0) == settles


def test_a_coarse_encoder_lowers_the_gains() -> None:
    recipe = builtin_recipe("paper-80gsm")
    coarse = IDENTITY._replace(opening_resolution=2.0 * math.pi / 8000)
    fine = capture_gains(recipe, IDENTITY, "friction", PROBED)
    found = capture_gains(recipe, coarse, "friction", PROBED)
    assert found.opening.kd < fine.opening.kd
    assert coarse.opening_resolution * found.opening.kp < 0.015


def test_gains_of_the_recipe_are_used_and_judged() -> None:
    keys = {"opening_kp_Nm_per_rad": 6.0, "opening_kd_Nm_s_per_rad": 0.06}
    recipe = changed("paper-80gsm", rig__control={**keys, "opening_ki_Nm_per_rad_s": 20.0})
    found = capture_gains(recipe, IDENTITY, "friction", PROBED)
    assert found.opening == Gains(6.0, 0.06, 20.0)
    assert found.verdicts[0].status == "fail"
    assert "rig.control" in found.verdicts[0].why
    with pytest.raises(DeviceError, match="would make the rig swing"):
        capture_gains(recipe, IDENTITY, "friction", replace(PROBED, delay_s=4e-3))
    part = changed("paper-80gsm", rig__control={"opening_kp_Nm_per_rad": 1.0})
    assert capture_gains(part, IDENTITY, "friction", PROBED).opening.kp == 1.0


def test_without_a_probe_the_gains_are_typical() -> None:
    found = capture_gains(builtin_recipe("paper-80gsm"), IDENTITY, "cut", None)
    assert found == TYPICAL
    assert "device probe" in found.verdicts[0].why


def test_a_known_delay_counts_where_the_probe_told_no_inertia() -> None:
    recipe = builtin_recipe("paper-80gsm")
    result = ProbeResult("rig", "0", "2026-11-22T20:00:00+00:00", delay_s=Estimate(5e-3, 1e-4))
    probed = Probed.of(result)
    assert probed is not None
    found = capture_gains(recipe, IDENTITY, "friction", probed)
    assert found.opening.kp < 0.5
    assert "found delay, and could not tell inertia and dry friction" in found.verdicts[0].why
    with pytest.raises(DeviceError, match=r"acts 5.2 ms after.*largest_torque_Nm"):
        capture_gains(recipe, IDENTITY, "cut", probed)
    keys = {"opening_kp_Nm_per_rad": 1.0, "opening_kd_Nm_s_per_rad": 0.02}
    stated = changed("paper-80gsm", rig__control={**keys, "opening_ki_Nm_per_rad_s": 5.0})
    ours = capture_gains(stated, IDENTITY, "friction", probed)
    assert (ours.opening, ours.verdicts[0].status) == (Gains(1.0, 0.02, 5.0), "fail")
    blind = Probed.of(replace(result, delay_s=None))
    told = capture_gains(recipe, IDENTITY, "cut", blind)
    assert told.opening == TYPICAL.opening
    assert "found nothing, and could not tell" in told.verdicts[0].why


def swung(faults: Faults, gains: CaptureGains, identity: Identity) -> tuple[float, float]:
    """Largest rate and torque at the strange device over a sweep at 1 rad/s."""
    device = StrangeDevice(faults)
    link = VirtualPort(device)
    recipe = builtin_recipe("paper-80gsm")
    with open_motion(link, servo_config(recipe, link.identity, gains=gains)) as motion:
        path = PathBuilder(*motion.position, motion.tick_s)
        for place in (0.9, 0.3, 0.6):
            path.open_to(place, 1.0, 20.0)
            path.rest(0.1)
        for _ in motion.track(path.reference()):
            pass
    return device.largest_rate, device.largest_torque


@pytest.mark.parametrize(
    ("late_ms", "tick_us"),
    [(0.0, 1000), (1.0, 1000), (3.0, 1000), (5.0, 1000), (3.0, 250), (5.0, 2000)],
)
def test_an_independent_device_is_followed_without_swinging(late_ms: float, tick_us: int) -> None:
    half = 0.5e-3 * late_ms
    faults = Faults(delay_to_host_s=half, delay_to_device_s=half, tick_us=tick_us)
    # From a measurement to the torque that answers it: a tick of exchange, the line, the motor.
    tick = 1e-6 * tick_us
    delay = math.ceil(half / tick - 1e-9) * 2 * tick + tick + faults.motor_lag_s
    probed = Probed(faults.inertia, 1e-4, 4e-3, faults.dry_Nm, delay)
    identity = VirtualPort(StrangeDevice(faults)).identity
    gains = capture_gains(builtin_recipe("paper-80gsm"), identity, "friction", probed)
    rate, torque = swung(faults, gains, identity)
    assert rate < 2.0
    assert torque < 0.2
