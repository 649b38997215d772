"""The heartbeat that tells the servo that its supervisor works."""

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

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
