"""How long the machine held up a process: it was ready to run, and no processor was given to it.

Run as ``python -I tests/hold_up.py PID``, it watches PID with all its children, threads included,
and answers lines on stdin: "begin" forgets what was, "tell" is answered with the worst hold-up
since, in ms. It ends with its stdin.

Two facts count. Linux counts for each thread the time in which it was ready and waited for a
processor (the second number of schedstat); what one thread waited within `WINDOW_S` is a hold-up.
And this process wakes on a schedule as a device does: how late it wakes is a hold-up, too, also
where the whole virtual machine was held up, which Linux does not count. A thread that waits for a
lock, for data or for another thread is not ready: what a fault of the program delays counts as
none of the machine's.
"""

import select
import subprocess
import sys
import time
from collections import deque
from pathlib import Path

EVERY_S = 0.005
LOOKS = 2
WINDOW_S = EVERY_S * LOOKS
"""As long as a device waits for a command by default (BRAKE_AFTER_MS), until it brakes."""


class HoldUps:
    """A watcher of this process and its children, in a process of its own; a context manager."""

    def __init__(self, pid: int) -> None:
        words = [sys.executable, "-I", __file__, str(pid)]
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(words, stdin=pipe, stdout=pipe, text=True, bufsize=1)
        self.pid = self._process.pid

    def begin(self) -> None:
        """Forget what was; returns once that is done."""
        self._ask("begin")

    def worst_ms(self) -> float:
        """The worst hold-up since `begin`."""
        return float(self._ask("tell"))

    def close(self) -> None:
        """End the watcher."""
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.close()
        self._process.wait()
        self._process.stdout.close()

    def __enter__(self) -> "HoldUps":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _ask(self, what: str) -> str:
        assert self._process.stdin is not None
        assert self._process.stdout is not None
        self._process.stdin.write(f"{what}\n")
        return self._process.stdout.readline()


class Waits:
    """What each thread of a process and its children waited for a processor."""

    def __init__(self, pid: int, own: int) -> None:
        self._pid, self._own = pid, own
        self._before: deque[dict[str, int]] = deque(maxlen=LOOKS)

    def worst_ms(self) -> float:
        """The most that one thread waited since `LOOKS` looks ago; of a new one, since it began."""
        now: dict[str, int] = {}
        self._add(self._pid, now)
        before = self._before[0] if self._before else now  # the first look has nothing before it
        self._before.append(now)
        waited = [wait - before.get(thread, 0) for thread, wait in now.items()]
        return 1e-6 * max(waited, default=0)

    def _add(self, pid: int, found: dict[str, int]) -> None:
        try:
            threads = list(Path(f"/proc/{pid}/task").iterdir())
        except OSError:  # it has ended, or this system has no such files
            return
        for thread in threads:
            words = _words_of(thread / "schedstat")
            if words:
                found[thread.name] = int(words[1])
            for child in _words_of(thread / "children"):
                if int(child) != self._own:
                    self._add(int(child), found)


def _words_of(file: Path) -> list[str]:
    """Nothing where the thread has ended meanwhile, or where Linux was built without the file.

    Children of a process that was killed have another parent then, and are not watched.
    """
    try:
        return file.read_text().split()
    except OSError:
        return []


def watch(pid: int, own: int) -> None:
    """Answer until stdin ends."""
    waits, worst_ms = Waits(pid, own), 0.0
    due = time.monotonic() + EVERY_S
    while True:
        asked = select.select([sys.stdin], [], [], max(0.0, due - time.monotonic()))[0]
        late_s = time.monotonic() - due
        if late_s >= 0.0:  # also where something was asked meanwhile
            worst_ms = max(worst_ms, 1e3 * late_s, waits.worst_ms())
            due = max(due + EVERY_S, time.monotonic())
        if not asked:
            continue
        what = sys.stdin.readline().strip()
        if not what:
            return
        if what == "begin":
            waits, worst_ms, due = Waits(pid, own), 0.0, time.monotonic() + EVERY_S
        print(worst_ms, flush=True)


if __name__ == "__main__":
    import os

    watch(int(sys.argv[1]), os.getpid())
