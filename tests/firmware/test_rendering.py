"""The firmware renders a package: its torque, how it starts and ends, and what stops it."""

import math
import zlib
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from scissorcal.kernel import (
    Command,
    ConfigKey,
    ConfigStatus,
    Drive,
    FaultCause,
    InputFlag,
    Kernel,
    LoadCommit,
    Mode,
    PassivityConfig,
    Servo,
    ServoConfig,
    State,
    StateFlag,
    estimated_rates,
    model_image,
)
from tests.firmware.bench import CLEAR, ENABLE, Bench, rendering
from tests.kernel.zoo import make_tables

PLAIN = ServoConfig(
    torque_limit=10.0, torque_slew=1e6, force_limit=100.0, force_slew=1e7, ramp_s=0.0
)
FELT = ServoConfig(
    torque_limit=0.06, torque_slew=3.0, force_limit=3.0, force_slew=900.0, ramp_s=0.4,
    passivity=PassivityConfig(
        rig_damping=1e-4, rig_coulomb=1e-4, margin_J=1e-7, most_damping=0.02, friction_width=0.003
    ),
)  # fmt: skip
PAPER = make_tables(kappa=0.8, render_friction=True, rate_damping=0.3)
RENDER_SILENCE_TICKS = 2000


def stroke(tick: int) -> float:
    """A hand that closes and opens the blades by 0.45 rad each second."""
    return 0.6 + 0.225 * math.cos(2e-3 * math.pi * tick)


def loaded(config: ServoConfig = PLAIN, **changes: Any) -> Bench:
    """A bench with paper loaded, rendering asked for, streaming, and blades that rest open."""
    bench = Bench(**changes)
    image = model_image(PAPER, config)
    assert bench.upload(image).crc32 == zlib.crc32(image)
    assert bench.configure(ConfigKey.RENDER, 1.0).status == ConfigStatus.OK
    bench.configure(ConfigKey.STREAM, 1.0)
    bench.opening = stroke(0)
    for _ in range(300):
        bench.tick()
    return bench


def closing(bench: Bench, ticks: int, *messages: Command) -> list[State]:
    """Let the hand make strokes from the start, with these messages in each tick."""
    states = []
    for tick in range(ticks):
        bench.opening = stroke(tick)
        states.append(bench.state(*messages))
    return states


def torque_of(bench: Bench) -> float:
    """Close the blades into the paper, and return the torque once they rest there."""
    closing(bench, 300, ENABLE)
    return [bench.state(ENABLE).motor_torque for _ in range(300)][-1]


def test_each_ticks_torque_is_the_step_at_that_ticks_opening_bit_for_bit() -> None:
    bench = loaded()
    states = closing(bench, 3000, ENABLE)
    opening = np.array([state.opening for state in states], dtype=np.float32)
    still = np.full(300, opening[0])
    rates = estimated_rates(np.concatenate([still, opening]), 1000, PLAIN.rate_cutoff_Hz)[300:]
    step = Kernel(PAPER).step_many(opening, rates, bench.advance)
    assert [state.motor_torque for state in states] == step["torque"].tolist()
    assert all(rendering(state) for state in states)
    assert step["torque"].max() > 0.05


@pytest.mark.parametrize("sign", [1, -1])
def test_it_renders_what_the_loop_of_the_host_would_command(sign: int) -> None:
    """Ramp, slews, limits, friction near rest, and damping of created energy; in float32."""
    config = replace(FELT, motor_sign=sign)
    bench = loaded(config)
    servo = Servo(PAPER, config)
    servo.step(bench.state())
    servo.engage(Mode.RENDER)
    differences, wanted, added = [], [], 0.0
    for tick in range(4000):
        bench.opening = stroke(tick) + 2e-4 * math.sin(0.9 * tick)
        state = bench.state(ENABLE)
        wanted.append(servo.step(state).torque)
        added = max(added, abs(float(servo._servo.port.injected)))
        differences.append(abs(state.motor_torque - wanted[-1]))
    assert max(wanted) == pytest.approx(0.06) or min(wanted) == pytest.approx(-0.06)
    assert servo.counters.torque_slewed > 10
    assert added > 1e-3
    assert max(differences) < 1e-5


def test_the_torque_begins_at_zero_each_time_the_motors_are_enabled() -> None:
    bench = loaded(replace(PLAIN, ramp_s=0.5))
    assert torque_of(bench) > 0.01
    for _ in range(2):
        off = bench.state(ENABLE._replace(flags=0))
        assert (off.motor_torque, rendering(off)) == (0.0, False)
        ramp = [bench.state(ENABLE).motor_torque for _ in range(500)]
        assert ramp[0] == pytest.approx(0.002 * ramp[-1], rel=1e-3)
        assert np.all(np.diff(ramp) >= 0.0)


def test_without_render_it_exerts_the_command_alone() -> None:
    bench = loaded()
    assert torque_of(bench) > 0.01
    assert bench.configure(ConfigKey.RENDER, 0.0).value == 0.0
    bench.tick(ENABLE)
    state = bench.state(ENABLE._replace(torque=0.03))
    assert state.motor_torque == np.float32(0.03)
    assert not rendering(state)


def test_when_render_ends_the_torque_falls_no_faster_than_its_slew() -> None:
    bench = loaded(replace(PLAIN, torque_slew=2.0))
    before = torque_of(bench)
    bench.configure(ConfigKey.RENDER, 0.0)
    fall = [before, bench.out.torque, *(bench.state(ENABLE).motor_torque for _ in range(60))]
    assert fall[-1] == 0.0
    assert np.max(-np.diff(fall)) == pytest.approx(2e-3, rel=1e-3)


def test_render_puts_in_a_fresh_sheet() -> None:
    bench = loaded()
    first = [state.motor_torque for state in closing(bench, 400, ENABLE)]
    again = [state.motor_torque for state in closing(bench, 400, ENABLE)]
    bench.opening = stroke(0)
    for _ in range(300):
        bench.tick(ENABLE)
    bench.configure(ConfigKey.RENDER, 1.0)
    fresh = [state.motor_torque for state in closing(bench, 400, ENABLE)]
    assert max(abs(a - b) for a, b in zip(first, again, strict=True)) > 0.01
    assert max(abs(a - b) for a, b in zip(first, fresh, strict=True)) < 1e-6


def test_a_commands_torque_adds_and_ends_with_the_silence_that_brakes_without_render() -> None:
    bench = loaded()
    plain = torque_of(bench)
    added = ENABLE._replace(torque=0.01)
    assert bench.state(added).motor_torque == pytest.approx(plain + 0.01, abs=1e-7)
    quiet = [bench.state().motor_torque for _ in range(20)]
    assert quiet[5] == pytest.approx(plain + 0.01, abs=1e-7)
    assert quiet[9:] == [plain] * 11


def test_a_hosts_silence_is_not_felt_for_two_seconds_and_then_it_brakes() -> None:
    bench = loaded()
    bench.tick(ENABLE)
    silent = closing(bench, RENDER_SILENCE_TICKS + 10)
    braked = next(i for i, state in enumerate(silent) if state.flags & StateFlag.FAULT_LATCHED)
    assert braked == RENDER_SILENCE_TICKS - 1  # the tick of the COMMAND counts
    assert silent[-1].cause == FaultCause.WATCHDOG
    assert bench.out.drive is Drive.BRAKE
    assert all(rendering(state) for state in silent[:braked])
    opening = np.array([stroke(0), *(state.opening for state in silent[:braked])], np.float32)
    rates = estimated_rates(np.concatenate([[opening[0]] * 300, opening]), 1000, 100.0)[300:]
    step = Kernel(PAPER).step_many(opening, rates, bench.advance)
    assert [state.motor_torque for state in silent[:braked]] == step["torque"][1:].tolist()


def braked_after(bench: Bench, ticks: int) -> int:
    """Ticks of silence until the fault."""
    silent = closing(bench, ticks)
    return next(i for i, state in enumerate(silent) if state.flags & StateFlag.FAULT_LATCHED)


def test_after_the_silence_only_render_renders_again_and_bears_two_seconds() -> None:
    bench = loaded()
    bench.tick(ENABLE)
    assert braked_after(bench, RENDER_SILENCE_TICKS + 10) == RENDER_SILENCE_TICKS - 1
    assert not rendering(bench.state(CLEAR))
    assert braked_after(bench, 20) <= 10
    bench.tick(CLEAR)
    assert bench.configure(ConfigKey.RENDER, 1.0).status == ConfigStatus.OK
    bench.tick(ENABLE)
    assert braked_after(bench, RENDER_SILENCE_TICKS + 10) == RENDER_SILENCE_TICKS - 1


def test_five_seconds_without_a_frame_end_render_and_keep_the_package() -> None:
    bench = loaded()
    bench.tick(ENABLE._replace(flags=0))
    for _ in range(5000):
        bench.tick()
    bench.configure(ConfigKey.STREAM, 1.0)
    state = bench.state(ENABLE)
    assert state.flags & StateFlag.MOTOR_ENABLED
    assert not rendering(state)
    bench.tick(ENABLE._replace(flags=0))
    assert bench.load(LoadCommit(0)).crc32 != 0
    assert bench.configure(ConfigKey.RENDER, 1.0).status == ConfigStatus.OK


def test_without_render_the_same_silence_brakes_within_ten_milliseconds() -> None:
    bench = loaded()
    bench.configure(ConfigKey.RENDER, 0.0)
    bench.tick(ENABLE)
    assert braked_after(bench, 20) <= 10


@pytest.mark.parametrize(
    ("flag", "cause"),
    [
        (InputFlag.STOP_BUTTON, FaultCause.STOP_BUTTON),
        (InputFlag.DRIVER_FAULT, FaultCause.DRIVER),
        (InputFlag.ENCODER_BAD, FaultCause.ENCODER),
    ],
)
def test_what_stops_the_motors_stops_a_rendering_in_its_tick(
    flag: InputFlag, cause: FaultCause
) -> None:
    bench = loaded(replace(PLAIN, ramp_s=0.1))
    before = torque_of(bench)
    state = bench.state(ENABLE, flags=int(flag))
    assert (state.cause, bench.out.drive, state.motor_torque) == (cause, Drive.BRAKE, 0.0)
    assert not rendering(state)
    for _ in range(20):
        bench.tick(ENABLE)
    assert bench.out.drive is Drive.BRAKE
    assert bench.configure(ConfigKey.RENDER, 1.0).status == ConfigStatus.VALUE_REFUSED
    first = bench.state(CLEAR)
    assert first.flags & StateFlag.MOTOR_ENABLED
    assert (first.motor_torque, rendering(first)) == (0.0, False)
    bench.tick(ENABLE)
    assert not rendering(bench.state(ENABLE))
    assert bench.configure(ConfigKey.RENDER, 1.0).value == 1.0
    again = bench.state(ENABLE)
    assert 0.0 < again.motor_torque < 0.05 * before
    assert rendering(again)


def test_a_device_that_lost_power_while_rendering_has_no_package_and_says_so_when_asked() -> None:
    bench = loaded()
    assert torque_of(bench) > 0.01
    after = Bench()
    after.configure(ConfigKey.STREAM, 1.0)
    state = after.state(ENABLE)
    assert (state.motor_torque, rendering(state)) == (0.0, False)
    assert after.load(LoadCommit(0)).crc32 == 0
    after.tick(ENABLE._replace(flags=0))
    assert after.configure(ConfigKey.RENDER, 1.0).status == ConfigStatus.VALUE_REFUSED


def test_the_boards_limits_bound_what_is_rendered() -> None:
    bench = loaded(PLAIN, torque_limit=0.02, torque_slew=5.0)
    torque = [state.motor_torque for state in closing(bench, 400, ENABLE)]
    assert max(map(abs, torque)) == np.float32(0.02)
    assert np.max(np.abs(np.diff([0.0, *torque]))) <= 5e-3 * 1.001


def test_an_encoder_that_is_no_number_gives_no_torque_and_no_damage() -> None:
    bench = loaded()
    assert torque_of(bench) > 0.01
    bench.configure(ConfigKey.RENDER, 1.0)  # a fresh sheet, as the one below
    before = bench.state(ENABLE).motor_torque
    good, bench.opening = bench.opening, math.nan
    assert bench.tick(ENABLE)[1].torque == 0.0
    bench.opening = good
    for _ in range(300):
        bench.tick(CLEAR)
    bench.configure(ConfigKey.RENDER, 1.0)
    assert bench.state(ENABLE).motor_torque == pytest.approx(before, rel=1e-6)
