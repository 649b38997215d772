"""The lockstep link with another device side, and what arrives while it waits for an answer."""

import numpy as np

from scissorcal.device import Faults, LockstepLink, VirtualRig
from scissorcal.device.sim.protocol import RigProtocol
from scissorcal.kernel import ConfigKey, State, decode


class LateDevice:
    """Reads what it received only at its next tick, as firmware does; counts its ticks."""

    def __init__(self, rig: VirtualRig, rng: np.random.Generator, faults: Faults | None) -> None:
        self._inner = RigProtocol(rig, rng, faults)
        self._received = b""
        self.ticks = 0

    @property
    def unplugged(self) -> bool:
        return self._inner.unplugged

    @property
    def garbled(self) -> int:
        return self._inner.garbled

    def receive(self, data: bytes) -> None:
        self._received += data

    def tick(self) -> None:
        self._inner.receive(self._received)
        self._received = b""
        self._inner.tick()
        self.ticks += 1

    def take(self) -> list[bytes]:
        return self._inner.take()


def test_the_device_side_is_a_parameter() -> None:
    made: list[LateDevice] = []

    def make(rig: VirtualRig, rng: np.random.Generator, faults: Faults | None) -> LateDevice:
        made.append(LateDevice(rig, rng, faults))
        return made[0]

    with LockstepLink("office-paper", np.random.default_rng(1), device=make) as link:
        assert link.identity.name == "scissorcal-sim"
        before = made[0].ticks
        link.exchange(None)
        assert made[0].ticks == before + 1


def test_states_that_arrive_before_an_echo_come_with_the_next_exchange() -> None:
    with LockstepLink("office-paper", np.random.default_rng(1), device=LateDevice) as link:
        link.configure(ConfigKey.STREAM, 1.0)
        payloads = link.exchange(None)
        for value in (20.0, 30.0, 40.0):
            assert link.configure(ConfigKey.BRAKE_AFTER_MS, value) == value
            payloads += link.exchange(None)
    states = [decode(payload) for payload in payloads]
    sequences = [state.sequence for state in states if isinstance(state, State)]
    assert len(sequences) == len(payloads) >= 8  # each of the three settings took a tick
    assert sequences == list(range(sequences[0], sequences[0] + len(sequences)))
