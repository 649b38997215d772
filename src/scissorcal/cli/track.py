"""``scissorcal track``"""

import math
import sys
import time
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Self

import typer

from scissorcal.cli.fit_plate import pose_lines
from scissorcal.cli.opening import open_workspace
from scissorcal.cli.options import RIG, Folder, options_of, positive
from scissorcal.cli.output import Answer, command
from scissorcal.cli.progress import time_words
from scissorcal.cli.terminal import echo, printable
from scissorcal.workday.options import TrackOptions

if TYPE_CHECKING:
    from rich.live import Live

    from scissorcal.workday.runs.track import TrackResult
    from scissorcal.workday.tracking.session import TrackMark

_RESTS = {
    "fused": "by pictures and contacts",
    "pictures": "by pictures alone",
    "contacts": "by contacts alone",
    "coasting": "as predicted: neither pictures nor contacts came last",
}
"""What a pose rests on, by the track's state."""


_OPTIONS = {
    "camera": typer.Option(
        "--camera",
        metavar="NUMBER|VIDEO|sim|none",
        help="A camera by its number, a video file, a track's recording (followed again by the "
        "recipe as it is now), sim: a rendered plate, or none.",
    ),
    "device": typer.Option(
        "--device",
        metavar="PORT|sim|none",
        help="Serial port of the rig whose blade's tip touches the plate, sim, or none.",
    ),
    "seconds": typer.Option(callback=positive, help="Stop after this time; Ctrl-C stops sooner."),
    "camera_delay_ms": typer.Option(
        metavar="MS",
        help="From a picture's exposure to its soonest arrival, in place of the recipe's.",
    ),
    "seed": RIG["seed"],
    "baud": RIG["baud"],
}


@command
@options_of(_OPTIONS)
def track(options: TrackOptions, folder: Folder = None) -> Answer:
    """Follow the plate's pose by a camera, by contacts of the blade's tip, or by both.

    Needs the camera's fit, and with a rig photographs of the rig card. The rig's motors are off:
    move the handles so that the tip taps the plate, at several places. A filter fuses pictures and
    contacts, on the clocks of both; samples, pictures and the pose after each go into a recording,
    in which Foxglove shows the plate's frame. Without a camera the fit of the plate is the start.

    \b
    Example:
      $ scissorcal track --camera sim --device sim
      captures/track-20261123T115726Z.mcap: pose by pictures and contacts, in the rig's frame ...
      52 poses in 59 pictures (7 blank), longest gap 0.23 s; 0 refused
      229 contacts used, 2 refused; 0 restarts
      ...
    """
    from scissorcal.workday.runs.track import track_plate

    workspace = open_workspace(folder)
    with TrackView(options.seconds) as view:
        done = track_plate(workspace, options, view.show)
    angles = done.pose.euler_angles
    result = {**asdict(done), "euler_angles": angles, "drop_outs": done.drop_outs}
    del result["verdicts"]
    name = workspace.relative(done.path) if done.path else Path(options.camera).name
    files = (done.path,) if done.path else ()
    return Answer(result, f"{name}: {_text(done)}", done.verdicts, files)


def _text(done: "TrackResult") -> str:
    lost = {
        state: n for state, n in done.states.items() if n and state not in ("seen", "ambiguous")
    }
    named = f" ({', '.join(f'{n} {state}' for state, n in lost.items())})" if lost else ""
    figures = done.figures
    rig = f" on {done.rig}" if done.rig else ""
    lines = [f"pose {_RESTS[done.state]}, in the {done.frame}'s frame ({done.seconds:.1f} s{rig})"]
    if done.pictures:
        lines.append(
            f"{done.poses} poses in {done.pictures} pictures{named}, longest gap "
            f"{done.longest_gap_s:.2g} s; {figures.pictures.refused} refused"
        )
    if done.states["ambiguous"]:
        lines.append(f"{done.states['ambiguous']} poses are ambiguous: both stand in the recording")
    if done.rig:
        lines.append(
            f"{figures.contacts.used} contacts used, {figures.contacts.refused} refused; "
            f"{figures.restarts} restarts"
        )
    x, y, z = (1e3 * value for value in done.translation_m)
    lines.append(f"at the end ({x:.2f}, {y:.2f}, {z:.2f}) mm, {done.pose.euler_angles.words}")
    lines += pose_lines({done.frame: done.pose})
    lines.append(
        f"the plate went {done.travel_mm:.2f} mm away from where it was first; it is known to "
        f"{done.sd_mm:.2g} mm and {done.sd_deg:.2g} deg"
    )
    return "\n".join([*lines, *done.notes])


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
