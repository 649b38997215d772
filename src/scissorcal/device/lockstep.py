"""A link to a virtual rig in this process, in virtual time: one tick for each exchange.

The frames are the real ones, encoded, sent through the rig's faults and decoded; only the port and
the clock are missing. So a day with the rig runs as fast as the computer can, and the same calls
give the same numbers on every machine.
"""

from collections.abc import Callable
from typing import Protocol

import numpy as np

from scissorcal.device.answers import check_echo, check_identity
from scissorcal.device.link import LoadMessage
from scissorcal.device.sim.protocol import RigProtocol
from scissorcal.device.sim.rig import TICK_S, VirtualRig
from scissorcal.device.sim.sensors import Faults
from scissorcal.device.sim.specimen import Specimen, load_specimen
from scissorcal.errors import DeviceError
from scissorcal.kernel import (
    Command,
    Config,
    ConfigEcho,
    FrameDecoder,
    Hello,
    Identity,
    LoadEcho,
    Message,
    State,
    decode,
    encode,
)

ATTEMPTS = 20
ANSWER_TICKS = 50


class DeviceSide(Protocol):
    """A device behind a lockstep link: it takes bytes, and gives bytes, in virtual time."""

    @property
    def unplugged(self) -> bool:
        """Whether its cable has been pulled."""

    @property
    def garbled(self) -> int:
        """Frames from the host that it discarded."""

    def receive(self, data: bytes) -> None:
        """Take bytes from the host, in pieces of any size."""

    def tick(self) -> None:
        """Advance one tick: measure, decide, drive, send."""

    def take(self) -> list[bytes]:
        """Bytes that are due for the host, oldest first."""


MakeDevice = Callable[[VirtualRig, np.random.Generator, Faults | None], DeviceSide]
"""Makes the device side of a rig whose mechanics it drives, one `VirtualRig.tick` for each tick."""


class LockstepLink:
    """A link (``identity``, ``configure``, ``close``) with :meth:`exchange`.

    ``specimen`` is a Specimen, its name or its path; ``rng`` seeds everything random in the rig.
    ``rig`` gives tests the truth. ``device`` makes the device side: the rig's own protocol, or
    another that drives the same mechanics, such as a firmware.

    >>> from scissorcal.kernel import ConfigKey
    >>> link = LockstepLink("office-paper", np.random.default_rng(1))
    >>> link.configure(ConfigKey.STREAM, 1.0)
    1.0
    >>> len(link.exchange(None))  # one tick, one STATE payload
    1
    """

    def __init__(
        self,
        specimen: Specimen | str,
        rng: np.random.Generator,
        faults: Faults | None = None,
        device: MakeDevice = RigProtocol,
    ) -> None:
        """Power on a rig and read its identity; DeviceError if it never answers."""
        loaded = specimen if isinstance(specimen, Specimen) else load_specimen(specimen)
        rig_rng, line_rng = rng.spawn(2)
        self.name = f"The virtual rig {loaded.name}"
        self.rig = VirtualRig(loaded, rig_rng)
        self._device = device(self.rig, line_rng, faults)
        self._unplug_s = faults.unplug_s if faults else None
        self._states: list[bytes] = []
        self._decoder = FrameDecoder()
        self._nonce = 0
        self._closed = False
        answer = self._ask(
            Hello,
            lambda reply, nonce: isinstance(reply, Identity) and reply.nonce_echo == nonce,
        )
        if not isinstance(answer, Identity):
            raise DeviceError(
                f"{self.name} did not answer {ATTEMPTS} times: its faults garble every frame. "
                "Set fewer faults."
            )
        self.identity: Identity = check_identity(self.name, answer)

    @property
    def virtual_time(self) -> float:
        """Seconds since the rig was switched on."""
        return self.rig.time_s

    @property
    def garbled(self) -> int:
        """Frames from the rig that were discarded."""
        return self._decoder.garbled

    def exchange(self, command_frame: bytes | None) -> list[bytes]:
        """Send a frame (or none), advance one tick, and return the STATE payloads that arrive.

        There is one payload per tick unless faults drop or delay it, and none before STREAM is
        set; those that arrived while :meth:`configure` waited for its echo come first.
        Raises DeviceError once the rig is unplugged or the link closed.
        """
        self._check_open()
        if command_frame is not None:
            self._device.receive(command_frame)
        self._pass_tick()
        states, self._states = self._states, []
        return states

    def configure(self, key: int, value: float) -> float:
        """Set a value of the device, wait for its echo and return the value in force.

        Sent again (with a new nonce) if no echo arrives; ticks pass only while waiting for one.
        Raises DeviceError if the device does not know the key, refuses the value, or never
        answers.
        """
        self._check_open()
        answer = self._ask(
            lambda nonce: Config(int(key), nonce, float(value)),
            lambda reply, nonce: isinstance(reply, ConfigEcho) and reply.nonce == nonce,
        )
        if not isinstance(answer, ConfigEcho):
            raise DeviceError(
                f"{self.name} did not confirm setting {int(key):#06x} in {ATTEMPTS} attempts: its "
                "faults drop too many frames. Set fewer faults."
            )
        check_echo(self.name, answer, int(key), float(value))
        return float(answer.value)

    def send(self, message: Command) -> None:
        """Send a command, which the device has in its next tick."""
        self._check_open()
        self._device.receive(encode(message))

    def load(self, message: LoadMessage) -> LoadEcho:
        """Send a message of an upload and return the answer, as a PortLink does."""
        self._check_open()
        answer = self._ask(
            lambda nonce: message._replace(nonce=nonce),
            lambda reply, nonce: isinstance(reply, LoadEcho) and reply.nonce == nonce,
        )
        if not isinstance(answer, LoadEcho):
            raise DeviceError(
                f"{self.name} did not confirm a part of the package in {ATTEMPTS} attempts: its "
                "faults drop too many frames. Set fewer faults."
            )
        return answer

    def close(self) -> None:
        """Release the rig; may be called twice."""
        self._closed = True

    def __enter__(self) -> "LockstepLink":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _ask(
        self, question: Callable[[int], Message], answers: Callable[[Message, int], bool]
    ) -> Message | None:
        """Ask until the answer arrives; states that arrive before it wait for the next exchange."""
        for _ in range(ATTEMPTS):
            self._nonce += 1
            self._device.receive(encode(question(self._nonce)))
            answered = self._collect()
            for _ in range(ANSWER_TICKS):
                for payload in answered:
                    if answers(reply := decode(payload), self._nonce):
                        return reply
                answered = self._pass_tick()
        return None

    def _pass_tick(self) -> list[bytes]:
        self._device.tick()
        if self._device.unplugged:
            self._closed = True
            after = f" after {self._unplug_s:g} s of streaming" if self._unplug_s else ""
            raise DeviceError(
                f"{self.name} was unplugged{after}, as its faults specify "
                f"({self.virtual_time / TICK_S:.0f} ticks in all)."
            )
        return self._collect()

    def _collect(self) -> list[bytes]:
        """Take what has arrived: states are kept for :meth:`exchange`, the rest is returned."""
        answers: list[bytes] = []
        for payload in self._decoder.feed(b"".join(self._device.take())):
            (self._states if _is_state(payload) else answers).append(payload)
        return answers

    def _check_open(self) -> None:
        if self._closed:
            raise DeviceError("The link to the virtual rig is closed: open a new one.")


_STATE_TYPE = FrameDecoder().feed(encode(State(0, 0, 0)))[0][0]


def _is_state(payload: bytes) -> bool:
    return payload[0] == _STATE_TYPE
