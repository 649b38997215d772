"""A running camera beside a rig: pictures are read and located in threads, the newest first."""

import queue
import threading
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress

from scissorcal.vision.live import Frame, LocatedFrame

CLOSE_S = 2.0


class CameraThread:
    """Reads pictures as they come, and locates the newest one whenever the last is done.

    A picture that nobody has time for is left out (``left_out`` counts them): a queue of old ones
    would make all that follow late. OpenCV releases the interpreter's lock while it works, so both
    threads run beside the caller's. What ends them is raised by :meth:`due`.
    """

    def __init__(
        self, frames: Iterable[Frame], locate: Callable[[Iterable[Frame]], Iterator[LocatedFrame]]
    ) -> None:
        self.left_out = 0
        self._newest: Frame | None = None
        self._ended = False
        self._closing = False
        self._error: BaseException | None = None
        self._news = threading.Condition()
        self._found: queue.SimpleQueue[LocatedFrame] = queue.SimpleQueue()
        self._threads = [
            threading.Thread(target=self._run, args=(self._read, frames), daemon=True),
            threading.Thread(target=self._run, args=(self._locate, locate), daemon=True),
        ]
        for thread in self._threads:
            thread.start()

    @property
    def ended(self) -> bool:
        """Whether no picture will come any more, and all were handed out."""
        return self._found.empty() and not self._threads[1].is_alive()

    def due(self, wait_s: float = 0.0) -> list[LocatedFrame]:
        """Located pictures since the last call, oldest first; waits so long for the first one.

        Raises what ended the camera.
        """
        located: list[LocatedFrame] = []
        with suppress(queue.Empty):
            located.append(self._found.get(timeout=wait_s) if wait_s else self._found.get_nowait())
            while True:
                located.append(self._found.get_nowait())
        if not located and self._error is not None and self.ended:
            raise self._error
        return located

    def close(self) -> None:
        """Stop reading; a camera that hangs is left to end with the process."""
        with self._news:
            self._closing = True
            self._news.notify_all()
        for thread in self._threads:
            thread.join(CLOSE_S)

    def _run(self, work: Callable[..., None], given: object) -> None:
        try:
            work(given)
        except BaseException as error:  # noqa: BLE001 - raised again where the pictures are used
            self._error = self._error or error
        finally:
            with self._news:
                self._ended = True
                self._news.notify_all()

    def _read(self, frames: Iterable[Frame]) -> None:
        for frame in frames:
            with self._news:
                if self._closing:
                    return
                self.left_out += self._newest is not None
                self._newest = frame
                self._news.notify_all()

    def _locate(self, locate: Callable[[Iterable[Frame]], Iterator[LocatedFrame]]) -> None:
        for located in locate(self._fresh()):
            self._found.put(located)

    def _fresh(self) -> Iterator[Frame]:
        while True:
            with self._news:
                while self._newest is None and not (self._ended or self._closing):
                    self._news.wait()
                frame, self._newest = self._newest, None
                if frame is None or self._closing:
                    return
            yield frame
