"""``scissorcal capture plate``"""

from pathlib import Path

import click

from scissorcal.cli.opening import open_workspace
from scissorcal.cli.options import workspace_option
from scissorcal.cli.output import Answer, command, note


@click.command("plate")
@click.option(
    "--image",
    "-i",
    "images",
    type=click.Path(path_type=Path),
    multiple=True,
    required=True,
    help="A photograph of the plate's target; give it again for each.",
)
@click.argument("more", nargs=-1, type=click.Path(path_type=Path))
@click.option(
    "--stances",
    type=click.Path(path_type=Path),
    default=None,
    help="The photographs are of the card on the rig's moving blade; this CSV file says where the "
    "rig stood in each: file,advance_mm,opening_deg.",
)
@workspace_option
@command
def plate(
    images: tuple[Path, ...], more: tuple[Path, ...], stances: Path | None, folder: Path | None
) -> Answer:
    """Take in photographs of the plate's target, or of the rig's card at known stances.

    Take five from one place, without touching camera or plate, and not squarely from the front.
    What comes after the first file name counts as photographs too. With --stances they tell where
    the camera stands in the rig's frame: photograph the card at several advances and openings.

    \b
    Example:
      $ scissorcal capture plate --image plate-*.jpg
      plate-01.jpg: 24 of 24 corners of the plate board, 62 px a side
      ...
    """
    from scissorcal.workday.plates import capture_plate, read_stances

    workspace = open_workspace(folder)
    where = read_stances(stances) if stances else None
    done = capture_plate(workspace, (*images, *more), note, stances=where)
    place = workspace.relative(done.capture.folder)
    text = f"{place}: {len(done.taken)} photographs of the {done.target}"
    if done.refused:
        text += f", {len(done.refused)} left out"
    result = {
        "capture": done.capture.folder,
        "target": done.target,
        "photographs": done.taken,
        "left_out": done.refused,
    }
    files = [done.capture.path(photo) for photo in done.capture.index.photographs]
    return Answer(result, text, files=files)
