"""Talk with a rig state by state: what is heard, what is answered, and what may never happen.

A stage of the probe is a generator: it yields the command that answers a state and gets the next
state back, so that it reads from top to bottom. Limits are kept here, whatever a stage asks for.
"""

import select
import time
from collections.abc import Generator, Iterator
from contextlib import AbstractContextManager, contextmanager, suppress
from dataclasses import dataclass, replace
from typing import NamedTuple, TypeVar, get_type_hints

import numpy as np
from numpy.typing import NDArray

from scissorcal.device.link import Link, PortLink
from scissorcal.device.lockstep_motion import Exchanging
from scissorcal.device.motion import RELEASE_COMMANDS, SILENCE_S
from scissorcal.device.probe.unsound import STAMPS, what_is_wrong
from scissorcal.device.upload import end_rendering
from scissorcal.errors import DeviceError
from scissorcal.kernel import (
    PROTOCOL_VERSION,
    Command,
    CommandFlag,
    ConfigKey,
    State,
    StateFlag,
    StopReason,
    decode,
    encode,
)
from scissorcal.kernel.loop import STALL_TICKS
from scissorcal.kernel.servo import STUCK_FRAMES

LINE = "the line, before a motor runs"
LISTEN_S = 5e-3
"""One wait for states, as in sc_loop.c: one that takes twice as long is this computer's delay."""
SENSORS = "the sensors, before a motor runs"
MOTORS = "the motors, before they run in earnest"
"""What checks of a probe guard begins so."""
REAL_TIME = "real_time"
"""Fact: 1 where the probe ran on a port, 0 in virtual time."""


Done = TypeVar("Done")

RATE_OVER_S = 4e-3
"""Rates are taken over four ticks of 1 kHz: a step of 2 pi / 20,000 then is 0.08 rad/s."""
U32 = 2**32
MEASURED = tuple(name for name, kind in get_type_hints(State).items() if kind is float)
"""The numbers that a device measures, by their names in STATE."""
HEARD = np.dtype(
    [
        ("sequence", np.int64),
        ("device_us", np.int64),
        ("host_s", np.float64),
        *((name, np.float64) for name in MEASURED),
        ("flags", np.int64),
        ("torque", np.float64),
        ("force", np.float64),
        ("answer_flags", np.int64),
    ]
)
"""A state with its answer: opening and advance are the first numbers. ``answer_flags`` is -1 for a
state that was not answered. Sequence and clock are unwrapped; signs of torque are the corrected
ones."""


class Answer(NamedTuple):
    """What the motors shall do: a torque (N m) and a force (N) with ENABLE, or nothing."""

    torque: float = 0.0
    force: float = 0.0
    enable: bool = True
    clear: bool = False
    hold_ticks: int = 0
    """Ticks that the effort acts, zero after them; a device of version 1 holds it (0 does)."""


RELEASE = Answer(enable=False)
Stage = Generator[Answer | None, State, Done]
"""Yields answers, or None to withhold one."""


class RunawayError(DeviceError):
    """The blades or the carriage moved faster or farther than the probe may move them."""


class StalledError(RunawayError):
    """The same, after this computer answered late: it held a torque for too long."""


@dataclass(frozen=True)
class Bounds:
    """The largest torque (N m), force (N), rates (rad/s, m/s) and way (rad, m) of a probe."""

    torque_Nm: float
    force_N: float
    rate_rad_per_s: float
    speed_m_per_s: float
    angle_rad: float
    way_m: float


class Talk(AbstractContextManager["Talk"]):
    """Runs stages on a link; leaving the context releases the motors and ends the stream.

    ``heard`` gives what was heard since a `mark`. ``largest_torque`` (N m) is the largest that was
    asked for, ``largest_rate`` (rad/s) the largest that was seen while the motors were on.
    """

    def __init__(self, link: Link, bounds: Bounds, motor_sign: int = 1) -> None:
        self.link = link
        self.identity = link.identity
        self.name = str(getattr(link, "name", "The device"))
        self.bounds = bounds
        self.largest_torque = self.largest_rate = 0.0
        self.duplicates = 0
        self.late_ticks = 1
        """Ticks from a state to what its answer does, as `lag` found them."""
        self.expiry_s = 0.01
        """Silence after which the device brakes; as set."""
        self.pushing = False
        """Whether the motors have begun to push: sensors are then watched between pushes, too."""
        self.rate_over_s = RATE_OVER_S
        """Time over which rates are taken; longer for an encoder that jitters."""
        self._sign = motor_sign
        self._virtual = link if isinstance(link, Exchanging) else None
        self._rows: list[tuple[float, ...]] = []
        self._origin: tuple[float, float] | None = None
        self._frame: bytes | None = None
        self._listened_at: float | None = None
        self._restarted = False
        self._held_up: list[tuple[int, float]] = []
        """Each time this computer did not listen: rows before it, and how long (s)."""
        end_rendering(link)
        link.configure(ConfigKey.STREAM, 1.0)

    @property
    def tick_s(self) -> float:
        """Seconds between two states, as the device states it."""
        return self.identity.tick_us * 1e-6

    def ticks(self, seconds: float) -> int:
        """Give the number of ticks in a time, at least one."""
        return max(1, round(seconds / self.tick_s))

    @property
    def sequence(self) -> int:
        """Ticks that the device has counted, unwrapped, as of the newest state."""
        return int(self._rows[-1][0])

    def mark(self) -> int:
        """Where `heard` may begin later."""
        return len(self._rows)

    def heard(self, since: int = 0) -> NDArray[np.void]:
        """What was heard since a mark, shape (n,), HEARD."""
        return np.array(self._rows[since:], dtype=HEARD)

    def play(self, stage: Stage[Done], *, free: bool = False) -> Done:
        """Run a stage to its end and return what it returns.

        Torque and force are clipped to the bounds; motion beyond them ends in a RunawayError with
        the motors off. ``free`` does not bound the way, for a stage that goes far on purpose.
        Raises DeviceError where the device falls silent.
        """
        self._origin = None
        try:
            next(stage)
            while True:
                state = self._next_state()
                answer = stage.send(state)
                if self.pushing or answer is None or answer.enable:
                    self._check(state)
                if answer is not None and answer.enable:
                    self._guard(state, free)
                self._answer(state, answer)
        except StopIteration as over:
            return over.value  # type: ignore[no-any-return]

    @contextmanager
    def allowing(self, torque_Nm: float) -> Iterator[None]:
        """Allow a larger torque for a stage that has bounded its effect otherwise."""
        before = self.bounds
        self.bounds = replace(before, torque_Nm=torque_Nm)
        try:
            yield
        finally:
            self.bounds = before

    @contextmanager
    def braking_after(self, milliseconds: float) -> Iterator[None]:
        """Set the device's watchdog for some stages; a device that refuses keeps its own."""
        before = self.expiry_s
        try:
            self.expiry_s = 1e-3 * self.link.configure(ConfigKey.BRAKE_AFTER_MS, milliseconds)
        except DeviceError:
            yield
            return
        try:
            yield
        finally:
            self.expiry_s = 1e-3 * self.link.configure(ConfigKey.BRAKE_AFTER_MS, 1e3 * before)

    @contextmanager
    def paused(self) -> Iterator[None]:
        """Motors and stream off, while a person is asked for something."""
        self.release()
        self.link.configure(ConfigKey.STREAM, 0.0)
        yield
        self.link.configure(ConfigKey.STREAM, 1.0)
        self._listened_at = None

    def refuse_not_homed(self) -> None:
        """Raise DeviceError where the device does not know the zero of its encoders."""
        if self._next_state().flags & StateFlag.NOT_HOMED:
            raise DeviceError(
                f"{self.name}: {StopReason.NOT_HOMED.sentence}", StopReason.NOT_HOMED.name
            )

    def release(self) -> None:
        """Switch the motors off, three times, in case a command is lost.

        The first three do not wait for a state: a device that fell silent may still listen.
        """
        self._send_release()
        with suppress(DeviceError):
            for _ in range(RELEASE_COMMANDS):
                self._answer(self._next_state(), RELEASE)

    def _send_release(self) -> None:
        """Send zero without ENABLE to the last state, whether or not another one comes."""
        self._frame = None
        if not self._rows:
            return
        command = Command(0, int(self._rows[-1][0]) % U32, 0.0, 0.0)
        for _ in range(RELEASE_COMMANDS):
            with suppress(DeviceError, OSError):
                if isinstance(self.link, PortLink):
                    self.link.send(command)
                else:
                    self._frame = encode(command)
                    for state in self._pass():
                        self._note(state)

    def __exit__(self, *_: object) -> None:
        self.release()
        with suppress(DeviceError):
            self._pass()
            self.link.configure(ConfigKey.STREAM, 0.0)

    def _next_state(self) -> State:
        """Wait for the next state; of several at once the newest, as the protocol asks."""
        silent_s = 0.0
        while silent_s < SILENCE_S:
            began = self._now()
            states = self._pass()
            fresh = [state for state in states if self._note(state)]
            if fresh:
                return fresh[-1]
            passed_s = self._now() - began
            if self._virtual is None:
                passed_s = min(passed_s, 2.0 * LISTEN_S)  # beyond it this computer did not listen
            silent_s += max(passed_s, 0.0 if states else 1e-6)
        held_s = sum(seconds for row, seconds in self._held_up if row == len(self._rows))
        first = (
            f"This computer did not listen for {1e3 * held_s:.0f} ms, and then "
            if held_s > 0.0
            else ""
        )
        raise DeviceError(
            f"{first}{self.name} stopped sending STATE frames; check its power and the cable, then "
            "start again."
        )

    def held_up(self, since: int = 0) -> list[tuple[int, float]]:
        """Times in which this computer did not listen: rows `heard` before, and how long (s)."""
        return [(row - since, seconds) for row, seconds in self._held_up if row > since]

    def _pass(self) -> list[State]:
        """Send what waits to be sent; return what arrives."""
        link, frame = self.link, self._frame
        self._frame = None
        if isinstance(link, PortLink):
            began = time.monotonic()
            ready = select.select([link], [], [], LISTEN_S)[0]
            waited_s = time.monotonic() - min(began, self._listened_at or began)
            self._listened_at = time.monotonic()
            if waited_s > 2.0 * LISTEN_S:
                self._held_up.append((len(self._rows), waited_s))
            if not ready:
                return []
            return [found for found in link.receive(0.0) if isinstance(found, State)]
        assert self._virtual is not None
        found = [decode(payload) for payload in self._virtual.exchange(frame)]
        return [message for message in found if isinstance(message, State)]

    def _note(self, state: State) -> bool:
        """Keep a state; False for one that repeats the last."""
        sequence, device_us = state.sequence, state.device_us
        if self._rows:
            last = self._rows[-1]
            passed = (sequence - int(last[0])) % U32
            if passed == 0:
                self.duplicates += 1
                return False
            sequence = int(last[0]) + passed
            device_us = int(last[1]) + (device_us - int(last[1])) % U32
            self._restarted = self._restarted or passed > U32 // 2
        corrected = state._replace(motor_torque=self._sign * state.motor_torque)
        numbers = (getattr(corrected, name) for name in MEASURED)
        stamps = (sequence, device_us, self._now())
        self._rows.append((*stamps, *numbers, state.flags, 0.0, 0.0, -1))
        return True

    def _now(self) -> float:
        """The host's clock in seconds: the virtual one where time is virtual."""
        return self._virtual.virtual_time if self._virtual is not None else time.monotonic()

    def _answer(self, state: State, answer: Answer | None) -> None:
        if answer is None:
            return
        torque = _clipped(answer.torque, self.bounds.torque_Nm) if answer.enable else 0.0
        force = _clipped(answer.force, self.bounds.force_N) if answer.enable else 0.0
        self.largest_torque = max(self.largest_torque, abs(torque))
        flags = (CommandFlag.ENABLE if answer.enable else 0) | (
            CommandFlag.CLEAR_FAULT if answer.clear else 0
        )
        self._rows[-1] = (*self._rows[-1][:-3], torque, force, int(flags))
        hold = answer.hold_ticks if self.identity.protocol_version >= PROTOCOL_VERSION else 0
        command = Command(int(flags), state.sequence, self._sign * torque, force, hold)
        if isinstance(self.link, PortLink):
            self.link.send(command)
        else:
            self._frame = encode(command)

    def _check(self, state: State) -> None:
        """Raise where sensors or clock show what no motor may run with."""
        wrong = what_is_wrong(state, self.identity, self.heard(-1 - STAMPS), self._restarted)
        if wrong:
            self.release()
            raise RunawayError(f"{self.name}: {wrong} The motors are off.")

    def _guard(self, state: State, free: bool) -> None:
        """Raise where the blades or the carriage move more than the probe may move them."""
        place = (state.opening, state.advance)
        if self._origin is None:
            self._origin = place
        if state.flags & StateFlag.FAULT_LATCHED:
            return
        rate, speed = self._rates()
        self.largest_rate = max(self.largest_rate, rate)
        bounds, origin = self.bounds, self._origin
        far = not free and abs(place[0] - origin[0]) > bounds.angle_rad
        off = not free and abs(place[1] - origin[1]) > bounds.way_m
        if rate > bounds.rate_rad_per_s or speed > bounds.speed_m_per_s or far or off:
            last = max(abs(row[-3]) for row in self._rows[-50:])
            self.release()
            what = (
                f"the blades moved by {abs(place[0] - origin[0]):.3g} rad at {rate:.2g} rad/s"
                if rate > bounds.rate_rad_per_s or far
                else f"the carriage moved by {1e3 * abs(place[1] - origin[1]):.3g} mm at "
                f"{speed:.2g} m/s"
            )
            late = np.diff([row[2] for row in self._rows[-STUCK_FRAMES:]])
            stalled = bool(np.any(late > STALL_TICKS * self.tick_s))
            allowed = (
                f"rig.probe.largest_angle_deg = {np.degrees(bounds.angle_rad):.3g} and "
                f"rig.probe.largest_rate_rad_per_s = {bounds.rate_rad_per_s:g}"
            )
            raise (StalledError if stalled else RunawayError)(
                f"Not determined: {what} after at most {1e3 * last:.3g} mN m of the probe, beyond "
                f"what the recipe allows ({allowed}), at {self.name}. Check that no hand, spring "
                "or gravity moves them and that the encoder's counts are right, or raise these "
                "keys. The motors are off."
            )

    def _rates(self) -> tuple[float, float]:
        """Magnitudes of the rates (rad/s, m/s) over the last few ticks."""
        now = self._rows[-1]
        span = max(2, self.ticks(self.rate_over_s))
        then = self._rows[-1 - span] if len(self._rows) > span else self._rows[0]
        time_s = (now[0] - then[0]) * self.tick_s
        if time_s <= 0.0:
            return 0.0, 0.0
        return abs(now[3] - then[3]) / time_s, abs(now[4] - then[4]) / time_s


def _clipped(value: float, limit: float) -> float:
    return min(max(value, -limit), limit)
