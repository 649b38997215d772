"""What a person at the rig sees: how far it is, what is covered, and what to load."""

import sys
import time
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

import typer

from scissorcal.cli.output import is_interactive
from scissorcal.errors import InputError

if TYPE_CHECKING:
    from rich.live import Live

    from scissorcal.device.coverage import CoverageGrid

_LINE_EVERY_S = 5.0
_DRAW_EVERY_S = 0.1


class LiveView:
    """Shows progress and coverage on stderr, live on a terminal and as lines elsewhere.

    ``ask`` says whether a person is asked to load material and to press Enter.
    """

    def __init__(self, ask: bool = True) -> None:
        self._ask = ask
        self._live: Live | None = None
        self._drawn_s = float("-inf")
        self._finished = False

    def __enter__(self) -> Self:
        self._start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._stop()

    def show(self, done: float, sentence: str, coverage: "CoverageGrid | None" = None) -> None:
        """Show how far the work at the rig is, and what a capture covers so far."""
        now = time.monotonic()
        every = _LINE_EVERY_S if self._live is None else _DRAW_EVERY_S
        finished = done >= 1.0 and not self._finished
        if now - self._drawn_s < every and not finished:
            return
        self._drawn_s, self._finished = now, done >= 1.0
        head = f"{100 * min(max(done, 0.0), 1.0):3.0f} %  {sentence}"
        if self._live is None:
            typer.echo(f"{head}; {coverage.sentence()}" if coverage else head, err=True)
        else:
            self._live.update(_drawing(done, head, coverage), refresh=True)

    def confirm(self, request: str) -> None:
        """Ask a person for what must be done, and wait until it is.

        Raises InputError where nobody is there to be asked, typer.Abort where they give up.
        """
        if not self._ask:
            typer.echo(f"{request} (--yes: taken as done)", err=True)
            return
        if not is_interactive():
            raise InputError(
                f"{request} Nobody can be asked here: run this at a terminal, or give --yes once "
                "it is done."
            )
        self._stop()
        typer.prompt(f"{request} Press Enter", default="", show_default=False, err=True)
        self._start()

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


def _drawing(done: float, head: str, coverage: "CoverageGrid | None") -> Any:
    from rich.console import Group
    from rich.progress_bar import ProgressBar
    from rich.text import Text

    bar = ProgressBar(total=1.0, completed=done, width=40)
    return Group(Text(head), bar, coverage) if coverage else Group(Text(head), bar)
