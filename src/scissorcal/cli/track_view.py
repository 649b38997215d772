"""What a person sees of a running track: one line, refreshed on a terminal."""

import math
import sys
import time
from typing import TYPE_CHECKING, Self

from scissorcal.cli.progress import time_words
from scissorcal.cli.terminal import echo, printable

if TYPE_CHECKING:
    from rich.live import Live

    from scissorcal.workday.tracking.session import TrackMark

_LINE_EVERY_S = 2.0
_DRAW_EVERY_S = 0.1


class TrackView:
    """Shows a track on stderr; ``seconds`` is how long it lasts, None where it is open."""

    def __init__(self, seconds: float | None) -> None:
        self._seconds = seconds
        self._live: Live | None = None
        self._drawn_s = float("-inf")

    def __enter__(self) -> Self:
        if sys.stderr.isatty():
            from rich.console import Console
            from rich.live import Live

            self._live = Live(console=Console(stderr=True), auto_refresh=False, transient=True)
            self._live.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self._live is not None:
            self._live.stop()

    def show(self, mark: "TrackMark") -> None:
        """Show how it stands."""
        now = time.monotonic()
        if now - self._drawn_s < (_LINE_EVERY_S if self._live is None else _DRAW_EVERY_S):
            return
        self._drawn_s = now
        line = track_line(mark, self._seconds)
        if self._live is None:
            echo(line, err=True)
        else:
            from rich.text import Text

            self._live.update(Text(printable(line)), refresh=True)


def track_line(mark: "TrackMark", seconds: float | None) -> str:
    """State, pose with its standard deviation, NIS, rows used and refused, ages: in one line."""
    from scissorcal.vision.live import STATES

    passed = time_words(mark.seconds) + (f" of {time_words(seconds)}" if seconds else "")
    share = "" if math.isnan(mark.done) else f", {100 * mark.done:.0f} % of the pictures"
    head = f"{mark.state:8} {passed}{share}"
    if mark.estimate is None:
        why = STATES[mark.picture] if mark.picture else "no picture yet"
        return f"{head}: no pose yet ({why})"
    return f"{head}: {_pose(mark)}; {_rows(mark)}"


def _pose(mark: "TrackMark") -> str:
    from scissorcal.vision.geometry.pose import Pose

    found = mark.estimate
    assert found is not None
    x, y, z = (1e3 * found.place_m).tolist()
    angles = Pose.from_matrix(found.rotation, found.place_m, found.covariance).euler_angles
    sds = [math.sqrt(variance) for variance in found.covariance.diagonal().tolist()]
    near = f" (pitch near {math.copysign(90.0, angles.pitch_deg):g})" if angles.note else ""
    return (
        f"({x:.2f}, {y:.2f}, {z:.2f}) +- {1e3 * max(sds[3:]):.2g} mm, {angles.words}{near} "
        f"+- {math.degrees(max(sds[:3])):.2g} deg"
    )


def _rows(mark: "TrackMark") -> str:
    from scissorcal.tracking.tracker import Outcome

    found = mark.estimate
    assert found is not None
    parts = [] if math.isnan(mark.nis) else [f"NIS {mark.nis:.1f}"]
    ages = {"picture": found.picture_age_s, "contact": found.contact_age_s}
    for source, age in ages.items():
        used = mark.outcomes[source, Outcome.USED] + mark.outcomes[source, Outcome.RESTARTED]
        refused = mark.outcomes[source, Outcome.REFUSED]
        if used or refused:
            old = f", last {age:.1f} s ago" if math.isfinite(age) else ""
            parts.append(f"{used} {source}s, {refused} refused{old}")
    return "; ".join(parts)
