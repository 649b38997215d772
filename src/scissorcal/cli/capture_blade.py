"""``scissorcal capture blade``"""

import tempfile
from pathlib import Path
from typing import Literal

import click

from scissorcal.cli.opening import open_workspace
from scissorcal.cli.options import images_option, seed_option, workspace_option
from scissorcal.cli.output import Answer, command, note


@click.command("blade")
@images_option("the blade on the mat")
@click.option(
    "--camera",
    "source",
    type=click.Choice(["sim"]),
    help="sim: three rendered photographs of the recipe's virtual blade.",
)
@click.option("--both", is_flag=True, help="Open scissors: both blades in each photograph.")
@click.option("--no-mat", is_flag=True, help="With --both: no mat, so shapes come up to scale.")
@click.option("--scale", type=float, help="With --no-mat: millimetres per pixel.")
@click.option("--length-mm", type=float, help="With --no-mat: the blade's length, pivot to tip.")
@click.option(
    "--edge",
    "edge_side",
    type=click.Choice(["down", "up"]),
    default="down",
    show_default=True,
    help="Which rim of the mat the edge faces.",
)
@click.option(
    "--pivot", nargs=2, type=float, default=None, help="Pivot in pixels, where no hole shows it."
)
@click.argument("more", nargs=-1, type=click.Path(path_type=Path))
@seed_option
@workspace_option
@command
def blade(
    images: tuple[Path, ...],
    source: str | None,
    both: bool,
    no_mat: bool,
    scale: float | None,
    length_mm: float | None,
    edge_side: Literal["down", "up"],
    pivot: tuple[float, float] | None,
    more: tuple[Path, ...],
    seed: int,
    folder: Path | None,
) -> Answer:
    """Take in photographs of a blade on the printed mat, or of open scissors.

    Lay the blade flat inside the markers, its pivot hole on the small cross, its tip to the right
    and its edge towards the lower rim. Three photographs from slightly different places are enough.
    What comes after the first file name counts as photographs too.

    \b
    Example:
      $ scissorcal capture blade --image blade-*.jpg
      blade-01.jpg: 74.98 mm long, 362 points, borders 0.9 px soft
      ...
    """
    from scissorcal.workday.photographs import BladeSetup
    from scissorcal.workday.runs.blade import capture_blade

    _refuse_contradictions(images, source, both, no_mat, scale, length_mm, pivot)
    workspace = open_workspace(folder)
    setup = BladeSetup(
        both=both,
        mat=not no_mat,
        edge_side=edge_side,
        scale_mm_per_px=scale,
        length_mm=length_mm,
        pivot_px=pivot,
    )
    if source == "sim":
        from scissorcal.vision.sim.sim_camera import render_blade_photographs
        from scissorcal.workday.demo.sim_photographs import specimen_blade

        with tempfile.TemporaryDirectory() as scratch:
            shape = specimen_blade(workspace.recipe())
            made = render_blade_photographs(shape, Path(scratch), seed, both=both)
            done = capture_blade(workspace, made, setup, note)
    else:
        done = capture_blade(workspace, (*images, *more), setup, note)
    place = workspace.relative(done.capture.folder)
    what = "open scissors" if both else "the blade"
    count = len(done.taken)
    text = f"{place}: {count} photograph{'s' if count > 1 else ''} of {what}"
    if done.refused:
        text += f", {len(done.refused)} left out"
    result = {
        "capture": done.capture.folder,
        "photographs": done.taken,
        "left_out": done.refused,
    }
    files = [done.capture.path(photo) for photo in done.capture.index.photographs]
    return Answer(result, text, files=files)


def _refuse_contradictions(
    images: tuple[Path, ...],
    source: str | None,
    both: bool,
    no_mat: bool,
    scale: float | None,
    length_mm: float | None,
    pivot: tuple[float, float] | None,
) -> None:
    if bool(images) == bool(source):
        raise click.UsageError("Give photographs with --image, or --camera sim.")
    if no_mat and not both:
        raise click.UsageError("A blade alone needs the mat; --no-mat goes with --both.")
    if (scale is not None or length_mm is not None) and not no_mat:
        raise click.UsageError("The mat gives the scale: --scale and --length-mm go with --no-mat.")
    if scale is not None and length_mm is not None:
        raise click.UsageError("Give --scale or --length-mm, not both.")
    for name, value in (("--scale", scale), ("--length-mm", length_mm)):
        if value is not None and not 0.0 < value < 1e4:
            raise click.UsageError(f"{name} must be a positive number.")
    if pivot is not None and both:
        raise click.UsageError("Open scissors show their own pivot: leave --pivot out.")
