"""``scissorcal track``"""

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from scissorcal.cli.opening import open_workspace
from scissorcal.cli.options import RIG, Folder, options_of, positive
from scissorcal.cli.output import Answer, command
from scissorcal.cli.pose_lines import pose_lines
from scissorcal.workday.options import TrackOptions

if TYPE_CHECKING:
    from scissorcal.workday.runs.track import TrackResult


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
    from scissorcal.cli.track_view import TrackView
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
