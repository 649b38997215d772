"""``scissorcal capture camera``"""

import tempfile
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import click

from scissorcal.cli.opening import open_workspace
from scissorcal.cli.options import images_option, seed_option, workspace_option
from scissorcal.cli.output import Answer, command, note

if TYPE_CHECKING:
    from scissorcal.vision.targets.boards import Board


@click.command("camera")
@images_option("the board")
@click.option(
    "--camera",
    "source",
    metavar="NUMBER|VIDEO|sim",
    help="Pick pictures from a camera or a video file, where the board is held still; sim: render "
    "them.",
)
@click.option(
    "--views",
    type=click.IntRange(min=3),
    default=20,
    show_default=True,
    help="Pictures to pick from --camera; Ctrl-C ends it sooner.",
)
@click.argument("more", nargs=-1, type=click.Path(path_type=Path))
@click.option(
    "--board",
    "words",
    default="camera",
    show_default=True,
    help="The printed camera board, or another: chessboard:9x6:25 (inner corners, mm), "
    "charuco:5x7:40:20:DICT_6X6_250 (squares, mm, mm).",
)
@seed_option
@workspace_option
@command
def camera(
    images: tuple[Path, ...],
    more: tuple[Path, ...],
    source: str | None,
    views: int,
    words: str,
    seed: int,
    folder: Path | None,
) -> Answer:
    """Take in photographs of the camera board, and say which views are still wanted.

    Photographs are copied as they are. Take 15, all at one focus and zoom and held one way, with
    the board near and far, in every corner, and turned by 20 to 45 deg to every side. What comes
    after the first file name counts as photographs too, so that a shell's board-*.jpg works.

    \b
    Example:
      $ scissorcal capture camera --image board-*.jpg
      board-01.jpg: 48 of 48 corners, 65 px a square, middling, facing left
        places 6 of 9, sizes 1 of 3, slants 1 of 5; wanted: upper left, left, lower left, ...
      ...
    """
    from scissorcal.vision.live import pick_frames
    from scissorcal.vision.targets.board_words import board_from_words
    from scissorcal.workday.runs.camera import capture_camera

    if bool(images) == bool(source):
        raise click.UsageError("Give photographs with --image, or a camera or video with --camera.")
    board = board_from_words(words)
    workspace = open_workspace(folder)
    if source:
        with tempfile.TemporaryDirectory() as scratch:
            frames: Iterable[Path]
            if source == "sim":
                frames = _rendered(board, Path(scratch), seed, views)
            else:
                frames = pick_frames(source, board, Path(scratch), views)
            done = capture_camera(workspace, frames, board, note)
    else:
        done = capture_camera(workspace, (*images, *more), board, note)
    place = workspace.relative(done.capture.folder)
    count = len(done.taken)
    text = f"{place}: {count} photograph{'s' if count > 1 else ''} of the {board.name}"
    if done.refused:
        text += f", {len(done.refused)} left out"
    text += f"\n{done.coverage.sentence()}"
    result = {
        "capture": done.capture.folder,
        "board": board.name,
        "photographs": done.taken,
        "left_out": done.refused,
        "wanted": done.coverage.wanted,
    }
    files = [done.capture.path(photo) for photo in done.capture.index.photographs]
    return Answer(result, text, files=files)


def _rendered(board: "Board", folder: Path, seed: int, views: int) -> Sequence[Path]:
    from scissorcal.vision.sim.sim_camera import render_board_photographs
    from scissorcal.vision.targets.boards import Chessboard

    if isinstance(board, Chessboard):
        raise click.UsageError("Only printed boards with markers are rendered: leave --board out.")
    return render_board_photographs(board, folder, seed, "board", count=views)
