"""A virtual rig on a pseudo-terminal that goes on by a tick for each command it is given.

So the servo's process, the port and its supervisor can be tested without a clock: the rig waits for
them, however long this computer makes them wait. What passes by their own clocks (that of the
heartbeat, of silence, of a handshake) is made to last by `patient`.
"""

import os
import select
import threading
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from scissorcal.device import capture, link, port_motion, servo_process
from scissorcal.device.sim.protocol import RigProtocol
from scissorcal.device.sim.rig import VirtualRig
from scissorcal.device.sim.sensors import Faults
from scissorcal.device.sim.specimen import load_specimen
from scissorcal.kernel import Command, Config, ConfigKey, FrameDecoder, LoopBlock, decode
from scissorcal.render import engine
from tests.guard import GUARD_S


class InStepRig:
    """Serves ``specimen`` at :attr:`port`; made by `in_step`."""

    def __init__(self, specimen: str, seed: int, faults: Faults | None) -> None:
        rig_rng, line_rng = np.random.default_rng(seed).spawn(2)
        self.rig = VirtualRig(load_specimen(specimen), rig_rng)
        self._protocol = RigProtocol(self.rig, line_rng, faults)
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.port = os.ttyname(self._slave)
        self._decoder = FrameDecoder()
        self._streams = False
        self._mutex = threading.Lock()
        self._over, self._end = os.pipe()
        self._thread = threading.Thread(target=self._serve, name="in-step-rig")
        self._thread.start()

    def pass_ticks(self, count: int) -> None:
        """Let time pass without a command."""
        with self._mutex:
            self._tick(count)

    def close(self) -> None:
        """End the service, and close both ends of the port."""
        os.close(self._end)
        self._thread.join()
        os.close(self._over)
        self._unplug()

    def _serve(self) -> None:
        while self._master >= 0:
            ready = select.select([self._master, self._over], [], [])[0]
            if self._over in ready:
                return
            with self._mutex:
                data = os.read(self._master, 65536)
                self._protocol.receive(data)
                self._send()
                self._tick(sum(self._asks_for_a_tick(one) for one in self._decoder.feed(data)))
                if self._protocol.unplugged:
                    self._unplug()

    def _asks_for_a_tick(self, payload: bytes) -> bool:
        """A command does, and the first request to stream: the first command answers a state."""
        message = decode(payload)
        if isinstance(message, Config) and message.key == ConfigKey.STREAM:
            begins = bool(message.value) and not self._streams
            self._streams = bool(message.value)
            return begins
        return isinstance(message, Command)

    def _tick(self, count: int) -> None:
        for _ in range(count):
            if not self._protocol.unplugged:
                self._protocol.tick()
                self._send()

    def _send(self) -> None:
        for frame in self._protocol.take():
            try:
                os.write(self._master, frame)
            except BlockingIOError:  # nobody reads
                return

    def _unplug(self) -> None:
        for end in (self._master, self._slave):
            if end >= 0:
                os.close(end)
        self._master = self._slave = -1


@contextmanager
def in_step(
    specimen: str | Path = "office-paper", seed: int = 1, faults: Faults | None = None
) -> Iterator[InStepRig]:
    """A rig that waits for its host, until the context ends."""
    rig = InStepRig(str(specimen), seed, faults)
    try:
        yield rig
    finally:
        rig.close()


def patient(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever ends a wait by this computer's clock waits as long as the guard of the tests."""
    for room, names in (
        (link, ("HELLO_WAIT_S", "CONFIGURE_WAIT_S")),
        (servo_process, ("START_TIMEOUT_S", "STREAM_TIMEOUT_S", "STOP_TIMEOUT_S")),
        (port_motion, ("IDLE_TIMEOUT_S", "FIRST_POSITION_TIMEOUT_S")),
        (servo_process, ("PATIENCE_S",)),
        (capture, ("SUPERVISOR_S",)),
        (engine, ("SUPERVISOR_S",)),
    ):
        for name in names:
            monkeypatch.setattr(room, name, GUARD_S)
    options = LoopBlock.create.__func__.__kwdefaults__  # type: ignore[attr-defined]
    monkeypatch.setitem(options, "silence_limit_ms", round(1e3 * GUARD_S))
    monkeypatch.setattr(LoopBlock.configure, "__defaults__", (GUARD_S,))
    monkeypatch.setattr(link.open_link, "__defaults__", (link.DEFAULT_BAUD, GUARD_S))
