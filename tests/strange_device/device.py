"""The device: the loop of docs/protocol.md around the mechanics, and what is wrong with it."""

import math
import struct
from collections import deque
from pathlib import Path

import numpy as np

from . import wire
from .faults import Faults
from .mechanics import SUBSTEPS, Axis, Hand, Sheet

TORQUE_LIMIT, FORCE_LIMIT = 0.8, 25.0
OPENING_LOW, OPENING_HIGH = 0.0, 1.05
ADVANCE_LOW, ADVANCE_HIGH = -0.12, 0.25
RESOLUTION_RAD, RESOLUTION_M = 2.0 * math.pi / 160_000, 2.5e-6
RADIUS_M = 0.06
TORQUE_NOISE_NM, FORCE_NOISE_N = 1.5e-3, 0.015
BRAKE_NM_S = 0.05
HOMING_S = 1.5
WIRE = Path(__file__).parents[2] / "data_schemas" / "wire.json"


class StrangeDevice:
    """``tick`` passes one tick of its time: bytes in, bytes out.

    ``largest_torque`` (N m, at the motor), ``largest_rate`` (rad/s) and ``largest_force`` (N) are
    the truth since the start or since `forget`. ``hand`` and ``sheet`` may be set at any time.
    ``version`` is that of the protocol, 1 or 2.
    """

    def __init__(self, faults: Faults | None = None, seed: int = 0, version: int = 1) -> None:
        self.faults = faults or Faults()
        self.version = version
        f = self.faults
        self.rng = np.random.default_rng(seed)
        low = OPENING_LOW if f.jammed_at_rad is None else f.jammed_at_rad
        self.blades = Axis(f.inertia, 4e-3, f.dry_Nm, low, OPENING_HIGH, 0.6)
        self.carriage = Axis(0.35, 3.0, 0.6, ADVANCE_LOW, ADVANCE_HIGH, -0.05)
        self.hand: Hand | None = None
        self.sheet: Sheet | None = None
        self.time_s = 0.0
        self.largest_torque = self.largest_rate = self.largest_force = 0.0
        self.unplugged = False
        self._splitter = wire.Splitter()
        self._hash = wire.schema_hash(WIRE, version)
        self._hand_since = 0.0
        self._arriving: deque[tuple[float, bytes]] = deque()
        self._leaving: deque[tuple[float, bytes]] = deque()
        self._power_on()

    @property
    def tick_s(self) -> float:
        """True length of a tick, whatever the identity states."""
        return self.faults.tick_us * 1e-6

    def forget(self) -> None:
        """Start the largest values again."""
        self.largest_torque = self.largest_rate = self.largest_force = 0.0

    def grasp(self, hand: Hand | None) -> None:
        """Let a hand take the handles; its strokes start now."""
        self.hand = hand
        self._hand_since = self.time_s

    def load(self) -> None:
        """Put in a fresh sheet, unless the fault is that nobody does."""
        self.sheet = None if self.faults.no_sheet else Sheet()

    def tick(self, received: bytes = b"") -> bytes:
        """Pass a tick: take bytes from the host, move, and return bytes to the host."""
        f = self.faults
        self._arriving.append((self.time_s + f.delay_to_device_s, received))
        while self._arriving and self._arriving[0][0] <= self.time_s + 1e-9:
            for payload in self._splitter.payloads(self._arriving.popleft()[1]):
                self._take(payload)
        self._watch()
        self._move()
        self.time_s += self.tick_s
        self._sequence += 1
        if self._streaming:
            self._streamed_s += self.tick_s
            self._send_state()
        return self._due()

    def _power_on(self) -> None:
        self._torque = self._force = 0.0
        self._motor = 0.0
        self._enabled = self._lost = self._fault = False
        self._fault_given = False
        self._cause = self._hold = 0
        self._homed, self._homing_s = not self.faults.not_homed, 0.0
        self._home_ended = 0
        self._silence_s = 0.0
        self._brake_after_ms = self.faults.brake_after_ms
        self._streaming = False
        self._streamed_s = 0.0
        self._sequence = 0
        self._clipped = False
        self._clock_us = 0.0
        self._last_measured: tuple[float, ...] | None = None
        self._last_state: bytes | None = None
        self._restarted = False

    def _take(self, payload: bytes) -> None:
        kind, size = payload[0], len(payload)
        if kind == wire.HELLO and size == 8:
            nonce = struct.unpack_from("<I", payload, 4)[0]
            self._send(self._identity(nonce))
        elif kind == wire.CONFIG and size == 12:
            self._send(self._configured(*struct.unpack_from("<HIf", payload, 2)))
        elif kind == wire.COMMAND and size == 16:
            hold, flags, _, torque, force = struct.unpack_from("<BHIff", payload, 1)
            if math.isfinite(torque) and math.isfinite(force):
                self._hold = hold if self.version >= 2 else 0
                self._obey(flags, torque, force)

    def _obey(self, flags: int, torque: float, force: float) -> None:
        self._enabled = bool(flags & wire.ENABLE) and self._homed
        self._torque, self._force = torque, force
        self._silence_s = 0.0
        self._lost = False
        if flags & wire.CLEAR_FAULT and not (self.faults.fault_stays and self._fault_given):
            self._fault, self._cause = False, 0

    def _latch(self, cause: int) -> None:
        self._cause = self._cause if self._fault else cause
        self._fault = True
        self._end_search(wire.HOME_FAULT)

    def _end_search(self, why: int) -> None:
        self._home_ended = why if self._homing_s > 0.0 else self._home_ended
        self._homing_s = 0.0

    def _stated_cause(self) -> int:
        without_zero = not (self._homed or self._homing_s > 0.0)
        return self._cause or (self._home_ended if without_zero else 0)

    def _configured(self, key: int, nonce: int, value: float) -> bytes:
        status, in_force = 1, 0.0
        if key == wire.STREAM:
            status = 0 if value in (0.0, 1.0) else 2
            self._streaming = value == 1.0 if status == 0 else self._streaming
            in_force = float(self._streaming)
        elif key == wire.BRAKE_AFTER_MS:
            fits = 1.0 <= value <= 1000.0 and not self.faults.refuses_brake_after
            status = 0 if fits else 2
            self._brake_after_ms = value if fits else self._brake_after_ms
            in_force = self._brake_after_ms
        elif key == wire.HOME and self.version >= 2:
            fits = value == 0.0 or (value == 1.0 and not self._fault and not self._enabled)
            status = 0 if fits else 2
            if fits:
                self._end_search(wire.HOME_STOPPED)
                self._homing_s = HOMING_S if value else 0.0
                self._home_ended = 0 if value else self._home_ended
                self._homed = self._homed and not value
            in_force = float(self._homing_s > 0.0)
        return struct.pack("<BBHIf", wire.CONFIG_ECHO, status, key, nonce, in_force)

    def _identity(self, nonce: int) -> bytes:
        f = self.faults
        return struct.pack(
            "<BBHIQ16s16sIIfffffffff",
            wire.IDENTITY, self.version, self._capabilities(), nonce, self._hash,
            b"strange", b"bench-3", 12, f.stated_tick_us or f.tick_us,
            TORQUE_LIMIT, FORCE_LIMIT, OPENING_LOW, OPENING_HIGH, ADVANCE_LOW, ADVANCE_HIGH,
            f.stated_resolution_rad or RESOLUTION_RAD, RESOLUTION_M, f.stated_radius_m or RADIUS_M,
        )  # fmt: skip

    def _capabilities(self) -> int:
        more = wire.HOMES | wire.TORQUE_MEASURED * self.faults.torque_measured
        return wire.FORCE_SENSOR | wire.ADVANCE_MOTOR | more * (self.version >= 2)

    def _watch(self) -> None:
        f = self.faults
        if self._streamed_s >= f.restarts_at_s and not self._restarted:
            self._power_on()
            self._restarted = self._streaming = True
            self._streamed_s = f.restarts_at_s
        if self._streamed_s >= f.fault_at_s and not self._fault_given:
            self._latch(f.fault_cause)
            self._fault_given = True
        if self._homing_s > 0.0:
            self._homing_s -= self.tick_s
            self._homed = self._homing_s <= 0.0 and f.home_finds
            self._home_ended = wire.HOME_TIMED_OUT if self._homing_s <= 0.0 else 0
        silent = 1e3 * self._silence_s >= self._brake_after_ms - 1e-9
        if self._enabled and silent and not f.watchdog_deaf:
            self._lost = True
            self._latch(wire.WATCHDOG)
        self._silence_s += self.tick_s

    def _move(self) -> None:
        f = self.faults
        drives = self._enabled and not self._fault
        drives &= self._hold == 0 or self._silence_s <= self._hold * self.tick_s + 1e-9
        asked = self._torque if drives else 0.0
        given = min(max(asked, -TORQUE_LIMIT), TORQUE_LIMIT) if f.clips else asked
        self._clipped = given != asked
        force = min(max(self._force, -FORCE_LIMIT), FORCE_LIMIT) if drives else 0.0
        brakes = self._fault
        dt = self.tick_s / SUBSTEPS
        share = 1.0 - math.exp(-dt / f.motor_lag_s) if f.motor_lag_s > 0.0 else 1.0
        blades, carriage = self.blades, self.carriage
        for step in range(SUBSTEPS):
            self._motor += share * (given - self._motor)
            motor = f.motor_sign * f.torque_gain * self._motor
            self.largest_torque = max(self.largest_torque, abs(motor))
            self._hand_torque = 0.0
            if self.hand is not None:
                at = self.time_s + step * dt - self._hand_since
                self._hand_torque = self.hand.torque(at, blades.place, blades.rate)
            effort = motor + self._hand_torque - (BRAKE_NM_S * blades.rate if brakes else 0.0)
            if self.sheet is not None:
                effort += self.sheet.resists(blades.place, carriage.place)
            blades.push(effort, dt)
            carriage.push(
                f.advance_motor_sign * force - (40.0 * carriage.rate if brakes else 0.0), dt
            )
            self.largest_rate = max(self.largest_rate, abs(blades.rate))
        self.largest_force = max(self.largest_force, abs(force))

    def _measured(self) -> tuple[float, float, float, float]:
        """Opening, advance, motor torque and handle force, as the sensors give them."""
        f, noise = self.faults, self.rng.standard_normal(3)
        at = self._streamed_s
        middle = OPENING_LOW + OPENING_HIGH
        true = self.blades.place if f.encoder_sign > 0 else middle - self.blades.place
        opening = f.encoder_scale * true + f.encoder_zero_rad + f.encoder_noise_rad * noise[2]
        opening = RESOLUTION_RAD * math.floor(opening / RESOLUTION_RAD)
        carriage = self.carriage.place if f.advance_encoder_sign > 0 else -self.carriage.place
        advance = RESOLUTION_M * math.floor(carriage / RESOLUTION_M)
        torque = 0.0 if f.measured_frozen else f.measured_gain * self._motor
        torque += f.measured_zero_Nm + TORQUE_NOISE_NM * noise[0]
        force = -self._hand_torque / RADIUS_M * f.force_gain
        force += f.force_zero_N + FORCE_NOISE_N * noise[1]
        old = self._last_measured
        if old is not None and at >= f.frozen_at_s:
            return old[0], old[1], old[2], old[3]
        if old is not None and at >= f.encoder_stuck_at_s:
            opening = old[0]
        if old is not None and at >= f.advance_stuck_at_s:
            advance = old[1]
        self._last_measured = (opening, advance, torque, force)
        if at >= f.nan_opening_at_s and self._sequence % f.nan_opening_every == 0:
            opening = math.nan
        if at >= f.beyond_stops_at_s:
            opening = OPENING_HIGH + 0.4
        if f.leap_at_s <= at < f.leap_at_s + 1.5 * self.tick_s:
            opening = max(opening - f.leap_rad, OPENING_LOW)
        if at >= f.nan_torque_at_s:
            torque = math.nan
        return opening, advance, torque, 0.0 if f.force_dead else force

    def _send_state(self) -> None:
        f, at = self.faults, self._streamed_s
        if at < f.clock_stands_at_s:
            step_us = 1e6 * self.tick_s * f.clock_gain
            self._clock_us += -step_us if at >= f.clock_down_at_s else step_us
        flags = wire.MOTOR_ENABLED * (self._enabled and not self._fault)
        flags |= wire.FAULT_LATCHED * self._fault | wire.COMMANDS_LOST * self._lost
        flags |= wire.AT_STOP * self.blades.at_stop | wire.TORQUE_SATURATED * self._clipped
        flags |= wire.ENCODER_FAULT * (at >= f.encoder_fault_at_s)
        if self.version >= 2:
            flags |= wire.NOT_HOMED * (not self._homed) | wire.HOMING * (self._homing_s > 0.0)
        clock = int(self._clock_us) & 0xFFFFFFFF
        third = at >= f.stamps_wrong_at_s and self._sequence % 3 == 0
        if at >= f.clock_random_at_s or third:
            clock = int(self.rng.integers(1 << 32))
        if at >= f.sequence_leaps_at_s and self._sequence % 2 == 0:
            self._sequence += 40
        state = struct.pack(
            "<BBHIIffff",
            wire.STATE,
            self._stated_cause() if self.version >= 2 else 0,
            flags,
            self._sequence & 0xFFFFFFFF,
            clock,
            *self._measured(),
        )
        if self._last_state is not None and at >= f.repeats_at_s:
            state = self._last_state
        self._last_state = state
        if at < f.silent_at_s:
            self._send(state)

    def _send(self, payload: bytes) -> None:
        f = self.faults
        if self.rng.random() < f.drop_share:
            return
        coded = wire.frame(payload)
        if self.rng.random() < f.garble_share:
            where = int(self.rng.integers(len(coded) - 1))
            coded = coded[:where] + bytes([(coded[where] ^ 0x15) or 1]) + coded[where + 1 :]
        copies = 2 if payload[0] == wire.STATE and self.rng.random() < f.duplicate_share else 1
        self._leaving.append((self.time_s + f.delay_to_host_s, coded * copies))

    def _due(self) -> bytes:
        f = self.faults
        if self._streamed_s >= f.unplugged_at_s:
            self.unplugged = True
        if self._streaming and self._streamed_s % f.late_every_s < f.late_for_s:
            return b""
        due = b""
        while self._leaving and self._leaving[0][0] <= self.time_s + 1e-9:
            due += self._leaving.popleft()[1]
        return due
