"""Runs an executable of firmware/arm in this process, under unicorn, from reset.

The processor's instructions are emulated and no part of the board: its registers are plain memory,
or what a test puts there. So this shows what the binary computes, and says nothing about time.
"""

import struct
from collections.abc import Callable

from unicorn import UC_ARCH_ARM, UC_HOOK_CODE, UC_MODE_MCLASS, UC_MODE_THUMB, Uc
from unicorn.arm_const import (
    UC_ARM_REG_LR,
    UC_ARM_REG_PC,
    UC_ARM_REG_R0,
    UC_ARM_REG_R1,
    UC_ARM_REG_R2,
    UC_ARM_REG_R3,
    UC_ARM_REG_SP,
    UC_CPU_ARM_CORTEX_M4,
)

from scissorcal.kernel import (
    RECORD_BYTES,
    Drive,
    FirmwareInputs,
    FirmwareOutputs,
    FirmwarePhase,
    HomeResult,
)
from tests.firmware.elf import Image

FLASH, FLASH_BYTES = 0x08000000, 1 << 20
RAM, RAM_BYTES = 0x20000000, 128 << 10
PERIPHERALS, PERIPHERAL_BYTES = 0x40000000, 0x80000
SYSTEM, SYSTEM_BYTES = 0xE0000000, 0x100000
CPACR = 0xE000ED88
INPUTS = struct.Struct("<I7f2I")
"""fw_record_in before its bytes."""
OUTPUTS = struct.Struct("<2fI3BxI")
"""fw_record_out before its bytes."""
PAINT = 0xA5
STACK_ROOM = 16384
"""Bytes below the top of the stack that are painted: many times what it may take."""
RETURN = FLASH + FLASH_BYTES - 16
"""Where a called function returns to: flash that no image fills."""

Registers = tuple[Callable[[int], int], Callable[[int, int], None]]
"""Read and write of a 32-bit register of the board, by address."""


class Processor:
    """A Cortex-M4F with an image in its flash, reset and run up to its first tick.

    ``registers`` answer for the board's peripherals; without them these are plain memory, in which
    the image's start would wait for ever for a clock, so that data, bss and FPU alone are set up.
    """

    def __init__(self, image: Image, registers: Registers | None = None) -> None:
        self.image = image
        self._uc = uc = Uc(UC_ARCH_ARM, UC_MODE_THUMB | UC_MODE_MCLASS)
        uc.ctl_set_cpu_model(UC_CPU_ARM_CORTEX_M4)
        uc.mem_map(FLASH, FLASH_BYTES)
        uc.mem_map(RAM, RAM_BYTES)
        uc.mem_map(SYSTEM, SYSTEM_BYTES)
        if registers is None:
            uc.mem_map(PERIPHERALS, PERIPHERAL_BYTES)
        else:
            read, write = registers
            uc.mmio_map(
                PERIPHERALS,
                PERIPHERAL_BYTES,
                lambda _uc, offset, _size, _data: read(PERIPHERALS + offset),
                None,
                lambda _uc, offset, _size, value, _data: write(PERIPHERALS + offset, value),
                None,
            )
        for address, data in image.flash:
            uc.mem_write(address, data)
        uc.mem_write(RAM, bytes([PAINT]) * RAM_BYTES)  # memory holds anything at power-on
        self.stack_top, reset = struct.unpack("<2I", uc.mem_read(FLASH, 8))
        uc.reg_write(UC_ARM_REG_SP, self.stack_top)
        uc.emu_start(reset | 1, image.address("loop_start") & ~1)

    def memory(self, address: int, size: int) -> bytes:
        return bytes(self._uc.mem_read(address, size))

    def write(self, address: int, data: bytes) -> None:
        self._uc.mem_write(address, data)

    def call(self, name: str, *arguments: int) -> int:
        """Call a function with up to four words and return its first result."""
        uc = self._uc
        for register, value in zip(
            (UC_ARM_REG_R0, UC_ARM_REG_R1, UC_ARM_REG_R2, UC_ARM_REG_R3), arguments, strict=False
        ):
            uc.reg_write(register, value)
        uc.reg_write(UC_ARM_REG_SP, self.stack_top)
        uc.reg_write(UC_ARM_REG_LR, RETURN | 1)
        uc.emu_start(self.image.address(name) | 1, RETURN)
        if uc.reg_read(UC_ARM_REG_PC) & ~1 != RETURN:
            raise RuntimeError(f"{name} did not return.")
        return int(uc.reg_read(UC_ARM_REG_R0))

    def counted(self, name: str, *arguments: int) -> int:
        """Call a function and return how many instructions it executed, each one counted."""
        executed = 0

        def count(*_: object) -> None:
            nonlocal executed
            executed += 1

        hook = self._uc.hook_add(UC_HOOK_CODE, count)
        self._uc.ctl_flush_tb()  # what was translated before calls no hook
        self.call(name, *arguments)
        self._uc.hook_del(hook)
        self._uc.ctl_flush_tb()
        return executed

    def paint_stack(self) -> None:
        """Fill what the stack may grow into, so that stack_bytes counts from here on."""
        self.write(self.stack_top - STACK_ROOM, bytes([PAINT]) * STACK_ROOM)

    def stack_bytes(self) -> int:
        """Bytes from the top of the stack to the deepest one that no longer holds the paint."""
        stack = self.memory(self.stack_top - STACK_ROOM, STACK_ROOM)
        return len(stack.lstrip(bytes([PAINT])))


class EmulatedCore:
    """The core in an image, by its record interface: a device without its board.

    It has the ``tick`` and ``garbled`` of `scissorcal.kernel.FirmwareCore`.
    """

    garbled = 0

    def __init__(self, image: Image, table: bytes, renders: bool = False) -> None:
        """Start the core with a table (a fw_board); ValueError if it refuses the table.

        With ``renders`` it has the image's own memory for a package. Where ``counts`` is a list,
        each tick appends how many instructions it took.
        """
        self.counts: list[int] | None = None
        self.processor = Processor(image)
        # above the image's own memory and far below its stack
        self._in = (image.address("fw_bss_end") + 1023) & ~1023
        self._out = self._in + RECORD_BYTES
        self._core = image.address("core")
        self.processor.write(self._in, table)
        if not self.processor.call("fw_init", self._core, self._in):
            raise ValueError("The core refuses this table.")
        if renders:
            memory, size = image.symbols["image"]
            render = image.address("render")
            self.processor.call("fw_let_render", self._core, render, memory, size)

    def tick(self, inputs: FirmwareInputs, received: bytes = b"") -> FirmwareOutputs:
        """Pass one tick."""
        out = self.tick_record(record_of(inputs, received))
        torque, force, drive, phase, cause, home_result, size = OUTPUTS.unpack_from(out)
        return FirmwareOutputs(
            torque,
            force,
            Drive(drive),
            FirmwarePhase(phase),
            cause,
            HomeResult(home_result),
            out[OUTPUTS.size : OUTPUTS.size + size],
        )

    def tick_record(self, record: bytes) -> bytes:
        """Pass one tick: a fw_record_in to a fw_record_out."""
        self.processor.write(self._in, record)
        places = (self._core, self._in, self._out)
        if self.counts is None:
            self.processor.call("fw_record_tick", *places)
        else:
            self.counts.append(self.processor.counted("fw_record_tick", *places))
        return self.processor.memory(self._out, RECORD_BYTES)


def record_of(inputs: FirmwareInputs, received: bytes = b"") -> bytes:
    """A fw_record_in."""
    head = INPUTS.pack(*inputs, len(received))
    return (head + received).ljust(RECORD_BYTES, b"\0")
