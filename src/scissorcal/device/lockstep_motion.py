"""The servo in this process and in virtual time: one exchange, one tick."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Protocol, runtime_checkable

import numpy as np

from scissorcal.aliases import Array
from scissorcal.device.link import Link
from scissorcal.device.motion import (
    BLOCK_S,
    RELEASE_COMMANDS,
    SILENCE_S,
    LoopTask,
    Motion,
    MotionReport,
    Samples,
    Stages,
)
from scissorcal.device.timing import FeltLag
from scissorcal.errors import DeviceError
from scissorcal.kernel import (
    CONTROL_DTYPE,
    SAMPLE_DTYPE,
    ConfigKey,
    Contour,
    ControlTask,
    Mode,
    Servo,
    ServoConfig,
    StopReason,
)


@runtime_checkable
class Exchanging(Link, Protocol):
    """A link in virtual time: each exchange is one tick."""

    @property
    def virtual_time(self) -> float: ...

    def exchange(self, command_frame: bytes | None) -> list[bytes]: ...


class LockstepMotion(Motion):
    """Runs the servo of the loop frame by frame; made by open_motion.

    The host's clock is the virtual one, in nanoseconds since the rig was switched on.
    """

    def __init__(
        self,
        link: Exchanging,
        config: ServoConfig,
        task: LoopTask,
        every_s: float = BLOCK_S,
    ) -> None:
        super().__init__(link.identity, every_s)
        self._link = link
        self._servo: Servo = Servo(task.tables, config, task.control, task.pieces)
        self._control_rows: list[bytes] = []
        self._frame: bytes | None = None
        self._ticks = max(1, round(every_s / self.tick_s))
        self._failure: DeviceError | None = None
        self._last_sequence = -1
        self._silent_s = 0.0
        self._garbled_before = link.garbled
        before_s = link.virtual_time
        self._passed_ns = round(1e9 * link.virtual_time)
        link.configure(ConfigKey.STREAM, 1.0)
        self._round_trip_s = link.virtual_time - before_s
        self.step()

    @property
    def stop_reason(self) -> StopReason:
        return StopReason.HANGUP if self._failure else self._servo.stop_reason

    @property
    def garbled(self) -> int:
        return self._link.garbled - self._garbled_before

    def set_path(self, place: Array, rate: Array, force: Array, stage: Stages) -> None:
        self._stop_following()
        self._task().set_path(place, rate, force, stage)

    def send_contour(self, contour: Contour) -> None:
        self._task().send(contour)

    def control_samples(self) -> Samples:
        rows, self._control_rows = b"".join(self._control_rows), []
        return np.frombuffer(rows, dtype=CONTROL_DTYPE)

    @property
    def now_s(self) -> float:
        return self._link.virtual_time

    def configure(self, key: int, value: float) -> float:
        return self._link.configure(key, value)

    @contextmanager
    def paused(self) -> Iterator[None]:
        """Virtual time stops during a pause."""
        self._go_idle()
        yield

    def report(self) -> MotionReport:
        return MotionReport(
            counters=self._servo.counters,
            ledger=self._servo.ledger,
            stop_reason=self.stop_reason,
            garbled=self.garbled,
            stalls=0,
            unsent=0,
            overrun=0,
            latency=None,
            interval=None,
            lag=FeltLag.of(self._servo.lag, self.tick_s, self._round_trip_s),
            rights=None,
            watched=self._servo.watched,
            fault_cause=self.fault_cause,
        )

    def close(self) -> None:
        if self._failure is not None:
            return
        self._servo.stop()
        try:
            for payload, came in self._received(RELEASE_COMMANDS):
                self._frame = self._servo.answer(payload, **came)
            self._link.configure(ConfigKey.STREAM, 0.0)
        except DeviceError as error:
            self._failure = error

    def step(self) -> Samples:
        """Let a block of virtual time pass, as fast as the computer can."""
        stopped = self.stop_reason is not StopReason.NONE
        rows: list[bytes] = []
        try:
            for payload, came in self._received(0 if stopped else self._ticks):
                self._frame = self._servo.answer(payload, **came)
                rows.append(self._servo.telemetry().tobytes())
                if self._servo.mode is Mode.CONTROL:
                    self._control_rows.append(self._servo.control_telemetry().tobytes())
        except DeviceError as error:
            self._failure = error
        samples = self._without_repeats(np.frombuffer(b"".join(rows), dtype=SAMPLE_DTYPE))
        self._silent_s = 0.0 if len(samples) else self._silent_s + self._ticks * self.tick_s
        if self._silent_s > SILENCE_S and not stopped:
            silence = StopReason.SILENCE
            self._failure = DeviceError(silence.sentence, silence.name)
        return self._arrived(samples)

    def _received(self, ticks: int) -> Iterator[tuple[bytes, dict[str, Any]]]:
        """The frames of some ticks, each with when it came; each tick sends the newest command."""
        for _ in range(ticks):
            payloads = self._link.exchange(self._frame)
            self._frame = None
            now_ns = round(1e9 * self._link.virtual_time)
            for left, payload in zip(range(len(payloads) - 1, -1, -1), payloads, strict=True):
                passed_us = round((now_ns - self._passed_ns) * 1e-3)
                self._passed_ns = now_ns
                yield (
                    payload,
                    {"host_time_ns": now_ns, "answered": left == 0, "passed_us": passed_us},
                )

    def _without_repeats(self, samples: Samples) -> Samples:
        """Drop the samples of repeated frames, for which the servo returns the previous sample."""
        sequence = samples["sequence"].astype(np.int64)
        fresh = np.diff(sequence, prepend=self._last_sequence) != 0
        if len(sequence):
            self._last_sequence = int(sequence[-1])
        return np.asarray(samples[fresh])

    def _why_lost(self) -> DeviceError | None:
        return self._failure

    def _go_idle(self) -> None:
        self.engage(Mode.IDLE)
        self.step()

    def _task(self) -> ControlTask:
        if self._servo.control is None:
            raise ValueError("This motion has no configuration of CONTROL.")
        return self._servo.control
