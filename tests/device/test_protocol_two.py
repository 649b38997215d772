"""What version 2 of the protocol adds: causes of faults, homing; version 1 is served as before."""

import itertools
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from scissorcal.device import (
    Faults,
    LockstepLink,
    Operator,
    RigSession,
    SimProcess,
    open_link,
    open_motion,
)
from scissorcal.device.faults import fault_sentence, stop_sentence
from scissorcal.device.loop_verdicts import loop_verdicts
from scissorcal.device.probe.idle import idle
from scissorcal.device.probe.judge import judge_idle
from scissorcal.device.probe.probe import probe
from scissorcal.device.probe.talk import Bounds, Talk
from scissorcal.errors import DeviceError
from scissorcal.kernel import (
    EARLIER_SCHEMAS,
    PROTOCOL_VERSION,
    Capability,
    Command,
    CommandFlag,
    ConfigKey,
    FaultCause,
    LoadBegin,
    LoadChunk,
    LoadCommit,
    LoadEcho,
    LoadStatus,
    ServoConfig,
    State,
    StateFlag,
    StopReason,
    decode,
    encode,
)
from scissorcal.recipe import builtin_recipe
from scissorcal.verdicts import failed
from tests.strange_device import Faults as StrangeFaults
from tests.strange_device import Person, StrangeDevice, VirtualPort

LATCHED = list(FaultCause)[FaultCause.STOP_BUTTON :]
"""What is latched by what happens in the device alone, the encoder aside."""
ENABLE, CLEAR = CommandFlag.ENABLE, CommandFlag.CLEAR_FAULT


def limits() -> ServoConfig:
    return ServoConfig(torque_limit=0.5, torque_slew=100, force_limit=0, force_slew=0)


def rig(**faults: object) -> LockstepLink:
    return LockstepLink("office-paper", np.random.default_rng(1), Faults(**faults))  # type: ignore[arg-type]


def state(link: LockstepLink | VirtualPort, command: Command | None = None) -> State:
    """The newest state after a tick."""
    payloads = link.exchange(encode(command) if command is not None else None)
    found = decode(payloads[-1])
    assert isinstance(found, State)
    return found


@pytest.mark.parametrize("version", [1, 2])
def test_a_rig_of_either_version_is_served_in_virtual_time(version: int) -> None:
    with rig(protocol_version=version) as link, open_motion(link, limits()) as motion:
        assert link.identity.protocol_version == version
        assert len(np.concatenate(list(motion.idle(0.1)))) == 100


@pytest.mark.parametrize("version", [1, 2])
def test_a_rig_of_either_version_is_served_on_a_port(version: int) -> None:
    with (
        SimProcess("office-paper", faults=[f"protocol={version}"]) as sim,
        open_link(sim.port) as link,
    ):
        assert link.identity.protocol_version == version
        link.configure(ConfigKey.STREAM, 1.0)
        assert link.state().cause == 0
        homes = bool(link.identity.capabilities & Capability.HOMES)
        assert homes is (version == 2)


@pytest.mark.parametrize("version", [1, 2])
def test_the_strange_device_serves_either_version(version: int) -> None:
    link = VirtualPort(StrangeDevice(version=version))
    assert link.identity.protocol_version == version
    with open_motion(link, limits()) as motion:
        assert len(np.concatenate(list(motion.idle(0.1)))) == 100


def test_a_device_of_version_1_keeps_its_own_schema_and_knows_no_new_key() -> None:
    with rig(protocol_version=1) as link:
        assert link.identity.schema_hash == EARLIER_SCHEMAS[1]
        for key in (ConfigKey.HOME, ConfigKey.RENDER):
            with pytest.raises(DeviceError, match="does not know the setting"):
                link.configure(key, 1.0)


def stops_with(cause: FaultCause, **more: object) -> DeviceError:
    with (
        rig(cause=cause, cause_s=0.3, **more) as link,
        open_motion(link, limits()) as motion,
        pytest.raises(DeviceError) as caught,
    ):
        for _ in motion.idle(2.0):
            pass
    assert caught.value.stop == "DEVICE_FAULT"
    return caught.value


@pytest.mark.parametrize("cause", LATCHED)
def test_a_stop_names_the_cause_and_its_remedy(cause: FaultCause) -> None:
    message = str(stops_with(cause))
    assert message.startswith(fault_sentence(cause))
    assert f"cause {cause.name}" in message


def test_a_device_of_version_1_states_no_cause() -> None:
    message = str(stops_with(FaultCause.HEAT, protocol_version=1))
    assert message.startswith("The device latched a fault that did not clear")
    assert "HEAT" not in message


def test_a_loop_that_did_not_run_is_named_first() -> None:
    for reason in (StopReason.SILENCE, StopReason.TRACKING_LOST, StopReason.DEVICE_FAULT):
        sentence = stop_sentence(reason, FaultCause.WATCHDOG, 1.0)
        assert sentence.startswith("This computer did not run the servo loop for 1000 ms")
        assert stop_sentence(reason, 0, 0.0) == reason.sentence
    heat = stop_sentence(StopReason.DEVICE_FAULT, FaultCause.HEAT, 1.0)
    assert heat.startswith("Motor or driver is too hot")
    unplugged = stop_sentence(StopReason.RESTARTED, 0, 1.0)
    assert unplugged == StopReason.RESTARTED.sentence


@pytest.mark.parametrize("cause", [FaultCause.HEAT, FaultCause.NONE])
def test_the_verdict_on_faults_names_the_last_cause(cause: FaultCause) -> None:
    with rig() as link, open_motion(link, limits()) as motion:
        report = motion.report()
    counters = replace(report.counters, faults=9)
    report = replace(report, counters=counters, fault_cause=int(cause))
    (why,) = (v.why for v in loop_verdicts("render", report, None, 1000) if "faults" in v.check)
    assert ("too hot" in why) is (cause is FaultCause.HEAT)
    assert ("device doctor" in why) is (cause is FaultCause.NONE)


@pytest.mark.parametrize("noticed", [True, False])
def test_what_this_computer_missed_is_no_loss_of_the_line(noticed: bool) -> None:
    """A host that is away for 300 ticks of the idle second; it knows of it, or not."""
    link = VirtualPort(StrangeDevice(version=2))
    with Talk(link, Bounds(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)) as talk:
        exchange, passed = link.exchange, itertools.count()

        def away(frame: bytes | None) -> list[bytes]:
            if next(passed) == 400:
                for _ in range(300):
                    exchange(None)
                if noticed:
                    talk._held_up.append((talk.mark(), 0.3))
            return exchange(frame)

        link.exchange = away  # type: ignore[method-assign]
        found = idle(talk)
    (verdict,) = (v for v in judge_idle(found, link.identity, 60.0) if "lost" in v.check)
    if noticed:
        assert (found.lost_share, found.held_up_s) == (0.0, 0.3)
        assert "did not listen for up to 300 ms" in verdict.why
        assert verdict.status == "pass"
    else:
        assert found.lost_share > 0.1
        assert verdict.status == "fail"


def test_every_cause_has_one_sentence_of_its_own_with_a_remedy() -> None:
    sentences = [fault_sentence(cause) for cause in FaultCause if cause]
    assert len(set(sentences)) == len(FaultCause) - 1
    assert fault_sentence(FaultCause.NONE) == ""
    assert "(77)" in fault_sentence(77)


@pytest.fixture(params=["virtual rig", "strange device"])
def device(request: pytest.FixtureRequest) -> Iterator[LockstepLink | VirtualPort]:
    link = rig() if request.param == "virtual rig" else VirtualPort(StrangeDevice(version=2))
    link.configure(ConfigKey.STREAM, 1.0)
    yield link
    link.close()


def test_the_watchdog_states_its_cause_until_the_fault_is_cleared(
    device: LockstepLink | VirtualPort,
) -> None:
    state(device, Command(ENABLE, 0, 0.0, 0.0))
    for _ in range(20):
        seen = state(device)
    assert seen.flags & StateFlag.FAULT_LATCHED
    assert seen.cause == FaultCause.WATCHDOG
    seen = state(device, Command(CLEAR, 0, 0.0, 0.0))
    assert (seen.cause, seen.flags & StateFlag.FAULT_LATCHED) == (0, 0)


@pytest.mark.parametrize("hold", [1, 3])
def test_a_command_with_hold_ticks_acts_for_so_many_ticks(
    device: LockstepLink | VirtualPort, hold: int
) -> None:
    """A torque beyond the limit is flagged while it acts."""
    flagged = []
    frame = Command(ENABLE, 0, 5.0, 0.0, hold)
    for tick in range(6):
        seen = state(device, frame if tick == 0 else None)
        flagged.append(bool(seen.flags & StateFlag.TORQUE_SATURATED))
        assert seen.flags & StateFlag.MOTOR_ENABLED
    assert flagged == [True] * hold + [False] * (6 - hold)


def test_of_two_commands_in_a_tick_the_later_one_acts(device: LockstepLink | VirtualPort) -> None:
    both = encode(Command(ENABLE, 0, 5.0, 0.0)) + encode(Command(ENABLE, 0, 0.0, 0.0))
    found = decode(device.exchange(both)[-1])
    assert isinstance(found, State)
    assert not found.flags & StateFlag.TORQUE_SATURATED


def test_unknown_flags_are_ignored(device: LockstepLink | VirtualPort) -> None:
    seen = state(device, Command(ENABLE | 0xFFF0, 0, 0.0, 0.0))
    assert seen.flags & ~int(StateFlag.OPENING_AT_STOP) == StateFlag.MOTOR_ENABLED


def test_reserved_bytes_are_ignored() -> None:
    from tests.strange_device import wire

    with rig() as link:
        payload = bytearray.fromhex("12 ff 02 00 07 00 00 00 00 00 a0 41")  # CONFIG, reserved 0xFF
        link._device.receive(wire.frame(bytes(payload)))
        link.exchange(None)
        assert link.configure(ConfigKey.BRAKE_AFTER_MS, 30.0) == 30.0
        link._device.receive(wire.frame(bytes(payload)))
        assert link._device._values[ConfigKey.BRAKE_AFTER_MS] == 20.0  # type: ignore[attr-defined]


def test_a_stream_that_ends_while_enabled_ends_in_the_watchdog() -> None:
    """STREAM = 0 changes nothing but the states: without commands the device brakes."""
    with rig() as link:
        link.configure(ConfigKey.STREAM, 1.0)
        state(link, Command(ENABLE, 0, 0.2, 0.0))
        link.configure(ConfigKey.STREAM, 0.0)
        link.exchange(None)  # and what came before the echo
        assert not any(link.exchange(None) for _ in range(50))
        link.configure(ConfigKey.STREAM, 1.0)
        seen = state(link)
        assert seen.cause == FaultCause.WATCHDOG


def test_a_device_that_does_not_render_refuses_an_image() -> None:
    with rig() as link:
        wanted = (
            (LoadBegin(1, 11, 500, 0), LoadStatus.OTHER_FORMAT),
            (LoadChunk(4, 12, 0, b"abcd"), LoadStatus.NOT_ANNOUNCED),
            (LoadCommit(13), LoadStatus.NOT_ANNOUNCED),
        )
        for message, status in wanted:
            link._device.receive(encode(message))
            (payload,) = link._collect()
            echo = decode(payload)
            assert echo == LoadEcho(status, message.nonce, 0, 0, 0)


def test_version_2_is_the_version_of_this_protocol() -> None:
    assert PROTOCOL_VERSION == 2


@pytest.mark.parametrize("what", ["virtual rig", "strange device"])
def test_a_motion_refuses_a_device_that_is_not_homed(what: str) -> None:
    link: LockstepLink | VirtualPort = rig(not_homed=True)
    if what == "strange device":
        link = VirtualPort(StrangeDevice(StrangeFaults(not_homed=True), version=2))
    with pytest.raises(DeviceError, match="scissorcal device home") as caught:
        open_motion(link, limits())
    assert caught.value.stop == "NOT_HOMED"
    if isinstance(link, VirtualPort):
        assert link.device.largest_torque == 0.0


@pytest.mark.slow
@pytest.mark.parametrize("version", [1, 2])
def test_a_probe_finds_the_same_on_a_device_of_either_version(version: int) -> None:
    device = StrangeDevice(seed=1, version=version)
    recipe = builtin_recipe("paper-80gsm")
    result = probe(RigSession(VirtualPort(device), recipe, Operator(Person(device))))
    assert failed(result.verdicts) == ()
    assert result.inertia_kg_m2 is not None
    low, high = result.inertia_kg_m2.interval
    assert low < device.faults.inertia < high


def test_a_device_that_is_not_homed_follows_no_command() -> None:
    with rig(not_homed=True) as link:
        link.configure(ConfigKey.STREAM, 1.0)
        for _ in range(20):
            seen = state(link, Command(ENABLE, 0, 0.3, 0.0))
        assert seen.flags & StateFlag.NOT_HOMED
        assert not seen.flags & StateFlag.MOTOR_ENABLED
        assert abs(link.rig.rate) < 1e-3
