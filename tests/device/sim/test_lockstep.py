"""The link in virtual time: the face of a link, and the same numbers every time."""

import numpy as np
import pytest

from scissorcal.device.link import Link
from scissorcal.device.lockstep import LockstepLink
from scissorcal.device.sim.sensors import Faults
from scissorcal.errors import DeviceError
from scissorcal.kernel import Command, ConfigKey, State, decode, encode


def link_of(seed: int = 1, faults: Faults | None = None) -> LockstepLink:
    return LockstepLink("office-paper", np.random.default_rng(seed), faults)


def test_it_is_a_link() -> None:
    link: Link = link_of()
    assert link.identity.name == "scissorcal-sim"
    link.configure(ConfigKey.STREAM, 1.0)
    link.close()
    link.close()
    with pytest.raises(DeviceError, match="closed"):
        link.configure(ConfigKey.STREAM, 1.0)


def test_each_exchange_is_one_tick() -> None:
    with link_of() as link:
        assert link.exchange(None) == []
        link.configure(ConfigKey.STREAM, 1.0)
        payloads = [link.exchange(None) for _ in range(100)]
        assert all(len(arrived) == 1 for arrived in payloads)
        assert link.virtual_time == pytest.approx(0.101)
        state = decode(payloads[-1][0])
        assert isinstance(state, State)
        assert state.sequence == 101


def test_a_command_acts_within_its_tick() -> None:
    with link_of() as link:
        link.configure(ConfigKey.STREAM, 1.0)
        for _ in range(20):
            (payload,) = link.exchange(encode(Command(1, 0, 0.2, 0.0)))
        state = decode(payload)
        assert isinstance(state, State)
        assert state.motor_torque == pytest.approx(0.2, abs=0.01)


def test_equal_seeds_give_equal_bytes() -> None:
    def run(seed: int) -> list[list[bytes]]:
        link = link_of(seed, Faults(drop_share=0.05, garble_share=0.05))
        link.configure(ConfigKey.MATERIAL, 1.0)
        link.configure(ConfigKey.HAND_SPEED_rad_per_s, 1.0)
        link.configure(ConfigKey.STREAM, 1.0)
        return [link.exchange(encode(Command(0, 0, 0.0, 0.0))) for _ in range(500)]

    assert run(7) == run(7)
    assert run(7) != run(8)


def test_configuration_succeeds_on_a_line_with_losses() -> None:
    link = link_of(3, Faults(drop_share=0.3, garble_share=0.2, delay_ms=16.0))
    for _ in range(10):
        link.configure(ConfigKey.STREAM, 1.0)
    link.exchange(None)  # and what arrived before the last echo
    heard = sum(len(link.exchange(None)) for _ in range(500))
    assert 100 < heard < 400
    assert link.garbled > 0


def test_refusals_and_unknown_keys_are_errors_with_reasons() -> None:
    with link_of() as link:
        with pytest.raises(DeviceError, match="refused STREAM"):
            link.configure(ConfigKey.STREAM, 3.0)
        with pytest.raises(DeviceError, match="0x4444"):
            link.configure(0x4444, 1.0)


def test_a_line_error_is_reported() -> None:
    with pytest.raises(DeviceError, match="did not answer"):
        link_of(1, Faults(drop_share=1.0))


def test_an_unplugged_rig_raises_on_every_call() -> None:
    link = link_of(1, Faults(unplug_s=0.1))
    link.configure(ConfigKey.STREAM, 1.0)

    def use() -> None:
        for _ in range(200):
            link.exchange(None)

    with pytest.raises(DeviceError, match="unplugged"):
        use()
    with pytest.raises(DeviceError, match="closed"):
        link.exchange(None)
