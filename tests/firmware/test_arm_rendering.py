"""The flashed binary renders a package as the library does, within its limits."""

import math

import pytest

from scissorcal.kernel import ConfigKey, ServoConfig, StateFlag, model_image

from .bench import ENABLE, Bench
from .elf import Image
from .test_rendering import FELT, PAPER, PLAIN, stroke
from .test_torn_upload import IMAGE, TORN

emulator = pytest.importorskip(
    "tests.firmware.emulator", reason="needs unicorn, of the extra 'dev'", exc_type=ImportError
)

RENDERING_INSTRUCTIONS = 12_000
STACK_BYTES = 1024
EVERY = 8
"""Ticks from one whose instructions are counted to the next."""


def on_arm(image: Image, config: ServoConfig) -> Bench:
    """A bench whose core is the flashed binary, with paper loaded."""
    bench = Bench()
    bench.core = emulator.EmulatedCore(image, bench.core.table, renders=True)
    bench.ticks = 0
    bench.tick()
    return loaded(bench, config)


def loaded(bench: Bench, config: ServoConfig) -> Bench:
    bench.upload(model_image(PAPER, config))
    bench.configure(ConfigKey.RENDER, 1.0)
    bench.configure(ConfigKey.STREAM, 1.0)
    return bench


@pytest.mark.parametrize("config", [PLAIN, FELT], ids=["plain", "damped and slewed"])
def test_the_binary_renders_bit_for_bit_as_the_library(
    stm32f405: Image, config: ServoConfig
) -> None:
    arm, library = on_arm(stm32f405, config), loaded(Bench(), config)
    most = 0.0
    for tick in range(3000):
        arm.opening = library.opening = stroke(tick) + 2e-4 * math.sin(0.9 * tick)
        arm.advance = library.advance = -0.02 + 2e-6 * tick
        assert arm.tick(ENABLE) == library.tick(ENABLE), f"tick {tick}"
        most = max(most, abs(arm.out.torque))
    assert most > 0.05


def test_the_binary_answers_torn_uploads_as_the_library(stm32f405: Image) -> None:
    memory = stm32f405.symbols["image"][1]
    arm, library = on_arm(stm32f405, PLAIN), loaded(Bench(memory), PLAIN)
    for make, _ in TORN.values():
        for part in make():
            assert arm.tick(part) == library.tick(part)
        assert arm.configure(ConfigKey.RENDER, 1.0) == library.configure(ConfigKey.RENDER, 1.0)
    assert arm.upload(IMAGE).crc32 == library.upload(IMAGE).crc32 != 0


def test_a_rendered_tick_takes_few_instructions_and_little_stack(stm32f405: Image) -> None:
    bench = on_arm(stm32f405, FELT)
    bench.core.processor.paint_stack()
    counts: list[int] = []
    for tick in range(2000):
        bench.opening = stroke(tick) + 2e-4 * math.sin(0.9 * tick)
        bench.core.counts = counts if tick % EVERY == 0 else None
        state = bench.state(ENABLE)
    assert state.flags & StateFlag.RENDERING
    stack = bench.core.processor.stack_bytes()
    print(f"{max(counts)} instructions for a rendered tick at the most, {stack} bytes of stack")
    assert 3000 < max(counts) <= RENDERING_INSTRUCTIONS
    assert 100 < stack <= STACK_BYTES
