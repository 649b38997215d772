"""The servo from Python: one STATE in, one COMMAND out, by the same C function as in the loop."""

from collections.abc import Sequence
from dataclasses import Field, dataclass, fields, is_dataclass
from enum import IntFlag
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scissorcal.kernel._kernel import ffi, lib
from scissorcal.kernel.control import (
    ControlConfig,
    ControlTask,
    Mode,
    control_sample,
    reference_arrays,
    refuse_change,
    refuse_mode,
)
from scissorcal.kernel.layout import dtype_of, fill_struct
from scissorcal.kernel.messages import Command, State
from scissorcal.kernel.plate import (
    KNOWN_PLATE,
    Piece,
    PlateConfig,
    Section,
    fill_pieces,
    placing,
    refuse_pieces,
)
from scissorcal.kernel.stop_reason import StopReason
from scissorcal.kernel.tables import ModelTables, model_struct
from scissorcal.kernel.watching import (
    NO_WATCHES,
    UNWATCHED_ENERGY,
    EnergyLedger,
    LagCounts,
    PassivityConfig,
    WatchConfig,
    largest_seen,
)
from scissorcal.kernel.wire import encode_frame

SAMPLE_DTYPE = dtype_of("sc_sample")
"""One frame's telemetry, as in the loop's ring buffer and in a recording: 80 bytes."""

U32 = 0xFFFFFFFF

STUCK_FRAMES = int(lib.SC_RECENT_STATES)
"""The newest states over which the servo counts what is wrong with clock and places."""
LEAP_RATES = int(lib.SC_LEAP_RATES)
"""Times the limit of the rate: no motion between two states is taken for one if it is faster."""

WIDEST_OPENING = 3.125
"""rad; just within half a turn, and the same number in 32 bits."""

OPENING_RATE_LIMIT = 30.0
"""Chosen: three times the rate of a hand that closes 1 rad in 0.1 s. A place that is off by
0.25 rad then stops the servo before the time since the last usable one makes it plausible
(4.2 ms)."""
ADVANCE_RATE_LIMIT = 5.0
"""Chosen: 5 mm in a tick of 1 ms, far beyond any carriage."""

_ABOVE_ZERO = (
    "opening_error_limit",
    "advance_error_limit",
    "opening_rate_limit",
    "advance_rate_limit",
    "tick_us",
)


class SampleFlag(IntFlag):
    """A sample's ``flags`` above bit 15; below are the device's own (StateFlag).

    PLATE_OUT: rendering with less than its force, for want of the plate's pose. A rendered step's
    flags (StepFlag) follow from bit 24 on.
    """

    TORQUE_LIMITED = 0x10000
    FORCE_LIMITED = 0x20000
    FALLBACK = 0x40000
    INVALID = 0x80000
    AFTER_GAP = 0x100000
    PLATE_OUT = 0x800000


@dataclass(frozen=True, kw_only=True)
class ServoConfig:
    """Limits and gains of the servo, in SI units and radians.

    Commands stay within ``torque_limit`` (N m) and ``force_limit`` (N; 0 switches the advance
    motor off) and the slews (N m/s, N/s). ``ramp_s``: from engaging RENDER to its
    full force. ``damping_Nm_s_per_rad`` acts in DAMP, ``let_go_damping_Nm_s_per_rad`` while torque
    and force fall to zero at a gentle end. ``rate_cutoff_Hz``: low-pass of the rate estimator, 0
    for none. TRACK stops when an error exceeds its limit (rad, m).
    A motion beyond ``opening_rate_limit`` (rad/s) or ``advance_rate_limit`` (m/s) stops while a
    mode drives the blades. Openings (rad) outside ``opening_low`` to ``opening_high`` are not
    usable, nor are places that would need twice as fast a motion.
    ``motor_sign = -1`` turns the motor's torque round on the wire, commanded and measured.
    ``supervisor_ms`` without a heartbeat leave damping only, five times as long stops;
    0 switches that off. ``fault_clearings``: how many latched faults are cleared; one
    more stops. ``watch`` has the thresholds of the watches, by default none; ``passivity`` watches
    the energy of RENDER, ``plate`` follows a plate whose pose is estimated. Raises ValueError for
    a number that is not finite or below 0.
    """

    torque_limit: float
    torque_slew: float
    force_limit: float
    force_slew: float
    ramp_s: float = 0.5
    damping_Nm_s_per_rad: float = 0.02
    let_go_damping_Nm_s_per_rad: float = 0.0
    rate_cutoff_Hz: float = 100.0
    opening_kp: float = 0.0
    opening_kd: float = 0.0
    opening_ki: float = 0.0
    advance_kp: float = 0.0
    advance_kd: float = 0.0
    advance_ki: float = 0.0
    opening_error_limit: float = 0.5
    advance_error_limit: float = 0.1
    opening_low: float = -WIDEST_OPENING
    opening_high: float = WIDEST_OPENING
    opening_rate_limit: float = OPENING_RATE_LIMIT
    advance_rate_limit: float = ADVANCE_RATE_LIMIT
    supervisor_ms: int = 200
    fault_clearings: int = 3
    tick_us: int = 1000
    motor_sign: int = 1
    watch: WatchConfig = NO_WATCHES
    passivity: PassivityConfig = UNWATCHED_ENERGY
    plate: PlateConfig = KNOWN_PLATE

    def __post_init__(self) -> None:
        for field in self._numbers():
            value = getattr(self, field.name)
            if field.name == "motor_sign":
                continue
            least = -WIDEST_OPENING if field.name in ("opening_low", "opening_high") else 0
            if not least <= value <= U32:  # NaN and infinity fail this too
                raise ValueError(
                    f"{field.name} = {value} is not usable: give a number from 0 to 2**32 - 1."
                )
        for name in _ABOVE_ZERO:
            if not getattr(self, name) > 0:
                raise ValueError(f"{name} must be above 0.")
        if self.motor_sign not in (1, -1):
            raise ValueError("motor_sign must be 1 or -1.")
        if not self.opening_low < self.opening_high:
            raise ValueError("opening_low must be below opening_high.")

    def _numbers(self) -> list[Field[Any]]:
        return [field for field in fields(self) if not is_dataclass(getattr(self, field.name))]


@dataclass(frozen=True)
class ServoCounters:
    """How many frames: taken, missed (gaps in the sequence), repeated, without usable numbers;
    and in how many the torque or force met a limit or slew, the device saturated, or only
    damping was left. ``faults`` counts faults of the device after the motors were first on,
    ``plate_out_frames`` those rendered with less than their force for want of the plate's pose.
    """

    frames: int
    misses: int
    duplicates: int
    invalid_frames: int
    torque_limited: int
    force_limited: int
    torque_slewed: int
    force_slewed: int
    device_saturated: int
    fallback_frames: int
    faults: int
    plate_out_frames: int


class ServoView:
    """What can be read off a C servo, be it one's own or the one in a loop's block."""

    _servo: Any

    @property
    def mode(self) -> Mode:
        """The mode in force, DAMP after a missing heartbeat of the supervisor."""
        return Mode(self._servo.mode)

    @property
    def stop_reason(self) -> StopReason:
        """Why it stopped; NONE while it has not."""
        return StopReason(self._servo.stop_reason)

    @property
    def fault_cause(self) -> int:
        """`FaultCause` of the last fault that the device latched, 0 where it stated none."""
        return int(self._servo.fault_cause)

    @property
    def track_index(self) -> int:
        """Where TRACK is in its reference; at or beyond its length once the last place is held."""
        return int(self._servo.track_index)

    @property
    def rates(self) -> tuple[float, float]:
        """Estimated rates of opening (rad/s) and advance (m/s)."""
        return float(self._servo.motion.opening_rate), float(self._servo.motion.advance_rate)

    @property
    def crack(self) -> float:
        """The rendered crack tip X (m, plate frame), with pieces that of the piece shown."""
        return float(self._servo.crack.crack)

    @property
    def plate(self) -> tuple[Section, float]:
        """Where an estimated plate is rendered now, and the share of force that it lets through."""
        plate = self._servo.plate
        now = Section(*(float(getattr(plate.now, field.name)) for field in fields(Section)))
        return now, float(plate.share)

    @property
    def ledger(self) -> EnergyLedger:
        ledger = self._servo.ledger
        return EnergyLedger(*(getattr(ledger, field.name) for field in fields(EnergyLedger)))

    @property
    def lag(self) -> LagCounts:
        """Lags so far, by the mode in force."""
        return LagCounts.of(self._servo.lag)

    @property
    def watched(self) -> dict[str, float]:
        """The largest value that each watch has seen, as a share of its threshold; 1 stops."""
        return largest_seen(self._servo.watch)

    @property
    def counters(self) -> ServoCounters:
        names = (field.name for field in fields(ServoCounters))
        return ServoCounters(*(int(getattr(self._servo, name)) for name in names))


class Servo(ServoView):
    """The servo on its own, for lockstep runs, tests and other loops.

    ``tables`` is needed for RENDER only, ``control`` for CONTROL; ``pieces`` replace the uniform
    sheet. It starts in IDLE with a fresh sheet (crack at 0).

    >>> servo = Servo(None, ServoConfig(torque_limit=1, torque_slew=200, force_limit=0,
    ...                                 force_slew=0, damping_Nm_s_per_rad=0.1))
    >>> servo.engage(Mode.DAMP)
    >>> for tick in range(100):
    ...     command = servo.step(State(1, tick, 1000 * tick, 0.5 - 1e-3 * tick, 0, 0, 0))
    >>> round(command.torque, 3)  # closing at 1 rad/s
    0.1
    """

    def __init__(
        self,
        tables: ModelTables | None,
        config: ServoConfig,
        control: ControlConfig | None = None,
        pieces: Sequence[Piece] | None = None,
    ) -> None:
        self.config = config
        self.control = None if control is None else ControlTask(control)
        self._config = ffi.new("sc_servo_config *")
        fill_struct(self._config, config)
        self._model, self._keep = (ffi.NULL, ()) if tables is None else model_struct(tables)
        if pieces is not None:
            refuse_pieces(pieces, tables is not None, config.plate.is_estimated)
            fill_pieces(ffi.addressof(self._config, "pieces"), pieces, self._model)
        self._orders = ffi.new("sc_orders *")
        self._reference = ffi.new("sc_reference *")
        if self.control is not None:
            self._reference.task = self.control.pointer
        self._reference_arrays: tuple[NDArray[Any], ...] = ()
        self._servo = ffi.new("sc_servo *")
        self._state = ffi.new("sc_state *")
        self._command = ffi.new("sc_command *")
        self._payload = ffi.new("uint8_t[]", int(lib.SC_SIZE_COMMAND))
        self._waiting = False

    def engage(self, mode: Mode) -> None:
        """Request a mode; it engages with the next frame (RENDER from zero force)."""
        path = 0 if self.control is None else self.control.path_size
        refuse_mode(mode, self._model != ffi.NULL, self._reference.size, path)
        self._orders.mode = int(mode)
        self._orders.order = (self._orders.order + 1) & U32

    def set_reference(
        self, opening: ArrayLike, opening_rate: ArrayLike, advance: ArrayLike, stroke: ArrayLike
    ) -> None:
        """Set what TRACK follows, one entry per device tick: rad, rad/s, m, stroke's index.

        The index moves with the device's sequence number, so lost frames do not shift it. At the
        end the last place is held. Not while TRACK is engaged.
        """
        refuse_change(self.mode)
        arrays = reference_arrays(opening, opening_rate, advance, stroke)
        self._reference_arrays = arrays
        self._reference.opening = ffi.from_buffer("float[]", arrays[0])
        self._reference.opening_rate = ffi.from_buffer("float[]", arrays[1])
        self._reference.advance = ffi.from_buffer("float[]", arrays[2])
        self._reference.stroke = ffi.from_buffer("int32_t[]", arrays[3])
        self._reference.size = len(arrays[0])

    def fresh_sheet(self, crack: float = 0.0) -> None:
        """Put the rendered crack at ``crack`` (m); a fresh sheet has it at 0.

        Cracks of pieces go to their near edges.
        """
        self._orders.crack = crack
        self._orders.sheet = (self._orders.sheet + 1) & U32

    def place(self, section: Section, usable: bool = True, age_s: float = 0.0) -> None:
        """Take an estimate of where the plate stands, ``age_s`` old; not usable: force falls."""
        lib.sc_servo_place(self._config, self._model, self._servo, placing(section, usable, age_s))

    def stop(self) -> None:
        """Release the motors from the next frame on, for good."""
        self._orders.stop = 1

    def step(
        self,
        state: State,
        *,
        heartbeat: bool = True,
        host_time_ns: int = 0,
        answered: bool = True,
        passed_us: int | None = None,
    ) -> Command:
        """Take a state and return the command.

        ``heartbeat=False`` simulates a supervisor without heartbeat. ``answered=False`` says that
        this command is not sent, as for all but the newest of states that arrived at once: a tick
        of time passes with the first of them (or ``passed_us``), and slews and clearings of faults
        count by commands that are sent.
        """
        for name, value in zip(State._fields, state, strict=True):
            setattr(self._state, name, value)
        self._step(heartbeat, host_time_ns, answered, passed_us)
        command = self._command
        return Command(command.flags, command.echo_sequence, command.torque, command.force)

    def answer(
        self,
        payload: bytes,
        *,
        heartbeat: bool = True,
        host_time_ns: int = 0,
        answered: bool = True,
        passed_us: int | None = None,
    ) -> bytes:
        """Take a STATE payload and return the whole COMMAND frame: :meth:`step` for bytes, faster.

        Raises ValueError if the payload is no STATE.
        """
        if not lib.sc_unpack_state(ffi.from_buffer(payload), len(payload), self._state):
            raise ValueError(f"A payload of {len(payload)} bytes is no STATE.")
        self._step(heartbeat, host_time_ns, answered, passed_us)
        size = lib.sc_pack_command(self._command, self._payload)
        return encode_frame(bytes(ffi.buffer(self._payload, size)))

    def _step(
        self, heartbeat: bool, host_time_ns: int, answered: bool, passed_us: int | None
    ) -> None:
        if heartbeat:
            self._orders.heartbeat = (self._orders.heartbeat + 1) & U32
        if not self._waiting:
            time_us = self.config.tick_us if passed_us is None else passed_us
            lib.sc_servo_pass(self._config, self._orders, self._servo, time_us)
        self._waiting = not answered
        fresh = lib.sc_servo_step(
            self._config,
            self._model,
            self._reference,
            self._orders,
            self._servo,
            self._state,
            self._command,
        )
        if fresh:
            self._servo.sample.host_time_ns = host_time_ns
        if answered:
            lib.sc_servo_sent(self._servo)
            lib.sc_servo_answered(self._servo)
        else:
            lib.sc_servo_not_sent(self._servo)

    def control_telemetry(self) -> NDArray[np.void]:
        """The last frame's sample of CONTROL, shape (1,), CONTROL_DTYPE; a copy."""
        return control_sample(self._servo)

    def telemetry(self) -> NDArray[np.void]:
        """The last frame's sample, shape (1,), SAMPLE_DTYPE; a copy."""
        data = bytes(ffi.buffer(ffi.addressof(self._servo, "sample")))
        return np.frombuffer(data, dtype=SAMPLE_DTYPE)
