"""Progress for people, always on stderr: a bar on a terminal, plain lines anywhere else."""

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import click

Progress = Callable[[float, str], None]

_LINE_EVERY_S = 5.0
_NEW_SENTENCE_AFTER_S = 2.0
_LINES_APART_S = 1.0


@contextmanager
def progress() -> Iterator[Progress]:
    """Give a callback ``(done from 0 to 1, sentence)`` that shows how far the work has come.

    >>> with progress() as tell:  # doctest: +SKIP
    ...     tell(0.5, "fitting friction")
     50 %  fitting friction
    """
    if sys.stderr.isatty():
        with _bar() as tell:
            yield tell
    else:
        yield _Lines()


@contextmanager
def _bar() -> Iterator[Progress]:
    from rich.console import Console
    from rich.progress import BarColumn, TaskProgressColumn, TextColumn, TimeElapsedColumn
    from rich.progress import Progress as RichProgress

    columns = (
        BarColumn(bar_width=30),
        TaskProgressColumn(),
        TimeElapsedColumn(),
        TextColumn("{task.description}", markup=False),
    )
    with RichProgress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("", total=1.0)
        yield lambda done, sentence: bar.update(task, completed=done, description=sentence)


class _Lines:
    """Print a line every few seconds, sooner where the sentence changes."""

    def __init__(self) -> None:
        self._last = ""
        self._printed_s = float("-inf")

    def __call__(self, done: float, sentence: str) -> None:
        now = time.monotonic()
        wait = _LINE_EVERY_S if sentence == self._last else _NEW_SENTENCE_AFTER_S
        if now - self._printed_s < wait:
            return
        self._last, self._printed_s = sentence, now
        click.echo(f"{100 * min(max(done, 0.0), 1.0):3.0f} %  {sentence}", err=True)
