"""The strange device and the firmware's core answer alike to the same bytes, tick by tick.

Both were written from docs/protocol.md by themselves. A script is what a host sends in each tick;
compared are the replies and, of each STATE, sequence, cause and flags.
"""

import math
import struct
from dataclasses import replace

import pytest

from scissorcal.kernel import (
    Capability,
    Command,
    Config,
    ConfigEcho,
    FirmwareCore,
    FirmwareInputs,
    FrameDecoder,
    Hello,
    Identity,
    State,
    decode,
    encode,
    encode_frame,
)
from tests.strange_device import Faults, StrangeDevice

from .records import BOARD

ENABLE, CLEAR = 1, 2
STREAM, BRAKE_AFTER_MS, HOME, MATERIAL = 1, 2, 3, 0x8002
OPENING_RAD = 0.6
Script = list[bytes]


def command(flags: int, torque: float = 0.0, hold: int = 0) -> bytes:
    return encode(Command(flags, 0, torque, 0.0, hold))


def config(key: int, value: float) -> bytes:
    return encode(Config(key, 40 + key, value))


def quiet(ticks: int) -> Script:
    return [b""] * ticks


ON = config(STREAM, 1.0)
SCRIPTS: dict[str, Script] = {
    "hello, again and streaming": [
        encode(Hello(nonce=1)),
        ON,
        encode(Hello(nonce=2)) + encode(Hello(nonce=3)),
        b"",
    ],
    "settings": [
        ON,
        *(config(BRAKE_AFTER_MS, ms) for ms in (0.5, 1.0, 2.5, 1000.0, 1001.0, math.nan)),
        *(config(STREAM, value) for value in (2.0, 0.5, math.nan, math.inf, 0.0, 1.0)),
        config(MATERIAL, 1.0) + config(77, 1.0),
        b"",
    ],
    "the watchdog, and what clears it": [
        ON,
        command(ENABLE, 0.01),
        *quiet(14),
        command(ENABLE),
        command(0),
        *quiet(3),
        command(CLEAR),
        command(ENABLE),
        *quiet(12),
        command(ENABLE | CLEAR),
        b"",
    ],
    "a shorter watchdog": [
        ON + config(BRAKE_AFTER_MS, 3.5),
        command(ENABLE),
        *quiet(6),
        command(ENABLE | CLEAR),
        command(0),
        *quiet(20),
    ],
    "no command, no fault": [ON, *quiet(30)],
    "clipped, not a number, two in a tick": [
        ON,
        command(ENABLE, 5.0),
        command(ENABLE, math.nan),
        command(ENABLE, 0.01) + command(ENABLE, -5.0),
        command(ENABLE, -5.0) + command(ENABLE, 0.01),
        command(0, 5.0),
        b"",
    ],
    "a number that is none does not feed the watchdog": [
        ON,
        command(ENABLE),
        *([command(ENABLE, math.inf)] * 12),
    ],
    "held for ticks": [ON, command(ENABLE, 5.0, hold=3), *quiet(6), command(ENABLE, 5.0), b""],
    "the stream ends alone": [
        ON,
        command(ENABLE),
        config(STREAM, 0.0),
        *quiet(12),
        config(STREAM, 1.0),
        b"",
    ],
    "unknown flags, types and sizes": [
        ON,
        encode_frame(struct.pack("<BBHIff", 2, 0, 0xFFFC | ENABLE, 0, 0.01, 0.0)),
        encode_frame(bytes([99]) * 7),
        encode_frame(bytes([2]) * 5),
        command(ENABLE),
        encode_frame(bytes([17]) * 92),
        command(ENABLE),
    ],
    "garbled, empty, overlong and torn frames": [
        b"noise\0" + ON + b"\0\0\0",
        bytes(range(1, 200)) * 3 + b"\0" + command(ENABLE)[:7],
        command(ENABLE)[7:] + b"\xff\0",
        command(ENABLE, 0.01)[:-1],
        b"\0",
        b"",
    ],
}
NOT_HOMED: dict[str, Script] = {
    "no command before home": [ON, command(ENABLE, 0.1), command(ENABLE, 5.0), *quiet(14)],
    "home is asked for and stopped": [
        ON,
        config(HOME, 2.0),
        config(HOME, math.nan),
        config(HOME, 1.0),
        *quiet(5),
        command(ENABLE, 0.1),
        config(HOME, 0.0),
        *quiet(3),
    ],
}


def answers(sent: list[bytes]) -> list[list[tuple[object, ...]]]:
    """What each tick's bytes say, in comparable form: replies first."""
    decoder, told = FrameDecoder(), []
    for data in sent:
        said: list[tuple[object, ...]] = []
        for payload in decoder.feed(data):
            message = decode(payload)
            if isinstance(message, State):
                said.append(("STATE", message.sequence, message.cause, message.flags))
            elif isinstance(message, Identity):
                version, schema = message.protocol_version, message.schema_hash
                said.insert(0, ("IDENTITY", version, schema, message.nonce_echo))
            elif isinstance(message, ConfigEcho):
                said.insert(0, ("CONFIG_ECHO", *message))
        told.append(sorted(said, key=str))
    assert decoder.garbled == 0
    return told


def of_the_core(script: Script, homes: bool) -> list[bytes]:
    capabilities = BOARD.capabilities & ~(0 if homes else int(Capability.HOMES))
    core = FirmwareCore(replace(BOARD, tick_us=1000, capabilities=capabilities))
    steady = FirmwareInputs(0, OPENING_RAD, 0.0, 0.0, 0.0, 0.0, 12.0, 25.0)
    return [
        core.tick(steady._replace(device_us=1000 * tick), data).sent
        for tick, data in enumerate(script)
    ]


def of_the_strange_device(script: Script, homes: bool) -> list[bytes]:
    device = StrangeDevice(Faults(not_homed=homes), seed=1, version=2)
    return [device.tick(data) for data in script]


@pytest.mark.parametrize("name", [*SCRIPTS, *NOT_HOMED])
def test_they_answer_alike(name: str) -> None:
    homes = name in NOT_HOMED
    script = NOT_HOMED[name] if homes else SCRIPTS[name]
    core = answers(of_the_core(script, homes))
    strange = answers(of_the_strange_device(script, homes))
    assert any(core)
    for tick, (one, other) in enumerate(zip(core, strange, strict=True)):
        assert one == other, f"tick {tick}"
