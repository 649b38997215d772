"""The servo loop in a separate process: started, monitored and ended."""

import math
import subprocess
import sys
import tempfile
import time

from scissorcal.device.heartbeat import Heartbeat
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
