"""The handshake and its refusals, against a thread on the other side of a pseudo-terminal."""

import fcntl
import inspect
import itertools
import struct
import termios
import time
from collections import deque
from collections.abc import Callable, Iterator
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from scissorcal.device import link as room
from scissorcal.device import ports
from scissorcal.device.answers import check_identity
from scissorcal.device.link import DEFAULT_BAUD, PortLink, open_link
from scissorcal.device.ports import modem_manager_runs, open_port
from scissorcal.errors import DeviceError
from scissorcal.kernel import (
    SCHEMA_HASH,
    Config,
    ConfigEcho,
    ConfigKey,
    Hello,
    Message,
    State,
    encode,
    encode_frame,
)
from tests.device.conftest import IDENTITY, Answer, FarEnd
from tests.guard import GUARD_S

Make = Callable[[Answer], FarEnd]
STATE = State(1, 5, 9000, 0.5, -0.06, 0.01, 0.2)


def honest(message: Message) -> list[bytes]:
    if isinstance(message, Hello):
        return [encode(IDENTITY._replace(nonce_echo=message.nonce))]
    if isinstance(message, Config):
        return [encode(ConfigEcho(0, message.key, message.nonce, message.value))]
    return []


def silent(message: Message) -> list[bytes]:
    return []


@pytest.fixture(autouse=True)
def patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """An answer is waited for however late it comes, so that nothing is asked twice."""
    monkeypatch.setattr(room, "HELLO_WAIT_S", GUARD_S)
    monkeypatch.setattr(room, "CONFIGURE_WAIT_S", GUARD_S)


def opened(end: FarEnd) -> PortLink:
    return open_link(end.port, timeout=GUARD_S)


def until_waiting(end: FarEnd, count: int) -> None:
    """Until so many bytes wait to be read by the host."""
    waiting, end_s = 0, time.monotonic() + GUARD_S
    while waiting < count:
        assert time.monotonic() < end_s, f"{waiting} of {count} bytes wait"
        time.sleep(1e-3)
        told = fcntl.ioctl(end._slave, termios.FIONREAD, struct.pack("i", 0))
        (waiting,) = struct.unpack("i", told)


def test_identity_arrives_although_stale_and_garbled_bytes_wait(far_end: Make) -> None:
    end = far_end(honest)
    stale = encode(IDENTITY._replace(name="yesterday"))
    waiting = b"\x05\x99" * 300 + stale + encode(STATE) * 10 + encode(STATE)[:9]
    end.say(waiting)
    until_waiting(end, len(waiting))
    with opened(end) as link:
        assert link.identity.name == "bench rig"
        assert link.received.garbled <= 1


class Scripted(PortLink):
    """A link whose port is a list of answers, one for each message that is sent."""

    def __init__(self, *answers: list[Message]) -> None:
        super().__init__(SimpleNamespace(close=lambda: None), "A scripted port")  # type: ignore[arg-type]
        self.sent: list[Message] = []
        self._answers = deque(answers)

    def send(self, message: Message) -> None:
        self.sent.append(message)

    def receive(self, timeout: float) -> Iterator[Message]:
        for answer in self._answers.popleft():
            if isinstance(answer, ConfigEcho):
                asked = self.sent[-1]
                assert isinstance(asked, Config)
                answer = answer._replace(nonce=asked.nonce)
            yield answer


ECHO = ConfigEcho(0, 1, 0, 1.0)


def test_configure_sends_again_what_got_lost() -> None:
    link = Scripted([], [STATE], [STATE, ECHO])
    assert link.configure(ConfigKey.STREAM, 1.0) == 1.0
    sent = [message for message in link.sent if isinstance(message, Config)]
    assert [(message.key, message.value) for message in sent] == [(1, 1.0)] * 3
    assert len({message.nonce for message in sent}) == 3


def test_what_is_never_confirmed_is_told_with_the_attempts() -> None:
    link = Scripted(*([[STATE]] * room.CONFIGURE_ATTEMPTS))
    with pytest.raises(DeviceError, match="did not confirm STREAM = 1 in 5 attempts"):
        link.configure(ConfigKey.STREAM, 1.0)
    assert len(link.sent) == room.CONFIGURE_ATTEMPTS


@pytest.mark.parametrize(
    ("status", "echoed", "words"),
    [
        (1, 0.1, "does not know the setting HAND_SPEED"),
        (2, 0.5, "refused HAND_SPEED_rad_per_s = 0.1 "),
    ],
)
def test_configure_reports_what_the_device_says(
    far_end: Make, status: int, echoed: float, words: str
) -> None:
    def refusing(message: Message) -> list[bytes]:
        if isinstance(message, Config):
            return [encode(ConfigEcho(status, message.key, message.nonce, echoed))]
        return honest(message)

    with (
        opened(far_end(refusing)) as link,
        pytest.raises(DeviceError, match=words),
    ):
        link.configure(ConfigKey.HAND_SPEED_rad_per_s, 0.1)


def test_missing_port_is_named() -> None:
    with pytest.raises(DeviceError, match="There is no port /dev/ttyNOWHERE"):
        open_link("/dev/ttyNOWHERE")


def test_a_file_is_not_a_port(tmp_path: Path) -> None:
    path = tmp_path / "recipe.toml"
    path.write_text("x")
    with pytest.raises(DeviceError, match="is not a serial port"):
        open_link(str(path))


def test_busy_port_is_refused(far_end: Make) -> None:
    end = far_end(honest)
    with opened(end), pytest.raises(DeviceError, match="in use by another program"):
        opened(end)


def test_forbidden_port_is_refused(far_end: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    import serial

    def forbidden(*args: object, **options: object) -> None:
        raise serial.SerialException(13, "could not open port: Permission denied")

    monkeypatch.setattr(serial, "Serial", forbidden)
    with pytest.raises(DeviceError, match="You may not open"):
        open_link(far_end(honest).port)


@pytest.mark.parametrize(
    ("said", "words"),
    [
        (b"", "sent nothing within 0.3 s"),
        (bytes(range(128, 160)), "sent 32 bytes but no valid frame"),
        (b"$GPGGA,foreign\r\n", r"sent text \('\$GPGGA,foreign'\).* another device"),
        (b"rst:0x1 (POWERON)\r\nload", r"sent text \('rst:0x1 .*restarted when its port"),
        (encode(STATE), "does not answer the handshake"),
    ],
)
def test_silence_and_foreign_data_give_different_errors(
    said: bytes, words: str, far_end: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The time of the handshake is over once what the far end says has been heard."""
    monkeypatch.setattr(room, "HELLO_WAIT_S", 0.01)
    once = iter([[said]] if said else [])
    end = far_end(lambda message: next(once, []))
    with PortLink(open_port(end.port, DEFAULT_BAUD), end.port) as link:
        looks = iter(range(20))

        def clock() -> float:
            heard = link.received.bytes_received
            return float(heard >= len(said) if said else next(looks) > 9)

        monkeypatch.setattr(room, "time", SimpleNamespace(monotonic=clock))
        with pytest.raises(DeviceError, match=words):
            link.shake_hands(0.3)


def test_what_a_device_sends_while_it_boots_is_discarded(
    far_end: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It boots when the port is opened, and hears nothing until it has."""
    monkeypatch.setattr(room, "HELLO_WAIT_S", 0.02)
    asked = itertools.count()

    def boots(message: Message) -> list[bytes]:
        if isinstance(message, Hello) and next(asked) < 3:
            return [b"rst:0x1 (POWERON),boot:0x8\r\n"]
        return honest(message)

    with opened(far_end(boots)) as link:
        assert link.identity.name == "bench rig"
        assert link.garbled == 0


def test_the_host_waits_longer_than_a_board_boots() -> None:
    """A boot loader waits for two seconds at most, and a device answers a second after that."""
    assert inspect.signature(open_link).parameters["timeout"].default == 4.0


def test_modem_manager_is_named_where_it_runs(tmp_path: Path) -> None:
    assert not modem_manager_runs(tmp_path)
    (tmp_path / "812").mkdir()
    (tmp_path / "812" / "comm").write_text("ModemManager\n", encoding="utf-8")
    assert modem_manager_runs(tmp_path)


@pytest.mark.parametrize("runs", [True, False])
def test_a_port_in_use_says_who_may_have_it(
    runs: bool, far_end: Make, monkeypatch: pytest.MonkeyPatch
) -> None:
    import serial

    def taken(*args: object, **options: object) -> None:
        raise serial.SerialException(16, "could not open port: Device or resource busy")

    monkeypatch.setattr(serial, "Serial", taken)
    monkeypatch.setattr(ports, "modem_manager_runs", lambda: runs)
    with pytest.raises(DeviceError, match="in use by another program") as caught:
        open_link(far_end(honest).port)
    assert ("udev rule" in str(caught.value)) is runs


@pytest.mark.parametrize("version", [1, 2])
def test_a_device_of_each_version_is_served_with_its_own_schema(
    far_end: Make, version: int
) -> None:
    def of_version(message: Message) -> list[bytes]:
        assert isinstance(message, Hello)
        schema = {1: 0xB09FB42A7F073F64, 2: SCHEMA_HASH}[version]
        identity = IDENTITY._replace(
            nonce_echo=message.nonce, protocol_version=version, schema_hash=schema
        )
        return [encode(identity)]

    with opened(far_end(of_version)) as link:
        assert link.identity.protocol_version == version


def test_a_device_of_version_1_with_the_schema_of_version_2_is_refused(far_end: Make) -> None:
    def mixed(message: Message) -> list[bytes]:
        assert isinstance(message, Hello)
        return [encode(IDENTITY._replace(nonce_echo=message.nonce, protocol_version=1))]

    with pytest.raises(DeviceError, match=r"another wire schema.*b09fb42a7f073f64"):
        opened(far_end(mixed))


def test_other_schema_gives_both_hashes(far_end: Make) -> None:
    def other(message: Message) -> list[bytes]:
        assert isinstance(message, Hello)
        identity = IDENTITY._replace(nonce_echo=message.nonce, schema_hash=0x1234)
        return [encode(identity)]

    with pytest.raises(DeviceError, match="0000000000001234") as caught:
        opened(far_end(other))
    assert f"{SCHEMA_HASH:016x}" in str(caught.value)
    assert "Update the device's firmware" in str(caught.value)


@pytest.mark.parametrize(("version", "remedy"), [(0, "the device's firmware"), (9, "scissorcal")])
def test_other_protocol_version_says_what_to_update(
    far_end: Make, version: int, remedy: str
) -> None:
    later = struct.pack("<BB30s", 0x11, version, b"")
    end = far_end(lambda message: [encode_frame(later)])
    with pytest.raises(DeviceError, match=f"version {version}, .* update {remedy}"):
        opened(end)


def test_unplugging_is_a_device_error(far_end: Make) -> None:
    end = far_end(honest)
    with opened(end) as link:
        end.unplug()
        with pytest.raises(DeviceError, match="is gone"):
            link.configure(ConfigKey.STREAM, 1.0)


@pytest.mark.parametrize(
    "wrong",
    [
        {"torque_limit": float("nan")},
        {"torque_limit": 0.0},
        {"opening_min": 1.0},
        {"advance_max": -1.0},
        {"handle_radius": float("inf")},
    ],
)
def test_invalid_limits_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(DeviceError, match=next(iter(wrong))):
        check_identity("port", IDENTITY._replace(**wrong))  # type: ignore[arg-type]


@pytest.mark.parametrize("tick_us", [0, 249, 10_001, 2**32 - 1])
def test_ticks_beyond_the_protocol_s_are_refused(tick_us: int) -> None:
    with pytest.raises(DeviceError, match="from 250 us to 10000 us"):
        check_identity("port", IDENTITY._replace(tick_us=tick_us))


@pytest.mark.parametrize("tick_us", [250, 10_000])
def test_the_protocol_s_shortest_and_longest_tick_are_taken(tick_us: int) -> None:
    identity = IDENTITY._replace(tick_us=tick_us)
    assert check_identity("port", identity) == identity


def test_the_round_trip_is_the_time_from_question_to_answer(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    class Asked(Scripted):
        def receive(self, timeout: float) -> Iterator[Message]:
            yield STATE
            asked = self.sent[-1]
            assert isinstance(asked, Hello)
            yield IDENTITY._replace(nonce_echo=asked.nonce - 1)
            yield IDENTITY._replace(nonce_echo=asked.nonce)

    clock: Any = SimpleNamespace(perf_counter=iter([7.0, 7.25]).__next__)
    monkeypatch.setattr(room, "time", clock)
    assert Asked().round_trip() == 0.25
