"""The loop on a file descriptor, and the block of shared memory that controls it.

One process creates a LoopBlock and hands its ``fileno()`` to another, which attaches it and calls
:func:`run_loop`; that one runs in C without the GIL until it stops. The creator sends orders and
heartbeats and reads samples, without touching the line.
"""

import mmap
import os
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scissorcal.errors import needs_unix
from scissorcal.kernel._kernel import ffi, lib
from scissorcal.kernel.control import (
    ControlBlock,
    ControlConfig,
    Mode,
    path_arrays,
    reference_arrays,
    refuse_change,
    refuse_mode,
)
from scissorcal.kernel.layout import fill_struct
from scissorcal.kernel.messages import ConfigEcho
from scissorcal.kernel.plate import Piece, Section, fill_pieces, placing, refuse_pieces
from scissorcal.kernel.servo import SAMPLE_DTYPE, ServoConfig, ServoView
from scissorcal.kernel.stop_reason import StopReason
from scissorcal.kernel.tables import TABLE_NAMES, ModelTables, Table, fill_numbers

RING_SAMPLES = int(lib.SC_RING_SAMPLES)
STALL_TICKS = int(lib.SC_TICKS_OF_A_STALL)
"""A longer pause between two states, by the host's clock, is a stall."""
_BINS = int(lib.SC_HISTOGRAM_BINS)
_PER_OCTAVE = int(lib.SC_BINS_PER_OCTAVE)


def run_loop(fd: int, block: "LoopBlock") -> StopReason:
    """Run the loop on ``fd`` until a stop, a hangup, silence or an error; return which.

    Runs in C with the GIL released. ``fd`` stays open, and is non-blocking meanwhile. A block is
    run once; make a new one to start again. Raises DeviceError where this system has no such loop.
    """
    reason = StopReason(lib.sc_loop_run(fd, block.pointer))
    if reason is StopReason.NONE:  # a loop that ran ends with a reason
        raise needs_unix("The loop at a port")
    return reason


def lock_memory() -> bool:
    """Keep this process's memory from being paged out; whether the system grants it."""
    return bool(lib.sc_rights_lock_memory())


def ask_for_slice(slice_us: int) -> bool:
    """Ask for a time slice of this length for this thread; whether the system knows such.

    Needs no right, and Linux 6.12 or newer (100 to 100,000 us): a thread then interrupts those of
    longer slices when it wakes, and its share of the processor stays. Ends real-time priority.
    """
    return bool(lib.sc_rights_slice(slice_us))


LATELY_NS = 3_000_000_000
"""Of a stop, which the supervisor sees within a second."""


@dataclass(frozen=True)
class LoopCounters:
    """What happened on the line.

    ``garbled`` frames were discarded, ``other_frames`` were valid but no STATE, ``answers`` are
    commands written and ``unsent`` those the line did not accept in time. ``stalls`` are pauses of
    more than five ticks between two STATE by the host's clock; ``lost_samples`` were overwritten
    in the ring before this process read them.
    """

    garbled: int
    bytes_received: int
    other_frames: int
    answers: int
    unsent: int
    stalls: int
    lost_samples: int


@dataclass(frozen=True, eq=False)
class Histogram:
    """Times in bins of equal width in the logarithm, eight to the octave.

    ``edges_us`` has shape (n + 1,): the first is 0 and the last infinite. ``counts``: (n,).
    """

    edges_us: NDArray[np.float64]
    counts: NDArray[np.uint64]
    largest_us: float

    @property
    def total(self) -> int:
        """How many times were counted."""
        return int(self.counts.sum())

    def quantile(self, share: float) -> float:
        """Time in us that ``share`` of all do not exceed: its bin's upper edge, NaN if empty.

        So it is at most 12.5 % too long, never too short.
        """
        if not 0 <= share <= 1:
            raise ValueError(f"A share lies between 0 and 1, not at {share}.")
        if self.total == 0:
            return float("nan")
        rank = max(1, int(np.ceil(share * self.total - 1e-9)))
        index = int(np.searchsorted(np.cumsum(self.counts), rank))
        return float(min(self.edges_us[index + 1], self.largest_us))


class LoopBlock(ServoView):
    """Shared memory between the loop and its supervisor.

    It has no name in the system: the memory exists as long as a process holds it, so a killed
    process leaves nothing behind.
    """

    def __init__(self, fd: int, size: int) -> None:
        """Map ``size`` bytes of ``fd``; meant for :meth:`create` and :meth:`attach`."""
        self._fd = fd
        self._memory = mmap.mmap(fd, size)
        self._keep = ffi.from_buffer(self._memory, require_writable=True)
        self.pointer = ffi.cast("sc_block *", self._keep)
        self._servo = ffi.addressof(self.pointer, "servo")
        self._cursor = ffi.new("uint64_t *")
        self._lost = ffi.new("uint64_t *")
        self.control = ControlBlock(self.pointer)

    @classmethod
    def create(
        cls,
        config: ServoConfig,
        tables: ModelTables | None = None,
        *,
        control: ControlConfig | None = None,
        pieces: Sequence[Piece] | None = None,
        reference_capacity: int = 0,
        silence_limit_ms: int = 1000,
    ) -> Self:
        """Create a block with everything the loop needs.

        ``tables`` are needed to render, ``control`` to press on a surface; ``pieces`` replace the
        uniform sheet.
        ``reference_capacity``: longest reference or path in ticks that it will get.
        ``silence_limit_ms``: how long the device may send no STATE before the loop gives up.
        """
        if pieces is not None:
            refuse_pieces(pieces, tables is not None, config.plate.is_estimated)
        size = int(lib.sc_block_size(reference_capacity))
        fd = _anonymous_file()
        os.ftruncate(fd, size)
        block = cls(fd, size)
        lib.sc_block_init(block.pointer, reference_capacity)
        block.pointer.silence_limit_ms = silence_limit_ms
        fill_struct(block.pointer.config, config)
        if tables is not None:
            _store_tables(block.pointer, tables, pieces)
        if control is not None:
            fill_struct(block.pointer.control.config, control)
            block.pointer.control.has_config = 1
        return block

    @classmethod
    def attach(cls, fd: int) -> Self:
        """Map the block that another process created; :meth:`close` then closes ``fd`` too.

        Raises ValueError, and leaves ``fd`` alone, if it holds no such block.
        """
        size = os.fstat(fd).st_size
        if size < ffi.sizeof("sc_block"):
            raise ValueError(f"Descriptor {fd} holds {size} bytes, too few for a loop's block.")
        block = cls(fd, size)
        if not lib.sc_block_is_sound(block.pointer, size):
            block._unmap()
            raise ValueError(
                f"Descriptor {fd} has no block of this version of scissorcal; both processes "
                "must run the same version."
            )
        return block

    def fileno(self) -> int:
        """The descriptor to hand to the other process (``pass_fds``)."""
        return self._fd

    def close(self) -> None:
        """Release the memory; the block cannot be used any more."""
        if self._fd >= 0:
            self._unmap()
            os.close(self._fd)
            self._fd = -1

    def _unmap(self) -> None:
        self.pointer = self._servo = ffi.NULL
        self.control = ControlBlock(ffi.NULL)
        ffi.release(self._keep)
        self._memory.close()

    def engage(self, mode: Mode) -> None:
        """Request a mode; it engages with the next frame (RENDER from zero force)."""
        size = int(self.pointer.reference_size)
        path = size if self.pointer.control.has_config else 0
        refuse_mode(mode, bool(self.pointer.has_model), size, path)
        lib.sc_block_order(self.pointer, int(mode))

    def set_reference(
        self, opening: ArrayLike, opening_rate: ArrayLike, advance: ArrayLike, stroke: ArrayLike
    ) -> None:
        """Set what TRACK follows, as :meth:`Servo.set_reference`; not while TRACK is engaged."""
        self._follow(reference_arrays(opening, opening_rate, advance, stroke))

    def set_path(
        self, place: ArrayLike, rate: ArrayLike, force: ArrayLike, stage: ArrayLike
    ) -> None:
        """Set what CONTROL follows, in the place of the reference; as :meth:`ControlTask.set_path`.

        Neither TRACK nor CONTROL may be engaged.
        """
        self._follow(path_arrays(place, rate, force, stage))

    def _follow(self, arrays: tuple[NDArray[Any], ...]) -> None:
        block = self.pointer
        refuse_change(block.orders.mode, block.servo.mode)
        n, capacity = len(arrays[0]), int(block.reference_capacity)
        if n > capacity:
            raise ValueError(
                f"A reference of {n} ticks does not fit this block: it was made for {capacity}."
            )
        start = ffi.sizeof("sc_block")
        for row, array in enumerate(arrays):
            at = start + row * capacity * 4
            self._memory[at : at + 4 * n] = array.tobytes()
        lib.sc_block_set_reference_size(block, n)

    def fresh_sheet(self, crack: float = 0.0) -> None:
        """Put the rendered crack at ``crack`` (m); a fresh sheet has it at 0.

        Cracks of pieces go to their near edges.
        """
        lib.sc_block_fresh_sheet(self.pointer, crack)

    def place(self, section: Section, usable: bool = True, age_s: float = 0.0) -> None:
        """Take an estimate of where the plate stands, ``age_s`` old; not usable: force falls."""
        lib.sc_block_place(self.pointer, placing(section, usable, age_s))

    def beat(self) -> None:
        """Send a heartbeat to the loop; at least every supervisor_ms."""
        lib.sc_block_beat(self.pointer)

    def stop(self) -> None:
        """Request that the loop releases the motors and returns."""
        lib.sc_block_stop(self.pointer)

    def configure(self, key: int, value: float, timeout_s: float = 1.0) -> ConfigEcho | None:
        """Have the loop send a CONFIG; return the device's echo, None if it is late.

        Heartbeats are sent meanwhile.
        """
        mailbox = self.pointer.mailbox
        request = lib.sc_block_request(self.pointer, int(key), value)
        until = time.monotonic() + timeout_s
        while not lib.sc_block_answered(self.pointer, request):
            if time.monotonic() > until:
                return None
            self.beat()
            time.sleep(0.001)
        return ConfigEcho(mailbox.status, int(key), request, mailbox.value_in_force)

    def read(self, most: int = RING_SAMPLES) -> NDArray[np.void]:
        """Samples that came since the last call, oldest first: shape (n,), SAMPLE_DTYPE.

        The ring holds 32767 (half a minute at 1 kHz); what was overwritten before it was read is
        counted as lost.
        """
        waiting = int(self.pointer.written) - int(self._cursor[0])
        samples = np.empty(max(0, min(most, waiting, RING_SAMPLES)), dtype=SAMPLE_DTYPE)
        place = ffi.from_buffer("sc_sample[]", samples, require_writable=True)
        count = lib.sc_block_read(self.pointer, self._cursor, place, len(samples), self._lost)
        return samples[:count]

    @property
    def rights(self) -> tuple[bool, bool]:
        """Whether the loop has real-time priority, and whether its memory is locked."""
        return bool(self.pointer.realtime), bool(self.pointer.memory_locked)

    @rights.setter
    def rights(self, granted: tuple[bool, bool]) -> None:
        self.pointer.realtime, self.pointer.memory_locked = (int(each) for each in granted)

    @property
    def running(self) -> bool:
        """Whether a loop is on this block now."""
        return bool(self.pointer.running)

    @property
    def stop_reason(self) -> StopReason:
        """Why the loop ended or is about to; NONE while it runs."""
        return StopReason(self.pointer.exit_reason or self._servo.stop_reason)

    @property
    def held_up_s(self) -> float:
        """Longest time in which this computer did not run the loop; 0 where none passed 10 ms."""
        return 1e-9 * float(self.pointer.held_up_ns)

    @property
    def held_up_lately_s(self) -> float:
        """The same within the last seconds."""
        pointer = self.pointer
        ago_ns = time.monotonic_ns() - int(pointer.recent_held_up_until_ns)
        return 1e-9 * float(pointer.recent_held_up_ns) if ago_ns < LATELY_NS else 0.0

    @property
    def line(self) -> LoopCounters:
        """What happened on the line so far."""
        block = self.pointer
        names = [field.name for field in fields(LoopCounters) if field.name != "lost_samples"]
        counts = {name: int(getattr(block, name)) for name in names}
        return LoopCounters(**counts, lost_samples=int(self._lost[0]))

    @property
    def latency(self) -> Histogram:
        """From a frame's arrival in the loop to its command's departure."""
        return _histogram(self.pointer.latency)

    @property
    def interval(self) -> Histogram:
        """Between the arrivals of two STATE, by the host's clock."""
        return _histogram(self.pointer.interval)


def _anonymous_file() -> int:
    if hasattr(os, "memfd_create"):
        return os.memfd_create("scissorcal-loop")
    with tempfile.TemporaryFile() as file:
        return os.dup(file.fileno())


def _store_tables(block: Any, tables: ModelTables, pieces: Sequence[Piece] | None) -> None:
    fill_numbers(block.model, tables)
    for name in TABLE_NAMES:
        _store_table(getattr(block, name), getattr(tables, name))
    block.has_model = 1
    model = ffi.new("sc_model *")
    if not lib.sc_block_model(block, model):
        raise ValueError("The kernel refuses these tables: their numbers do not fit float32.")
    lib.sc_model_edge_slopes(model)
    block.model.flattest, block.model.steepest = model.flattest, model.steepest
    block.model.release_falls = lib.sc_model_release_falls(model)
    if pieces is not None:
        fill_pieces(ffi.addressof(block.config, "pieces"), pieces, model)


def _store_table(store: Any, table: Table) -> None:
    n = len(table.x)
    for name in ("x", "y", "slope"):
        ffi.memmove(getattr(store, name), getattr(table, name), 4 * n)
    store.size = n
    view = ffi.new("sc_table *")
    view.x, view.y, view.slope, view.size = store.x, store.y, store.slope, n
    lib.sc_table_accumulate(view, store.area)


def _histogram(histogram: Any) -> Histogram:
    bins = np.arange(_BINS)
    lower = (_PER_OCTAVE + bins % _PER_OCTAVE) * 2.0 ** (bins // _PER_OCTAVE) / _PER_OCTAVE
    edges = np.append(lower, np.inf)
    edges[0] = 0.0
    counts = np.frombuffer(bytes(ffi.buffer(histogram.count)), dtype=np.uint64)
    return Histogram(edges, counts, histogram.largest_ns * 1e-3)
