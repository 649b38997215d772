"""What a device answers, and which answers this host can work with; DeviceError for the others."""

import math

from scissorcal.errors import DeviceError
from scissorcal.kernel import (
    EARLIER_SCHEMAS,
    PROTOCOL_VERSION,
    SCHEMA_HASH,
    ConfigEcho,
    ConfigKey,
    ConfigStatus,
    Identity,
)

IDENTITY_TYPE = 0x11
SHORTEST_TICK_US, LONGEST_TICK_US = 250, 10_000
"""Limits of the protocol (docs/protocol.md, Timing)."""

SCHEMAS = {**EARLIER_SCHEMAS, PROTOCOL_VERSION: SCHEMA_HASH}
"""Schema hash of each protocol version that is served."""


def check_identity(name: str, identity: Identity) -> Identity:
    """Return the identity if this host can work with it.

    Raises DeviceError where version or schema differ, where a limit is no number or empty, or where
    the tick is shorter or longer than the protocol's.
    """
    version = identity.protocol_version
    if identity.schema_hash != SCHEMAS.get(version):
        raise DeviceError(
            f"{name} has another wire schema: the device (firmware "
            f"{identity.firmware_version}, protocol version {version}) has "
            f"{identity.schema_hash:016x}, this scissorcal has "
            f"{SCHEMAS.get(version, SCHEMA_HASH):016x}. Update the device's firmware to this "
            "scissorcal's data_schemas/wire.json, or install the scissorcal that the firmware was "
            "built with."
        )
    wrong = [
        name
        for name, value in identity._asdict().items()
        if isinstance(value, float) and not math.isfinite(value)
    ]
    if not identity.torque_limit > 0:
        wrong.append("torque_limit")
    if not identity.opening_min < identity.opening_max:
        wrong.append("opening_min/opening_max")
    if not identity.advance_min <= identity.advance_max:
        wrong.append("advance_min/advance_max")
    if wrong:
        raise DeviceError(
            f"{name} states impossible limits ({', '.join(dict.fromkeys(wrong))}): "
            "correct the identity in its firmware. No motor was moved."
        )
    if not SHORTEST_TICK_US <= identity.tick_us <= LONGEST_TICK_US:
        raise DeviceError(
            f"{name} states a tick of {identity.tick_us} us; the protocol has ticks from "
            f"{SHORTEST_TICK_US} us to {LONGEST_TICK_US} us. Correct tick_us in its firmware, or "
            "the rate at which it sends. No motor was moved."
        )
    return identity


_BLOCKED = (
    "; open the blades before a sheet or plate is put in, and give the virtual rig's specimen a "
    "plate where one shall be touched."
)


def check_echo(name: str, echo: ConfigEcho, key: int, value: float) -> None:
    """Raise DeviceError unless the echo confirms the value."""
    if echo.status == ConfigStatus.UNKNOWN_KEY:
        raise DeviceError(
            f"{name} does not know the setting {key_name(key)}: update its firmware"
            + (" (only a simulator has it)." if key >= 0x8000 else ".")
        )
    if echo.status != ConfigStatus.OK:
        raise DeviceError(
            f"{name} refused {key_name(key)} = {value:g} (in force: {echo.value:g})"
            + (_BLOCKED if key == ConfigKey.MATERIAL else ".")
        )


def refuse_other_version(name: str, payload: bytes) -> None:
    """Raise DeviceError for an identity of a version whose layout this host cannot read."""
    if len(payload) > 1 and payload[0] == IDENTITY_TYPE and payload[1] not in SCHEMAS:
        older = "the device's firmware" if payload[1] < PROTOCOL_VERSION else "scissorcal"
        raise DeviceError(
            f"{name} has wire protocol version {payload[1]}, this scissorcal version "
            f"{PROTOCOL_VERSION}: update {older}."
        )


def key_name(key: int) -> str:
    """The name of a setting; the number of one that this host does not know.

    >>> key_name(0x7777)
    '0x7777'
    """
    return ConfigKey(key).name if key in list(ConfigKey) else f"0x{key:04x}"
