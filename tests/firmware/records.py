"""Golden records: ticks of the firmware's core, in and out, that every build repeats byte for byte.

    python -m tests.firmware.records    # write them anew, by the build in this Python

`GOLDEN` is gzip of: the board (fw_board), then for each tick fw_record_in and fw_record_out, as
they lie in the memory of a little-endian processor. The ticks are a session with all in it:
settings, commands, homing, each fault, garbled bytes, and inputs that are no numbers.
"""

import gzip
import math
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from scissorcal.kernel import (
    RECORD_BYTES,
    Capability,
    Command,
    CommandFlag,
    Config,
    ConfigKey,
    Drive,
    FirmwareBoard,
    FirmwareCore,
    FirmwareInputs,
    FirmwarePhase,
    Hello,
    InputFlag,
    encode,
)

GOLDEN = Path(__file__).parents[1] / "golden" / "firmware-records.gz"
TICKS = 4000
SEED = 32

BOARD = FirmwareBoard(
    name="golden",
    serial="1",
    tick_us=500,
    capabilities=int(
        Capability.ADVANCE_MOTOR
        | Capability.TORQUE_MEASURED
        | Capability.HANDLE_FORCE_SENSOR
        | Capability.HOMES
    ),
    torque_limit=0.5,
    force_limit=20.0,
    opening_min=0.1,
    opening_max=0.95,
    advance_min=-0.1,
    advance_max=0.2,
    opening_resolution=1e-4,
    advance_resolution=1e-6,
    handle_radius=0.06,
    torque_slew=150.0,
    force_slew=5000.0,
    overspeed=20.0,
    opening_leap=0.1,
    advance_leap=0.01,
    torque_per_A=0.1,
    resistance=1.0,
    current_limit=8.0,
    current_continuous=1.0,
    i2t_limit=4.0,
    supply_min=11.0,
    supply_max=13.0,
    temperature_max=80.0,
    home_torque=0.05,
    home_speed=2.0,
    home_opening=0.9,
    home_timeout=5.0,
)
SWITCH_RAD = 0.9
FAULTS: tuple[tuple[str, float | int], ...] = (
    ("flags", InputFlag.STOP_BUTTON),
    ("flags", InputFlag.DRIVER_FAULT),
    ("flags", InputFlag.ENCODER_BAD),
    ("current", 9.0),
    ("supply", 9.0),
    ("temperature", 90.0),
    ("opening", math.nan),
    ("current", math.inf),
)


def session(ticks: int = TICKS) -> Iterator[tuple[bytes, bytes]]:
    """Run the session on the build in this Python; yields each tick's two records."""
    core, rng = FirmwareCore(BOARD), np.random.default_rng(SEED)
    opening, rate, drive, torque, phase = 0.8, 0.0, Drive.RELEASE, 0.0, FirmwarePhase.UNHOMED
    for tick in range(ticks):
        damping = 0.1 if drive is Drive.BRAKE else 0.02
        rate += (torque - damping * rate) / 1e-3 * 5e-4
        opening += rate * 5e-4
        if not 0.09 < opening < 1.01:
            opening, rate = min(max(opening, 0.09), 1.01), 0.0
        read = {
            "device_us": 500 * tick & 0xFFFFFFFF,
            "opening": 1e-4 * math.floor(opening / 1e-4) + 2.0,
            "advance": 1e-6 * (tick % 50),
            "motor_torque": torque,
            "handle_force": float(rng.normal()),
            "current": torque / 0.1,
            "supply": 12.0,
            "temperature": 25.0,
            "flags": int(InputFlag.AT_HOME) if opening > SWITCH_RAD else 0,
        }
        if tick > 800 and tick % 400 < 3:
            name, value = FAULTS[tick // 400 % len(FAULTS)]
            read[name] = value
        out = core.tick(FirmwareInputs(**read), _sent(tick, phase, rng))
        torque, drive, phase = out.torque, out.drive, out.phase
        yield core.last_records()


def _sent(tick: int, phase: FirmwarePhase, rng: np.random.Generator) -> bytes:
    """What the host sends in a tick."""
    if tick == 0:
        return encode(Hello(nonce=7)) + encode(Config(int(ConfigKey.STREAM), 8, 1.0))
    if phase is FirmwarePhase.UNHOMED and tick % 20 == 0:
        return encode(Config(int(ConfigKey.HOME), 9, 1.0))
    if tick % 997 == 0:
        return bytes(rng.integers(0, 256, 60, dtype=np.uint8))
    if tick % 500 == 250:
        key, value = int(rng.integers(0, 6)), float(rng.choice([0.5, 1.0, 20.0, math.nan]))
        stream = encode(Config(int(ConfigKey.STREAM), tick, 1.0))
        return encode(Config(key, tick, value)) + stream
    if tick % 700 < 60:
        return b""  # long enough for the watchdog
    clear = tick % 100 < 20
    flags = int(CommandFlag.ENABLE) | (int(CommandFlag.CLEAR_FAULT) if clear else 0)
    torque = float(0.3 * np.sin(0.01 * tick) + rng.normal(0.0, 0.1))
    hold = int(rng.integers(0, 4)) if tick % 90 == 0 else 0
    return encode(Command(flags, tick, torque, float(rng.normal(0.0, 9.0)), hold))


def read_golden() -> tuple[bytes, list[tuple[bytes, bytes]]]:
    """The golden board and records."""
    data = gzip.decompress(GOLDEN.read_bytes())
    size = len(FirmwareCore(BOARD).table)
    pairs = [
        (data[at : at + RECORD_BYTES], data[at + RECORD_BYTES : at + 2 * RECORD_BYTES])
        for at in range(size, len(data), 2 * RECORD_BYTES)
    ]
    return data[:size], pairs


if __name__ == "__main__":
    records = b"".join(given + made for given, made in session())
    GOLDEN.write_bytes(gzip.compress(FirmwareCore(BOARD).table + records, 9, mtime=0))
    print(f"{GOLDEN.name} written: {TICKS} ticks")
