"""The messages between host and device, and their way into frames and out of payloads.

Layouts and meanings stand in ``data_schemas/wire.json`` and ``docs/protocol.md``.
"""

from collections.abc import Callable
from enum import IntEnum, IntFlag
from typing import Any, NamedTuple

from scissorcal.kernel._kernel import ffi, lib
from scissorcal.kernel.wire import encode_frame

PROTOCOL_VERSION = int(lib.SC_PROTOCOL_VERSION)
SCHEMA_HASH = int(lib.sc_schema_hash())
"""First 8 bytes, little-endian, of SHA-256 over the canonical form of data_schemas/wire.json."""


class StateFlag(IntFlag):
    """What a device says about itself in every STATE."""

    MOTOR_ENABLED = 1
    FAULT_LATCHED = 2
    COMMANDS_LOST = 4
    OPENING_AT_STOP = 8
    TORQUE_SATURATED = 16
    HANDLE_FORCE_SATURATED = 32
    ENCODER_FAULT = 64


class CommandFlag(IntFlag):
    """What a host asks for in every COMMAND, besides torque and force."""

    ENABLE = 1
    CLEAR_FAULT = 2


class Capability(IntFlag):
    """What a device has."""

    HANDLE_FORCE_SENSOR = 1
    ADVANCE_MOTOR = 2
    SIMULATOR = 0x8000


class ConfigKey(IntEnum):
    """Values that CONFIG sets; those from 0x8000 on exist in the simulator only."""

    STREAM = 1
    BRAKE_AFTER_MS = 2
    HAND_SPEED_rad_per_s = 0x8001
    MATERIAL = 0x8002
    HAND_STROKES = 0x8003


class ConfigStatus(IntEnum):
    """How a device answered a CONFIG."""

    OK = 0
    UNKNOWN_KEY = 1
    VALUE_REFUSED = 2


class State(NamedTuple):
    """Device to host, each tick: opening in rad, advance in m, torque in N m, force in N."""

    flags: int
    sequence: int
    device_us: int
    opening: float
    advance: float
    motor_torque: float
    handle_force: float


class Command(NamedTuple):
    """Host to device, one per STATE: torque in N m and force in N for the motors."""

    flags: int
    echo_sequence: int
    torque: float
    force: float


class Hello(NamedTuple):
    """Host to device: asks for IDENTITY."""

    nonce: int
    protocol_version: int = PROTOCOL_VERSION


class Identity(NamedTuple):
    """Device to host: who it is and what it can bear, in SI units and radians."""

    nonce_echo: int
    name: str
    serial: str
    capabilities: int
    firmware_version: int
    tick_us: int
    torque_limit: float
    force_limit: float
    opening_min: float
    opening_max: float
    advance_min: float
    advance_max: float
    opening_resolution: float
    advance_resolution: float
    handle_radius: float
    schema_hash: int = SCHEMA_HASH
    protocol_version: int = PROTOCOL_VERSION


class Config(NamedTuple):
    """Host to device: sets one value, see :class:`ConfigKey`."""

    key: int
    nonce: int
    value: float


class ConfigEcho(NamedTuple):
    """Device to host: answers CONFIG with the value now in force."""

    status: int
    key: int
    nonce: int
    value: float


Message = State | Command | Hello | Identity | Config | ConfigEcho


def encode(message: Message) -> bytes:
    """Give the whole frame of a message, delimiter included.

    Raises ValueError for numbers that their field cannot hold and texts that are not ASCII of at
    most 16 characters.

    >>> encode(Command(flags=1, echo_sequence=7, torque=0.25, force=0.0)).hex(" ")
    '02 02 02 01 02 07 01 01 01 01 03 80 3e 01 01 01 03 2f 4e 00'
    """
    payload = ffi.new("uint8_t[]", int(lib.SC_PAYLOAD_MAX))
    try:
        size = _PACK[type(message)](message, payload)
    except (OverflowError, TypeError, UnicodeEncodeError) as error:
        name = type(message).__name__
        raise ValueError(f"{name} cannot be put on the wire: {error}.") from error
    return encode_frame(bytes(ffi.buffer(payload, size)))


def decode(payload: bytes) -> Message:
    """Read a payload (CRC already checked and stripped) back into its message.

    Raises ValueError if its type is unknown or its size is not that type's.
    """
    kind = payload[0] if payload else -1
    if kind not in _UNPACK:
        raise ValueError(f"No message has type {kind}: the other side speaks another protocol.")
    name, unpack = _UNPACK[kind]
    message = unpack(ffi.from_buffer(payload), len(payload))
    if message is None:
        raise ValueError(f"A {name} does not have {len(payload)} bytes.")
    return message


def _pack_state(message: State, payload: Any) -> int:
    return int(lib.sc_pack_state(ffi.new("sc_state *", message._asdict()), payload))


def _pack_command(message: Command, payload: Any) -> int:
    return int(lib.sc_pack_command(ffi.new("sc_command *", message._asdict()), payload))


def _pack_hello(message: Hello, payload: Any) -> int:
    return int(lib.sc_pack_hello(ffi.new("sc_hello *", message._asdict()), payload))


def _pack_identity(message: Identity, payload: Any) -> int:
    fields = message._asdict() | {
        "name": _text_bytes(message.name),
        "serial": _text_bytes(message.serial),
    }
    return int(lib.sc_pack_identity(ffi.new("sc_identity *", fields), payload))


def _pack_config(message: Config, payload: Any) -> int:
    config = ffi.new("sc_config *", message._asdict())
    return int(lib.sc_pack_config(config, lib.SC_TYPE_CONFIG, payload))


def _pack_config_echo(message: ConfigEcho, payload: Any) -> int:
    config = ffi.new("sc_config *", message._asdict())
    return int(lib.sc_pack_config(config, lib.SC_TYPE_CONFIG_ECHO, payload))


def _text_bytes(text: str) -> list[int]:
    data = text.encode("ascii")
    if len(data) > 16:
        raise OverflowError(f"the text {text!r} is longer than 16 characters")
    return list(data.ljust(16, b"\0"))


def _unpack_state(data: Any, size: int) -> State | None:
    c = ffi.new("sc_state *")
    if not lib.sc_unpack_state(data, size, c):
        return None
    return State(
        c.flags, c.sequence, c.device_us, c.opening, c.advance, c.motor_torque, c.handle_force
    )


def _unpack_command(data: Any, size: int) -> Command | None:
    c = ffi.new("sc_command *")
    if not lib.sc_unpack_command(data, size, c):
        return None
    return Command(c.flags, c.echo_sequence, c.torque, c.force)


def _unpack_hello(data: Any, size: int) -> Hello | None:
    c = ffi.new("sc_hello *")
    if not lib.sc_unpack_hello(data, size, c):
        return None
    return Hello(c.nonce, c.protocol_version)


def _unpack_identity(data: Any, size: int) -> Identity | None:
    c = ffi.new("sc_identity *")
    if not lib.sc_unpack_identity(data, size, c):
        return None
    fields = {field: getattr(c, field) for field in Identity._fields}
    fields["name"] = _text_from(c.name)
    fields["serial"] = _text_from(c.serial)
    return Identity(**fields)


def _text_from(array: Any) -> str:
    return bytes(array).split(b"\0", 1)[0].decode("ascii", "replace")


def _unpack_config(data: Any, size: int) -> Config | None:
    c = ffi.new("sc_config *")
    if not lib.sc_unpack_config(data, size, lib.SC_TYPE_CONFIG, c):
        return None
    return Config(c.key, c.nonce, c.value)


def _unpack_config_echo(data: Any, size: int) -> ConfigEcho | None:
    c = ffi.new("sc_config *")
    if not lib.sc_unpack_config(data, size, lib.SC_TYPE_CONFIG_ECHO, c):
        return None
    return ConfigEcho(c.status, c.key, c.nonce, c.value)


_PACK: dict[type, Callable[[Any, Any], int]] = {
    State: _pack_state,
    Command: _pack_command,
    Hello: _pack_hello,
    Identity: _pack_identity,
    Config: _pack_config,
    ConfigEcho: _pack_config_echo,
}
_UNPACK: dict[int, tuple[str, Callable[[Any, int], Message | None]]] = {
    int(lib.SC_TYPE_STATE): ("STATE", _unpack_state),
    int(lib.SC_TYPE_COMMAND): ("COMMAND", _unpack_command),
    int(lib.SC_TYPE_HELLO): ("HELLO", _unpack_hello),
    int(lib.SC_TYPE_IDENTITY): ("IDENTITY", _unpack_identity),
    int(lib.SC_TYPE_CONFIG): ("CONFIG", _unpack_config),
    int(lib.SC_TYPE_CONFIG_ECHO): ("CONFIG_ECHO", _unpack_config_echo),
}
