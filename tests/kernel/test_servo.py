"""The servo's promises: limits, ramp, watchdog, faults, lost frames, the books of energy."""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest

from scissorcal.kernel import (
    Command,
    FaultCause,
    Mode,
    SampleFlag,
    Servo,
    ServoConfig,
    State,
    StateFlag,
    StopReason,
    decode,
    encode,
)
from tests.kernel.reference_wire import unstuffed
from tests.kernel.zoo import make_tables

ENABLE, CLEAR_FAULT = 1, 2
CONFIG = ServoConfig(
    torque_limit=0.5,
    torque_slew=50.0,
    force_limit=10.0,
    force_slew=5000.0,
    ramp_s=0.1,
    damping_Nm_s_per_rad=0.05,
    opening_kp=6.0,
    opening_kd=0.06,
    opening_ki=20.0,
    advance_kp=3000.0,
    advance_kd=40.0,
)


def state(tick: int, opening: float = 0.6, advance: float = -0.02, flags: int = 1) -> State:
    return State(
        flags, tick % 2**32, 1000 * tick % 2**32, opening, advance, motor_torque=0, handle_force=0
    )


def closing(start: int = 1, rate: float = 0.5) -> Iterator[State]:
    """One state a tick, closing at a steady rate."""
    tick = start
    while True:
        yield state(tick, 0.7 - rate * 1e-3 * (tick - start))
        tick += 1


def rendering(**changes: object) -> Servo:
    servo = Servo(make_tables(**changes), CONFIG)
    servo.engage(Mode.RENDER)
    return servo


def test_idle_releases_the_motors_and_still_answers() -> None:
    servo = Servo(None, CONFIG)
    assert servo.step(state(5)) == Command(0, 5, 0.0, 0.0)
    assert servo.mode is Mode.IDLE


def test_rendering_starts_from_zero_and_reaches_the_model_s_force_after_the_ramp() -> None:
    servo = rendering()
    forces = [servo.step(s).force for s, _ in zip(closing(), range(200), strict=False)]
    assert forces[0] == 0
    shares = np.array(forces) / -0.6  # the crack runs all the time, so the model says -J_c h
    expected = np.minimum(np.arange(200) / 100, 1.0)
    np.testing.assert_allclose(shares, expected, atol=2e-3)


def test_rendering_again_ramps_again() -> None:
    servo = rendering()
    states = closing()
    for _ in range(150):
        servo.step(next(states))
    servo.engage(Mode.IDLE)
    servo.step(next(states))
    servo.engage(Mode.RENDER)
    assert abs(servo.step(next(states)).force) < 0.01


def test_torque_meets_limit_and_slew_and_counts_it() -> None:
    servo = Servo(
        make_tables(fracture_energy=0.0),
        replace(CONFIG, ramp_s=0.0, torque_limit=0.05, torque_slew=10.0),
    )
    servo.engage(Mode.RENDER)
    servo.fresh_sheet(-0.001)
    torques = [servo.step(s).torque for s, _ in zip(closing(), range(100), strict=False)]
    steps = np.diff([0.0, *torques])
    assert max(torques) == pytest.approx(0.05)
    assert np.abs(steps).max() <= 10.0 * 1e-3 * 1.0001
    assert servo.counters.torque_limited > 50
    assert servo.counters.torque_slewed >= 4
    assert servo.telemetry()["flags"][0] & SampleFlag.TORQUE_LIMITED


def test_a_force_limit_of_zero_keeps_the_advance_motor_off() -> None:
    servo = Servo(make_tables(), replace(CONFIG, force_limit=0.0, ramp_s=0.0))
    servo.engage(Mode.RENDER)
    commands = [servo.step(s) for s, _ in zip(closing(), range(50), strict=False)]
    assert all(c.force == 0 for c in commands)
    assert commands[-1].torque > 0


def test_damping_opposes_the_rate() -> None:
    servo = Servo(None, CONFIG)
    servo.engage(Mode.DAMP)
    for s, _ in zip(closing(rate=0.8), range(200), strict=False):
        command = servo.step(s)
    assert command.torque == pytest.approx(0.05 * 0.8, rel=1e-3)
    assert command.force == 0


def joint(servo: Servo, ticks: int, gone: Callable[[int], bool] = lambda tick: False) -> np.ndarray:
    """A bare joint of 2e-4 kg m^2 with some friction under the servo; its opening per tick."""
    opening, rate, torque = 0.6, 0.0, 0.0
    track = []
    for tick in range(ticks):
        acceleration = (torque - 0.002 * rate) / 2e-4
        rate += acceleration * 1e-3
        opening += rate * 1e-3
        track.append(opening)
        if not gone(tick):
            torque = servo.step(state(tick, opening)).torque
    return np.array(track)


def smooth_path(n: int = 800) -> tuple[np.ndarray, np.ndarray]:
    t = np.linspace(0.0, 1.0, n)
    opening = 0.6 - 0.2 * (10 * t**3 - 15 * t**4 + 6 * t**5)
    return opening, np.gradient(opening, 1e-3)


@pytest.mark.parametrize("every", [0, 5])
def test_tracking_follows_and_lost_frames_do_not_shift_it(every: int) -> None:
    opening, rate = smooth_path()
    servo = Servo(None, CONFIG)
    servo.set_reference(opening, rate, np.full(800, -0.02), np.arange(800) // 100)
    servo.engage(Mode.TRACK)
    track = joint(servo, 1000, lambda tick: every > 0 and tick % every == every - 1)
    assert np.abs(track[:800] - opening).max() < 0.01
    assert track[-1] == pytest.approx(opening[-1], abs=2e-3)
    assert servo.track_index == 998 if every else 999
    assert servo.counters.misses == (199 if every else 0)
    assert servo.stop_reason is StopReason.NONE


def test_samples_have_their_stroke_while_tracking_and_minus_one_after_the_end() -> None:
    servo = Servo(None, CONFIG)
    servo.set_reference([0.6] * 4, [0.0] * 4, [-0.02] * 4, [7, 7, 8, 8])
    servo.engage(Mode.TRACK)
    strokes = []
    for tick in (10, 11, 13, 14):
        servo.step(state(tick))
        strokes.append(int(servo.telemetry()["stroke"][0]))
    assert strokes == [7, 7, -1, -1]


def test_the_integral_does_not_wind_up_at_the_limit() -> None:
    """Held away from its aim for long, the servo lets go at once when the aim is passed."""
    servo = Servo(None, replace(CONFIG, torque_slew=1e6, opening_kd=0.0))
    servo.set_reference([0.7] * 9000, [0.0] * 9000, [-0.02] * 9000, [0] * 9000)
    servo.engage(Mode.TRACK)
    for tick in range(5000):
        command = servo.step(state(tick, 0.5))
    assert command.torque == pytest.approx(0.5)
    for tick in range(5000, 5010):
        command = servo.step(state(tick, 0.78))
    assert command.torque < 0.05


def test_tracking_that_is_lost_stops() -> None:
    servo = Servo(None, replace(CONFIG, opening_error_limit=0.2))
    servo.set_reference([0.6], [0.0], [-0.02], [0])
    servo.engage(Mode.TRACK)
    for tick in range(1, 100):
        held = servo.step(state(tick, 0.42)).torque
    assert servo.stop_reason is StopReason.NONE
    torques = [servo.step(state(tick, 0.395)).torque for tick in range(100, 400)]
    assert servo.stop_reason is StopReason.TRACKING_LOST
    assert held > 0.4
    assert np.all(np.diff(torques) <= 0.0)
    assert torques[125] == pytest.approx(0.5 * held, rel=0.05), "half of it after 0.125 s"
    assert torques[251:] == [0.0] * 49


def test_the_stop_latches() -> None:
    servo = rendering()
    states = closing()
    for _ in range(150):
        assert servo.step(next(states)).flags == ENABLE
    servo.stop()
    assert servo.step(next(states))[2:4] == (0.0, 0.0)
    servo.engage(Mode.RENDER)
    for _ in range(50):
        command = servo.step(next(states))
        assert (command.flags, command.torque, command.force) == (0, 0.0, 0.0)
    assert servo.stop_reason is StopReason.ASKED
    assert "asked" in servo.stop_reason.sentence


def test_a_missing_heartbeat_leaves_damping_then_stops() -> None:
    servo = Servo(make_tables(), replace(CONFIG, supervisor_ms=20))
    servo.engage(Mode.RENDER)
    states = closing()
    for _ in range(100):
        servo.step(next(states))
    modes = []
    for _ in range(110):
        command = servo.step(next(states), heartbeat=False)
        modes.append(servo.mode)
    assert modes[18] is Mode.RENDER
    assert modes[19] is Mode.DAMP
    assert servo.stop_reason is StopReason.SUPERVISOR_LOST
    assert command.flags == 0
    assert servo.counters.fallback_frames > 50
    assert servo.telemetry()["flags"][0] & SampleFlag.FALLBACK


def test_rendering_ramps_up_again_when_the_heartbeat_returns() -> None:
    servo = Servo(make_tables(), replace(CONFIG, supervisor_ms=20))
    servo.engage(Mode.RENDER)
    states = closing()
    for _ in range(30):
        servo.step(next(states), heartbeat=False)
    assert servo.mode is Mode.DAMP
    crack = servo.crack
    first = servo.step(next(states))
    assert servo.mode is Mode.RENDER
    assert servo.crack >= crack
    assert abs(first.force) < 0.02
    for _ in range(120):
        last = servo.step(next(states))
    assert abs(last.force) > 10 * abs(first.force)
    assert not servo.telemetry()["flags"][0] & SampleFlag.FALLBACK


def test_tracking_is_not_taken_up_in_the_middle_of_its_path() -> None:
    servo = Servo(None, replace(CONFIG, supervisor_ms=20))
    servo.set_reference([0.6] * 500, [0.0] * 500, [-0.02] * 500, [0] * 500)
    servo.engage(Mode.TRACK)
    for tick in range(1, 31):
        servo.step(state(tick), heartbeat=False)
    servo.step(state(31))
    assert servo.mode is Mode.DAMP
    servo.engage(Mode.TRACK)
    servo.step(state(32))
    assert servo.mode is Mode.TRACK


@pytest.mark.parametrize("bad", [math.nan, math.inf, 7.0])
def test_an_opening_that_is_not_finite_gives_zero_torque(bad: float) -> None:
    servo = rendering()
    states = closing()
    for _ in range(150):
        assert next_torque(servo, states) >= 0
    tick = next(states).sequence
    command = servo.step(state(tick, opening=bad))
    assert (command.torque, command.force) == (0.0, 0.0)
    assert servo.counters.invalid_frames == 1
    assert servo.telemetry()["flags"][0] & SampleFlag.INVALID
    assert math.isfinite(servo.rates[0])


def next_torque(servo: Servo, states: Iterator[State]) -> float:
    return servo.step(next(states)).torque


def test_a_repeated_frame_gets_the_same_answer_and_changes_nothing() -> None:
    servo = rendering()
    states = closing()
    for _ in range(80):
        last = next(states)
        first = servo.step(last)
    sample, rates, ledger = servo.telemetry(), servo.rates, servo.ledger
    assert servo.step(last) == first
    assert servo.rates == rates
    assert servo.ledger == ledger
    assert servo.telemetry() == sample
    assert servo.counters.duplicates == 1
    assert servo.counters.frames == 80


def test_device_time_is_unwrapped() -> None:
    servo = Servo(None, CONFIG)
    start = 2**32 - 3000
    times = []
    for tick in range(6):
        us = (start + 1000 * tick) % 2**32
        servo.step(State(0, tick, us, 0.6, 0.0, 0.0, 0.0))
        times.append(int(servo.telemetry()["device_time_us"][0]))
    assert np.diff(times).tolist() == [1000] * 5


def test_the_rate_survives_gaps_repeated_times_and_a_restarted_clock() -> None:
    servo = Servo(None, CONFIG)
    servo.engage(Mode.DAMP)
    sent = [(k, 1000 * k) for k in range(1, 100) if k % 9 not in (0, 1)]
    sent += [(99, 99_000), (100, 100_000), (101, 100_000), (102, 101_000)]
    sent += [(103, 5000), (104, 6000)]  # the clock fell back
    for sequence, us in sent:
        servo.step(State(1, sequence, us, 0.9 - 2e-4 * sequence, 0.0, 0.0, 0.0))
        if sequence >= 99:
            assert servo.rates[0] == pytest.approx(-0.2, rel=5e-3)
    servo.step(State(1, 404, 306_000, 0.9 - 2e-4 * 404, 0.0, 0.0, 0.0))  # 300 ticks lost
    assert servo.rates[0] == pytest.approx(-0.2, rel=5e-3)
    assert servo.stop_reason is StopReason.NONE


def test_a_fault_before_the_start_is_cleared_without_being_counted() -> None:
    servo = Servo(None, replace(CONFIG, fault_clearings=0))
    servo.engage(Mode.DAMP)
    command = servo.step(state(1, flags=StateFlag.FAULT_LATCHED))
    assert command == Command(ENABLE | CLEAR_FAULT, 1, 0.0, 0.0)
    assert servo.step(state(2)).flags == ENABLE
    assert servo.counters.faults == 0
    servo.step(state(3, flags=StateFlag.FAULT_LATCHED))
    assert servo.stop_reason is StopReason.DEVICE_FAULT


def test_faults_are_cleared_a_limited_number_of_times_and_forces_ramp_up_again() -> None:
    servo = Servo(make_tables(), replace(CONFIG, fault_clearings=2))
    servo.engage(Mode.RENDER)
    states = closing()
    for fault in range(3):
        for _ in range(150):
            command = servo.step(next(states))
        assert command.force == pytest.approx(-0.6, rel=1e-2)
        command = servo.step(next(states)._replace(flags=int(StateFlag.FAULT_LATCHED)))
        if fault < 2:
            assert command[0] == ENABLE | CLEAR_FAULT
            assert command[2:4] == (0.0, 0.0)
            assert abs(servo.step(next(states)).force) < 0.02
    assert servo.stop_reason is StopReason.DEVICE_FAULT
    assert command.flags == 0


@pytest.mark.parametrize("cause", FaultCause)
def test_motors_go_on_by_themselves_only_after_a_late_host(cause: FaultCause) -> None:
    """A cause that is not told, as by a device of version 1, is taken for a late host."""
    servo = rendering()
    servo.step(state(1))
    command = servo.step(state(2, flags=StateFlag.FAULT_LATCHED)._replace(cause=int(cause)))
    if cause in (FaultCause.NONE, FaultCause.WATCHDOG):
        assert command.flags == ENABLE | CLEAR_FAULT
        assert servo.step(state(3)).flags == ENABLE
    else:
        assert command == Command(0, 2, 0.0, 0.0)
        assert servo.stop_reason is StopReason.DEVICE_FAULT


def test_a_fault_of_any_cause_from_before_the_start_is_cleared() -> None:
    servo = rendering()
    for tick in range(1, 10):
        stopped = state(tick, flags=StateFlag.FAULT_LATCHED)._replace(cause=FaultCause.STOP_BUTTON)
        assert servo.step(stopped).flags == ENABLE | CLEAR_FAULT
    assert servo.step(state(10)).flags == ENABLE


def test_a_fault_that_cannot_be_cleared_stops() -> None:
    servo = Servo(None, CONFIG)
    servo.engage(Mode.DAMP)
    for tick in range(1, 102):
        servo.step(state(tick, flags=StateFlag.FAULT_LATCHED))
    assert servo.stop_reason is StopReason.DEVICE_FAULT


def test_frames_queued_before_a_clearing_do_not_stop_the_servo() -> None:
    """A host that stood still for 0.2 s finds 200 states, all older than its first clearing."""
    servo = Servo(None, CONFIG)
    servo.set_reference(np.full(1000, 0.6), np.zeros(1000), np.full(1000, -0.02), np.zeros(1000))
    servo.engage(Mode.TRACK)
    for tick in range(1, 51):
        servo.step(state(tick))
    index = servo.track_index
    for tick in range(51, 251):
        command = servo.step(state(tick, flags=StateFlag.FAULT_LATCHED), answered=tick == 250)
    assert command == Command(ENABLE | CLEAR_FAULT, 250, 0.0, 0.0)
    assert servo.step(state(251)).flags == ENABLE
    assert servo.stop_reason is StopReason.NONE
    assert servo.counters.faults == 1
    assert servo.track_index == index + 1, "the reference waited for the blades"


def test_clearings_that_were_sent_and_cleared_nothing_stop() -> None:
    servo = Servo(None, CONFIG)
    servo.engage(Mode.DAMP)
    for tick in range(1, 1002):
        assert servo.stop_reason is StopReason.NONE
        servo.step(state(tick, flags=StateFlag.FAULT_LATCHED), answered=tick % 10 == 0)
    assert servo.stop_reason is StopReason.DEVICE_FAULT


def test_in_idle_a_fault_is_cleared_without_enabling() -> None:
    servo = Servo(None, CONFIG)
    assert servo.step(state(1, flags=StateFlag.FAULT_LATCHED)).flags == CLEAR_FAULT


def test_an_encoder_fault_stops_at_once() -> None:
    servo = rendering()
    servo.step(state(1))
    command = servo.step(state(2, flags=StateFlag.ENCODER_FAULT))
    assert command == Command(0, 2, 0.0, 0.0)
    assert servo.stop_reason is StopReason.ENCODER_FAULT


def test_bytes_in_bytes_out_is_the_same_step() -> None:
    by_state, by_bytes = rendering(), rendering()
    for s, _ in zip(closing(), range(120), strict=False):
        command = by_state.step(s)
        payload = unstuffed(encode(s)[:-1])[:-2]
        assert decode(unstuffed(by_bytes.answer(payload)[:-1])[:-2]) == command
    with pytest.raises(ValueError, match="no STATE"):
        by_bytes.answer(b"\2" * 28)


def test_invalid_values_are_refused() -> None:
    servo = Servo(None, CONFIG)
    with pytest.raises(ValueError, match="RENDER needs"):
        servo.engage(Mode.RENDER)
    with pytest.raises(ValueError, match="TRACK needs"):
        servo.engage(Mode.TRACK)
    with pytest.raises(ValueError, match="one shape"):
        servo.set_reference([0.6], [0.0, 0.0], [0.0], [0])
    with pytest.raises(ValueError, match="finite"):
        servo.set_reference([math.nan], [0.0], [0.0], [0])
    with pytest.raises(ValueError, match="half a turn"):
        servo.set_reference([4.0], [0.0], [0.0], [0])
    servo.set_reference([0.6], [0.0], [-0.02], [0])
    servo.engage(Mode.TRACK)
    servo.step(state(1))
    with pytest.raises(ValueError, match="cannot change"):
        servo.set_reference([0.6], [0.0], [0.0], [0])


@pytest.mark.parametrize(
    "change",
    [
        {"torque_limit": math.nan},
        {"torque_limit": -1.0},
        {"force_slew": math.inf},
        {"tick_us": 0},
        {"opening_error_limit": 0.0},
        {"supervisor_ms": -1},
    ],
)
def test_limits_that_are_not_numbers_are_refused(change: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=next(iter(change))):
        replace(CONFIG, **change)  # type: ignore[arg-type]


def hand_against_rendering(servo: Servo, ticks: int = 4000) -> None:
    """A hand swings a joint of 5e-4 kg m^2 to and fro against what is rendered.

    The joint has the rendered torque on it for the tick after it was commanded, as a rig has.
    """
    opening, rate, torque = 0.7, 0.0, 0.0
    for tick in range(ticks):
        aim = 0.5 + 0.25 * math.cos(2 * math.pi * tick / 1000)
        for _ in range(10):
            push = 3.0 * (aim - opening) - 0.05 * rate
            rate += (torque + push - 0.004 * rate) / 5e-4 * 1e-4
            opening += rate * 1e-4
        torque = servo.step(state(tick, opening)).torque


@pytest.mark.parametrize("kappa", [1.0, 0.7])
def test_rendering_creates_negligible_energy(kappa: float) -> None:
    """The books close: the motor takes up what the model took, but for what sampling adds.

    A spring of stiffness K sampled at T and felt one tick late gives back more than it took, by
    some K T rate^2 for each second of contact: here less than 5 % of what the cut takes. The ramp
    at the start and the limits only take energy out.
    """
    servo = Servo(make_tables(kappa=kappa, render_friction=True), CONFIG)
    servo.engage(Mode.RENDER)
    hand_against_rendering(servo)
    ledger = servo.ledger
    assert ledger.fracture_J > 5e-3
    assert ledger.friction_J > 5e-3
    assert (ledger.arrest_J > 1e-4) == (kappa < 1)
    taken = ledger.fracture_J + ledger.arrest_J + ledger.friction_J
    assert -0.1 * taken < ledger.created_J < 0.05 * taken


def test_the_energies_of_a_press_balance_when_the_mode_ends() -> None:
    servo = Servo(make_tables(fracture_energy=0.0), replace(CONFIG, ramp_s=0.0))
    servo.engage(Mode.RENDER)
    servo.fresh_sheet(-0.001)
    for s, _ in zip(closing(), range(100), strict=False):
        servo.step(s)
    stored = servo.ledger.stored_J
    assert stored > 0
    servo.engage(Mode.IDLE)
    servo.step(state(500))
    assert servo.ledger.stored_J == 0
    assert servo.ledger.arrest_J == pytest.approx(stored)


def test_a_motor_sign_turns_commanded_and_measured_torque_round_on_the_wire_alone() -> None:
    damping = replace(CONFIG, damping_Nm_s_per_rad=0.1)
    plain, turned = Servo(None, damping), Servo(None, replace(damping, motor_sign=-1))
    plain.engage(Mode.DAMP)
    turned.engage(Mode.DAMP)
    for tick in range(50):
        opening, torque = 0.6 - 1e-3 * tick, 0.02
        right = plain.step(State(1, tick, 1000 * tick, opening, 0.0, torque, 0.0))
        wrong = turned.step(State(1, tick, 1000 * tick, opening, 0.0, -torque, 0.0))
        assert wrong.torque == -right.torque
        assert wrong.force == right.force
        assert turned.telemetry() == plain.telemetry()
    assert right.torque > 0.05
    assert turned.ledger == plain.ledger
    with pytest.raises(ValueError, match="motor_sign must be 1 or -1"):
        replace(CONFIG, motor_sign=2)
