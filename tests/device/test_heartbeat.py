"""The heartbeat means that the supervisor's main loop works, not only that its process lives."""

import time
from collections.abc import Iterator

import pytest

from scissorcal.device import heartbeat as room
from scissorcal.device.heartbeat import Heartbeat


class Beats:
    def __init__(self) -> None:
        self.count = 0

    def __call__(self) -> None:
        self.count += 1

    def within(self, seconds: float) -> int:
        before = self.count
        time.sleep(seconds)
        return self.count - before


@pytest.fixture
def beats() -> Beats:
    return Beats()


@pytest.fixture
def running(beats: Beats, monkeypatch: pytest.MonkeyPatch) -> Iterator[Heartbeat]:
    monkeypatch.setattr(room, "PATIENCE_S", 0.4)
    heartbeat = Heartbeat(beats)
    heartbeat.start()
    yield heartbeat
    heartbeat.close()


def test_it_beats_while_a_block_takes_long(running: Heartbeat, beats: Beats) -> None:
    running.seen()
    assert beats.within(0.3) > 0


def test_it_ends_where_the_main_loop_hangs_and_returns_with_it(
    running: Heartbeat, beats: Beats
) -> None:
    time.sleep(0.6)
    assert beats.within(0.3) == 0
    running.seen()
    assert beats.within(0.3) > 0


def test_it_goes_on_while_a_person_is_asked(running: Heartbeat, beats: Beats) -> None:
    with running.held():
        time.sleep(0.6)
        assert beats.within(0.3) > 0


def test_it_can_be_closed_before_it_was_started(beats: Beats) -> None:
    heartbeat = Heartbeat(beats)
    heartbeat.close()
    heartbeat.close()
    assert beats.count == 0
