"""Times and lags are counted right, in memory that does not grow."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from scissorcal.device.timing import FeltLag, LoopRights, TimeHistogram
from scissorcal.kernel import LagCounts, Mode, Servo, ServoConfig, State

CONFIG = ServoConfig(torque_limit=1, torque_slew=200, force_limit=0, force_slew=0)


def lag_of(sequences: list[int], sent: list[bool]) -> LagCounts:
    servo = Servo(None, CONFIG)
    for number, answered in zip(sequences, sent, strict=True):
        servo.step(State(0, number, 1000 * number % 2**32, 0.5, 0.0, 0.0, 0.0), answered=answered)
    return servo.lag


def reference_lag(sequences: list[int], sent: list[bool]) -> tuple[list[int], int]:
    """Lag of each tick from the first command on, and the ticks without a new command."""
    lags: list[int] = []
    held, answers, last, fresh = 0, None, sequences[0], False
    for number, answered in zip(sequences, sent, strict=True):
        if answers is not None:
            for tick in range(last + 1, number + 1):
                lags.append(tick - answers)
                held += not fresh
                fresh = False
        last = number
        if answered:
            answers, fresh = number, True
    return lags, held


@given(
    steps=st.lists(st.tuples(st.integers(1, 100), st.booleans()), min_size=1, max_size=40),
    start=st.sampled_from([0, 2**32 - 50]),
)
def test_lag_is_the_tick_less_what_the_newest_command_answers(
    steps: list[tuple[int, bool]], start: int
) -> None:
    sequences = [int(number) for number in np.cumsum([step for step, _ in steps])]
    sent = [answered for _, answered in steps]
    lags, held = reference_lag(sequences, sent)
    found = lag_of([(start + number) % 2**32 for number in sequences], sent)
    size = found.counts.shape[1]
    counts = np.bincount(np.minimum(np.array(lags, dtype=int), size), minlength=size + 1)[1:]
    assert np.array_equal(found.counts[int(Mode.IDLE)], counts)
    assert found.held[int(Mode.IDLE)] == held
    assert found.worst[int(Mode.IDLE)] == max(lags, default=0)


def test_a_repeated_or_restarted_sequence_counts_no_lag() -> None:
    found = lag_of([5, 6, 6, 6, 2, 3], [True] * 6)
    assert found.counts.sum() == 2
    assert found.worst.max() == 1


def test_felt_lag_adds_the_round_trip_to_the_ticks() -> None:
    lag = FeltLag.of(lag_of(list(range(1001)), [True] * 996 + [False] * 4 + [True]), 1e-3, 4e-4)
    assert (lag.ticks.p50, lag.ticks.p99, lag.ticks.p999, lag.ticks.worst) == (1, 1, 4, 5)
    assert lag.held_share == pytest.approx(0.004)
    assert lag.ms.p50 == pytest.approx(1.4)
    assert lag.ms.worst == pytest.approx(5.4)
    assert lag.sentence.startswith("1 to 5 ticks of felt lag (middle to worst; 99 % within 1)")
    assert "0.4 ms" in lag.sentence


def test_ticks_with_the_motors_on_go_before_those_with_the_motors_off() -> None:
    counts = np.zeros((len(Mode), 64), dtype=np.int64)
    counts[int(Mode.IDLE), 9] = 1000
    counts[int(Mode.RENDER), 0] = 10
    worst = np.zeros(len(Mode), dtype=np.int64)
    worst[int(Mode.IDLE)], worst[int(Mode.RENDER)] = 10, 1
    lag = LagCounts(counts, np.zeros(len(Mode), dtype=np.int64), worst)
    assert FeltLag.of(lag, 1e-3, 0.0).ticks.worst == 1
    counts[int(Mode.RENDER), 0] = 0
    assert FeltLag.of(lag, 1e-3, 0.0).ticks.worst == 10


def test_a_lag_beyond_the_counts_is_stated_by_its_worst() -> None:
    lag = FeltLag.of(lag_of([0, 1, 200], [True, True, True]), 1e-3, math.nan)
    assert lag.ticks.p999 == lag.ticks.worst == 199
    assert "could not be measured" in lag.sentence


def test_without_a_command_no_lag_is_stated() -> None:
    lag = FeltLag.of(lag_of([0, 1, 2], [False] * 3), 1e-3, 0.0)
    assert math.isnan(lag.ticks.worst)
    assert "not measured" in lag.sentence


@given(times=st.lists(st.integers(1, 10**10), min_size=1, max_size=200), pieces=st.integers(1, 5))
def test_counted_times_have_the_percentiles_of_the_times(times: list[int], pieces: int) -> None:
    histogram = TimeHistogram()
    for piece in np.array_split(np.array(times), pieces):
        histogram.add(piece)
    found = histogram.percentiles_us()
    exact = np.quantile(
        np.maximum(np.array(times) / 1000, 1.0), [0.5, 0.99, 0.999], method="inverted_cdf"
    )
    counted = np.array([found.p50, found.p99, found.p999])
    worst = max(times) / 1000
    assert np.all(counted >= np.minimum(exact, worst) * (1 - 1e-9))
    assert np.all(counted <= exact * 2 ** (1 / 64) * (1 + 1e-9))
    assert found.worst == pytest.approx(worst)


def test_what_was_refused_comes_with_its_remedy() -> None:
    assert "rtprio" in LoopRights(realtime=False, memory_locked=True).sentence
    assert "memlock" in LoopRights(realtime=True, memory_locked=False).sentence
    assert "limits.d" not in LoopRights(realtime=True, memory_locked=True).sentence
