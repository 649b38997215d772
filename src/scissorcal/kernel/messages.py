"""The messages of the wire. Generated from data_schemas/wire.json by write_wire.py: do not edit."""

from enum import IntEnum, IntFlag
from typing import NamedTuple

PROTOCOL_VERSION = 2
SCHEMA_HASH = 0xAE72CC7C5BFA0A33
"""First 8 bytes, little-endian, of SHA-256 over the canonical form of wire.json."""
EARLIER_SCHEMAS: dict[int, int] = {
    1: 0xB09FB42A7F073F64,
}
"""Schema hash of each earlier protocol version whose devices are served."""


class StateFlag(IntFlag):
    """What a device says about itself in every STATE."""

    MOTOR_ENABLED = 1
    FAULT_LATCHED = 2
    COMMANDS_LOST = 4
    OPENING_AT_STOP = 8
    TORQUE_SATURATED = 16
    HANDLE_FORCE_SATURATED = 32
    ENCODER_FAULT = 64
    NOT_HOMED = 128
    HOMING = 256
    RENDERING = 512


class FaultCause(IntEnum):
    """What latched the fault that stands."""

    NONE = 0
    WATCHDOG = 1
    ENCODER = 2
    STOP_BUTTON = 3
    CURRENT = 4
    HEAT = 5
    SPEED = 6
    SUPPLY = 7
    DRIVER = 8


class CommandFlag(IntFlag):
    """What a host asks for in every COMMAND."""

    ENABLE = 1
    CLEAR_FAULT = 2


class Capability(IntFlag):
    """What a device has."""

    HANDLE_FORCE_SENSOR = 1
    ADVANCE_MOTOR = 2
    TORQUE_MEASURED = 4
    HOMES = 8
    RENDERS = 16
    SIMULATOR = 32768


class ConfigStatus(IntEnum):
    """How a device answered a CONFIG."""

    OK = 0
    UNKNOWN_KEY = 1
    VALUE_REFUSED = 2


class LoadStatus(IntEnum):
    """How a device answered a LOAD message."""

    OK = 0
    NOT_ANNOUNCED = 1
    OTHER_FORMAT = 2
    TOO_LARGE = 3
    OUT_OF_ORDER = 4
    TORN = 5
    NOT_SOUND = 6
    BUSY = 7


class ConfigKey(IntEnum):
    """Values that CONFIG sets; those from 0x8000 on exist in the simulator only."""

    STREAM = 1
    BRAKE_AFTER_MS = 2
    HOME = 3
    RENDER = 4
    HAND_SPEED_rad_per_s = 32769
    MATERIAL = 32770
    HAND_STROKES = 32771


class State(NamedTuple):
    """Device to host: what the device measures, sent each tick.

    ``flags``: state_flags.
    ``sequence``: grows by one each tick, wraps.
    ``device_us``: device clock, wraps, us.
    ``opening``: opening angle, rad.
    ``advance``: position of the pivot along the cut, m.
    ``motor_torque``: torque that the motor exerts, positive when it opens the blades, N m.
    ``handle_force``: positive when the hand pushes the handles closed, N.
    ``cause``: fault_causes: what latched the fault that stands, 0 without one.
    """

    flags: int
    sequence: int
    device_us: int
    opening: float = 0.0
    advance: float = 0.0
    motor_torque: float = 0.0
    handle_force: float = 0.0
    cause: int = 0


class Command(NamedTuple):
    """Host to device: what the motors shall exert, one for each STATE.

    ``flags``: command_flags.
    ``echo_sequence``: sequence of the STATE it answers.
    ``torque``: positive opens the blades, N m.
    ``force``: along the cut, positive advances, N.
    ``hold_ticks``: ticks that torque and force hold, zero after them; 0: until the next COMMAND.
    """

    flags: int
    echo_sequence: int
    torque: float
    force: float
    hold_ticks: int = 0


class Hello(NamedTuple):
    """Host to device: asks who is there.

    ``nonce``: returned in IDENTITY.
    ``protocol_version``: 2.
    """

    nonce: int
    protocol_version: int = PROTOCOL_VERSION


class Identity(NamedTuple):
    """Device to host: who the device is and what it can bear.

    ``capabilities``: capabilities.
    ``nonce_echo``: nonce of the HELLO.
    ``name``: ASCII, padded with 0.
    ``serial``: ASCII, padded with 0.
    ``firmware_version``: the maker's own.
    ``tick_us``: time between two STATEs, us.
    ``torque_limit``: largest torque magnitude, N m.
    ``force_limit``: largest force magnitude, 0 without an advance motor, N.
    ``opening_min``: lower stop, rad.
    ``opening_max``: upper stop, rad.
    ``advance_min``: lower stop, m.
    ``advance_max``: upper stop, m.
    ``opening_resolution``: encoder step, rad.
    ``advance_resolution``: encoder step, m.
    ``handle_radius``: from the pivot to where the hand pushes, m.
    ``protocol_version``: 2.
    ``schema_hash``: first 8 bytes of SHA-256 of this file's canonical form.
    """

    capabilities: int
    nonce_echo: int
    name: str
    serial: str
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
    protocol_version: int = PROTOCOL_VERSION
    schema_hash: int = SCHEMA_HASH


class Config(NamedTuple):
    """Host to device: sets one value.

    ``key``: config_keys.
    ``nonce``: returned in CONFIG_ECHO.
    ``value``: in the key's unit.
    """

    key: int
    nonce: int
    value: float


class ConfigEcho(NamedTuple):
    """Device to host: answers CONFIG with the value now in force.

    ``status``: config_status.
    ``key``: as asked.
    ``nonce``: as asked.
    ``value``: the value now in force.
    """

    status: int
    key: int
    nonce: int
    value: float


class LoadBegin(NamedTuple):
    """Host to device: announces an image of a package.

    ``image_format``: version of the layout of the image.
    ``nonce``: returned in LOAD_ECHO.
    ``size``: of the whole image, bytes.
    ``crc32``: CRC-32 (IEEE 802.3, as zlib) over the whole image.
    """

    image_format: int
    nonce: int
    size: int
    crc32: int


class LoadChunk(NamedTuple):
    """Host to device: a piece of the image announced last.

    ``count``: bytes used, 1 to 192.
    ``nonce``: returned in LOAD_ECHO.
    ``offset``: place of the first byte in the image; pieces come in order, bytes.
    ``bytes``: the piece, padded with 0.
    """

    count: int  # type: ignore[assignment]
    nonce: int
    offset: int
    bytes: bytes


class LoadCommit(NamedTuple):
    """Host to device: checks the image and puts it in force at the next tick.

    ``nonce``: returned in LOAD_ECHO.
    """

    nonce: int


class LoadEcho(NamedTuple):
    """Device to host: answers LOAD_BEGIN, LOAD_CHUNK and LOAD_COMMIT.

    ``status``: load_status.
    ``nonce``: as asked.
    ``received``: of the image announced last, in order, bytes.
    ``capacity``: largest image that fits, bytes.
    ``crc32``: of the image in force, 0 without one.
    """

    status: int
    nonce: int
    received: int
    capacity: int
    crc32: int


Message = (
    State
    | Command
    | Hello
    | Identity
    | Config
    | ConfigEcho
    | LoadBegin
    | LoadChunk
    | LoadCommit
    | LoadEcho
)

TYPES: dict[int, type[Message]] = {
    1: State,
    2: Command,
    16: Hello,
    17: Identity,
    18: Config,
    19: ConfigEcho,
    20: LoadBegin,
    21: LoadChunk,
    22: LoadCommit,
    23: LoadEcho,
}
"""Messages by the first byte of their payload."""
