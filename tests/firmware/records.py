"""Records of ticks for the core, as firmware/core/fw_record.h lays them out."""

import math
import struct
from dataclasses import dataclass, fields, replace

import numpy as np

from scissorcal.kernel import (
    Capability,
    Command,
    CommandFlag,
    Config,
    ConfigKey,
    Hello,
    encode,
)

RECORD_BYTES = 512
RECEIVED_BYTES = 472
INPUTS = struct.Struct("<I7fI")
OUTPUTS = struct.Struct("<2fI4BI")
HOMING_EVERY = 2500
"""Ticks."""
SILENT = range(1200, 1215)
"""Ticks after homing without a frame: longer than the watchdog waits."""
FAST = range(1800, 1815)
"""Ticks after homing in which the blades are faster than the table allows."""
STOP_BUTTON, DRIVER_FAULT, ENCODER_BAD, AT_HOME, FORCE_SATURATED = 1, 2, 4, 8, 16


@dataclass(frozen=True)
class Board:
    """A fw_board, member by member; the rig of these records."""

    name: bytes = b"records"
    serial: bytes = b"1"
    firmware_version: int = 1
    tick_us: int = 1000
    capabilities: int = int(
        Capability.HANDLE_FORCE_SENSOR
        | Capability.ADVANCE_MOTOR
        | Capability.TORQUE_MEASURED
        | Capability.HOMES
    )
    torque_limit: float = 0.5
    force_limit: float = 20.0
    opening_min: float = 0.0
    opening_max: float = 1.1
    advance_min: float = 0.0
    advance_max: float = 0.3
    opening_resolution: float = 1e-4
    advance_resolution: float = 1e-6
    handle_radius: float = 0.07
    torque_slew: float = 500.0
    force_slew: float = 20000.0
    overspeed: float = 30.0
    opening_leap: float = 0.1
    advance_leap: float = 0.01
    torque_per_A: float = 0.2
    resistance: float = 2.0
    current_limit: float = 3.0
    current_continuous: float = 1.5
    i2t_limit: float = 10.0
    supply_min: float = 10.0
    supply_max: float = 14.0
    temperature_max: float = 80.0
    home_torque: float = -0.05
    home_speed: float = 0.5
    home_opening: float = 0.0
    home_timeout: float = 2.0
    home_at_stop: int = 0

    def packed(self) -> bytes:
        """The bytes of a fw_board."""
        packed = struct.pack("<16s16s", self.name, self.serial)
        for field in fields(self)[2:]:
            value = getattr(self, field.name)
            packed += struct.pack("<I" if isinstance(value, int) else "<f", value)
        return packed


@dataclass(frozen=True)
class Inputs:
    """A fw_inputs: what the sensors give in a tick."""

    device_us: int = 0
    opening: float = 0.5
    advance: float = 0.0
    motor_torque: float = 0.0
    handle_force: float = 0.0
    current: float = 0.0
    supply: float = 12.0
    temperature: float = 25.0
    flags: int = 0

    def record(self, received: bytes = b"") -> bytes:
        """A fw_record_in."""
        values = (getattr(self, field.name) for field in fields(self))
        head = INPUTS.pack(*values) + struct.pack("<I", len(received))
        return (head + received).ljust(RECORD_BYTES, b"\0")


@dataclass(frozen=True)
class Outputs:
    """A fw_record_out."""

    torque: float
    force: float
    drive: int
    phase: int
    cause: int
    home_result: int
    sent: bytes

    @classmethod
    def of(cls, record: bytes) -> "Outputs":
        *values, _, size = OUTPUTS.unpack_from(record)
        return cls(*values, sent=record[OUTPUTS.size : OUTPUTS.size + size])


def a_day_of_records(ticks: int, seed: int) -> list[bytes]:
    """Homing, captures, faults of every cause, garbled and split frames, at random but repeatable.

    The motion is made up: the core shall answer all of it alike in every build, sensible or not.
    """
    rng = np.random.default_rng(seed)
    records = []
    pending = b""
    for tick in range(ticks):
        frames = b"".join(_frames(tick, rng))
        if frames and rng.random() < 0.02:
            spoilt = bytearray(frames)
            spoilt[int(rng.integers(len(spoilt)))] ^= int(rng.integers(1, 256))
            frames = bytes(spoilt)
        pending += frames
        part = len(pending) if rng.random() < 0.9 else int(rng.integers(len(pending) + 1))
        received, pending = pending[: min(part, RECEIVED_BYTES)], pending[part:]
        opening = 0.55 + 0.6 * math.sin(2e-3 * tick) + float(rng.normal(0.0, 1e-4))
        if tick % HOMING_EVERY in FAST:
            opening += 0.06 * (tick % HOMING_EVERY - FAST.start)
        measured = Inputs(
            device_us=(1000 * tick + 0xFFF00000) & 0xFFFFFFFF,
            opening=opening,
            advance=0.1 + 0.1 * math.sin(1e-3 * tick),
            motor_torque=float(rng.normal(0.0, 0.1)),
            handle_force=float(rng.normal(0.0, 10.0)),
            current=float(rng.normal(0.0, 0.8)),
            supply=float(rng.normal(12.0, 0.2)),
            temperature=40.0,
            flags=AT_HOME if 200 <= tick % HOMING_EVERY < 250 else 0,
        )
        records.append(_disturbed(measured, rng).record(received))
    return records


def _frames(tick: int, rng: np.random.Generator) -> list[bytes]:
    """What a host sends before this tick."""
    nonce = tick & 0xFFFFFFFF
    since_homing = tick % HOMING_EVERY
    if since_homing in (HOMING_EVERY - 20, HOMING_EVERY - 10):
        return [encode(Command(int(CommandFlag.CLEAR_FAULT), nonce, 0.0, 0.0))]
    if since_homing > HOMING_EVERY - 20 or 0 < since_homing < 250 or since_homing in SILENT:
        return []
    if since_homing == 0:
        return [
            encode(Hello(nonce)),
            encode(Config(int(ConfigKey.STREAM), nonce, 1.0)),
            encode(Config(int(ConfigKey.HOME), nonce + 1, 1.0)),
        ]
    draw = rng.random()
    if draw < 0.003:
        key = int(rng.choice([*map(int, ConfigKey), 0, 77]))
        return [encode(Config(key, nonce, float(rng.choice([0.0, 1.0, 5.0, 50.0, math.nan]))))]
    if draw < 0.004:
        return [rng.integers(0, 256, int(rng.integers(1, 300)), dtype=np.uint8).tobytes()]
    if draw < 0.02:
        return []
    flags = int(CommandFlag.ENABLE)
    if draw < 0.05:
        flags |= int(CommandFlag.CLEAR_FAULT)
    elif draw < 0.06:
        flags = 0
    torque = float(rng.choice([rng.normal(0.0, 0.3), math.inf, math.nan], p=[0.99, 0.005, 0.005]))
    hold = int(rng.choice([0, 1, 5, 255], p=[0.7, 0.1, 0.1, 0.1]))
    count = 2 if rng.random() < 0.01 else 1
    return [encode(Command(flags, nonce, torque, float(rng.normal(0.0, 8.0)), hold))] * count


def _disturbed(inputs: Inputs, rng: np.random.Generator) -> Inputs:
    """Seldom a reading or a flag that latches a fault."""
    if rng.random() > 0.002:
        return inputs
    return replace(
        inputs,
        **rng.choice(
            [
                {"flags": STOP_BUTTON},
                {"flags": DRIVER_FAULT},
                {"flags": ENCODER_BAD},
                {"flags": FORCE_SATURATED},
                {"opening": math.nan},
                {"opening": inputs.opening + 0.5},
                {"current": 5.0},
                {"supply": 8.0},
                {"temperature": 90.0},
            ]
        ),
    )
