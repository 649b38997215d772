"""The exported step as a Cortex-M4F binary: the kernel's bits, and the instructions it takes."""

import struct
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest

from scissorcal.package import ModelPackage, PackageSummary, open_package
from tests.package.test_export_c import (
    CORTEX_M4F,
    WARNINGS,
    ZIG,
    bits,
    exported,
    random_states,
    run,
)

unicorn = pytest.importorskip("unicorn")
pytest.importorskip("ziglang")
from unicorn import arm_const  # noqa: E402

pytestmark = pytest.mark.slow

FLASH, RAM, SYSTEM = 0x08000000, 0x20000000, 0xE0000000
INPUTS, CRACK, OUT, STACK = RAM, RAM + 64, RAM + 128, RAM + 0x8000
RETURN = FLASH + 0xFFFF0
CALLS = """
#include "scissorcal_package.h"
void step_at(const float *at, sc_crack *crack, sc_step_output *out);
void step_at(const float *at, sc_crack *crack, sc_step_output *out)
{
    sc_model_step(&scissorcal_package, crack, at[0], at[1], at[2], out);
}
"""
LAYOUT = f"""
SECTIONS {{
    . = {FLASH:#x};
    .text : {{ *(.text*) *(.rodata*) }}
    .ARM.exidx : {{ *(.ARM.exidx*) }}
}}
"""
STEPS = 300


class StepOnArm:
    """The package's step in a processor of which the instructions alone are emulated."""

    def __init__(self, folder: Path) -> None:
        """Compile an exported project and load it."""
        (folder / "calls.c").write_text(CALLS)
        sources = [path.name for path in folder.glob("sc_*.c")]
        (folder / "step.ld").write_text(LAYOUT)
        link = ("-nostdlib", "-Wl,-T,step.ld", "-Wl,-e,step_at", "-Wl,--gc-sections")
        flags = (
            "-fno-builtin",
            "-fno-math-errno",
            "-ffunction-sections",
            "-fdata-sections",
            "-Ifreestanding",
        )
        sources += ["calls.c", "freestanding/library.c"]
        run(*ZIG, *CORTEX_M4F, *WARNINGS, *flags, *link, "-o", "step.elf", *sources, cwd=folder)
        image = (folder / "step.elf").read_bytes()
        entry, segments = struct.unpack_from("<2I", image, 24)
        size, count = struct.unpack_from("<2H", image, 42)
        self.flash_bytes = 0
        self._uc = uc = unicorn.Uc(
            unicorn.UC_ARCH_ARM, unicorn.UC_MODE_THUMB | unicorn.UC_MODE_MCLASS
        )
        uc.ctl_set_cpu_model(arm_const.UC_CPU_ARM_CORTEX_M4)
        for start in (FLASH, RAM, SYSTEM):
            uc.mem_map(start, 0x100000)
        for index in range(count):
            kind, offset, address, _, held, _ = struct.unpack_from(
                "<6I", image, segments + size * index
            )
            if kind == 1:  # PT_LOAD
                uc.mem_write(address, image[offset : offset + held])
                self.flash_bytes += held
        self._entry, self._executed = entry, 0
        uc.mem_write(0xE000ED88, struct.pack("<I", 0xF << 20))  # the floating-point unit
        uc.hook_add(unicorn.UC_HOOK_CODE, self._count)

    def _count(self, *_: object) -> None:
        self._executed += 1

    def step(self, place: Sequence[float], crack: float | None = None) -> tuple[list[float], int]:
        """Torque, force and crack of a step, and its instructions; ``crack`` on a fresh sheet."""
        uc = self._uc
        uc.mem_write(INPUTS, struct.pack("<3f", *place))
        if crack is not None:
            uc.mem_write(CRACK, struct.pack("<f3i", crack, 0, 0, 0))
        for name, value in (
            ("R0", INPUTS),
            ("R1", CRACK),
            ("R2", OUT),
            ("SP", STACK),
            ("LR", RETURN | 1),
        ):
            uc.reg_write(getattr(arm_const, f"UC_ARM_REG_{name}"), value)
        self._executed = 0
        uc.emu_start(self._entry | 1, RETURN)
        values = struct.unpack("<2f", uc.mem_read(OUT, 8))
        return [*values, *struct.unpack("<f", uc.mem_read(CRACK, 4))], self._executed


def counted(package: ModelPackage, folder: Path) -> tuple[int, list[int], list[int]]:
    """Flash bytes, and instructions of each step of a slow stroke and at states of the scene."""
    arm, kernel = StepOnArm(exported(package, folder)), package.kernel()
    ranges = package.manifest.ranges
    stroke, spread = [], []
    for index, opening in enumerate(np.linspace(*ranges.opening_rad[::-1], STEPS)):
        place = np.float32([opening, -0.5, -ranges.contact_m[0]]).tolist()
        found, executed = arm.step(place, 0.0 if index == 0 else None)
        out = kernel.step(*place)
        assert np.array_equal(bits(found), bits([out.torque, out.force, kernel.crack]))
        stroke.append(executed)
    for crack, *place in random_states(package, np.random.default_rng(21))[1:STEPS].tolist():
        found, executed = arm.step(place, crack)
        kernel.reset(crack)
        out = kernel.step(*place)
        assert np.array_equal(bits(found), bits([out.torque, out.force, kernel.crack]))
        spread.append(executed)
    return arm.flash_bytes, stroke, spread


@pytest.mark.parametrize("name", ["paper", "pad"])
def test_the_arm_binary_gives_the_kernels_bits_within_its_cost(
    name: str, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    """The cost that docs/export.md states: at most 7,000 instructions, 12 kB with its tables."""
    summary: PackageSummary = request.getfixturevalue(name)
    package = open_package(summary.path, warn=False)
    flash, stroke, spread = counted(package, tmp_path / "c")
    print(f"{name}: {flash} bytes, stroke {np.mean(stroke):.0f}, worst {max(stroke + spread)}")
    assert max(stroke + spread) <= 7000
    assert flash <= 12_000
