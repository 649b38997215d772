"""The binary that gets flashed computes what every other build does, within its limits."""

import struct
from dataclasses import replace
from pathlib import Path

import pytest

from scissorcal.kernel import (
    Command,
    CommandFlag,
    Config,
    ConfigKey,
    Drive,
    FirmwareCore,
    FirmwareInputs,
    FirmwarePhase,
    InputFlag,
    encode,
)

from . import records
from .builds import HOST_BUILDS, host_build, make, run
from .elf import Image, read_elf

emulator = pytest.importorskip(
    "tests.firmware.emulator", reason="needs unicorn, of the extra 'dev'", exc_type=ImportError
)

EXCHANGE_INSTRUCTIONS = 5000
STACK_BYTES = 1024
TABLE = FirmwareCore(records.BOARD).table


@pytest.fixture(scope="module")
def golden() -> tuple[list[bytes], list[bytes]]:
    """Golden records: in, out."""
    pairs = records.read_golden()[1]
    return [given for given, _ in pairs], [made for _, made in pairs]


def test_the_binary_gives_the_golden_records(
    stm32f405: Image, golden: tuple[list[bytes], list[bytes]]
) -> None:
    core = emulator.EmulatedCore(stm32f405, TABLE)
    for tick, (given, made) in enumerate(zip(*golden, strict=True)):
        assert core.tick_record(given) == made, f"tick {tick}"


@pytest.mark.parametrize("optimise", ["-O0", "-O2"])
def test_the_binary_gives_them_however_it_is_optimised(
    optimise: str, golden: tuple[list[bytes], list[bytes]], tmp_path: Path
) -> None:
    pytest.importorskip("ziglang", reason="needs the compiler of the extra 'page'")
    make(tmp_path, f"{tmp_path}/stm32f405.elf", optimise=optimise)
    core = emulator.EmulatedCore(read_elf(tmp_path / "stm32f405.elf"), TABLE)
    assert [core.tick_record(given) for given in golden[0]] == golden[1]


@pytest.mark.parametrize("name", HOST_BUILDS)
def test_builds_for_this_computer_give_them(
    name: str, golden: tuple[list[bytes], list[bytes]], tmp_path: Path
) -> None:
    problem = host_build(name, tmp_path / "core")
    if problem is not None and "32 bits" in name:
        pytest.skip("needs gcc's 32-bit libraries: apt install gcc-multilib")
    assert problem is None
    assert run(tmp_path / "core", TABLE, golden[0]) == b"".join(golden[1])


def test_start_clears_memory_and_enables_the_fpu(stm32f405: Image) -> None:
    processor = emulator.Processor(stm32f405)
    address, size = stm32f405.symbols["core"]
    assert processor.memory(address, size) == bytes(size)  # painted at power-on
    assert struct.unpack("<I", processor.memory(emulator.CPACR, 4)) == (0xF << 20,)
    assert processor.stack_top == emulator.RAM + emulator.RAM_BYTES


def test_an_exchange_takes_few_instructions(stm32f405: Image) -> None:
    core = emulator.EmulatedCore(stm32f405, TABLE)
    asked = (ConfigKey.STREAM, ConfigKey.HOME)
    frames = [encode(Config(int(key), 1, 1.0)) for key in asked] + [b"", b""]
    at = FirmwareInputs(device_us=0, opening=0.5, supply=12.0, temperature=25.0)
    homed = at._replace(flags=int(InputFlag.AT_HOME))
    for inputs, frame in zip((at, at, at, homed), frames, strict=True):
        core.tick(inputs, frame)
    core.counts = []
    for tick in range(200):
        torque, force = 0.01 * (tick % 50) - 0.2, 0.1 * (tick % 30)
        command = encode(Command(int(CommandFlag.ENABLE), tick, torque, force, 3))
        moved = at._replace(device_us=500 * tick, opening=0.5 - 1e-4 * tick, current=0.3)
        last = core.tick(moved, command)
    assert (last.phase, last.drive) == (FirmwarePhase.ENABLED, Drive.DRIVE)
    assert len(last.sent) == 32
    most = max(core.counts)
    print(f"{most} instructions for a COMMAND and a STATE at the most")
    assert 1000 < most <= EXCHANGE_INSTRUCTIONS


def test_the_stack_stays_small(stm32f405: Image, golden: tuple[list[bytes], list[bytes]]) -> None:
    core = emulator.EmulatedCore(stm32f405, TABLE)
    core.processor.paint_stack()
    for given in golden[0]:
        core.tick_record(given)
    print(f"{core.processor.stack_bytes()} bytes of stack for a tick")
    assert 100 < core.processor.stack_bytes() <= STACK_BYTES


def test_a_table_that_is_impossible_is_refused(stm32f405: Image) -> None:
    table = bytearray(TABLE)
    table[32 + 4 : 32 + 8] = bytes(4)  # tick_us
    assert bytes(table) != TABLE
    with pytest.raises(ValueError, match="refuses this table"):
        emulator.EmulatedCore(stm32f405, bytes(table))
    faster = replace(records.BOARD, tick_us=1000)
    emulator.EmulatedCore(stm32f405, FirmwareCore(faster).table)
