"""Progress for people, always on stderr: a bar on a terminal, plain lines anywhere else."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from scissorcal.cli.terminal import echo, printable
from scissorcal.errors import VerdictError

if TYPE_CHECKING:
    from scissorcal.aliases import Progress

_LINE_EVERY_S = 5.0
_NEW_SENTENCE_AFTER_S = 2.0
_LEAST_DONE = 0.03
"""Share of the work below which nothing is said of the time left."""


@contextmanager
def progress(limit_s: float | None = None, grace_s: float = 0.0) -> Iterator[Progress]:
    """Give a callback ``(done from 0 to 1, sentence)`` that shows how far the work has come.

    The time that it took so far stands behind the sentence, with the time left at the same pace.
    Where ``limit_s`` is given, work that goes on for ``grace_s`` longer ends with a VerdictError at
    its next call; grace is for work that keeps to the limit by itself and then needs to finish.

    >>> with progress() as tell:  # doctest: +SKIP
    ...     tell(0.5, "fitting friction")
     50 %  fitting friction (12 s, about 12 s left)
    """
    began_s = time.monotonic()

    def reporting(show: Progress) -> Progress:
        def tell(done: float, sentence: str) -> None:
            elapsed_s = time.monotonic() - began_s
            if limit_s is not None and elapsed_s > limit_s + grace_s and done < 1.0:
                raise VerdictError(
                    f"The time allowed ({time_words(limit_s)}) was used up at {100 * done:.0f} % "
                    f"of the work ({sentence}), and nothing was stored: allow more with "
                    "--max-minutes, use --effort draft, or give it less data."
                )
            show(done, f"{sentence} ({pace(done, elapsed_s)})")

        return tell

    if sys.stderr.isatty():
        with _bar() as show:
            yield reporting(show)
    else:
        yield reporting(_Lines())


def pace(done: float, elapsed_s: float) -> str:
    """Say how long work took so far, and how long the rest takes at that pace.

    >>> pace(0.25, 20.0)
    '20 s, about 1 min 0 s left'
    >>> pace(0.01, 2.0)
    '2 s'
    """
    if not _LEAST_DONE <= done < 1.0:
        return time_words(elapsed_s)
    return f"{time_words(elapsed_s)}, about {time_words(elapsed_s * (1.0 - done) / done)} left"


def time_words(seconds: float) -> str:
    """Seconds as people say them: 42 s, 3 min 5 s."""
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest} s" if minutes else f"{rest} s"


@contextmanager
def _bar() -> Iterator[Progress]:
    from rich.console import Console
    from rich.progress import BarColumn, TaskProgressColumn, TextColumn
    from rich.progress import Progress as RichProgress

    columns = (
        BarColumn(bar_width=30),
        TaskProgressColumn(),
        TextColumn("{task.description}", markup=False),
    )
    with RichProgress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=1.0)
        yield lambda done, sentence: bar.update(
            task, completed=done, description=printable(sentence)
        )


class _Lines:
    """Print a line every few seconds, sooner where the sentence changes."""

    def __init__(self) -> None:
        self._last = ""
        self._printed_s = float("-inf")

    def __call__(self, done: float, sentence: str) -> None:
        now = time.monotonic()
        stage = sentence.rpartition(" (")[0]
        wait = _LINE_EVERY_S if stage == self._last else _NEW_SENTENCE_AFTER_S
        if now - self._printed_s < wait:
            return
        self._last, self._printed_s = stage, now
        echo(f"{100 * min(max(done, 0.0), 1.0):3.0f} %  {sentence}", err=True)
