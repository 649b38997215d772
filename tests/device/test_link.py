"""The handshake and its refusals, against a thread on the other side of a pseudo-terminal."""

import struct
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from scissorcal.device.link import check_identity, open_link
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


def test_identity_arrives_although_stale_and_garbled_bytes_wait(far_end: Make) -> None:
    end = far_end(honest)
    stale = encode(IDENTITY._replace(name="yesterday"))
    end.say(b"\x05\x99" * 300 + stale + encode(STATE) * 10 + encode(STATE)[:9])
    time.sleep(0.05)
    with open_link(end.port) as link:
        assert link.identity.name == "bench rig"
        assert link.received.garbled <= 1


def test_configure_sends_again_what_got_lost(far_end: Make) -> None:
    lost = 2

    def forgetful(message: Message) -> list[bytes]:
        nonlocal lost
        if isinstance(message, Config) and lost:
            lost -= 1
            return []
        return honest(message)

    end = far_end(forgetful)
    with open_link(end.port) as link:
        assert link.configure(ConfigKey.STREAM, 1.0) == 1.0
    sent = [message for message in end.heard if isinstance(message, Config)]
    assert [(message.key, message.value) for message in sent] == [(1, 1.0)] * 3
    assert len({message.nonce for message in sent}) == 3


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
        open_link(far_end(refusing).port) as link,
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
    with open_link(end.port), pytest.raises(DeviceError, match="in use by another program"):
        open_link(end.port)


def test_forbidden_port_is_refused(far_end: Make, monkeypatch: pytest.MonkeyPatch) -> None:
    import serial

    def forbidden(*args: object, **options: object) -> None:
        raise serial.SerialException(13, "could not open port: Permission denied")

    monkeypatch.setattr(serial, "Serial", forbidden)
    with pytest.raises(DeviceError, match="You may not open"):
        open_link(far_end(honest).port)


def test_silence_and_foreign_data_give_different_errors(far_end: Make) -> None:
    with pytest.raises(DeviceError, match="sent nothing within"):
        open_link(far_end(silent).port, timeout=0.3)
    with pytest.raises(DeviceError, match="no valid frame"):
        open_link(far_end(lambda message: [b"$GPGGA,foreign\r\n"]).port, timeout=0.3)
    with pytest.raises(DeviceError, match="does not answer the handshake"):
        open_link(far_end(lambda message: [encode(STATE)]).port, timeout=0.3)


def test_other_schema_gives_both_hashes(far_end: Make) -> None:
    def other(message: Message) -> list[bytes]:
        assert isinstance(message, Hello)
        identity = IDENTITY._replace(nonce_echo=message.nonce, schema_hash=0x1234)
        return [encode(identity)]

    with pytest.raises(DeviceError, match="0000000000001234") as caught:
        open_link(far_end(other).port)
    assert f"{SCHEMA_HASH:016x}" in str(caught.value)
    assert "Update the device's firmware" in str(caught.value)


@pytest.mark.parametrize(("version", "remedy"), [(0, "the device's firmware"), (9, "scissorcal")])
def test_other_protocol_version_says_what_to_update(
    far_end: Make, version: int, remedy: str
) -> None:
    later = struct.pack("<BB30s", 0x11, version, b"")
    end = far_end(lambda message: [encode_frame(later)])
    with pytest.raises(DeviceError, match=f"version {version}, .* update {remedy}"):
        open_link(end.port)


def test_unplugging_is_a_device_error(far_end: Make) -> None:
    end = far_end(honest)
    with open_link(end.port) as link:
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
        {"tick_us": 0},
        {"handle_radius": float("inf")},
    ],
)
def test_invalid_limits_are_refused(wrong: dict[str, float]) -> None:
    with pytest.raises(DeviceError, match=next(iter(wrong))):
        check_identity("port", IDENTITY._replace(**wrong))  # type: ignore[arg-type]


def test_round_trip_is_measured(far_end: Make) -> None:
    with open_link(far_end(honest).port) as link:
        assert 0 < link.round_trip() < 0.5
