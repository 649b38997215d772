"""What a person at the rig sees: progress, opening and torque, coverage, and what to load."""

import sys
import time
from collections import deque
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Self

import typer

from scissorcal.cli import questions
from scissorcal.cli.output import is_interactive, note
from scissorcal.cli.progress import pace
from scissorcal.cli.terminal import echo, printable
from scissorcal.errors import InputError

if TYPE_CHECKING:
    from rich.live import Live

    from scissorcal.device.coverage import CoveredAxis
    from scissorcal.device.recorder import Recorder
    from scissorcal.device.session import Operator
    from scissorcal.recording.header import UntilMark

_LINE_EVERY_S = 5.0
_DRAW_EVERY_S = 0.1
_TRACE_POINTS = 300
_BARS, _BARS_SHOWN = "▁▂▃▄▅▆▇█", 40
_TRACE_SIZE = (60, 8)
"""Most columns and the rows of the plot of torque over opening."""
_MARGIN = 12
"""Columns left of that plot: its marks and its axis."""
_BAR_COLUMNS = 40


class LiveView:
    """Shows progress, torque, opening and coverage on stderr: live on a terminal, else as lines.

    ``ask`` says whether a person is asked to load material and to press Enter. ``listed``: the
    strokes are known beforehand, so that their coverage is shown.
    """

    def __init__(self, ask: bool = True, *, listed: bool = True) -> None:
        self._listed = listed
        self._ask = ask
        self._live: Live | None = None
        self._began_s = time.monotonic()
        self._drawn_s = float("-inf")
        self._finished = False
        self._unloaded = 0
        self._trace: deque[tuple[float, float]] = deque(maxlen=_TRACE_POINTS)
        self._axis: CoveredAxis | None = None
        self._approach: list[UntilMark] = []

    def __enter__(self) -> Self:
        self._start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop()

    @property
    def operator(self) -> "Operator":
        """Asks, tells and shows to the person at the terminal."""
        from scissorcal.device.session import Operator

        return Operator(self.confirm, note, self.show, self.approach)

    def show(self, done: float, sentence: str, recorder: "Recorder | None" = None, /) -> None:
        """Show the progress of the work at the rig, and what a capture recorded so far."""
        now = time.monotonic()
        if recorder is not None:
            self._tell_unloaded(recorder)
        if recorder is not None and recorder.last is not None:
            last, self._axis = recorder.last[0], recorder.axis
            place, effort = last[self._axis.channel], last[self._axis.effort]
            self._trace.append((self._axis.places * place, self._axis.efforts * effort))
        interval_s = _LINE_EVERY_S if self._live is None else _DRAW_EVERY_S
        self._finished = self._finished and done >= 1.0  # a capture follows its probe
        finished = done >= 1.0 and not self._finished
        if now - self._drawn_s < interval_s and not finished:
            return
        self._drawn_s, self._finished = now, done >= 1.0
        share = min(max(done, 0.0), 1.0)
        head = [f"{100 * share:3.0f} %  {sentence} ({pace(share, now - self._began_s)})"]
        if self._trace and self._axis:
            (place, effort), axis = self._trace[-1], self._axis
            head.append(
                f"{axis.channel} {place:.1f} {axis.unit}, "
                f"{axis.effort_name} {effort:.1f} {axis.effort_unit}"
            )
        if self._live is None:
            coverage = [recorder.coverage.sentence()] if recorder and self._listed else []
            echo("; ".join([*head, *coverage]), err=True)
        else:
            width = self._live.console.width
            self._live.update(self._drawing(share, head, recorder, width), refresh=True)

    def approach(self, mark: "UntilMark") -> None:
        """Show how far a capture is from the scene's tolerance, after each update of the fit."""
        self._approach.append(mark)
        if self._live is None:
            echo(_band_line(self._approach), err=True)

    def confirm(self, request: str) -> None:
        """Ask a person for what must be done, and wait until it is.

        Raises InputError where stdin or stderr is no terminal, typer.Abort where they give up.
        """
        if not self._ask:
            echo(f"{request} (--yes: taken as done)", err=True)
            return
        if questions.answers is not None:
            questions.ask(request)
            return
        if not is_interactive():
            raise InputError(
                f"{request} This is not a terminal, so you cannot confirm it: run the command at a "
                "terminal, or give --yes once it is done."
            )
        self._stop()
        typer.prompt(f"{printable(request)} Press Enter", default="", show_default=False, err=True)
        self._start()

    def _tell_unloaded(self, recorder: "Recorder") -> None:
        """Say at once, and for good, which strokes cut nothing."""
        from scissorcal.device.recorder import unloaded_sentence

        for stroke in recorder.empty[self._unloaded :]:
            sentence = unloaded_sentence(stroke)
            if self._live is None:
                echo(sentence, err=True)
            else:
                self._live.console.print(printable(sentence), markup=False)
        self._unloaded = len(recorder.empty)

    def _start(self) -> None:
        if sys.stderr.isatty():
            from rich.console import Console
            from rich.live import Live

            self._live = Live(console=Console(stderr=True), auto_refresh=False, transient=True)
            self._live.start()

    def _stop(self) -> None:
        if self._live is not None:
            self._live.stop()
            self._live = None

    def _drawing(
        self, share: float, head: list[str], recorder: "Recorder | None", width: int
    ) -> Any:
        """What stands on a terminal of ``width`` columns; only sentences are folded there."""
        from rich.console import Group
        from rich.padding import Padding
        from rich.progress_bar import ProgressBar
        from rich.text import Text

        bar = ProgressBar(total=1.0, completed=share, width=min(_BAR_COLUMNS, width))
        # a bar of rich ends no line; padded, it is a line of its own
        drawn: list[Any] = [*map(Text, head), Padding(bar, 0)]
        if self._trace and self._axis:
            drawn.append(Text(effort_plot(self._trace, self._axis, width)))
        if self._approach:
            drawn.append(Text(_band_line(self._approach)))
        elif recorder and self._listed:
            drawn.append(recorder.coverage)
        return Group(*drawn)


def _band_line(marks: "Sequence[UntilMark]") -> str:
    """The last mark's sentence, and a bar for each: the share of places within the tolerance.

    >>> from scissorcal.recording.header import UntilMark
    >>> first = UntilMark("", 1, 1, 0.5, 1.0, 0.0, 0.2, 0.07, 0.95)
    >>> second = UntilMark("", 2, 1, 0.6, 0.9, 1.0, 0.05, 0.07, 0.95)
    >>> _band_line([first, second])[:2]
    '▁█'
    """
    shares = [mark.within for mark in marks if mark.within is not None][-_BARS_SHOWN:]
    bars = "".join(_BARS[round(share * (len(_BARS) - 1))] for share in shares)
    return f"{bars} {marks[-1].sentence}".strip()


def effort_plot(points: deque[tuple[float, float]], of: "CoveredAxis", width: int = 80) -> str:
    """Plot an axis's effort over its place within ``width`` columns; the newest point is an o."""
    most, rows = _TRACE_SIZE
    columns = max(min(most, width - _MARGIN), 2)
    left, right = _range([point[0] for point in points])
    low, high = _range([point[1] for point in points])
    grid = [[" "] * columns for _ in range(rows)]
    for index, (place, effort) in enumerate(points, start=1):
        column = round((columns - 1) * (place - left) / (right - left))
        row = round((rows - 1) * (high - effort) / (high - low))
        grid[row][column] = "o" if index == len(points) else "."
    marks = [f"{high:9.1f}", *[" " * 9] * (rows - 2), f"{low:9.1f}"]
    lines = [f"{mark} |{''.join(cells)}".rstrip() for mark, cells in zip(marks, grid, strict=True)]
    axis = f"{left:<10.1f}{f'{of.channel} ({of.unit})':^{max(columns - 20, 0)}}{right:>10.1f}"
    return "\n".join([f"{of.effort_name} ({of.effort_unit})", *lines, " " * 11 + axis])


def _range(values: list[float]) -> tuple[float, float]:
    low, high = min(values), max(values)
    return (low, high) if high > low else (low - 0.5, high + 0.5)
