"""The device's side of the wire, message by message, and what it does when a host goes quiet."""

import math

import numpy as np
import pytest

from scissorcal.device.probe.talk import MEASURED
from scissorcal.device.sim.protocol import ENCODER_CHECK_MS, RigProtocol
from scissorcal.device.sim.rig import VirtualRig
from scissorcal.device.sim.sensors import Faults, Measured
from scissorcal.device.sim.specimen import Specimen, load_specimen
from scissorcal.kernel import (
    PROTOCOL_VERSION,
    SCHEMA_HASH,
    Capability,
    Command,
    CommandFlag,
    Config,
    ConfigEcho,
    ConfigKey,
    ConfigStatus,
    FrameDecoder,
    Hello,
    Identity,
    Message,
    State,
    StateFlag,
    decode,
    encode,
)
from tests.device.sim.build import specimen

ENABLE = int(CommandFlag.ENABLE)


class Host:
    """The other end: sends messages, lets ticks pass, and decodes what comes."""

    def __init__(
        self,
        faults: Faults | None = None,
        name: str = "office-paper",
        truth: Specimen | None = None,
    ) -> None:
        rng = np.random.default_rng(1)
        self.rig = VirtualRig(truth or load_specimen(name), rng)
        self.device = RigProtocol(self.rig, np.random.default_rng(2), faults)
        self.decoder = FrameDecoder()

    def say(self, *messages: Message) -> list[Message]:
        for message in messages:
            self.device.receive(encode(message))
        return self.hear()

    def hear(self) -> list[Message]:
        return [decode(p) for frame in self.device.take() for p in self.decoder.feed(frame)]

    def tick(self, command: Command | None = None) -> State:
        if command is not None:
            self.device.receive(encode(command))
        self.device.tick()
        states = [message for message in self.hear() if isinstance(message, State)]
        assert len(states) == 1
        return states[0]

    def set(self, key: int, value: float) -> ConfigEcho:
        (echo,) = self.say(Config(key, 77, value))
        assert isinstance(echo, ConfigEcho)
        assert (echo.key, echo.nonce) == (key, 77)
        return echo


@pytest.fixture
def host() -> Host:
    streaming = Host()
    streaming.set(ConfigKey.STREAM, 1.0)
    return streaming


def test_the_sensors_give_the_numbers_of_a_state_in_their_order() -> None:
    assert Measured._fields[: len(MEASURED)] == MEASURED


def test_hello_is_answered_with_an_identity() -> None:
    host = Host()
    (identity,) = host.say(Hello(nonce=123))
    assert isinstance(identity, Identity)
    assert identity.nonce_echo == 123
    assert identity.schema_hash == SCHEMA_HASH
    assert identity.protocol_version == PROTOCOL_VERSION
    assert identity.capabilities & Capability.SIMULATOR
    assert identity.opening_min == pytest.approx(math.radians(8.0))
    assert identity.handle_radius == pytest.approx(0.06)
    assert identity.tick_us == 1000


def test_nothing_is_sent_before_streaming() -> None:
    host = Host()
    for _ in range(5):
        host.device.tick()
    assert host.hear() == []


def test_states_count_ticks_and_the_devices_own_time(host: Host) -> None:
    states = [host.tick() for _ in range(2_000)]
    assert [state.sequence for state in states] == list(range(1, 2_001))
    assert states[-1].device_us == int(2_000_000 * (1 + 30e-6))


@pytest.mark.parametrize(
    ("key", "value", "status"),
    [
        (ConfigKey.STREAM, 0.5, ConfigStatus.VALUE_REFUSED),
        (ConfigKey.BRAKE_AFTER_MS, 25.0, ConfigStatus.OK),
        (ConfigKey.BRAKE_AFTER_MS, 0.0, ConfigStatus.VALUE_REFUSED),
        (ConfigKey.BRAKE_AFTER_MS, float("nan"), ConfigStatus.VALUE_REFUSED),
        (ConfigKey.HAND_SPEED_rad_per_s, float("inf"), ConfigStatus.VALUE_REFUSED),
        (ConfigKey.HAND_SPEED_rad_per_s, -1.0, ConfigStatus.VALUE_REFUSED),
        (ConfigKey.HAND_STROKES, 2.5, ConfigStatus.VALUE_REFUSED),
        (ConfigKey.HAND_STROKES, float("nan"), ConfigStatus.VALUE_REFUSED),
        (ConfigKey.HAND_STROKES, 3.0, ConfigStatus.OK),
        (ConfigKey.MATERIAL, 2.0, ConfigStatus.OK),
        (ConfigKey.MATERIAL, 3.0, ConfigStatus.VALUE_REFUSED),
        (ConfigKey.MATERIAL, 1.0, ConfigStatus.OK),
        (0x1234, 1.0, ConfigStatus.UNKNOWN_KEY),
    ],
)
def test_configuration_is_echoed_with_the_value_in_force(
    key: int, value: float, status: ConfigStatus
) -> None:
    host = Host()
    echo = host.set(key, value)
    assert echo.status == status
    if status == ConfigStatus.OK:
        assert echo.value == value
    else:
        assert math.isfinite(echo.value)
        assert echo.value != value


def test_a_fresh_sheet_starts_uncut(host: Host) -> None:
    host.set(ConfigKey.MATERIAL, 1.0)
    host.set(ConfigKey.HAND_STROKES, 1.0)
    host.set(ConfigKey.HAND_SPEED_rad_per_s, 2.0)
    for _ in range(4_000):
        host.tick()
    assert host.rig.crack > 0.02
    assert host.set(ConfigKey.MATERIAL, 0.0).status == ConfigStatus.OK
    assert math.isnan(host.rig.crack)
    host.rig.carriage.place = -0.06
    assert host.set(ConfigKey.MATERIAL, 1.0).status == ConfigStatus.OK
    assert host.rig.crack == 0.0


def test_material_is_refused_while_the_blades_block_it(host: Host) -> None:
    host.rig.joint.place, host.rig.carriage.place = 0.2, 0.0
    echo = host.set(ConfigKey.MATERIAL, 1.0)
    assert echo.status == ConfigStatus.VALUE_REFUSED
    assert echo.value == 0.0


def test_a_plate_is_put_in_where_the_specimen_has_one() -> None:
    """Without one, as in test_configuration_is_echoed_with_the_value_in_force, 2 is refused."""
    plate = {"place_mm": (0.0, 10.0, 0.0)}
    host = Host(truth=specimen(plate=plate))
    assert host.set(ConfigKey.MATERIAL, 2.0).status == ConfigStatus.OK
    assert host.rig.plate is not None
    assert host.set(ConfigKey.MATERIAL, 3.0).status == ConfigStatus.VALUE_REFUSED
    host.rig.joint.place, host.rig.carriage.place = 0.15, -0.04
    assert host.set(ConfigKey.MATERIAL, 2.0).status == ConfigStatus.VALUE_REFUSED
    assert host.set(ConfigKey.MATERIAL, 0.0).status == ConfigStatus.OK
    assert host.rig.plate is None


def test_enabled_motors_follow_commands_and_disabled_ones_do_not(host: Host) -> None:
    for _ in range(20):
        state = host.tick(Command(0, 0, 0.3, 0.0))
    assert not state.flags & StateFlag.MOTOR_ENABLED
    assert abs(state.motor_torque) < 0.01
    for _ in range(20):
        state = host.tick(Command(ENABLE, 0, 0.3, 0.0))
    assert state.flags == StateFlag.MOTOR_ENABLED
    assert state.motor_torque == pytest.approx(0.3, abs=0.01)


def test_torque_beyond_the_limit_is_clipped_and_flagged(host: Host) -> None:
    for _ in range(20):
        state = host.tick(Command(ENABLE, 0, -50.0, 0.0))
    assert state.flags & StateFlag.TORQUE_SATURATED
    assert state.motor_torque == pytest.approx(-1.5, abs=0.01)


def test_silence_brakes_and_latches_until_the_fault_is_cleared(host: Host) -> None:
    drive = Command(ENABLE, 0, 0.05, 0.0)
    host.tick(drive)
    quiet = [host.tick() for _ in range(30)]
    lost = [bool(state.flags & StateFlag.COMMANDS_LOST) for state in quiet]
    assert lost.index(True) == 10 - 1  # the first tick after the command is not yet silence
    assert quiet[-1].flags == StateFlag.FAULT_LATCHED | StateFlag.COMMANDS_LOST
    assert abs(quiet[-1].motor_torque) < 0.01

    state = host.tick(drive)
    assert state.flags == StateFlag.FAULT_LATCHED
    state = host.tick(drive._replace(flags=ENABLE | CommandFlag.CLEAR_FAULT))
    assert state.flags == StateFlag.MOTOR_ENABLED


def test_a_host_that_died_is_streamed_to_for_five_seconds(host: Host) -> None:
    host.set(ConfigKey.STREAM, 1.0)
    heard = 0
    for _ in range(7000):
        host.device.tick()
        heard += len(host.hear())
    assert 4990 <= heard <= 5000
    assert isinstance(host.say(Hello(5))[0], Identity)
    host.set(ConfigKey.STREAM, 1.0)
    for tick in range(12_000):
        if tick % 4000 == 0:
            host.say(Hello(6))
        host.device.tick()
        assert len(host.hear()) == 1


def test_without_enable_silence_is_no_fault(host: Host) -> None:
    host.tick(Command(ENABLE, 0, 0.01, 0.0))
    host.tick(Command(0, 0, 0.0, 0.0))
    assert [host.tick().flags for _ in range(100)] == [0] * 100


def test_the_timeout_can_be_raised(host: Host) -> None:
    host.set(ConfigKey.BRAKE_AFTER_MS, 50.0)
    host.tick(Command(ENABLE, 0, 0.01, 0.0))
    flags = [host.tick().flags for _ in range(60)]
    assert flags.index(StateFlag.FAULT_LATCHED | StateFlag.COMMANDS_LOST) == 49


def test_commands_that_are_not_finite_are_ignored(host: Host) -> None:
    host.tick(Command(ENABLE, 0, 0.01, 0.0))
    for _ in range(15):
        state = host.tick(Command(ENABLE, 0, float("nan"), 0.0))
        assert math.isfinite(state.opening)
    assert state.flags & StateFlag.COMMANDS_LOST


def test_noise_on_the_line_is_counted_and_skipped(host: Host) -> None:
    rng = np.random.default_rng(4)
    for _ in range(200):
        host.device.receive(rng.integers(0, 256, 40, dtype=np.uint8).tobytes())
    host.device.receive(b"\0")
    assert host.device.garbled > 20
    assert isinstance(host.say(Hello(5))[0], Identity)


def test_messages_of_the_device_itself_are_ignored(host: Host) -> None:
    assert host.say(State(0, 1, 2, 0.1, 0.0, 0.0, 0.0), ConfigEcho(0, 1, 2, 0.0)) == []


def test_dropped_and_garbled_frames_have_their_stated_share() -> None:
    host = Host(Faults(drop_share=0.1, garble_share=0.05))
    while not host.say(Config(ConfigKey.STREAM, 1, 1.0)):
        pass
    count = 10_000
    heard = 0
    for tick in range(count):
        if tick % 500 == 0:  # a silent host is not streamed to for long
            host.device.receive(encode(Command(0, 0, 0.0, 0.0)))
        host.device.tick()
        heard += len(host.hear())
    # a garbled frame is lost too; one that loses its delimiter takes the next one with it
    assert heard / count == pytest.approx(0.9 * 0.95, abs=0.012)
    assert host.decoder.garbled == pytest.approx(0.9 * 0.05 * count, rel=0.15)


def test_delayed_frames_come_late_and_in_order() -> None:
    host = Host(Faults(delay_ms=16.0))
    host.say(Config(ConfigKey.STREAM, 1, 1.0))
    heard: list[int] = []
    for tick in range(1, 101):
        host.device.tick()
        states = [message.sequence for message in host.hear() if isinstance(message, State)]
        assert all(sequence == tick - 16 for sequence in states)
        heard += states
    assert heard == list(range(1, 85))


def test_a_stuck_encoder_is_constant_then_detected_and_latches() -> None:
    host = Host(Faults(stuck_encoder_s=0.05))
    host.set(ConfigKey.STREAM, 1.0)
    drive = Command(ENABLE | CommandFlag.CLEAR_FAULT, 0, 0.1, 0.0)
    states = [host.tick(drive) for _ in range(300)]
    frozen = {state.opening for state in states[51:]}
    assert len(frozen) == 1
    assert len({state.opening for state in states[:50]}) > 10
    flagged = [bool(state.flags & StateFlag.ENCODER_FAULT) for state in states]
    assert abs(flagged.index(True) - 50 - ENCODER_CHECK_MS) <= 1
    assert states[-1].flags & StateFlag.FAULT_LATCHED
    assert not states[-1].flags & StateFlag.MOTOR_ENABLED


def test_unplugging_happens_at_its_time_after_streaming_began() -> None:
    host = Host(Faults(unplug_s=0.2))
    for _ in range(500):
        host.device.tick()
    assert not host.device.unplugged
    host.set(ConfigKey.STREAM, 1.0)
    for _ in range(200):
        host.device.tick()
    assert not host.device.unplugged
    host.device.tick()
    assert host.device.unplugged
