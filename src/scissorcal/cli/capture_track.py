"""``scissorcal capture track``"""

from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

from scissorcal.cli.opening import open_workspace
from scissorcal.cli.options import Folder, Seed, positive
from scissorcal.cli.output import Answer, command
from scissorcal.cli.progress import progress

if TYPE_CHECKING:
    from scissorcal.calibration.plate.track import TrackSummary

_SIM_FRAMES = 24


@command
def track(
    source: Annotated[
        str,
        typer.Option(
            "--camera",
            metavar="NUMBER|VIDEO|sim",
            help="A camera by its number, a video file, or sim: a rendered plate that slides.",
        ),
    ],
    seconds: Annotated[
        float | None,
        typer.Option(
            callback=positive, help="Stop after this time; Ctrl-C stops sooner. Poses are kept."
        ),
    ] = None,
    seed: Seed = 0,
    folder: Folder = None,
) -> Answer:
    """Follow the plate's pose on a running camera or a video, picture by picture.

    Needs the camera's fit. Writes a line of JSON for each picture as it comes: number, time, state,
    and the plate's pose with its covariance, in the rig's frame where that is known. A picture
    without a pose is a drop-out; its line says why.

    \b
    Example:
      $ scissorcal capture track --camera sim
      captures/track-20261121T160312Z.jsonl: 21 poses in 24 pictures (2.3 s), in the camera's frame
      3 drop-outs, longest 0.2 s: 3 blank
      ...
    """
    from scissorcal.vision.live import frames_of
    from scissorcal.vision.sim.sim_camera import render_frames
    from scissorcal.workday.runs.track import track_plate

    workspace = open_workspace(folder)
    if source == "sim":
        frames = render_frames(workspace.recipe(), seed, _SIM_FRAMES)
    else:
        frames = frames_of(source)
    with progress() as tell:
        done = track_plate(workspace, frames, source, seconds=seconds, progress=tell)
    result = {**asdict(done), "drop_outs": done.drop_outs}
    place = workspace.relative(done.path)
    return Answer(result, f"{place}: {_text(done)}", files=(done.path,))


def _text(done: "TrackSummary") -> str:
    lost = {state: n for state, n in done.states.items() if n and state != "seen"}
    named = ", ".join(f"{n} {state}" for state, n in lost.items() if state != "ambiguous")
    lines = [
        f"{done.poses} poses in {done.pictures} pictures ({done.seconds:.1f} s), "
        f"in the {done.frame}'s frame",
        f"{done.drop_outs} drop-outs"
        + (f", longest {done.longest_gap_s:.2g} s: {named}" if named else ""),
    ]
    if done.states["ambiguous"]:
        lines.append(f"{done.states['ambiguous']} poses are ambiguous: both stand in the file")
    lines.append(
        f"the plate went {done.travel_mm:.2f} mm away from where it was first; "
        f"a pose is known to {done.sd_mm:.2g} mm and {done.sd_deg:.2g} deg"
    )
    return "\n".join(lines)
