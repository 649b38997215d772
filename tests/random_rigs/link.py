"""A random rig behind the wire, as a link in virtual time; a host that is away now and then."""

import ctypes
import functools
import hashlib
import math
import os
import shlex
import struct
import subprocess
import tempfile
from collections import deque
from pathlib import Path

import numpy as np

from scissorcal.device import check_echo, check_identity
from scissorcal.errors import DeviceError
from scissorcal.kernel import Config, ConfigEcho, Hello, Identity, LoadEcho, decode, encode

from ..strange_device import wire
from .rigs import RigParameters

HERE = Path(__file__).parent
BUILD = HERE.parents[1] / "build" / "random_rigs"
FLAGS = ("-std=c99", "-O3", "-fno-math-errno", "-Wall", "-Wextra", "-Werror", "-fPIC", "-shared")
WIRE = HERE.parents[1] / "data_schemas" / "wire.json"
FORCE_LIMIT = 20.0
HAND_GRIP, HAND_S = 4.0, 1.5
ADVANCE = (-0.1, 0.24)

FIELDS = """inertia opening closing rise rise_rate viscous fine slow slow_share bristle_damping
gravity gravity_phase cogging cogging_periods motor_lag motor_gain brake low high stop_stiffness
stop_damping obstacle backlash place rate motor z_fine z_slow coupled largest_rate"""


class Joint(ctypes.Structure):
    """Mirror of joint in joint.h."""

    _fields_ = tuple((name, ctypes.c_double) for name in FIELDS.split())


@functools.cache
def library() -> ctypes.CDLL:
    """Compile where needed and load."""
    compiler = shlex.split(os.environ.get("CC", "cc"))
    text = b"".join((HERE / name).read_bytes() for name in ("joint.c", "joint.h"))
    key = hashlib.sha256(text + repr((compiler, FLAGS)).encode()).hexdigest()[:16]
    target = BUILD / f"joint-{key}.so"
    if not target.exists():
        BUILD.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=BUILD) as folder:
            made = Path(folder) / "joint.so"
            command = [*compiler, *FLAGS, str(HERE / "joint.c"), "-o", str(made), "-lm"]
            subprocess.run(command, check=True)
            made.replace(target)
    loaded = ctypes.CDLL(str(target))
    if loaded.joint_size() != ctypes.sizeof(Joint):
        raise RuntimeError("joint.h and link.py disagree about the layout of joint.")
    double = ctypes.c_double
    loaded.joint_pass.argtypes = [ctypes.POINTER(Joint), double, ctypes.c_int] + [double] * 3
    loaded.joint_pass.restype = None
    return loaded


class RigLink:
    """A link as scissorcal takes it (``identity``, ``configure``, ``exchange``, ``close``).

    ``largest_rate`` (rad/s) and ``travel`` (rad) are the truth while the motor was on.
    """

    def __init__(self, rig: RigParameters) -> None:
        self.rig = rig
        self.name = f"rig {rig.seed}"
        self.rng = np.random.default_rng([rig.seed, 1])
        start = rig.low + self.rng.uniform(0.3, 0.7) * (rig.high - rig.low)
        dry = 0.5 * (rig.coulomb_opening + rig.coulomb_closing)
        self.joint = Joint(
            inertia=rig.inertia, opening=rig.coulomb_opening, closing=rig.coulomb_closing,
            rise=rig.rise_share * dry, rise_rate=rig.rise_rate, viscous=rig.viscous,
            fine=rig.fine_rad, slow=rig.slow_rad, slow_share=rig.slow_share,
            bristle_damping=rig.bristle_damping_share
            * math.sqrt(dry / rig.fine_rad * rig.inertia),
            gravity=rig.gravity, gravity_phase=rig.gravity_phase,
            cogging=rig.cogging, cogging_periods=rig.cogging_periods,
            motor_lag=rig.motor_lag, motor_gain=rig.motor_sign * rig.motor_gain, brake=0.03,
            low=rig.low, high=rig.high, stop_stiffness=60.0, stop_damping=0.05,
            obstacle=rig.obstacle, backlash=rig.backlash,
            place=start, rate=0.0, motor=0.0, z_fine=0.0, z_slow=0.0, coupled=start,
            largest_rate=0.0,
        )  # fmt: skip
        self._library = library()
        self.time_s = 0.0
        self.largest_rate = 0.0
        self._splitter, self._host_splitter = wire.Splitter(), wire.Splitter()
        self._hash = wire.schema_hash(WIRE, 1)
        self._arriving: deque[tuple[int, bytes]] = deque()
        self._out = b""
        self._tick = 0
        self._torque, self._flags, self._silence_ms = 0.0, 0, 0.0
        self._fault = self._lost = self._streaming = False
        self._brake_after_ms = 10.0
        self._clock_us = float(self.rng.integers(0, 2**32))
        self._stuck: float | None = None
        self._nonce = 0
        self._away_until = 0
        self._pass(0.5)
        answer = self._ask(lambda nonce: encode(Hello(nonce=nonce)), Identity)
        assert isinstance(answer, Identity)
        self.identity: Identity = check_identity(self.name, answer)

    # -- the link
    @property
    def virtual_time(self) -> float:
        return self.time_s

    @property
    def garbled(self) -> int:
        return self._host_splitter.garbled

    def exchange(self, frame: bytes | None) -> list[bytes]:
        """Send a frame, pass a tick (or those for which the host is away), return the states."""
        ticks = 1
        rig = self.rig
        tick_s = 1e-6 * rig.tick_us
        if rig.stalls_per_s and self.rng.random() < rig.stalls_per_s * tick_s:
            ticks += max(1, round(rig.stall_s * self.rng.uniform(0.3, 1.0) / tick_s))
        found: list[bytes] = []
        for index in range(ticks):
            found += self._host_splitter.payloads(self._one(frame if index == 0 and frame else b""))
        return [payload for payload in found if payload[0] == wire.STATE]

    def configure(self, key: int, value: float) -> float:
        answer = self._ask(lambda nonce: encode(Config(int(key), nonce, float(value))), ConfigEcho)
        assert isinstance(answer, ConfigEcho)
        check_echo(self.name, answer, int(key), float(value))
        return float(answer.value)

    def load(self, message: object) -> LoadEcho:
        """It renders nothing itself."""
        raise DeviceError(f"{self.name} takes no package.")

    def close(self) -> None:
        """Nothing to release."""

    def _ask(self, question, kind):  # type: ignore[no-untyped-def]
        for _ in range(5):
            self._nonce += 1
            sent = question(self._nonce)
            for _ in range(200):
                for payload in self._host_splitter.payloads(self._one(sent)):
                    reply = decode(payload) if payload[0] != wire.STATE else None
                    if isinstance(reply, kind):
                        return reply
                sent = b""
        raise DeviceError(f"{self.name} does not answer.")

    # -- the world
    def move_by_hand(self, share: float) -> None:
        """A hand moves the blades to a share of their way and, half open, lets go."""
        rig = self.rig
        beyond = {0.0: rig.low - 0.03, 1.0: rig.high + 0.03}
        goal = beyond.get(share, rig.low + share * (rig.high - rig.low))
        self._pass(HAND_S, hand=goal, grip=HAND_GRIP)
        if share in beyond:
            self._held = (goal, HAND_GRIP)
        else:
            self._held = (0.0, 0.0)
            self._pass(0.3)

    _held = (0.0, 0.0)

    def _pass(self, seconds: float, *, hand: float = 0.0, grip: float = 0.0) -> None:
        """Time passes without the device's protocol, motors off."""
        self._library.joint_pass(ctypes.byref(self.joint), seconds, 0, 0.0, hand, grip)
        ticks = round(seconds * 1e6 / self.rig.tick_us)
        self._tick += ticks
        self.time_s += seconds
        self._clock_us += ticks * self.rig.tick_us
        self._quiet_s = seconds

    # -- the device
    def _one(self, received: bytes) -> bytes:
        rig = self.rig
        self._arriving.append((self._tick + rig.delay_ticks, received))
        while self._arriving and self._arriving[0][0] <= self._tick:
            for payload in self._splitter.payloads(self._arriving.popleft()[1]):
                self._take(payload)
        tick_s = rig.tick_us * 1e-6
        enabled = bool(self._flags & wire.ENABLE)
        if enabled and self._silence_ms >= self._brake_after_ms - 1e-9:
            self._lost = self._fault = True
        self._silence_ms += 1e3 * tick_s
        mode = 2 if self._fault else 1 if enabled else 0
        limit = rig.torque_limit
        torque = min(max(self._torque, -limit), limit)
        saturated = enabled and torque != self._torque
        before = self.joint.largest_rate
        self.joint.largest_rate = 0.0
        self._library.joint_pass(ctypes.byref(self.joint), tick_s, mode, torque, *self._held)
        if self._flags & wire.ENABLE or abs(self.joint.motor) > 1e-6:
            self.largest_rate = max(self.largest_rate, self.joint.largest_rate)
        self.joint.largest_rate = max(before, self.joint.largest_rate)
        self.time_s += tick_s
        self._tick += 1
        if self._streaming:
            flags = wire.MOTOR_ENABLED * (mode == 1) | wire.FAULT_LATCHED * self._fault
            flags |= wire.COMMANDS_LOST * self._lost | wire.TORQUE_SATURATED * saturated
            self._send(self._state(flags))
        sent, self._out = self._out, b""
        return sent

    def _send(self, payload: bytes) -> None:
        self._out += wire.frame(payload)

    def _take(self, payload: bytes) -> None:
        kind, size = payload[0], len(payload)
        if kind == wire.HELLO and size == 8:
            self._send(self._identity(struct.unpack_from("<I", payload, 4)[0]))
        elif kind == wire.CONFIG and size == 12:
            self._send(self._configured(*struct.unpack_from("<HIf", payload, 2)))
        elif kind == wire.COMMAND and size == 16:
            flags, _, torque, _ = struct.unpack_from("<HIff", payload, 2)
            if not math.isfinite(torque) or self.rng.random() < self.rig.commands_lost:
                return
            self._flags, self._torque = flags, torque
            self._silence_ms, self._lost = 0.0, False
            if flags & wire.CLEAR_FAULT:
                self._fault = False

    def _configured(self, key: int, nonce: int, value: float) -> bytes:
        status, in_force = 1, 0.0
        if key == wire.STREAM:
            status, self._streaming, in_force = 0, value == 1.0, value
        elif key == wire.BRAKE_AFTER_MS:
            status = 0 if 1.0 <= value <= 1000.0 else 2
            self._brake_after_ms = value if status == 0 else self._brake_after_ms
            in_force = self._brake_after_ms
        return struct.pack("<BBHIf", wire.CONFIG_ECHO, status, key, nonce, in_force)

    def _identity(self, nonce: int) -> bytes:
        rig = self.rig
        return struct.pack(
            "<BBHIQ16s16sIIfffffffff",
            wire.IDENTITY, 1, wire.FORCE_SENSOR, nonce, self._hash, b"random",
            str(rig.seed).encode(), 3, rig.tick_us, rig.torque_limit, FORCE_LIMIT,
            rig.low, rig.high, *ADVANCE, rig.step, 5e-6, rig.stated_radius,
        )  # fmt: skip

    def _state(self, flags: int) -> bytes:
        rig, joint = self.rig, self.joint
        noise = self.rng.standard_normal(3)
        true = joint.coupled if rig.backlash else joint.place
        if rig.encoder_sign < 0:
            true = rig.low + rig.high - true
        place = rig.low + rig.encoder_scale * (true - rig.low) if rig.encoder_scale != 1 else true
        counts = math.floor(place / rig.step + rig.encoder_jitter_steps * noise[0])
        opening = rig.step * counts + rig.encoder_zero
        if rig.stuck:
            self._stuck = opening = opening if self._stuck is None else self._stuck
        torque = rig.report_gain * joint.motor + rig.torque_offset + rig.torque_noise * noise[1]
        torque = rig.torque_step * math.floor(torque / rig.torque_step + 0.5)
        force = -self._held[1] * (self._held[0] - joint.place) / 0.06
        force = 0.01 * math.floor((force + 0.02 * noise[2]) / 0.01 + 0.5)
        step = {"right": rig.tick_us, "down": -rig.tick_us, "stopped": 0}.get(rig.clock, 0)
        self._clock_us += step
        clock = self._clock_us
        if rig.clock == "random":
            clock = float(self.rng.integers(0, 2**32))
        return struct.pack(
            "<BBHIIffff", wire.STATE, 0, flags, self._tick & 0xFFFFFFFF,
            int(clock) & 0xFFFFFFFF, opening, 0.0, torque, force,
        )  # fmt: skip
