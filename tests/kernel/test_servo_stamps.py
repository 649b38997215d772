"""The servo when a device's clock or its sequence is wrong: bounds hold and it stops, whatever the
stamps say."""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from scissorcal.kernel import Mode, Servo, State, StopReason
from tests.kernel.test_servo import CONFIG, rendering
from tests.kernel.zoo import make_tables

TICK_US = 1000
RECENT, STAMPS_UNTIL_STOP, PLACES_UNTIL_STOP = 20, 8, 4
RATE_LIMIT = CONFIG.opening_rate_limit
TICK_SLEW = CONFIG.torque_slew * TICK_US * 1e-6
GAP_TICKS = 100
U32 = 2**32

Clock = Callable[[int], int]


def _random_clock(seed: int) -> Clock:
    stamps = np.random.default_rng(seed).integers(0, U32, 4000).tolist()
    return lambda tick: stamps[tick % 4000]


def _spoilt(every: int) -> Clock:
    """Each ``every``-th stamp is that of an hour ago."""
    return lambda tick: TICK_US * tick - (3_600_000_000 if tick % every == 0 else 0)


WRONG_CLOCKS: dict[str, tuple[Clock, StopReason, int]] = {
    "counts down": (lambda tick: -TICK_US * tick, StopReason.DEVICE_CLOCK, 8),
    "stands": (lambda tick: 7, StopReason.DEVICE_CLOCK, 8),
    "random": (_random_clock(5), StopReason.DEVICE_CLOCK, 8),
    "every third stamp wrong": (_spoilt(3), StopReason.DEVICE_CLOCK, 13),
    "every fourth stamp wrong": (_spoilt(4), StopReason.DEVICE_CLOCK, 18),
    "in milliseconds": (lambda tick: tick, StopReason.CLOCK_RATE, 8),
    "in nanoseconds": (lambda tick: 1_000_000 * tick, StopReason.CLOCK_RATE, 8),
    "three times too fast": (lambda tick: 3 * TICK_US * tick, StopReason.CLOCK_RATE, 8),
}
"""The clock, the stop, and within how many states."""


@pytest.mark.parametrize("name", WRONG_CLOCKS)
@pytest.mark.parametrize("mode", [Mode.RENDER, Mode.DAMP, Mode.IDLE])
def test_a_wrong_clock_stops_within_20_states(name: str, mode: Mode) -> None:
    clock, reason, within = WRONG_CLOCKS[name]
    servo = Servo(make_tables(), CONFIG)
    servo.engage(mode)
    begins = 1 if reason is StopReason.CLOCK_RATE else 101
    for tick in range(1, begins):
        servo.step(State(1, tick, TICK_US * tick, 0.7 - 2e-4 * tick, -0.02, 0.0, 0.0))
    rates = []
    for tick in range(begins, begins + RECENT):
        servo.step(State(1, tick, clock(tick) % U32, 0.7 - 2e-4 * tick, -0.02, 0.0, 0.0))
        rates.append(servo.rates[0])
        if servo.stop_reason is not StopReason.NONE:
            break
    assert servo.stop_reason is reason
    assert len(rates) <= within + 1
    if begins > 1:
        np.testing.assert_allclose(rates, -0.2, rtol=2e-3)


@pytest.mark.parametrize("wrap_us", [0, 1_500_000, 2**32 - 1_000])
def test_one_wrong_stamp_one_reset_and_a_wrap_stop_nothing(wrap_us: int) -> None:
    servo = Servo(None, CONFIG)
    servo.engage(Mode.DAMP)
    start = U32 - wrap_us
    for tick in range(1, 3000):
        us = start + TICK_US * tick
        if tick % 500 == 250:
            us += 7_000_000
        if tick >= 2200:
            us -= 1_000_000_000
        servo.step(State(1, tick, us % U32, 0.8 - 1e-4 * tick, 0.0, 0.0, 0.0))
        if tick > 30:
            assert servo.rates[0] == pytest.approx(-0.1, rel=1e-2)
    assert servo.stop_reason is StopReason.NONE
    assert servo.counters.misses == 0


def test_ticks_that_jitter_by_40_percent_are_timed_by_the_clock() -> None:
    late = np.random.default_rng(4).integers(-400, 400, 2000)
    late[1::2] = 0  # so that two neighbours differ by 400 us at most
    servo = Servo(None, replace(CONFIG, rate_cutoff_Hz=0.0))
    servo.engage(Mode.DAMP)
    for tick in range(1, 2000):
        us = TICK_US * tick + int(late[tick])
        servo.step(State(1, tick, us, 0.9 - 2e-7 * us, 0.0, 0.0, 0.0))
        if tick > 1:
            assert servo.rates[0] == pytest.approx(-0.2, rel=1e-3)
    assert servo.stop_reason is StopReason.NONE


@pytest.mark.parametrize(
    ("leap", "clock_leaps"),
    [(40, False), *((n, leaps) for n in (200, 5_000, 1_070_000, 2**30) for leaps in (False, True))],
)
def test_a_leap_of_the_sequence_does_not_end_a_reference(leap: int, clock_leaps: bool) -> None:
    servo = Servo(None, CONFIG)
    opening = np.linspace(0.6, 0.3, 3000)
    servo.set_reference(opening, np.full(3000, -0.1), np.full(3000, -0.02), np.zeros(3000))
    servo.engage(Mode.TRACK)
    for tick in range(1, 201):
        servo.step(State(1, tick, TICK_US * tick, opening[tick], -0.02, 0.0, 0.0))
    before = servo.track_index
    us = TICK_US * (201 + leap * clock_leaps)
    servo.step(State(1, 201 + leap, us % U32, opening[201], -0.02, 0.0, 0.0))
    assert servo.track_index == before + 1
    assert servo.stop_reason is StopReason.NONE


def test_sequences_that_leap_again_and_again_stop() -> None:
    servo = rendering()
    sequence, states = 0, 0
    while servo.stop_reason is StopReason.NONE and states < 100:
        states += 1
        sequence += 40 if states % 2 == 0 else 1
        servo.step(State(1, sequence, TICK_US * states, 0.6, -0.02, 0.0, 0.0))
    assert servo.stop_reason is StopReason.DEVICE_CLOCK
    assert states <= 2 * STAMPS_UNTIL_STOP


@pytest.mark.parametrize(("every", "within"), [(1, 4), (2, 8), (3, 12), (5, 20)])
def test_openings_that_are_no_number_now_and_then_stop(every: int, within: int) -> None:
    servo = rendering()
    for tick in range(1, 101):
        servo.step(State(1, tick, TICK_US * tick, 0.6, -0.02, 0.0, 0.0))
    taken = 0
    while servo.stop_reason is StopReason.NONE and taken < 100:
        taken += 1
        opening = math.nan if taken % every == 0 else 0.6
        servo.step(State(1, 100 + taken, TICK_US * (100 + taken), opening, -0.02, 0.0, 0.0))
    assert servo.stop_reason is StopReason.IMPLAUSIBLE
    assert taken <= within


STAMPS = st.lists(
    st.tuples(
        st.sampled_from([1, 1, 1, 1, 2, 5, 50, 1_070_000, 2**30]),  # of the sequence
        st.one_of(
            st.just(None),  # right
            st.sampled_from([0, -1000, 1, 499, 1999, 2000, 50_000, 2**31 - 1, -(2**31)]),
            st.integers(-(2**31), 2**31 - 1),
            st.integers(400, 2100),
        ),
    ),
    min_size=80,
    max_size=160,
)


def _stream(stamps: list[tuple[int, int | None]]) -> Iterator[tuple[int, int, int, bool]]:
    """Sequence, device_us, ticks that truly passed, and whether the two contradict each other."""
    sequence, us = 17, 999
    for leap, by in stamps:
        stated = TICK_US * leap if by is None else by
        stated = (stated + 2**31) % U32 - 2**31
        agree = leap * TICK_US <= 2 * stated <= 4 * leap * TICK_US
        sequence, us = (sequence + leap) % U32, (us + stated) % U32
        yield sequence, us, leap if agree else 1, not agree


@settings(max_examples=150)
@given(
    stamps=STAMPS,
    rate=st.floats(1.2 * RATE_LIMIT, 6.0 * RATE_LIMIT),
    mode=st.sampled_from([Mode.RENDER, Mode.DAMP, Mode.TRACK]),
)
@example(stamps=[(50, 1000), (1, 1000), (1, 1000)] * 40, rate=36.0, mode=Mode.DAMP)
@example(stamps=[(1, -1000)] * 80, rate=60.0, mode=Mode.RENDER)
@example(stamps=[(1, 1999)] * 80, rate=36.0, mode=Mode.TRACK)
def test_blades_that_are_too_fast_stop_whatever_the_stamps_say(
    stamps: list[tuple[int, int | None]], rate: float, mode: Mode
) -> None:
    """1.2 times the limit shows in 4 states behind the filter of 100 Hz: within 8 with wrong stamps
    between; and contradictions are counted besides. Lost frames count as the time that they take,
    as long as both stamps say so."""
    servo = Servo(make_tables(), replace(CONFIG, opening_error_limit=10.0))
    servo.set_reference([0.5] * 9, [0.0] * 9, [0.0] * 9, [0] * 9)
    servo.engage(mode)
    opening = -1.0
    wrong: list[bool] = []
    servo.step(State(1, 17, 999, opening, 0.0, 0.0, 0.0))
    for states, (sequence, us, passed, contradict) in enumerate(_stream(stamps)):
        wrong.append(contradict)
        opening += rate * passed * TICK_US * 1e-6
        if opening > 3.0:
            opening = -3.0 if rate > 0 else 3.0  # beyond any scissors: another leap
        servo.step(State(1, sequence, us, opening, 0.0, 0.0, 0.0))
        if servo.stop_reason is not StopReason.NONE:
            break
        assert sum(wrong[-RECENT:]) < STAMPS_UNTIL_STOP
        assert states < 7, "fast blades went on"


@settings(max_examples=150)
@given(
    stamps=STAMPS,
    moved=st.lists(st.floats(-3e-3, 3e-3), min_size=160, max_size=160),
    bad=st.sets(st.integers(0, 159), max_size=20),
    mode=st.sampled_from([Mode.RENDER, Mode.DAMP, Mode.TRACK, Mode.IDLE]),
)
def test_torque_slew_reference_and_stops_hold_whatever_the_stamps_say(
    stamps: list[tuple[int, int | None]], moved: list[float], bad: set[int], mode: Mode
) -> None:
    servo = Servo(make_tables(), CONFIG)
    servo.set_reference(
        np.linspace(0.6, 0.3, 3000), np.full(3000, -0.1), np.full(3000, -0.02), np.zeros(3000)
    )
    servo.engage(mode)
    opening, sent, stopped = 0.6, 0.0, False
    wrong: list[bool] = []
    lost: list[bool] = []
    for index, (sequence, us, _, contradict) in enumerate(_stream([(1, None), *stamps])):
        opening = min(max(opening + moved[index % 160], 0.3), 0.9)
        seen = math.nan if index in bad else opening
        before = servo.track_index
        command = servo.step(State(1, sequence, us, seen, -0.02, 0.0, 0.0))
        wrong.append(contradict and index > 0)
        lost.append(index in bad)
        assert abs(command.torque) <= CONFIG.torque_limit
        assert command.torque == 0.0 or abs(command.torque - sent) <= TICK_SLEW * (1 + 1e-4)
        if index > 0:
            assert servo.track_index - before <= GAP_TICKS
        assert all(map(math.isfinite, servo.rates))
        if stopped:
            assert (command.flags & 1, command.torque) == (0, 0.0)
        sent, stopped = command.torque, servo.stop_reason is not StopReason.NONE
        if sum(wrong[-RECENT:]) >= STAMPS_UNTIL_STOP or sum(lost[-RECENT:]) >= PLACES_UNTIL_STOP:
            assert stopped
