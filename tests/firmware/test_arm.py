"""The binary that gets flashed computes what every other build does, within its limits."""

import struct
from pathlib import Path

import pytest

from scissorcal.kernel import Command, CommandFlag, Config, ConfigKey, FaultCause, Hello, encode
from tests.firmware.builds import HOST_BUILDS, host_build, make, run
from tests.firmware.elf import Image, read_elf
from tests.firmware.records import Board, Inputs, Outputs, a_day_of_records

emulator = pytest.importorskip("tests.firmware.emulator", exc_type=ImportError)

EXCHANGE_INSTRUCTIONS = 5000
STACK_BYTES = 1024
FLASH_BYTES = 24 << 10
TICKS = 20_000
PHASES = 5
BOARD = Board().packed()


@pytest.fixture(scope="module")
def records() -> list[bytes]:
    return a_day_of_records(TICKS, seed=1)


@pytest.fixture(scope="module")
def answers(stm32f405: Image, records: list[bytes]) -> bytes:
    """What the flashed binary answers."""
    core = emulator.EmulatedCore(stm32f405, BOARD)
    return b"".join(core.tick(record) for record in records)


def outputs_of(answers: bytes) -> list[Outputs]:
    size = emulator.RECORD_BYTES
    return [Outputs.of(answers[at : at + size]) for at in range(0, len(answers), size)]


def test_the_records_visit_every_phase_and_every_cause(answers: bytes) -> None:
    outputs = outputs_of(answers)
    assert {tick.phase for tick in outputs} == set(range(PHASES))
    assert {tick.cause for tick in outputs} == set(map(int, FaultCause))
    assert sum(len(tick.sent) for tick in outputs) > 400_000


@pytest.mark.parametrize("name", HOST_BUILDS)
def test_the_binary_answers_as_the_builds_for_this_computer(
    name: str, answers: bytes, records: list[bytes], tmp_path: Path
) -> None:
    problem = host_build(name, tmp_path / "core")
    if problem is not None and "32 bits" in name:
        pytest.skip("needs gcc's 32-bit libraries: apt install gcc-multilib")
    assert problem is None
    assert run(tmp_path / "core", BOARD, records) == answers


def test_the_binary_answers_alike_without_optimisation(
    answers: bytes, records: list[bytes], tmp_path: Path
) -> None:
    make(tmp_path, f"{tmp_path}/stm32f405.elf", optimise="-O0")
    core = emulator.EmulatedCore(read_elf(tmp_path / "stm32f405.elf"), BOARD)
    assert b"".join(core.tick(record) for record in records) == answers


def test_start_copies_data_clears_bss_and_enables_the_fpu(stm32f405: Image) -> None:
    processor = emulator.Processor(stm32f405)
    address, size = stm32f405.symbols["core"]
    assert processor.memory(address, size) == bytes(size)  # painted at power-on
    assert struct.unpack("<I", processor.memory(emulator.CPACR, 4)) == (0xF << 20,)
    assert processor.stack_top == emulator.RAM + emulator.RAM_BYTES


def test_an_exchange_takes_few_instructions(stm32f405: Image) -> None:
    core = emulator.EmulatedCore(stm32f405, BOARD)
    setup = [
        encode(Config(int(ConfigKey.STREAM), 1, 1.0)),
        encode(Config(int(ConfigKey.HOME), 2, 1.0)),
        *[b""] * 3,
    ]
    for tick, frame in enumerate(setup):
        core.tick(Inputs(device_us=1000 * tick, flags=8 if tick == 4 else 0).record(frame))
    counts = []
    for tick in range(5, 205):
        torque = 0.01 * (tick % 50) - 0.2
        command = encode(Command(int(CommandFlag.ENABLE), tick, torque, 1.0, 3))
        record = Inputs(device_us=1000 * tick, opening=0.5 + 1e-4 * tick, current=0.3).record(
            command
        )
        counts.append(core.counted_tick(record))
    last = Outputs.of(core.tick(record))
    assert (last.phase, last.drive, len(last.sent)) == (3, 1, 32)
    assert 1000 < max(counts) <= EXCHANGE_INSTRUCTIONS


def test_the_stack_stays_small(stm32f405: Image, records: list[bytes]) -> None:
    core = emulator.EmulatedCore(stm32f405, BOARD)
    core.processor.paint_stack()
    for record in records[:5000]:
        core.tick(record)
    assert 100 < core.processor.stack_bytes() <= STACK_BYTES


def test_a_table_that_is_impossible_is_refused(stm32f405: Image) -> None:
    with pytest.raises(ValueError, match="refuses this table"):
        emulator.EmulatedCore(stm32f405, Board(torque_per_A=0.0).packed())


def test_an_identity_is_answered_at_once(stm32f405: Image) -> None:
    core = emulator.EmulatedCore(stm32f405, BOARD)
    assert Outputs.of(core.tick(Inputs().record(encode(Hello(7))))).sent[-1:] == b"\0"
