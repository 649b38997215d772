"""A far end for link tests: a pseudo-terminal on which a thread answers as it is told."""

import os
import select
import threading
import tty
from collections.abc import Callable, Iterator

import pytest

from scissorcal.kernel import FrameDecoder, Identity, Message, decode

IDENTITY = Identity(
    nonce_echo=0,
    name="bench rig",
    serial="0001",
    capabilities=3,
    firmware_version=7,
    tick_us=1000,
    torque_limit=1.5,
    force_limit=40.0,
    opening_min=0.14,
    opening_max=0.96,
    advance_min=-0.08,
    advance_max=0.25,
    opening_resolution=4.8e-5,
    advance_resolution=1e-6,
    handle_radius=0.06,
)

Answer = Callable[[Message], list[bytes]]


class FarEnd:
    """The master side of a pty; ``port`` is what the host opens."""

    def __init__(self, answer: Answer) -> None:
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        self.port = os.ttyname(self._slave)
        self.heard: list[Message] = []
        self._answer = answer
        self._ends = False
        self._thread = threading.Thread(target=self._serve)
        self._thread.start()

    def say(self, data: bytes) -> None:
        os.write(self._master, data)

    def unplug(self) -> None:
        self._ends = True
        self._thread.join()
        for end in (self._master, self._slave):
            if end >= 0:
                os.close(end)
        self._master = self._slave = -1

    def _serve(self) -> None:
        decoder = FrameDecoder()
        while not self._ends:
            if not select.select([self._master], [], [], 0.02)[0]:
                continue
            for payload in decoder.feed(os.read(self._master, 4096)):
                message = decode(payload)
                self.heard.append(message)
                for frame in self._answer(message):
                    os.write(self._master, frame)


@pytest.fixture
def far_end() -> Iterator[Callable[[Answer], FarEnd]]:
    made: list[FarEnd] = []

    def make(answer: Answer) -> FarEnd:
        made.append(FarEnd(answer))
        return made[-1]

    yield make
    for end in made:
        if end._master >= 0:
            end.unplug()
