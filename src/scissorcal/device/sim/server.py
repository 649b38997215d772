"""A virtual rig on a pseudo-terminal, in real time, in a separate process.

Run as ``python -m scissorcal.device.sim.server SPECIMEN``, it prints the port's path on the first
line of stdout and serves until its stdin ends (so that it ends with the process that holds the
other end of that pipe), until SIGTERM or SIGINT, or until its faults unplug it.

Ticks follow an absolute schedule. A process that wakes late catches up with at most CATCH_UP_TICKS
ticks at once, fewer than the default BRAKE_AFTER_MS, so that its own delay is not taken for a
silent host. During any longer delay the rig stands still, which is counted as a stall. Nothing
blocks: while the port is not open its frames are lost, as on a real line, and a slow reader loses
the oldest ones.
"""

import argparse
import os
import select
import signal
import stat
import sys
import time
from collections import deque
from collections.abc import Callable
from contextlib import suppress
from types import FrameType
from typing import NamedTuple, Protocol

import numpy as np

from scissorcal.device.sim.protocol import RigProtocol
from scissorcal.device.sim.rig import TICK_S, VirtualRig
from scissorcal.device.sim.sensors import Faults, parse_faults
from scissorcal.device.sim.specimen import Specimen, load_specimen
from scissorcal.errors import ScissorcalError, needs_unix

CATCH_UP_TICKS = 5
WAITING_FRAMES = 256
READ_BYTES = 4096


class Side(Protocol):
    """What of a device is served: see `scissorcal.device.lockstep.DeviceSide`."""

    @property
    def unplugged(self) -> bool:
        """Whether its cable has been pulled."""

    def receive(self, data: bytes) -> None:
        """Take bytes from the host."""

    def tick(self) -> None:
        """Advance one tick."""

    def take(self) -> list[bytes]:
        """Frames that are due for the host."""


class ServeReport(NamedTuple):
    """How a served rig ended: ticks served, how often it stood still, whether it was unplugged."""

    ticks: int
    stalls: int
    unplugged: bool


def serve(
    specimen: Specimen,
    seed: int = 0,
    faults: Faults | None = None,
    announce: Callable[[str], None] = print,
    should_stop: Callable[[], bool] = lambda: False,
) -> ServeReport:
    """Serve a virtual rig on a new pseudo-terminal until stopped.

    ``announce`` is called once with the port's path. ``should_stop`` is asked after every tick. A
    stdin that is a pipe ends the service when it is closed; SIGTERM and SIGINT end it too, if this
    is the main thread.
    """
    rig_rng, line_rng = np.random.default_rng(seed).spawn(2)
    protocol = RigProtocol(VirtualRig(specimen, rig_rng), line_rng, faults)
    return serve_side(protocol, TICK_S, announce, should_stop)


def serve_side(
    side: Side,
    tick_s: float,
    announce: Callable[[str], None],
    should_stop: Callable[[], bool] = lambda: False,
) -> ServeReport:
    """Serve any device side on a new pseudo-terminal, a tick each ``tick_s``; as `serve`."""
    stopping = _StopSignals()
    with _Port() as port, stopping:
        announce(port.path)
        parent = _ParentPipe()
        ticks = stalls = 0
        due = time.monotonic() + tick_s
        while not (stopping.caught or parent.closed or side.unplugged or should_stop()):
            parent.wait(due - time.monotonic())
            late = int((time.monotonic() - due) / tick_s)
            if late >= CATCH_UP_TICKS:
                due += (late - CATCH_UP_TICKS + 1) * tick_s
                stalls += 1
            while due <= time.monotonic() and not side.unplugged:
                side.receive(port.read())
                side.tick()
                port.write(side.take())
                due += tick_s
                ticks += 1
    return ServeReport(ticks, stalls, side.unplugged)


def main(arguments: list[str] | None = None) -> int:
    """Command line of the server; returns the exit code."""
    parser = argparse.ArgumentParser(
        prog="python -m scissorcal.device.sim.server", description="Serve a virtual rig on a pty."
    )
    parser.add_argument("specimen", help="name of a specimen, or path of its .toml file")
    parser.add_argument("--seed", type=int, default=0, help="seed of everything random")
    parser.add_argument(
        "--fault", action="append", default=[], metavar="KIND=VALUE", help="may be repeated"
    )
    options = parser.parse_args(arguments)
    try:
        specimen, faults = load_specimen(options.specimen), parse_faults(options.fault)
        serve(specimen, options.seed, faults, lambda path: print(path, flush=True))
    except ScissorcalError as error:
        print(error, file=sys.stderr)
        return error.exit_code
    return 0


class _Port:
    """The master's side of a raw pseudo-terminal that never blocks."""

    def __init__(self) -> None:
        try:
            import tty
        except ImportError:
            raise needs_unix("A virtual rig") from None
        self._master, slave = os.openpty()
        tty.setraw(slave)
        self.path = os.ttyname(slave)
        os.close(slave)
        os.set_blocking(self._master, False)
        self._poll = select.poll()
        self._poll.register(self._master, select.POLLIN)
        self._frames: deque[bytes] = deque(maxlen=WAITING_FRAMES)
        self._begun = b""
        self._had_reader = False

    def __enter__(self) -> "_Port":
        return self

    def __exit__(self, *_: object) -> None:
        os.close(self._master)

    def read(self) -> bytes:
        """What the host has written; nothing while no one has the port open."""
        try:
            return os.read(self._master, READ_BYTES)
        except OSError:  # EAGAIN: nothing there; EIO: no one has the port open
            return b""

    def write(self, frames: list[bytes]) -> None:
        """Send frames as far as the reader takes them; the oldest wait, and at last are lost."""
        if not self._has_reader():
            self._frames.clear()
            self._begun = b""
            return
        self._frames.extend(frames)
        while self._begun or self._frames:
            data = self._begun or self._frames.popleft()
            try:
                sent = os.write(self._master, data)
            except OSError:
                sent = 0
            self._begun = data[sent:]
            if self._begun:
                return

    def _has_reader(self) -> bool:
        events = self._poll.poll(0)
        has_reader = not (events and events[0][1] & select.POLLHUP)
        if self._had_reader and not has_reader:
            self._forget_unread()
        self._had_reader = has_reader
        return has_reader

    def _forget_unread(self) -> None:
        """Drop what the last reader left unread, as a real port does when it is closed."""
        import termios

        with suppress(OSError, termios.error):
            slave = os.open(self.path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
            try:
                termios.tcflush(slave, termios.TCIFLUSH)
            finally:
                os.close(slave)


class _ParentPipe:
    """Waits for time to pass, and sees when the process at the other end of stdin is gone.

    Only a pipe or socket shows this: a terminal, /dev/null or no stdin at all is left alone.
    """

    def __init__(self) -> None:
        self.closed = False
        self._poll: select.poll | None = None
        try:
            self._stdin = sys.stdin.fileno()
            mode = os.fstat(self._stdin).st_mode
        except (AttributeError, OSError, ValueError):
            return
        if stat.S_ISFIFO(mode) or stat.S_ISSOCK(mode):
            self._poll = select.poll()
            self._poll.register(self._stdin, select.POLLIN)

    def wait(self, seconds: float) -> None:
        """Sleep for ``seconds`` (not at all if negative), then look whether the pipe has ended."""
        if seconds > 0:
            time.sleep(seconds)
        if self._poll is not None and self._poll.poll(0):
            self.closed = not os.read(self._stdin, READ_BYTES)


class _StopSignals:
    """Turns SIGTERM and SIGINT into a flag while it is entered in the main thread."""

    def __init__(self) -> None:
        self.caught = False
        self._before: list[tuple[int, Callable[[int, FrameType | None], object] | int | None]] = []

    def __enter__(self) -> "_StopSignals":
        for number in (signal.SIGTERM, signal.SIGINT):
            with suppress(ValueError):  # not the main thread: signals are someone else's
                self._before.append((number, signal.signal(number, self._catch)))
        return self

    def __exit__(self, *_: object) -> None:
        for number, handler in self._before:
            signal.signal(number, handler if handler is not None else signal.SIG_DFL)

    def _catch(self, _number: int, _frame: FrameType | None) -> None:
        self.caught = True


if __name__ == "__main__":
    sys.exit(main())
