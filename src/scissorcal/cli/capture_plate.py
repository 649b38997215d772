"""``scissorcal capture plate``"""

import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from scissorcal.cli.opening import open_workspace
from scissorcal.cli.options import images_option, seed_option, workspace_option
from scissorcal.cli.output import Answer, command, note

if TYPE_CHECKING:
    from scissorcal.workday.runs.plate import PlateCapture
    from scissorcal.workday.workspace import Workspace


@click.command("plate")
@images_option("the plate's target")
@click.option(
    "--camera",
    "source",
    metavar="NUMBER|VIDEO|sim",
    help="Take pictures from a camera or a video file; sim: rendered photographs.",
)
@click.option(
    "--views",
    type=click.IntRange(min=1),
    default=5,
    show_default=True,
    help="Pictures to take from --camera; Ctrl-C ends it sooner.",
)
@click.argument("more", nargs=-1, type=click.Path(path_type=Path))
@click.option(
    "--stances",
    metavar="FILE|sim",
    default=None,
    help="The photographs are of the card on the rig's moving blade; this CSV file says where the "
    "rig stood in each: file,advance_mm,opening_deg. sim goes with --camera sim.",
)
@seed_option
@workspace_option
@command
def plate(
    images: tuple[Path, ...],
    source: str | None,
    views: int,
    more: tuple[Path, ...],
    stances: str | None,
    seed: int,
    folder: Path | None,
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
    from scissorcal.vision.stances import read_stances
    from scissorcal.workday.runs.plate import capture_plate

    if bool(images) == bool(source):
        raise click.UsageError("Give photographs with --image, or a camera or video with --camera.")
    if source and stances and (source, stances) != ("sim", "sim"):
        raise click.UsageError(
            "Nobody knows where the rig stood in a running camera's pictures: --stances goes with "
            "--image, or --stances sim with --camera sim."
        )
    workspace = open_workspace(folder)
    if source:
        done = _from_camera(workspace, source, views, seed, card=bool(stances))
    else:
        where = read_stances(Path(stances)) if stances else None
        done = capture_plate(workspace, (*images, *more), note, stances=where)
    place = workspace.relative(done.capture.folder)
    count = len(done.taken)
    text = f"{place}: {count} photograph{'s' if count > 1 else ''} of the {done.target}"
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


def _from_camera(
    workspace: "Workspace", source: str, views: int, seed: int, *, card: bool
) -> "PlateCapture":
    from scissorcal.vision.live import pick_at_rest
    from scissorcal.vision.sim.sim_camera import render_card_photographs, render_plate_photographs
    from scissorcal.vision.targets.boards import PLATE_BOARD, PLATE_STRIP
    from scissorcal.workday.runs.plate import capture_plate

    with tempfile.TemporaryDirectory() as scratch:
        if card:
            made = render_card_photographs(workspace.recipe(), Path(scratch), seed)
            where = {path.name: stance for path, stance in made.items()}
            return capture_plate(workspace, list(made), note, stances=where)
        if source == "sim":
            still: Sequence[Path] = render_plate_photographs(
                workspace.recipe(), Path(scratch), seed, count=views
            )
            return capture_plate(workspace, still, note)
        frames = pick_at_rest(source, (PLATE_BOARD, PLATE_STRIP), Path(scratch), views)
        return capture_plate(workspace, frames, note)
