"""``scissorcal control``"""

from typing import TYPE_CHECKING

import typer

from scissorcal.cli.opening import open_workspace
from scissorcal.cli.options import (
    NO_RECORD,
    PLATE_CAMERA,
    RIG,
    Folder,
    Yes,
    options_of,
    positive,
)
from scissorcal.cli.output import Answer, command, table
from scissorcal.workday.options import ControlOptions, RigOptions

if TYPE_CHECKING:
    from scissorcal.control.control_result import ControlResult
    from scissorcal.workday.runs.at_rig import RigRun


_OPTIONS = {
    "path_file": typer.Option(
        "--path",
        metavar="PATH.csv",
        help="Points on the plate: x_mm, and y_mm, force_N, speed_mm_per_s where stated.",
    ),
    "force_N": typer.Option(
        "--force", callback=positive, metavar="N", help="Force along the normal."
    ),
    "speed_mm_per_s": typer.Option(
        "--speed", callback=positive, metavar="MM_PER_S", help="Along the path."
    ),
    "pose": typer.Option(
        metavar="X_MM,Y_MM,RISE_DEG|x=MM,y=MM,z=MM,yaw=DEG,pitch=DEG,roll=DEG",
        help="Where the plate stands in the rig's frame (a rotation also as qw=,qx=,qy=,qz=); "
        "as it was fitted if not given.",
    ),
    "camera": PLATE_CAMERA,
    "no_record": NO_RECORD,
}


@command
@options_of({**RIG, **_OPTIONS})
def control(
    rig: RigOptions, options: ControlOptions, yes: Yes = False, folder: Folder = None
) -> Answer:
    """Press with the upper blade's tip on the plate, and follow a path on its surface.

    Both motors move the tip; nobody holds the handles. Friction of both axes must be fitted
    ('scissorcal capture friction', with --axis advance too), and the recipe states the plate's
    surface and stiffness. With --camera the plate may move: its pose follows from pictures and
    from the tip's contacts, as 'scissorcal track' has it. With --device sim the specimen's plate is
    pressed on.

    \b
    Example:
      $ scissorcal control --device sim --path path.csv --force 2 --pose 20,10,3
      followed 40.0 mm of path with 2 N on scissorcal-sim office-paper
      force 0.05 N rms and 0.10 N in 95 % off (known to 0.02 N), path 0.15 mm rms and ...
      ...
    """
    from scissorcal.cli.live_view import LiveView
    from scissorcal.workday.runs.control import control_workspace

    workspace = open_workspace(folder)
    with LiveView(ask=not yes) as view:
        controlled = control_workspace(workspace, rig, options, view.operator)
    return Answer(controlled.facts, _text(controlled), controlled.verdicts, controlled.files)


def _text(controlled: "RigRun[ControlResult]") -> str:
    done = controlled.result
    figures = done.figures
    peak = max(figures.peaks_N, default=float("nan"))
    lines = [
        f"followed {figures.way_mm:.1f} mm of path with {done.wanted_N:g} N on {controlled.rig}",
        f"force {figures.force_rms_N:.2f} N rms and {figures.force_95_N:.2f} N in 95 % off (known "
        f"to {figures.force_sd_N:.2f} N), path {figures.path_rms_mm:.2f} mm rms and "
        f"{figures.path_95_mm:.2f} mm in 95 %",
        f"{figures.touches} touches, the hardest {peak:.2f} N beyond what was wanted; contact "
        f"lost {figures.losses} times, let go of {figures.let_goes} times; "
        f"{100 * figures.limited_share:.1f} % of the ticks at a limit",
        "",
    ]
    if controlled.tracked:
        lines.insert(-1, controlled.tracked.sentence)
    rows = [["gain", "", ""]]
    rows += [
        ["damping along the normal", f"{done.gains.contact_kd:.0f}", "1/s"],
        ["integral of the force", f"{done.gains.force_ki:.0f}", "1/s"],
        ["slowest decay", f"{done.gains.decay_per_s:.1f}", "1/s"],
        ["path", f"{done.gains.path_kp:.0f}", "1/s^2"],
    ]
    lines += [table(rows, right=[1]), "", done.report.lag.sentence]
    if done.report.rights is not None:
        lines.append(done.report.rights.sentence)
    if done.warnings:
        lines += ["", *(f"note: {warning}" for warning in done.warnings)]
    return "\n".join(lines)
