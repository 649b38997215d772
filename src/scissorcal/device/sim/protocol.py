"""The device's side of the wire: bytes in, frames out, tick by tick; without clock or port.

Its behaviour, beyond the messages themselves:

* HELLO is answered with IDENTITY, CONFIG with CONFIG_ECHO that states the value in force. After
  STREAM = 1 a STATE follows every tick. ``sequence`` counts ticks since power-on, streamed or not.
* A COMMAND holds from the next tick on until another comes. One that is not finite is ignored.
* With ENABLE the motors follow the commands; without it they exert nothing. While they are
  enabled, BRAKE_AFTER_MS without a COMMAND brakes them (short-circuited windings) and latches a
  fault: COMMANDS_LOST is set until the next COMMAND, FAULT_LATCHED until a COMMAND has
  CLEAR_FAULT. While the fault is latched the motors brake, whatever is commanded. A host
  that disconnects first sends a COMMAND without ENABLE.
* A host that died without farewell is noticed by its silence: UNHEARD_S without a valid frame end
  the stream.
* Commands beyond the motors' limits are clipped and flagged TORQUE_SATURATED.
* MATERIAL = 1 puts in a fresh sheet with its near edge at advance + contact = 0. It is refused
  (VALUE_REFUSED) while the blades block it: open them or retract first. MATERIAL = 2 puts in the
  specimen's plate to touch, and is refused where it has none or the tip blocks it.
* Without a zero of its encoder (NOT_HOMED) it follows no command. HOME = 1 makes it look for one
  at the closing stop (HOMING); HOME = 0, a fault, and UNHEARD_S of silence end that.
* With ``hold_ticks`` = n a COMMAND acts for n ticks; torque and force are zero after them.
* A LOAD message is refused: this device renders nothing by itself.
* A device of protocol version 1 has none of these, and no cause of its faults.
* HAND_SPEED > 0 makes the virtual hand do HAND_STROKES strokes and then release; 0 releases now.
* A stuck encoder is detected after ENCODER_CHECK_MS: ENCODER_FAULT, and the fault latches.
  Until then its reading is constant.
"""

import math
from collections import deque

import numpy as np

from scissorcal.device.sim.homing import Homing
from scissorcal.device.sim.rig import TICK_S, VirtualRig
from scissorcal.device.sim.sensors import Faults, FaultyLine
from scissorcal.kernel import (
    EARLIER_SCHEMAS,
    PROTOCOL_VERSION,
    SCHEMA_HASH,
    Capability,
    Command,
    CommandFlag,
    Config,
    ConfigEcho,
    ConfigKey,
    ConfigStatus,
    FaultCause,
    FrameDecoder,
    Hello,
    HomeResult,
    Identity,
    LoadBegin,
    LoadChunk,
    LoadCommit,
    LoadEcho,
    LoadStatus,
    Message,
    State,
    StateFlag,
    decode,
    encode,
)

DEVICE_NAME = "scissorcal-sim"
FIRMWARE_VERSION = 1
DEFAULT_BRAKE_AFTER_MS = 10.0
ENCODER_CHECK_MS = 100
UNHEARD_S = 5.0
TICK_US = round(TICK_S * 1e6)
U32 = 0xFFFFFFFF
FASTEST_HAND_rad_per_s = 5.0
PLATE = 2.0
"""MATERIAL that puts in the specimen's plate."""

_ENABLE = int(CommandFlag.ENABLE)
_CLEAR_FAULT = int(CommandFlag.CLEAR_FAULT)
_MOTOR_ENABLED = int(StateFlag.MOTOR_ENABLED)
_FAULT_LATCHED = int(StateFlag.FAULT_LATCHED)
_COMMANDS_LOST = int(StateFlag.COMMANDS_LOST)
_OPENING_AT_STOP = int(StateFlag.OPENING_AT_STOP)
_TORQUE_SATURATED = int(StateFlag.TORQUE_SATURATED)
_FORCE_SATURATED = int(StateFlag.HANDLE_FORCE_SATURATED)
_ENCODER_FAULT = int(StateFlag.ENCODER_FAULT)
_NOT_HOMED = int(StateFlag.NOT_HOMED)
_HOMING = int(StateFlag.HOMING)


class RigProtocol:
    """A virtual rig with the wire protocol.

    Pass what the host wrote to :meth:`receive`, advance the time with :meth:`tick` (one device tick
    each), and collect its frames with :meth:`take`. ``garbled`` counts frames it could not read,
    ``unplugged`` turns True when its cable is pulled.
    """

    def __init__(
        self, rig: VirtualRig, rng: np.random.Generator, faults: Faults | None = None
    ) -> None:
        self.rig = rig
        self.faults = faults or Faults()
        self.unplugged = False
        self._line = FaultyLine(self.faults, rng)
        self._decoder = FrameDecoder()
        self._waiting: deque[tuple[int, bytes]] = deque()
        self._delay_ticks = round(self.faults.delay_ms * 1e-3 / TICK_S)
        self._ticks = 0
        self._streamed_since: int | None = None
        self._version = self.faults.protocol_version
        self._homing = Homing(rig, homed=not self.faults.not_homed)
        self._values = {int(key): 0.0 for key in self._known_keys()}
        self._values[int(ConfigKey.BRAKE_AFTER_MS)] = DEFAULT_BRAKE_AFTER_MS
        self._values[int(ConfigKey.HAND_STROKES)] = float(rig.hand.strokes)
        self._command = Command(0, 0, 0.0, 0.0)
        self._silent_ticks = 0
        self._unheard_ticks = 0
        self._cause: FaultCause | None = None
        self._lost = False
        self._stuck_at: float | None = None
        self._clock_rate = 1.0 + rig.specimen.sensors.clock_drift_ppm * 1e-6

    @property
    def garbled(self) -> int:
        """Frames from the host that were discarded."""
        return self._decoder.garbled

    def receive(self, data: bytes) -> None:
        """Take bytes from the host, in pieces of any size."""
        for payload in self._decoder.feed(self._line.garbled(data)):
            if self._line.drops():
                continue
            self._unheard_ticks = 0
            try:
                message = decode(payload)
            except ValueError:
                continue  # valid frames of another protocol are ignored
            self._handle(message)

    def tick(self) -> None:
        """Advance one tick: move, measure, check for faults, and send STATE if streaming."""
        self._watch_commands()
        self._watch_faults()
        self._watch_host()
        homing = self._homing
        if not homing.homed:
            self._command = self._command._replace(flags=self._command.flags & ~_ENABLE)
        command = self._command
        fault = self._cause is not None
        enabled = bool(command.flags & _ENABLE) and not fault
        hold = command.hold_ticks if self._version >= PROTOCOL_VERSION else 0
        holds = hold == 0 or self._silent_ticks <= hold
        torque, force = (command.torque, command.force) if holds else (0.0, 0.0)
        if homing.active:
            torque, force = homing.torque(), 0.0
        measured = self.rig.tick(torque, force, enabled or homing.active, fault)
        self._ticks += 1
        if not self._values[ConfigKey.STREAM]:
            return
        flags = (_MOTOR_ENABLED if enabled else 0) | (_FAULT_LATCHED if fault else 0)
        flags |= (_COMMANDS_LOST if self._lost else 0) | (
            _OPENING_AT_STOP if measured.at_stop and homing.homed else 0
        )
        flags |= (_TORQUE_SATURATED if measured.torque_saturated else 0) | (
            _FORCE_SATURATED if measured.force_saturated else 0
        )
        flags |= _ENCODER_FAULT if self._encoder_noticed() else 0
        if self._version >= PROTOCOL_VERSION:
            flags |= (0 if homing.homed else _NOT_HOMED) | (_HOMING if homing.active else 0)
        opening = homing.opening(measured.opening)
        if self._stuck_at is not None:
            opening = self._stuck_at
        elif self._stuck():
            self._stuck_at = opening
        limit = self.rig.specimen.motor.torque_limit_Nm
        given = min(max(torque, -limit), limit) if enabled or homing.active else 0.0
        self._send(
            State(
                flags,
                self._ticks & U32,
                int(self._ticks * TICK_US * self._clock_rate) & U32,
                opening,
                measured.advance,
                given if self.faults.unmeasured_torque else measured.motor_torque,
                measured.handle_force,
                cause=int(self._cause or homing.cause) if self._version >= PROTOCOL_VERSION else 0,
            )
        )

    def take(self) -> list[bytes]:
        """Whole frames that are due for the host, oldest first."""
        waiting = self._waiting
        due = []
        while waiting and waiting[0][0] <= self._ticks:
            due.append(waiting.popleft()[1])
        return due

    def _handle(self, message: Message) -> None:
        if isinstance(message, Command):
            if math.isfinite(message.torque) and math.isfinite(message.force):
                self._silent_ticks = 0
                self._lost = False
                if message.flags & _CLEAR_FAULT and self._present_cause() is None:
                    self._cause = None
                self._command = message
        elif isinstance(message, Hello):
            self._send(self._identity(message.nonce))
        elif isinstance(message, Config):
            self._send(self._configured(message))
        elif isinstance(message, LoadBegin | LoadChunk | LoadCommit) and self._version > 1:
            begins = isinstance(message, LoadBegin)
            status = LoadStatus.OTHER_FORMAT if begins else LoadStatus.NOT_ANNOUNCED
            self._send(LoadEcho(status, message.nonce, received=0, capacity=0, crc32=0))

    def _known_keys(self) -> list[ConfigKey]:
        """A key of what this device does not do is unknown to it."""
        missing = [ConfigKey.RENDER] if self._version > 1 else [ConfigKey.RENDER, ConfigKey.HOME]
        return [key for key in ConfigKey if key not in missing]

    def _configured(self, config: Config) -> ConfigEcho:
        """Set a value if it is acceptable, and state the value in force."""
        key, value = config.key, config.value
        if key not in self._values:
            return ConfigEcho(ConfigStatus.UNKNOWN_KEY, key, config.nonce, 0.0)
        accepted = self._accepts(key, value)
        if accepted and key == ConfigKey.MATERIAL:
            if value == PLATE:
                accepted = self.rig.load_plate()
            elif value:
                accepted = self.rig.load_sheet()
            else:
                self.rig.remove_material()
        if accepted:
            self._values[key] = value
            self._apply(key, value)
        if key == ConfigKey.HOME:
            self._values[key] = float(self._homing.active)
        status = ConfigStatus.OK if accepted else ConfigStatus.VALUE_REFUSED
        return ConfigEcho(status, key, config.nonce, self._values[key])

    def _accepts(self, key: int, value: float) -> bool:
        if key == ConfigKey.STREAM:
            return value in (0.0, 1.0)
        if key == ConfigKey.HOME:
            follows = bool(self._command.flags & _ENABLE)
            return value == 0.0 or (value == 1.0 and self._cause is None and not follows)
        if key == ConfigKey.MATERIAL:
            return value in (0.0, 1.0, PLATE)
        if key == ConfigKey.BRAKE_AFTER_MS:
            return 1.0 <= value <= 1000.0
        if key == ConfigKey.HAND_STROKES:
            return 1.0 <= value <= 1000.0 and value == int(value)
        return 0.0 <= value <= FASTEST_HAND_rad_per_s

    def _apply(self, key: int, value: float) -> None:
        rig = self.rig
        if key == ConfigKey.STREAM and value and self._streamed_since is None:
            self._streamed_since = self._ticks
        elif key == ConfigKey.HOME and not value:
            self._homing.stop()
        elif key == ConfigKey.HOME and not self._homing.active:
            self._homing.start()
        elif key == ConfigKey.HAND_SPEED_rad_per_s:
            rig.hand.start(value, rig.opening, rig.advance)
        elif key == ConfigKey.HAND_STROKES:
            rig.hand.strokes = int(value)

    def _watch_commands(self) -> None:
        self._silent_ticks += 1
        if not self._command.flags & _ENABLE:
            return
        if (self._silent_ticks - 1) * TICK_US * 1e-3 >= self._values[ConfigKey.BRAKE_AFTER_MS]:
            self._lost = True
            self._latch(FaultCause.WATCHDOG)

    def _watch_host(self) -> None:
        self._unheard_ticks += 1
        if self._unheard_ticks * TICK_S >= UNHEARD_S:
            self._values[int(ConfigKey.STREAM)] = 0.0
            self._homing.stop()

    def _latch(self, cause: FaultCause) -> None:
        """The first cause stands until the fault is cleared."""
        self._cause = self._cause or cause
        self._homing.stop(HomeResult.FAULT)

    def _present_cause(self) -> FaultCause | None:
        """What would latch a fault now, apart from missing commands."""
        if self._encoder_noticed():
            return FaultCause.ENCODER
        at = self.faults.cause_s
        return self.faults.cause if at is not None and self._streamed_s() >= at else None

    def _watch_faults(self) -> None:
        cause = self._present_cause()
        if cause is not None:
            self._latch(cause)
        if self.faults.unplug_s is not None and self._streamed_s() >= self.faults.unplug_s:
            self.unplugged = True

    def _streamed_s(self) -> float:
        """Seconds since the first STREAM; negative before."""
        return (
            -1.0 if self._streamed_since is None else (self._ticks - self._streamed_since) * TICK_S
        )

    def _stuck(self) -> bool:
        at = self.faults.stuck_encoder_s
        return at is not None and self._streamed_s() >= at

    def _encoder_noticed(self) -> bool:
        at = self.faults.stuck_encoder_s
        return at is not None and self._streamed_s() >= at + ENCODER_CHECK_MS * 1e-3

    def _send(self, message: Message) -> None:
        if self._line.drops():
            return
        self._waiting.append((self._ticks + self._delay_ticks, self._line.garbled(encode(message))))

    def _identity(self, nonce: int) -> Identity:
        specimen = self.rig.specimen
        mechanism, motor, sensors = specimen.mechanism, specimen.motor, specimen.sensors
        low, high = mechanism.opening_range_deg
        capabilities = (
            Capability.HANDLE_FORCE_SENSOR | Capability.ADVANCE_MOTOR | Capability.SIMULATOR
        )
        if self._version >= PROTOCOL_VERSION:
            capabilities |= Capability.HOMES
            if not self.faults.unmeasured_torque:
                capabilities |= Capability.TORQUE_MEASURED
        schemas = {**EARLIER_SCHEMAS, PROTOCOL_VERSION: SCHEMA_HASH}
        return Identity(
            nonce_echo=nonce,
            name=DEVICE_NAME,
            serial=specimen.name[:16],
            protocol_version=self._version,
            schema_hash=schemas[self._version],
            capabilities=int(capabilities),
            firmware_version=FIRMWARE_VERSION,
            tick_us=TICK_US,
            torque_limit=motor.torque_limit_Nm,
            force_limit=motor.force_limit_N,
            opening_min=math.radians(low),
            opening_max=math.radians(high),
            advance_min=mechanism.advance.range_mm[0] * 1e-3,
            advance_max=mechanism.advance.range_mm[1] * 1e-3,
            opening_resolution=sensors.opening_step_rad,
            advance_resolution=sensors.advance_step_um * 1e-6,
            handle_radius=mechanism.handle_radius_mm * 1e-3,
        )
