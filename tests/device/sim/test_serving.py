"""What the served rig sends and when, by a made-up clock: its host acts between its ticks."""

import itertools
import os
import select
import tty
from collections.abc import Callable, Iterator
from types import SimpleNamespace

import pytest

from scissorcal.device.sim import server as room
from scissorcal.device.sim.protocol import RigProtocol
from scissorcal.device.sim.rig import TICK_S
from scissorcal.device.sim.sensors import Faults
from scissorcal.device.sim.server import CATCH_UP_TICKS, WAITING_FRAMES, ServeReport, serve
from scissorcal.device.sim.specimen import load_specimen
from scissorcal.kernel import (
    Config,
    ConfigEcho,
    ConfigKey,
    FrameDecoder,
    Hello,
    Identity,
    Message,
    State,
    decode,
    encode,
)
from tests.guard import GUARD_S

STREAM = Config(ConfigKey.STREAM, 7, 1.0)


class Clock:
    """Time that passes where the server sleeps, or a test says so."""

    def __init__(self) -> None:
        self.now_s = 100.0

    def monotonic(self) -> float:
        return self.now_s

    def sleep(self, seconds: float) -> None:
        self.now_s += seconds


class Host:
    """The other end of the port; what it reads is decoded."""

    def __init__(self) -> None:
        self.port = ""
        self._fd = -1
        self._decoder = FrameDecoder()

    def open(self) -> None:
        self._fd = os.open(self.port, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        tty.setraw(self._fd)

    def close(self) -> None:
        os.close(self._fd)
        self._fd = -1

    def say(self, message: Message) -> None:
        os.write(self._fd, encode(message))

    def hear(self) -> list[Message]:
        """What came since the last time."""
        data = b""
        try:
            while block := os.read(self._fd, 65536):
                data += block
        except BlockingIOError:
            pass
        return [decode(payload) for payload in self._decoder.feed(data)]

    def states(self) -> list[int]:
        """Sequences of the states that came; waits for one, which costs none of the made-up time.

        The kernel hands on what was written when it gets a processor.
        """
        assert select.select([self._fd], [], [], GUARD_S)[0], "nothing was sent"
        return [one.sequence for one in self.hear() if isinstance(one, State)]


Script = Callable[[Host, Clock], Iterator[None]]


def run(
    script: Script, monkeypatch: pytest.MonkeyPatch, faults: Faults | None = None
) -> ServeReport:
    """Serve; a step of the script after each tick, and the end with its end."""
    host, clock = Host(), Clock()
    monkeypatch.setattr(room, "time", SimpleNamespace(monotonic=clock.monotonic, sleep=clock.sleep))
    steps = script(host, clock)

    def announce(port: str) -> None:
        host.port = port

    def is_over() -> bool:
        return next(steps, steps) is steps

    report = serve(load_specimen("office-paper"), 3, faults, announce, is_over)
    if host._fd >= 0:
        host.close()
    return report


def passing(ticks: int) -> Iterator[None]:
    for _ in range(ticks):
        yield


def until(heard: list[Message], host: Host, kind: type) -> Iterator[None]:
    """Ticks until a message of this kind has come: the kernel hands on what was written."""
    while not any(isinstance(one, kind) for one in heard):
        heard += host.hear()
        yield


def test_a_state_follows_each_tick_and_the_next_reader_hears_nothing_stale(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    found: list[int] = []

    def script(host: Host, clock: Clock) -> Iterator[None]:
        host.open()
        host.say(Hello(5))
        heard: list[Message] = []
        yield from until(heard, host, Identity)
        host.say(STREAM)
        yield from until(heard, host, ConfigEcho)
        found.extend(one.sequence for one in heard if isinstance(one, State))
        while len(found) < 300:
            found.extend(host.states())
            yield
        host.close()
        yield from passing(20)
        host.open()
        host.say(Hello(6))
        again: list[Message] = []
        yield from until(again, host, State)
        first = next(one for one in again if isinstance(one, State))
        assert first.sequence > found[-1] + 20

    report = run(script, monkeypatch)
    assert found == list(range(found[0], found[0] + len(found)))
    assert report.stalls == 0
    assert not report.unplugged


MORE_THAN_A_LINE_HOLDS = 4000
"""States of 35 bytes; a pseudo-terminal of Linux keeps 64 kB and some. Less than 5 s of them."""


def test_a_reader_that_does_not_read_loses_the_oldest_and_gets_the_rest_in_order(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    late: list[int] = []

    def script(host: Host, clock: Clock) -> Iterator[None]:
        host.open()
        host.say(STREAM)
        yield from passing(MORE_THAN_A_LINE_HOLDS)
        while not late or late[-1] < MORE_THAN_A_LINE_HOLDS:
            late.extend(host.states())
            yield

    run(script, monkeypatch)
    gaps = [after - before for before, after in itertools.pairwise(late)]
    assert min(gaps) == 1
    assert sum(gap > 1 for gap in gaps) == 1, "what came between line and queue was lost"
    after = gaps[next(n for n, gap in enumerate(gaps) if gap > 1) + 1 :]
    assert len(after) >= WAITING_FRAMES - 1


def test_ticks_follow_the_clock_and_a_late_process_makes_up_for_a_few(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Held up for longer the rig stands still, so that no silence of the host is made up."""
    ends: list[float] = []

    def script(host: Host, clock: Clock) -> Iterator[None]:
        yield from passing(100)
        clock.now_s += (CATCH_UP_TICKS - 1) * TICK_S
        yield from passing(100)
        clock.now_s += 1.3
        yield from passing(100)
        ends.append(clock.now_s)

    report = run(script, monkeypatch)
    assert report.stalls == 1
    assert report.ticks == pytest.approx(301, abs=CATCH_UP_TICKS)
    assert ends[0] - 100.0 == pytest.approx(1.3 + 301 * TICK_S, abs=2 * CATCH_UP_TICKS * TICK_S)


def test_its_cable_is_pulled_at_its_time(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[int] = []
    receive = RigProtocol.receive

    def noted(self: RigProtocol, data: bytes) -> None:
        if data:
            asked.append(self._ticks)
        receive(self, data)

    def script(host: Host, clock: Clock) -> Iterator[None]:
        host.open()
        host.say(STREAM)
        while True:
            yield

    monkeypatch.setattr(RigProtocol, "receive", noted)
    report = run(script, monkeypatch, Faults(unplug_s=0.2))
    assert report.unplugged
    assert report.ticks - asked[0] == pytest.approx(200, abs=1)
