"""The heartbeat means that the supervisor's main loop works, not only that its process lives."""

import threading

import pytest

from scissorcal.device.servo_process import BEAT_S, PATIENCE_S, Heartbeat
from tests.guard import GUARD_S


class Beats:
    """Counts beats, and lets a test wait for one."""

    def __init__(self) -> None:
        self.count = 0
        self.came = threading.Event()

    def __call__(self) -> None:
        self.count += 1
        self.came.set()


class Clock:
    """Seconds that pass when a test says so."""

    def __init__(self) -> None:
        self.now_s = 10.0

    def __call__(self) -> float:
        return self.now_s


@pytest.fixture
def beats() -> Beats:
    return Beats()


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def heartbeat(beats: Beats, clock: Clock) -> Heartbeat:
    """One whose thread does not run: a test calls `pulse` for it."""
    return Heartbeat(beats, clock)


def pulses(heartbeat: Heartbeat, clock: Clock, seconds: float) -> None:
    """What the thread does within so many seconds."""
    for _ in range(round(seconds / BEAT_S)):
        clock.now_s += BEAT_S
        heartbeat.pulse()


def test_it_beats_while_a_block_takes_long(
    heartbeat: Heartbeat, beats: Beats, clock: Clock
) -> None:
    heartbeat.seen()
    pulses(heartbeat, clock, PATIENCE_S - BEAT_S)
    assert beats.count == round(PATIENCE_S / BEAT_S)


def test_it_ends_where_the_main_loop_hangs_and_returns_with_it(
    heartbeat: Heartbeat, beats: Beats, clock: Clock
) -> None:
    clock.now_s += PATIENCE_S
    pulses(heartbeat, clock, 10.0)
    assert beats.count == 0
    heartbeat.seen()
    heartbeat.pulse()
    assert beats.count == 2


def test_it_goes_on_while_a_person_is_asked(
    heartbeat: Heartbeat, beats: Beats, clock: Clock
) -> None:
    with heartbeat.held():
        pulses(heartbeat, clock, 60.0)
    assert beats.count == 60.0 / BEAT_S + 1
    clock.now_s += PATIENCE_S
    heartbeat.pulse()
    assert beats.count == 60.0 / BEAT_S + 1


def test_a_thread_of_its_own_beats_until_it_is_closed(beats: Beats, clock: Clock) -> None:
    heartbeat = Heartbeat(beats, clock)
    heartbeat.start()
    for _ in range(3):
        beats.came.clear()
        assert beats.came.wait(GUARD_S)
    heartbeat.close()
    count = beats.count
    heartbeat.close()
    assert beats.count == count
    assert "servo-heartbeat" not in {thread.name for thread in threading.enumerate()}


def test_it_can_be_closed_before_it_was_started(beats: Beats) -> None:
    heartbeat = Heartbeat(beats)
    heartbeat.close()
    heartbeat.close()
    assert beats.count == 0
