"""The servo when frames are wrong: leaps, repeats, clocks that stand, stalls, faults, backlogs."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scissorcal.kernel import Mode, SampleFlag, Servo, State, StateFlag, StopReason
from tests.kernel.test_servo import CONFIG, closing, rendering, state
from tests.kernel.test_servo_stamps import STAMPS_UNTIL_STOP
from tests.kernel.zoo import make_tables

TICK_SLEW = CONFIG.torque_slew * CONFIG.tick_us * 1e-6


def at_work(ticks: int = 150) -> tuple[Servo, int]:
    """A servo that renders a cut at full force, and its last tick."""
    servo = rendering()
    states = closing()
    for _ in range(ticks):
        last = next(states)
        servo.step(last)
    return servo, last.sequence


def place(tick: int) -> float:
    return 0.7 - 0.5e-3 * (tick - 1)


def test_the_ramp_begins_when_a_fault_ends_however_long_it_stood() -> None:
    servo, tick = at_work()
    for _ in range(1000):
        tick += 1
        servo.step(state(tick, place(150), flags=1 | StateFlag.FAULT_LATCHED), answered=False)
    torques = []
    for k in range(60):
        tick += 1
        torques.append(servo.step(state(tick, place(150 + k))).torque)
    ramp = CONFIG.ramp_s * 1e6 / CONFIG.tick_us
    full = max(map(abs, torques))
    assert full > 0.0
    assert all(abs(torque) <= (k + 2) / ramp * 2 * full for k, torque in enumerate(torques))


def test_a_backlog_is_answered_by_one_tick_of_slew() -> None:
    """Twenty frames in one read: the one command that is sent may move by one tick's slew."""
    servo, tick = at_work()
    sent = servo.step(state(tick + 1, place(tick + 1))).torque
    for k in range(2, 22):
        command = servo.step(state(tick + k, place(tick + k)), answered=k == 21)
    assert abs(command.torque - sent) <= TICK_SLEW * (1 + 1e-5)


def test_energy_is_booked_for_torques_that_were_sent() -> None:
    servo, tick = at_work()
    sent = servo.step(state(tick + 1, place(tick + 1))).torque
    before = servo.ledger.delivered_J
    for k in range(2, 12):
        servo.step(state(tick + k, place(tick + k)), answered=False)
        assert servo.telemetry()["torque_command"][0] == pytest.approx(sent)
    moved = place(tick + 11) - place(tick + 1)
    assert servo.ledger.delivered_J - before == pytest.approx(sent * moved, rel=1e-3)


def test_repeats_keep_a_torque_for_20_ms_only_and_the_heartbeat_is_watched() -> None:
    servo, tick = at_work()
    last = state(tick, place(tick))
    held = servo.step(last).torque
    torques = [servo.step(last, heartbeat=False).torque for _ in range(1300)]
    assert held > 0.0
    assert torques[:19] == [held] * 19
    assert torques[45] == 0.0
    assert servo.stop_reason is StopReason.SUPERVISOR_LOST
    assert servo.counters.duplicates == 1301


def test_a_clock_that_stands_does_not_freeze_the_torque_and_stops() -> None:
    servo, tick = at_work()
    frozen = 1000 * tick
    cracks = [servo.crack]
    while servo.stop_reason is StopReason.NONE:
        tick += 1
        servo.step(State(1, tick, frozen, place(tick), -0.02, 0.0, 0.0))
        cracks.append(servo.crack)
        assert tick < 200
    assert servo.stop_reason is StopReason.DEVICE_CLOCK
    assert len(cracks) == 1 + STAMPS_UNTIL_STOP
    assert cracks[-2] > cracks[0], "the blades moved and cut"


@pytest.mark.parametrize("leap", [0.25, -0.25, 2.0])
def test_one_place_that_leaps_moves_no_crack(leap: float) -> None:
    servo, tick = at_work()
    crack = servo.crack
    command = servo.step(state(tick + 1, place(tick + 1) + leap))
    assert (command.torque, command.force) == (0.0, 0.0)
    assert servo.crack == crack
    assert servo.telemetry()["flags"][0] & SampleFlag.INVALID
    servo.step(state(tick + 2, place(tick + 2)))
    assert servo.stop_reason is StopReason.NONE
    assert servo.crack == pytest.approx(crack, abs=1e-3)


def test_places_that_stay_wrong_stop() -> None:
    servo, tick = at_work()
    crack = servo.crack
    for k in range(1, 5):
        servo.step(state(tick + k, place(tick + k) - 0.25))
    assert servo.stop_reason is StopReason.IMPLAUSIBLE
    assert servo.crack == crack


def test_a_motion_that_is_too_fast_stops() -> None:
    servo = rendering()
    for tick in range(1, 6):
        servo.step(state(tick, 0.7))
    for k in range(1, 30):
        command = servo.step(state(5 + k, 0.7 - 0.04 * min(k, 10)))
    assert servo.stop_reason is StopReason.OVERSPEED
    assert (command.flags, command.torque) == (0, 0.0)


def test_openings_beyond_the_stops_are_not_usable() -> None:
    servo = Servo(make_tables(), replace(CONFIG, opening_low=0.1, opening_high=0.75))
    servo.engage(Mode.RENDER)
    servo.step(state(1, 0.09))
    assert servo.counters.invalid_frames == 1
    servo.step(state(2, 0.11))
    assert servo.counters.invalid_frames == 1


def test_lost_frames_are_no_leap() -> None:
    servo, tick = at_work()
    for k in range(10, 60, 10):
        servo.step(state(tick + k, place(tick + 150) if k == 50 else place(tick + k)))
    assert servo.counters.invalid_frames == 0


def test_a_gap_fills_no_integral() -> None:
    servo = Servo(None, replace(CONFIG, opening_ki=50.0, opening_kp=0.0, opening_kd=0.0))
    servo.set_reference([0.65] * 100, [0.0] * 100, [-0.02] * 100, [0] * 100)
    servo.engage(Mode.TRACK)
    servo.step(state(1, 0.6))
    command = servo.step(State(1, 2, 91_000, 0.6, -0.02, 0.0, 0.0))
    assert command.torque <= 50.0 * 0.05 * 0.01 * (1 + 1e-5)


FRAMES = st.lists(
    st.tuples(
        st.sampled_from(
            ["next", "next", "next", "repeat", "lost", "leap", "nan", "fault", "stuck"]
        ),
        st.booleans(),  # heartbeat
        st.booleans(),  # answered
        st.floats(-3e-3, 3e-3),
    ),
    min_size=1,
    max_size=300,
)


@settings(max_examples=150)
@given(frames=FRAMES, mode=st.sampled_from([Mode.RENDER, Mode.DAMP, Mode.IDLE]))
def test_whatever_comes_limits_slew_and_latches_hold(frames: list[object], mode: Mode) -> None:
    """Torque within its limit, slew kept from one sent command to the next, a stop stays."""
    servo = Servo(make_tables(), replace(CONFIG, supervisor_ms=30))
    servo.engage(mode)
    tick, us, opening, sent, stopped = 0, 0, 0.6, 0.0, False
    for kind, heartbeat, answered, moved in frames:  # type: ignore[misc]
        if kind != "repeat" or tick == 0:
            tick += 3 if kind == "lost" else 1
            us += {"lost": 3000, "stuck": 0}.get(kind, 1000)
            opening = min(max(opening + moved, 0.3), 0.9)
        seen = {"leap": opening + 0.4, "nan": math.nan}.get(kind, opening)
        flags = 1 | (StateFlag.FAULT_LATCHED if kind == "fault" else 0)
        one = State(flags, tick, us, seen, -0.02, 0.0, 0.0)
        command = servo.step(one, heartbeat=heartbeat, answered=answered)
        assert math.isfinite(command.torque)
        assert abs(command.torque) <= CONFIG.torque_limit
        assert abs(command.force) <= CONFIG.force_limit
        if stopped:
            assert (command.flags & 1, command.torque) == (0, 0.0)
        stopped = servo.stop_reason is not StopReason.NONE
        if answered:
            released = command.torque == 0.0
            assert released or abs(command.torque - sent) <= TICK_SLEW * (1 + 1e-4)
            sent = command.torque
    assert math.isfinite(servo.ledger.created_J)


def test_the_latched_stop_survives_ten_thousand_random_frames() -> None:
    rng = np.random.default_rng(5)
    servo, tick = at_work()
    servo.stop()
    for _ in range(10_000):
        tick += int(rng.integers(0, 3))
        servo.engage(Mode.RENDER if rng.random() < 0.5 else Mode.DAMP)
        command = servo.step(state(tick, float(rng.uniform(0.2, 0.9))))
        assert (command.flags & 1, command.torque, command.force) == (0, 0.0, 0.0)
