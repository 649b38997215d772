"""Homing: asked for, followed to its end, and told with the reason where it fails."""

import math

import numpy as np
import pytest

from scissorcal.device import Faults, LockstepLink, Operator, RigSession, SimProcess, open_link
from scissorcal.device.home import WHY_GAVE_UP, home
from scissorcal.device.probe.probe import probe
from scissorcal.errors import DeviceError, InputError
from scissorcal.kernel import (
    HOME_CAUSE,
    ConfigKey,
    FaultCause,
    HomeResult,
    State,
    StateFlag,
    decode,
)
from scissorcal.recipe import builtin_recipe
from tests.strange_device import Faults as StrangeFaults
from tests.strange_device import StrangeDevice, VirtualPort, serve_on_pty


def rig(**faults: object) -> LockstepLink:
    return LockstepLink("office-paper", np.random.default_rng(1), Faults(**faults))  # type: ignore[arg-type]


def flags(link: LockstepLink) -> StateFlag:
    link.configure(ConfigKey.STREAM, 1.0)
    seen = decode(link.exchange(None)[-1])
    assert isinstance(seen, State)
    return StateFlag(seen.flags)


def test_a_rig_finds_its_zero_slowly_and_at_the_stop() -> None:
    with rig(not_homed=True) as link:
        rates = []
        exchange = link.exchange

        def watched(frame: bytes | None) -> list[bytes]:
            states = exchange(frame)
            rates.append(abs(link.rig.rate))
            return states

        link.exchange = watched  # type: ignore[method-assign]
        homed = home(link)
        assert not homed.was_homed
        assert max(rates) < 0.5
        assert math.isclose(homed.opening_rad, link.rig.opening, abs_tol=1e-3)
        assert not flags(link) & (StateFlag.NOT_HOMED | StateFlag.HOMING)


def test_a_rig_that_knows_its_zero_may_look_again() -> None:
    with rig() as link:
        assert home(link).was_homed


def test_nothing_moves_before_a_person_was_asked() -> None:
    device = StrangeDevice(StrangeFaults(not_homed=True), version=2)
    link = VirtualPort(device)
    with pytest.raises(InputError, match="ask a person"):
        home(link)

    def refuse(request: str) -> None:
        assert "Clear the space between the blades" in request
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        home(link, Operator(refuse))
    assert not device._homing_s
    asked: list[str] = []
    assert home(link, Operator(asked.append)).seconds > 1.0
    assert len(asked) == 1


def test_a_device_on_a_port_is_homed() -> None:
    device = StrangeDevice(StrangeFaults(not_homed=True), version=2)
    with serve_on_pty(device) as port, open_link(port) as link:
        assert not home(link, Operator(lambda request: None)).was_homed


def test_an_interrupted_search_is_stopped() -> None:
    def interrupt(done: float, sentence: str, recorder: object = None, /) -> None:
        raise KeyboardInterrupt

    with rig(not_homed=True) as link:
        with pytest.raises(KeyboardInterrupt):
            home(link, Operator(progress=interrupt))
        seen = flags(link)
        assert seen & StateFlag.NOT_HOMED
        assert not seen & StateFlag.HOMING


def test_a_search_without_a_zero_is_told() -> None:
    device = StrangeDevice(StrangeFaults(not_homed=True, home_finds=False), version=2)
    with pytest.raises(
        DeviceError, match=r"gave up after 1.5 s without finding its zero: the blades moved, "
    ):
        home(VirtualPort(device), Operator(lambda request: None))


def test_a_fault_on_the_way_is_told_with_its_cause() -> None:
    with (
        rig(not_homed=True, cause=FaultCause.CURRENT, cause_s=0.5) as link,
        pytest.raises(DeviceError, match=r"stopped looking for its zero. The motor's current"),
    ):
        home(link)


def test_a_fault_that_stands_is_told_before_anything_moves() -> None:
    with rig(not_homed=True, cause=FaultCause.STOP_BUTTON, cause_s=0.0) as link:
        place = link.rig.opening
        with pytest.raises(DeviceError, match=r"not homed. The stop button"):
            home(link)
        assert abs(link.rig.opening - place) < 1e-3


@pytest.mark.parametrize("version", [1, 2])
def test_home_is_refused_while_the_motors_follow(version: int) -> None:
    """A device of version 1 does not home at all."""
    with rig(protocol_version=version) as link:
        if version == 1:
            with pytest.raises(DeviceError, match="does not look for its zero by command"):
                home(link)
            return
        from scissorcal.kernel import Command, CommandFlag, encode

        link.configure(ConfigKey.STREAM, 1.0)
        link.exchange(encode(Command(CommandFlag.ENABLE, 0, 0.0, 0.0)))
        with pytest.raises(DeviceError, match="refused HOME = 1"):
            link.configure(ConfigKey.HOME, 1.0)


def test_a_probe_refuses_before_it_asks_anybody() -> None:
    device = StrangeDevice(StrangeFaults(not_homed=True), version=2)

    def nobody(request: str) -> None:
        pytest.fail(f"It asked: {request}")

    session = RigSession(VirtualPort(device), builtin_recipe("paper-80gsm"), Operator(nobody))
    with pytest.raises(DeviceError, match="scissorcal device home") as caught:
        probe(session)
    assert caught.value.stop == "NOT_HOMED"
    assert device.largest_torque == 0.0


@pytest.mark.parametrize("cause", [FaultCause.STOP_BUTTON, FaultCause.HEAT])
def test_a_probe_names_the_cause_of_a_fault_that_stays(cause: FaultCause) -> None:
    with (
        rig(cause=cause, cause_s=0.0) as link,
        pytest.raises(DeviceError, match=rf"cause {cause.name}.*did not clear it"),
    ):
        probe(RigSession(link, builtin_recipe("paper-80gsm")))


def test_a_virtual_rig_on_a_port_is_homed() -> None:
    with (
        SimProcess("office-paper", seed=1, faults=["not-homed=1"]) as sim,
        open_link(sim.port) as link,
    ):
        assert not home(link).was_homed


@pytest.mark.parametrize(
    ("result", "why"),
    [
        (HomeResult.STOPPED, "it was told to stop"),
        (HomeResult.TIMED_OUT, "the blades moved, but did not meet it in time"),
        (HomeResult.JAMMED, "its motor did not move the blades"),
        (HomeResult.FAULT, "a fault ended the search"),
    ],
)
def test_each_end_of_a_search_has_its_sentence(result: HomeResult, why: str) -> None:
    assert WHY_GAVE_UP[HOME_CAUSE + result].startswith(why)


def test_a_virtual_rig_states_why_it_gave_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("scissorcal.device.sim.homing.TIMEOUT_S", 0.2)
    with (
        rig(not_homed=True) as link,
        pytest.raises(DeviceError, match=r"finding its zero: the blades moved, but did not meet"),
    ):
        home(link)
