"""The servo on a rig, through a port in real time or in virtual time.

A motion idles (motors off), tracks a reference, renders, or damps. In each mode it yields samples
in blocks, as they arrive.
"""

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.device.faults import stop_sentence
from scissorcal.device.paths import Reference
from scissorcal.device.timing import FeltLag, LoopRights, Percentiles
from scissorcal.device.trajectory import approach, check_reference
from scissorcal.errors import DeviceError
from scissorcal.kernel import (
    Contour,
    ControlConfig,
    EnergyLedger,
    Identity,
    LoopBlock,
    Mode,
    ModelTables,
    Piece,
    Section,
    Servo,
    ServoCounters,
    StopReason,
)

Samples = NDArray[np.void]
Stages = NDArray[np.int32]

BLOCK_S = 0.05
STOP_MARGIN_RAD = 0.05
"""Openings are usable up to so far beyond the stops that a device states."""
SILENCE_S = 1.0
"""A device that sends nothing for so long is gone; `LoopBlock.create` has it in milliseconds."""
FELL_BACK = (
    "The servo fell back to damping: this process did not send its heartbeat in time. Close "
    "programs that load the processor, and start again."
)
RELEASE_COMMANDS = 3
"""Zero commands at the end of a run, in case one is garbled; as FAREWELLS in sc_loop.c."""


@dataclass(frozen=True)
class MotionReport:
    """Counts, energies and latencies of a motion.

    ``counters`` count frames and limits; ``garbled`` frames were discarded, ``stalls`` are
    pauses of more than five ticks between frames by the host's clock, ``overrun`` samples were
    overwritten before they were read. ``latency`` (arrival of a frame to departure of its
    command) and ``interval`` (between frames) are in microseconds, None in virtual time. ``lag`` is
    what a hand feels of all delays; ``rights`` are what the system granted the loop, None in
    virtual time. ``watched`` is the largest value that each watch has seen, as a share of what
    stops. ``held_up_s`` is the longest time in which this computer did not run the loop,
    ``fault_cause`` that of the device's last fault.
    """

    counters: ServoCounters
    ledger: EnergyLedger
    stop_reason: StopReason
    garbled: int
    stalls: int
    unsent: int
    overrun: int
    latency: Percentiles | None
    interval: Percentiles | None
    lag: FeltLag
    rights: LoopRights | None
    watched: Mapping[str, float] = field(default_factory=dict)
    held_up_s: float = 0.0
    fault_cause: int = 0


@dataclass(frozen=True, eq=False)
class LoopTask:
    """What the loop does besides idling.

    ``tables`` are needed to render, and ``pieces`` replace the uniform sheet; ``control`` to press
    on a surface; ``longest_reference`` (ticks) to track or to follow a path.
    """

    tables: ModelTables | None = None
    pieces: Sequence[Piece] | None = None
    control: ControlConfig | None = None
    longest_reference: int = 0


IDLE = LoopTask()


class Motion(AbstractContextManager["Motion"], ABC):
    """A running servo on a rig; leaving the context switches the motors off.

    ``identity`` is the rig's, ``position`` its last opening (rad) and advance (m), ``every_s`` the
    length of a block of samples. Methods that yield samples raise DeviceError once the servo has
    stopped by itself, after the last sample.
    """

    identity: Identity
    _servo: Servo | LoopBlock

    def __init__(self, identity: Identity, every_s: float = BLOCK_S) -> None:
        self.identity = identity
        self.every_s = every_s
        self._position: tuple[float, float] | None = None
        self._approach_ticks = 0

    @property
    def tick_s(self) -> float:
        """Seconds between two frames of the device."""
        return self.identity.tick_us * 1e-6

    @property
    def position(self) -> tuple[float, float]:
        """Opening (rad) and advance (m) of the last sample; DeviceError if there was none."""
        if self._position is None:
            raise DeviceError(
                "The device sends no usable opening and advance: check its encoders and cables."
            )
        return self._position

    @property
    def approach_ticks(self) -> int:
        """Ticks of the approach to the start of the reference."""
        return self._approach_ticks

    def idle(self, seconds: float) -> Iterator[Samples]:
        """Switch the motors off and yield samples for ``seconds`` of the device's time."""
        self.engage(Mode.IDLE)
        yield from self._for_ticks(round(seconds / self.tick_s))

    def track(self, reference: Reference) -> Iterator[Samples]:
        """Move smoothly to the start of a reference and follow it to its end; then motors off.

        Samples of the approach have stroke -1. Raises InputError, before anything moves,
        if the reference leaves the device's limits.
        """
        path = approach(*self.position, reference, self.tick_s)
        whole = Reference.joined([path, reference])
        check_reference(reference, self.identity)
        self._approach_ticks = len(path)
        self.set_reference(whole)
        self.engage(Mode.TRACK)
        while not (self.mode is Mode.TRACK and self.track_index >= len(whole) - 1):
            if self.mode is Mode.DAMP:
                raise DeviceError(FELL_BACK)
            yield self.step()
        yield from self.idle(BLOCK_S)

    def render(self, seconds: float) -> Iterator[Samples]:
        """Render the model for ``seconds`` of the device's time; then motors off."""
        self.engage(Mode.RENDER)
        yield from self._for_ticks(round(seconds / self.tick_s))
        yield from self.idle(BLOCK_S)

    def watch(self, seconds: float) -> Iterator[Samples]:
        """Watch a device that renders by itself for ``seconds``, motors on; then motors off."""
        self.engage(Mode.WATCH)
        yield from self._for_ticks(round(seconds / self.tick_s))
        yield from self.idle(BLOCK_S)

    def control(self) -> Iterator[Samples]:
        """Follow the path that :meth:`set_path` set until the caller ends it; then motors off.

        Between blocks the caller sends contours and looks at :meth:`control_samples`.
        """
        self.engage(Mode.CONTROL)
        begun = False
        try:
            while True:
                yield self.step()
                if begun and self.mode is Mode.DAMP:
                    raise DeviceError(FELL_BACK)
                begun = begun or self.mode is Mode.CONTROL
        finally:
            self.engage(Mode.IDLE)

    @abstractmethod
    def step(self) -> Samples:
        """Wait for about a block, send a heartbeat, and return the samples that arrived."""

    def _arrived(self, samples: Samples) -> Samples:
        """Note the position in a block; raises the error of a servo that sends none any more."""
        if len(samples):
            place = (float(samples["opening"][-1]), float(samples["advance"][-1]))
            if np.all(np.isfinite(place)):
                self._position = place
        elif self.stop_reason is not StopReason.NONE:
            raise self._stopped()
        return samples

    def engage(self, mode: Mode) -> None:
        """Request a mode; it takes effect with the next frame."""
        self._servo.engage(mode)

    def set_reference(self, reference: Reference) -> None:
        """Set what TRACK follows; motors off first where one is followed now."""
        self._stop_following()
        self._servo.set_reference(
            reference.opening, reference.opening_rate, reference.advance, reference.stroke
        )

    @abstractmethod
    def set_path(self, place: Array, rate: Array, force: Array, stage: Stages) -> None:
        """Set what CONTROL follows, an entry each tick (m, m/s, N, stage); not while it does."""

    @abstractmethod
    def send_contour(self, contour: Contour) -> None:
        """Tell the servo how the surface runs near the tip; needed before CONTROL presses."""

    @abstractmethod
    def control_samples(self) -> Samples:
        """Samples of CONTROL since the last call, shape (n,) with CONTROL_DTYPE."""

    def fresh_sheet(self, crack: float = 0.0) -> None:
        """Put the rendered crack at ``crack`` (m)."""
        self._servo.fresh_sheet(crack)

    @property
    @abstractmethod
    def now_s(self) -> float:
        """The clock of this process, by which an estimate's age counts: the host's, or virtual."""

    def place(self, section: Section, usable: bool, age_s: float) -> None:
        """Take an estimate of where the plate stands, ``age_s`` old; not usable: force falls."""
        self._servo.place(section, usable, age_s)

    @abstractmethod
    def configure(self, key: int, value: float) -> float:
        """Set a value of the device and return the value in force; DeviceError if it refuses."""

    @abstractmethod
    def paused(self) -> AbstractContextManager[None]:
        """Motors off while the caller waits for a person; the samples of that time are dropped."""

    @abstractmethod
    def report(self) -> MotionReport:
        """Counts, energies and latencies so far."""

    @abstractmethod
    def close(self) -> None:
        """Motors off, streaming off; the link stays open."""

    @property
    def mode(self) -> Mode:
        """The mode in force."""
        return self._servo.mode

    @property
    def track_index(self) -> int:
        """Ticks of the reference that have passed."""
        return self._servo.track_index

    @property
    @abstractmethod
    def stop_reason(self) -> StopReason:
        """Why the servo stopped, NONE while it has not."""

    @property
    @abstractmethod
    def garbled(self) -> int:
        """Frames discarded so far."""

    @abstractmethod
    def _go_idle(self) -> None:
        """Switch the motors off and wait for the mode to change."""

    def _stop_following(self) -> None:
        if self.mode in (Mode.TRACK, Mode.CONTROL):
            self._go_idle()

    @abstractmethod
    def _why_lost(self) -> DeviceError | None:
        """The error where the link to the rig failed, None where the servo itself stopped."""

    @property
    def fault_cause(self) -> int:
        """`FaultCause` of the last fault, 0 without one or where the device states none."""
        return self._servo.fault_cause

    @property
    def held_up_s(self) -> float:
        """Longest time, lately, in which this computer did not run the loop."""
        return 0.0

    @property
    def _stop_sentence(self) -> str:
        return stop_sentence(self.stop_reason, self.fault_cause, self.held_up_s)

    def refuse_not_homed(self) -> None:
        """Raise DeviceError, with the motors off, where the device does not know its zero."""
        if self.stop_reason is StopReason.NOT_HOMED:
            error = self._stopped()
            self.close()
            raise error

    def _stopped(self) -> DeviceError:
        lost = self._why_lost()
        if lost is not None:
            return lost
        sentence = self._stop_sentence
        if self.stop_reason in (StopReason.TRACKING_LOST, StopReason.OVERSPEED):
            sentence += (
                " If 'scissorcal device doctor' finds the port slow, lower the gains in the "
                "recipe's rig.control."
            )
        return DeviceError(sentence, self.stop_reason.name)

    def _for_ticks(self, ticks: int) -> Iterator[Samples]:
        first: int | None = None
        passed = 0
        while passed < ticks:
            samples = self.step()
            if len(samples):
                first = int(samples["sequence"][0]) if first is None else first
                passed = (int(samples["sequence"][-1]) - first) % 2**32 + 1
            yield samples

    def __exit__(self, *_: object) -> None:
        self.close()
