"""A link to a virtual rig in this process, in virtual time: one tick for each exchange.

The frames are the real ones, encoded, sent through the rig's faults and decoded; only the port and
the clock are missing. So a day with the rig runs as fast as the computer can, and the same calls
give the same numbers on every machine.
"""

from collections.abc import Callable

import numpy as np

from scissorcal.device.link import check_echo, check_identity
from scissorcal.device.sim.protocol import RigProtocol
from scissorcal.device.sim.rig import TICK_S, VirtualRig
from scissorcal.device.sim.sensors import Faults
from scissorcal.device.sim.specimen import Specimen, load_specimen
from scissorcal.errors import DeviceError
from scissorcal.kernel import (
    Config,
    ConfigEcho,
    FrameDecoder,
    Hello,
    Identity,
    Message,
    State,
    decode,
    encode,
)

ATTEMPTS = 20
ANSWER_TICKS = 50


class LockstepLink:
    """A link (``identity``, ``configure``, ``close``) with :meth:`exchange`.

    ``specimen`` is a Specimen, its name or its path; ``rng`` seeds everything random in the rig.
    ``rig`` gives tests the truth.

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
    ) -> None:
        """Power on a rig and read its identity; DeviceError if it never answers."""
        loaded = specimen if isinstance(specimen, Specimen) else load_specimen(specimen)
        rig_rng, line_rng = rng.spawn(2)
        self.name = f"The virtual rig {loaded.name}"
        self.rig = VirtualRig(loaded, rig_rng)
        self._protocol = RigProtocol(self.rig, line_rng, faults)
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
        set. Raises DeviceError once the rig is unplugged or the link closed.
        """
        self._check_open()
        if command_frame is not None:
            self._protocol.receive(command_frame)
        return [payload for payload in self._pass_tick() if _is_state(payload)]

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
        """Ask until the answer arrives; STATE payloads that arrive before it are dropped."""
        for _ in range(ATTEMPTS):
            self._nonce += 1
            self._protocol.receive(encode(question(self._nonce)))
            payloads = self._collect()
            for _ in range(ANSWER_TICKS):
                for payload in payloads:
                    if not _is_state(payload) and answers(reply := decode(payload), self._nonce):
                        return reply
                payloads = self._pass_tick()
        return None

    def _pass_tick(self) -> list[bytes]:
        self._protocol.tick()
        if self._protocol.unplugged:
            self._closed = True
            raise DeviceError(
                f"{self.name} was unplugged after {self._protocol.faults.unplug_s:g} s of "
                f"streaming, as its faults specify ({self.virtual_time / TICK_S:.0f} ticks in all)."
            )
        return self._collect()

    def _collect(self) -> list[bytes]:
        return self._decoder.feed(b"".join(self._protocol.take()))

    def _check_open(self) -> None:
        if self._closed:
            raise DeviceError("The link to the virtual rig is closed: open a new one.")


_STATE_TYPE = FrameDecoder().feed(encode(State(0, 0, 0)))[0][0]


def _is_state(payload: bytes) -> bool:
    return payload[0] == _STATE_TYPE
