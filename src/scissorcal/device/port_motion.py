"""The servo on a port, in real time: a separate process runs it, this one supervises."""

import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress

from scissorcal.aliases import Array
from scissorcal.device.answers import check_echo
from scissorcal.device.link import Link, PortLink
from scissorcal.device.lockstep_motion import Exchanging, LockstepMotion
from scissorcal.device.motion import BLOCK_S, IDLE, LoopTask, Motion, MotionReport, Samples, Stages
from scissorcal.device.servo_process import ServoProcess
from scissorcal.device.timing import FeltLag, LoopRights, Percentiles
from scissorcal.device.upload import end_rendering
from scissorcal.errors import DeviceError
from scissorcal.kernel import (
    Command,
    ConfigKey,
    Contour,
    LoopBlock,
    Mode,
    ServoConfig,
    StopReason,
)


def open_motion(
    link: Link, config: ServoConfig, task: LoopTask = IDLE, every_s: float = BLOCK_S
) -> Motion:
    """Start the servo on a link: in a separate process on a port, in this process in virtual time.

    Samples come in blocks of about ``every_s``. It starts idle, with the rig's position known. A
    fault that the device has latched is cleared, and RENDER is 0. Raises DeviceError, before a
    motor runs, where the device does not know the zero of its encoders.

    >>> import numpy as np
    >>> from scissorcal.device.lockstep import LockstepLink
    >>> link = LockstepLink("office-paper", np.random.default_rng(1))
    >>> limits = ServoConfig(torque_limit=1, torque_slew=200, force_limit=0, force_slew=0)
    >>> with open_motion(link, limits) as motion:
    ...     samples = np.concatenate(list(motion.idle(0.2)))
    >>> len(samples), bool(samples["torque_command"].any())
    (200, False)
    """
    end_rendering(link)
    motion: Motion
    if isinstance(link, Exchanging):
        motion = LockstepMotion(link, config, task, every_s)
    elif isinstance(link, PortLink):
        motion = PortMotion(link, config, task, every_s)
    else:
        raise TypeError(f"A {type(link).__name__} is neither a port nor a lockstep link.")
    motion.refuse_not_homed()
    return motion


CONFIGURE_ATTEMPTS = 3
IDLE_TIMEOUT_S = 2.0
FIRST_POSITION_TIMEOUT_S = 2.0
SPARE_S = 30.0
"""Room in the shared memory beyond the longest reference, for the approach to its start."""


class PortMotion(Motion):
    """Controls a ServoProcess through its shared memory block; made by open_motion.

    The heartbeat comes from a thread, as long as :meth:`step` is called: see Heartbeat.
    """

    def __init__(
        self,
        link: PortLink,
        config: ServoConfig,
        task: LoopTask,
        every_s: float = BLOCK_S,
    ) -> None:
        super().__init__(link.identity, every_s)
        self._link = link
        self._servo = self._block = LoopBlock.create(
            config,
            task.tables,
            control=task.control,
            pieces=task.pieces,
            reference_capacity=task.longest_reference + round(SPARE_S * 1e6 / config.tick_us),
        )
        self._process = ServoProcess(link, self._block)
        self._drain_at = 0.0
        self._final: MotionReport | None = None
        try:
            self._process.start()
            until = time.monotonic() + FIRST_POSITION_TIMEOUT_S
            while self._position is None and time.monotonic() < until:
                self.step()
        except BaseException:
            self.close()
            raise

    @property
    def pid(self) -> int | None:
        """Process id of the servo."""
        return self._process.pid

    @property
    def stop_reason(self) -> StopReason:
        """As the loop reports it, HANGUP where its process died."""
        if not self._process.alive and self._block.stop_reason is StopReason.NONE:
            return StopReason.HANGUP
        return self._block.stop_reason

    @property
    def held_up_s(self) -> float:
        return self._block.held_up_lately_s

    @property
    def garbled(self) -> int:
        return self._block.line.garbled

    def set_path(self, place: Array, rate: Array, force: Array, stage: Stages) -> None:
        self._stop_following()
        self._block.set_path(place, rate, force, stage)

    def send_contour(self, contour: Contour) -> None:
        self._block.control.send(contour)

    def control_samples(self) -> Samples:
        return self._block.control.read()

    @property
    def now_s(self) -> float:
        return time.monotonic()

    def configure(self, key: int, value: float) -> float:
        for _ in range(CONFIGURE_ATTEMPTS):
            echo = self._block.configure(key, value)
            if echo is not None:
                check_echo(self._link.name, echo, key, value)
                return echo.value
            if self.stop_reason is not StopReason.NONE:
                raise self._stopped()
        raise DeviceError(
            f"{self._link.name} did not confirm setting {key:#x} = {value:g} while it streamed: "
            "check the cable."
        )

    @contextmanager
    def paused(self) -> Iterator[None]:
        """Motors off; the heartbeat goes on, and samples of this time are dropped."""
        self._go_idle()
        with self._process.heartbeat.held():
            yield
        self._block.read()
        self._drain_at = 0.0

    def report(self) -> MotionReport:
        if self._final is not None:
            return self._final
        block, line = self._block, self._block.line
        return MotionReport(
            counters=block.counters,
            ledger=block.ledger,
            stop_reason=block.stop_reason,
            garbled=line.garbled,
            stalls=line.stalls,
            unsent=line.unsent,
            overrun=line.lost_samples,
            latency=Percentiles.counted(block.latency),
            interval=Percentiles.counted(block.interval),
            lag=FeltLag.of(block.lag, self.tick_s, self._process.round_trip_s),
            rights=LoopRights(*block.rights),
            watched=block.watched,
            held_up_s=block.held_up_s,
            fault_cause=block.fault_cause,
        )

    def close(self) -> None:
        if self._final is not None:
            return
        self._process.close()
        self._final = self.report()
        self._block.close()
        with suppress(DeviceError):  # an unplugged device has released its motors anyway
            self._link.send(Command(0, 0, 0.0, 0.0))
            self._link.configure(ConfigKey.STREAM, 0.0)
            self._link.flush()

    def step(self) -> Samples:
        """Wait until a block after the last call, or the end of the loop; empty the ring buffer."""
        self._process.heartbeat.seen()
        self._drain_at = max(self._drain_at + self.every_s, time.monotonic())
        left = self._drain_at - time.monotonic()
        if left > 0 and self._process.alive:
            time.sleep(left)  # in one piece: each time this process wakes may delay the loop
        return self._arrived(self._block.read())

    def _why_lost(self) -> DeviceError | None:
        reason = self._block.stop_reason
        if reason is StopReason.NONE and not self._process.alive:
            return self._process.why_dead()
        if reason in (StopReason.HANGUP, StopReason.SILENCE, StopReason.LINE_ERROR):
            return DeviceError(f"{self._link.name}: {self._stop_sentence}", reason.name)
        return None

    def _go_idle(self) -> None:
        self.engage(Mode.IDLE)
        until = time.monotonic() + IDLE_TIMEOUT_S
        while self.mode is not Mode.IDLE:
            self._process.heartbeat.seen()
            if self.stop_reason is not StopReason.NONE:
                raise self._stopped()
            if time.monotonic() > until:
                raise DeviceError(f"{self._link.name} sends no frames: restart the device.")
            time.sleep(0.002)
