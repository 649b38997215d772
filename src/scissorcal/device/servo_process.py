"""The servo loop in a separate process: started, monitored, ended; its supervisor's heartbeat."""

import math
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

from scissorcal.device.link import PortLink
from scissorcal.errors import DeviceError
from scissorcal.kernel import Config, ConfigKey, LoopBlock, StopReason

START_TIMEOUT_S = 30.0
STREAM_TIMEOUT_S = 2.0
STOP_TIMEOUT_S = 2.0
ASK_AGAIN_S = 0.2
ROUND_TRIPS = 8


class ServoProcess:
    """Runs the loop on a link's port in another process.

    The process owns the port from :meth:`start` to :meth:`close`. It runs in its own session, so
    Ctrl-C does not reach it. It stops when this process dies (the end of a pipe) or hangs (the
    missing heartbeat). ``round_trip_s`` is the shortest round trip of the line before the start,
    NaN if none was answered.
    """

    def __init__(self, link: PortLink, block: LoopBlock) -> None:
        self._link = link
        self._block = block
        self._errors = tempfile.TemporaryFile()  # noqa: SIM115 - closed in close()
        self._process: subprocess.Popen[bytes] | None = None
        self.heartbeat = Heartbeat(block.beat)
        self.round_trip_s = math.nan

    @property
    def pid(self) -> int | None:
        """Process id of the loop; None before the start."""
        return None if self._process is None else self._process.pid

    @property
    def alive(self) -> bool:
        """Whether the process still runs."""
        return self._process is not None and self._process.poll() is None

    def start(self) -> None:
        """Start the loop, start the stream, and wait for the first state.

        Raises DeviceError if the process does not start or the device sends nothing.
        """
        self._link.configure(ConfigKey.STREAM, 0.0)
        self._link.flush()
        self.round_trip_s = _shortest_round_trip(self._link)
        line, memory = self._link.fileno(), self._block.fileno()
        self._process = subprocess.Popen(
            [sys.executable, "-m", "scissorcal.device.servo_main", str(line), str(memory)],
            pass_fds=(line, memory),
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=self._errors,
            start_new_session=True,
        )
        self._await_loop()
        self.heartbeat.start()
        self._begin_streaming()

    def close(self) -> None:
        """Ask the loop to release the motors and end; kill it if it does not. Idempotent."""
        self.heartbeat.close()
        process, self._process = self._process, None
        if process is not None:
            self._block.stop()
            try:
                process.wait(STOP_TIMEOUT_S)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()
            if process.stdin is not None:
                process.stdin.close()
        self._errors.close()

    def why_dead(self) -> DeviceError:
        """The error where the process ended by itself: how, and its last words."""
        self._errors.seek(0)
        lines = self._errors.read().decode(errors="replace").strip().splitlines()
        code = None if self._process is None else self._process.poll()
        how = f"was killed by signal {-code}" if code and code < 0 else f"ended with code {code}"
        said = f" Its last message: {lines[-1]}" if lines else ""
        return DeviceError(
            f"The servo process {how}. Without commands the device brakes by itself.{said} Start "
            "again."
        )

    def _await_loop(self) -> None:
        until = time.monotonic() + START_TIMEOUT_S
        while not self._block.running:
            if not self.alive:
                raise self.why_dead()
            if time.monotonic() > until:
                raise DeviceError(
                    f"The servo process did not start within {START_TIMEOUT_S:g} s: close programs "
                    "that load the processor, and start again."
                )
            self.heartbeat.seen()
            time.sleep(0.002)

    def _begin_streaming(self) -> None:
        """Ask for the stream until states arrive; only the loop reads, so no echo is awaited."""
        until = time.monotonic() + STREAM_TIMEOUT_S
        ask_at = time.monotonic()
        while self._block.counters.frames == 0:
            if time.monotonic() >= ask_at:
                ask_at += ASK_AGAIN_S
                self._link.send(Config(ConfigKey.STREAM, 0, 1.0))
            if not self.alive:
                raise self.why_dead()
            if self._block.stop_reason is not StopReason.NONE or time.monotonic() > until:
                raise DeviceError(
                    f"{self._link.name} sends no state after STREAM = 1: restart the device."
                )
            self.heartbeat.seen()
            time.sleep(0.002)


def _shortest_round_trip(link: PortLink) -> float:
    """Shortest of some, in seconds: it has the least of the device's own waiting in it."""
    trips: list[float] = []
    while len(trips) < ROUND_TRIPS and not math.isnan(trip := link.round_trip()):
        trips.append(trip)
    return min(trips, default=math.nan)


BEAT_S = 0.04
"""A fifth of the least supervisor_ms; each time this process wakes may delay the loop."""
PATIENCE_S = 1.0
"""Chosen: longer than any pause of the supervisor that was seen on a busy computer (0.45 s), and
an eighth of what the ring of samples holds at 4 kHz, so that nothing is lost before it shows."""


class Heartbeat:
    """Beats from a thread while the supervisor's main loop shows that it works.

    The main loop calls :meth:`seen` with each block of samples that it takes. The thread beats
    every 40 ms as long as that was within the last ``PATIENCE_S``, so that a block that takes
    long (a slow disk, a busy processor) does not end a rendering, while a main loop that hangs is
    noticed ``PATIENCE_S`` and the servo's own limit later. A process that is stopped or dies does
    not beat at all. ``clock`` gives seconds, of which only differences count.
    """

    def __init__(
        self, beat: Callable[[], None], clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._beat = beat
        self._clock = clock
        self._seen_at = clock()
        self._held = 0
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._run, name="servo-heartbeat", daemon=True)

    def start(self) -> None:
        """Begin to beat."""
        self.seen()
        self._thread.start()

    def seen(self) -> None:
        """The main loop works now."""
        self._seen_at = self._clock()
        self._beat()

    @contextmanager
    def held(self) -> Iterator[None]:
        """Beat throughout while the caller waits for a person, with the motors off."""
        self._held += 1
        try:
            yield
        finally:
            self.seen()
            self._held -= 1

    def close(self) -> None:
        """End the thread; may be called twice, and before :meth:`start`."""
        self._over.set()
        if self._thread.is_alive():
            self._thread.join()

    def pulse(self) -> None:
        """Beat where the main loop works, or waits for a person; the thread calls it."""
        if self._held or self._clock() - self._seen_at < PATIENCE_S:
            self._beat()

    def _run(self) -> None:
        while not self._over.wait(BEAT_S):
            self.pulse()
