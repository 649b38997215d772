"""The firmware's core in this process: what a board runs, tick by tick, on numbers from outside."""

from dataclasses import asdict, dataclass
from enum import IntEnum, IntFlag
from typing import NamedTuple

from scissorcal.kernel._firmware import ffi, lib

RECORD_BYTES = int(lib.FW_RECORD_SIZE)
"""Size of one tick's record, in and out (firmware/core/fw_record.h)."""


class Drive(IntEnum):
    """What the motors do until the next tick."""

    RELEASE = 0
    DRIVE = 1
    BRAKE = 2


class FirmwarePhase(IntEnum):
    """Phase of the core; firmware/README.md has the table of what leads from one to another."""

    UNHOMED = 0
    HOMING = 1
    READY = 2
    ENABLED = 3
    FAULT = 4


class HomeResult(IntEnum):
    """How homing ended last."""

    NOT_TRIED = 0
    FOUND = 1
    STOPPED = 2
    TIMED_OUT = 3
    JAMMED = 4
    FAULT = 5


HOME_CAUSE = 64
"""Added to a `HomeResult`: ``cause`` of a STATE without a zero and without a fault."""


class InputFlag(IntFlag):
    """What a board reports beside numbers."""

    STOP_BUTTON = 1
    DRIVER_FAULT = 2
    ENCODER_BAD = 4
    AT_HOME = 8
    FORCE_SATURATED = 16


@dataclass(frozen=True)
class FirmwareBoard:
    """Constants of a board; firmware/core/fw_board.h states each (SI units, at the blades).

    What a board does not have is 0: ``force_limit`` and the advance figures without a carriage,
    ``supply_max`` and ``temperature_max`` where they are not watched, the ``home`` figures without
    the capability HOMES.
    """

    name: str
    serial: str
    tick_us: int
    capabilities: int
    torque_limit: float
    opening_min: float
    opening_max: float
    opening_resolution: float
    handle_radius: float
    torque_slew: float
    overspeed: float
    opening_leap: float
    torque_per_A: float
    resistance: float
    current_limit: float
    current_continuous: float
    i2t_limit: float
    supply_min: float
    force_limit: float = 0.0
    force_slew: float = 0.0
    advance_min: float = 0.0
    advance_max: float = 0.0
    advance_resolution: float = 0.0
    advance_leap: float = 0.0
    supply_max: float = 0.0
    temperature_max: float = 0.0
    home_torque: float = 0.0
    home_speed: float = 0.0
    home_opening: float = 0.0
    home_timeout: float = 0.0
    home_at_stop: int = 0
    firmware_version: int = 1


class FirmwareInputs(NamedTuple):
    """What a board measured at the start of a tick; firmware/core/fw_core.h states each.

    Times in us, angles in rad, advance in m, torque in N m, force in N, current in A, supply in V,
    temperature in degC; ``flags`` of `InputFlag`.
    """

    device_us: int
    opening: float
    advance: float = 0.0
    motor_torque: float = 0.0
    handle_force: float = 0.0
    current: float = 0.0
    supply: float = 0.0
    temperature: float = 0.0
    flags: int = 0


class FirmwareOutputs(NamedTuple):
    """What a tick decided: torque in N m and force in N under `Drive`, and bytes for the host."""

    torque: float
    force: float
    drive: Drive
    phase: FirmwarePhase
    cause: int
    home_result: HomeResult
    sent: bytes


class FirmwareCore:
    """One device's core; with ``image_bytes`` of memory it loads and renders packages.

    Raises ValueError, with the sentence that says what to change, where the board is impossible.

    >>> from scissorcal.kernel.firmware import FirmwareBoard, FirmwareCore, FirmwareInputs
    >>> board = FirmwareBoard(
    ...     "mine", "1", tick_us=1000, capabilities=0, torque_limit=0.2, opening_min=0.0,
    ...     opening_max=1.0, opening_resolution=1e-4, handle_radius=0.06, torque_slew=100.0,
    ...     overspeed=20.0, opening_leap=0.1, torque_per_A=0.1, resistance=1.0, current_limit=4.0,
    ...     current_continuous=1.0, i2t_limit=10.0, supply_min=10.0)
    >>> FirmwareCore(board).tick(FirmwareInputs(device_us=1000, opening=0.5)).drive.name
    'RELEASE'
    """

    def __init__(self, board: FirmwareBoard, image_bytes: int = 0) -> None:
        self._core = ffi.new("fw_core *")
        self._in, self._out = ffi.new("fw_record_in *"), ffi.new("fw_record_out *")
        self._table = ffi.new("fw_board *")
        for name, value in asdict(board).items():
            setattr(self._table, name, value.encode("ascii") if isinstance(value, str) else value)
        sentence = ffi.new("const char **")
        if lib.fw_board_problem(self._table, sentence):
            raise ValueError(ffi.string(sentence[0]).decode("ascii"))
        lib.fw_init(self._core, self._table)
        if image_bytes:
            self._render = ffi.new("fw_render *")
            self._memory = ffi.new("float[]", image_bytes // 4)
            lib.fw_let_render(self._core, self._render, self._memory, image_bytes)

    @property
    def garbled(self) -> int:
        """Frames from the host that were discarded."""
        return int(self._core.decoder.garbled)

    @property
    def brake_after_ms(self) -> float:
        """BRAKE_AFTER_MS in force."""
        return float(self._core.brake_after_ms)

    def tick(self, inputs: FirmwareInputs, received: bytes = b"") -> FirmwareOutputs:
        """Pass one tick; bytes beyond a record's room are taken before it."""
        room = int(lib.FW_RECORD_RECEIVED)
        early, late = received[:-room], received[-room:]
        if early:
            lib.fw_receive(self._core, early, len(early))
        record = self._in
        record.inputs = inputs
        record.received_size = len(late)
        ffi.memmove(record.received, late, len(late))
        lib.fw_record_tick(self._core, record, self._out)
        out = self._out
        return FirmwareOutputs(
            out.outputs.torque,
            out.outputs.force,
            Drive(out.outputs.drive),
            FirmwarePhase(out.phase),
            int(out.cause),
            HomeResult(out.home_result),
            bytes(ffi.buffer(out.sent, out.sent_size)),
        )

    @property
    def table(self) -> bytes:
        """The board as the core has it, fw_board's bytes."""
        return bytes(ffi.buffer(self._table))

    def last_records(self) -> tuple[bytes, bytes]:
        """Give the records, in and out, of the last tick, `RECORD_BYTES` each."""
        return bytes(ffi.buffer(self._in)), bytes(ffi.buffer(self._out))
