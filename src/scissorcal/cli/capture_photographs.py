"""``scissorcal capture camera``, ``blade`` and ``plate``: photographs, taken in by one driver."""

import tempfile
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from scissorcal.cli.opening import open_workspace
from scissorcal.cli.options import Folder, Images, MoreImages, Seed
from scissorcal.cli.output import Answer, command, note
from scissorcal.errors import InputError

if TYPE_CHECKING:
    from scissorcal.vision.targets.boards import Board
    from scissorcal.workday.photographs import Taken
    from scissorcal.workday.workspace import Workspace

Source = Annotated[
    str | None,
    typer.Option(
        "--camera",
        metavar="NUMBER|VIDEO|sim",
        help="Take pictures from a camera or a video file, while the target is held still; sim: "
        "render them.",
    ),
]

_VIEWS_HELP = "Pictures to take from --camera; Ctrl-C ends it sooner."


@command
def camera(
    images: Images = None,
    more: MoreImages = None,
    source: Source = None,
    views: Annotated[int, typer.Option(min=3, help=_VIEWS_HELP)] = 20,
    words: Annotated[
        str,
        typer.Option(
            "--board",
            help="The printed camera board, or another: chessboard:9x6:25 (inner corners, mm), "
            "charuco:5x7:40:20:DICT_6X6_250 (squares, mm, mm); followed by :legacy where OpenCV "
            "before 4.6 drew an even number of rows.",
        ),
    ] = "camera",
    seed: Seed = 0,
    folder: Folder = None,
) -> Answer:
    """Take in photographs of the camera board, and say which views are missing.

    Photographs are copied unchanged. Take 15 with one focus, zoom and orientation of the camera:
    the board near and far, in every corner, and tilted by 20 to 45 deg to every side.

    \b
    Example:
      $ scissorcal capture camera --image board-*.jpg
      board-01.jpg: 48 of 48 corners, 65 px a square, middling, facing left
        places 6 of 9, sizes 1 of 3, slants 1 of 5; wanted: upper left, left, lower left, ...
      ...
    """
    from scissorcal.vision.targets.boards import board_from_words
    from scissorcal.vision.view_coverage import ViewCoverage
    from scissorcal.workday.runs.camera import capture_camera

    _refuse_two_sources(images, source)
    board = board_from_words(words)
    wanted = ViewCoverage()

    def store(workspace: "Workspace", photographs: Iterable[Path]) -> "Taken":
        nonlocal wanted
        taken, wanted = capture_camera(workspace, photographs, board, note)
        return taken

    return _take_in(
        open_workspace(folder),
        (*(images or ()), *(more or ())),
        partial(_board_pictures, source, board, seed, views) if source else None,
        store,
        of=lambda done: f"the {board.name}",
        facts=lambda done: {"board": board.name, "wanted": wanted.wanted},
        last_line=lambda done: f"\n{wanted.sentence()}",
    )


BladeSource = Annotated[
    Literal["sim"] | None,
    typer.Option("--camera", help="sim: three rendered photographs of the recipe's virtual blade."),
]
OTHER_LAMP = (
    "Photographs under one lamp share its shadow, and their agreement is no evidence: take others "
    "with the scissors turned by 90 deg, or the lamp elsewhere."
)
Both = Annotated[
    bool, typer.Option("--both", help="Open scissors: both blades in each photograph.")
]
NoMat = Annotated[bool, typer.Option("--no-mat", help="With --both: no mat; shapes have no scale.")]
Scale = Annotated[float | None, typer.Option(help="With --no-mat: millimetres per pixel.")]
LengthMm = Annotated[
    float | None, typer.Option(help="With --no-mat: the blade's length, pivot to tip.")
]
EdgeSide = Annotated[
    Literal["down", "up"],
    typer.Option("--edge", help="Which side of the mat the edge faces."),
]
Pivot = Annotated[
    tuple[float, float] | None,
    typer.Option(help="Pivot in pixels, where no hole marks it."),
]


@command
def blade(
    images: Images = None,
    source: BladeSource = None,
    both: Both = False,
    no_mat: NoMat = False,
    scale: Scale = None,
    length_mm: LengthMm = None,
    edge_side: EdgeSide = "down",
    pivot: Pivot = None,
    more: MoreImages = None,
    seed: Seed = 0,
    folder: Folder = None,
) -> Answer:
    """Take in photographs of a blade on the printed mat, or of open scissors.

    Lay the blade flat inside the markers, its pivot hole on the small cross, its tip to the right
    and its edge towards the lower side. Three photographs from slightly different places are
    enough. Of open scissors (--both) take four, turning them by 90 deg under the lamp after each.

    \b
    Example:
      $ scissorcal capture blade --image blade-*.jpg
      blade-01.jpg: 74.98 mm long, 362 points, borders 0.9 px soft
      ...
    """
    from scissorcal.vision.sim.sim_camera import render_blade_photographs
    from scissorcal.workday.demo.sim_photographs import specimen_blade
    from scissorcal.workday.photographs import BladeSetup
    from scissorcal.workday.runs.blade import capture_blade

    if bool(images) == bool(source):
        raise InputError("Give photographs with --image, or --camera sim.")
    _refuse_contradictions(both, no_mat, scale, length_mm, pivot)
    setup = BladeSetup(
        both=both,
        mat=not no_mat,
        edge_side=edge_side,
        scale_mm_per_px=scale,
        length_mm=length_mm,
        pivot_px=pivot,
    )
    return _take_in(
        open_workspace(folder),
        (*(images or ()), *(more or ())),
        (
            lambda workspace, scratch: render_blade_photographs(
                specimen_blade(workspace.recipe()), scratch, seed, both=both
            )
        )
        if source
        else None,
        lambda workspace, photographs: capture_blade(workspace, list(photographs), setup, note),
        of=lambda done: "open scissors" if both else "the blade",
        last_line=lambda done: f"\n{OTHER_LAMP}" if both else "",
    )


@command
def plate(
    images: Images = None,
    source: Source = None,
    views: Annotated[int, typer.Option(min=1, help=_VIEWS_HELP)] = 5,
    more: MoreImages = None,
    stances: Annotated[
        str | None,
        typer.Option(
            metavar="FILE|sim",
            help="The photographs are of the card on the rig's moving blade; this CSV file says "
            "where the rig stood in each: file,advance_mm,opening_deg. sim goes with --camera sim.",
        ),
    ] = None,
    seed: Seed = 0,
    folder: Folder = None,
) -> Answer:
    """Take in photographs of the plate's target, or of the rig's card at known stances.

    Take five from one place, without touching camera or plate, and not squarely from the front.
    With --stances, the photographs locate the camera in the rig's frame: photograph the card at
    several advances and openings.

    \b
    Example:
      $ scissorcal capture plate --image plate-*.jpg
      plate-01.jpg: 24 of 24 corners of the plate board, 62 px a side
      ...
    """
    from scissorcal.vision.sim.sim_camera import render_card_photographs, standing_plate
    from scissorcal.vision.stances import read_stances
    from scissorcal.workday.runs.plate import capture_plate

    _refuse_two_sources(images, source)
    if source and stances and (source, stances) != ("sim", "sim"):
        raise InputError(
            "The rig's stances are not known in pictures of a running camera: --stances goes with "
            "--image, or --stances sim with --camera sim."
        )
    known = read_stances(Path(stances)) if stances and not source else None

    def pictures(workspace: "Workspace", scratch: Path) -> Iterable[Path]:
        nonlocal known
        if not stances:
            return _plate_pictures(str(source), seed, views, workspace, scratch)
        recipe = workspace.recipe()
        made = render_card_photographs(recipe, scratch, seed, standing_plate(recipe))
        known = {path.name: stance for path, stance in made.items()}
        return list(made)

    def store(workspace: "Workspace", photographs: Iterable[Path]) -> "Taken":
        return capture_plate(workspace, photographs, note, stances=known)

    return _take_in(
        open_workspace(folder),
        (*(images or ()), *(more or ())),
        pictures if source else None,
        store,
        of=lambda done: f"the {done.capture.index.board.name}",
        facts=lambda done: {"target": done.capture.index.board.name},
    )


def _take_in(
    workspace: "Workspace",
    given: tuple[Path, ...],
    pictures: "Callable[[Workspace, Path], Iterable[Path]] | None",
    store: "Callable[[Workspace, Iterable[Path]], Any]",
    *,
    of: Callable[[Any], str],
    facts: Callable[[Any], Mapping[str, Any]] = lambda done: {},
    last_line: Callable[[Any], str] = lambda done: "",
) -> Answer:
    """Store the photographs ``given``, or those that ``pictures`` makes in a temporary folder.

    ``store`` checks and keeps them; ``of`` names what they show. Every capture of photographs ends
    here, so that all of them report alike.
    """
    with tempfile.TemporaryDirectory() as scratch:
        done = store(workspace, pictures(workspace, Path(scratch)) if pictures else given)
    count = len(done.taken)
    plural = "s" if count > 1 else ""
    text = f"{workspace.relative(done.capture.folder)}: {count} photograph{plural} of {of(done)}"
    if done.refused:
        text += f", {len(done.refused)} left out"
    result = {
        "capture": done.capture.folder,
        "photographs": done.taken,
        "left_out": done.refused,
        **facts(done),
    }
    files = [done.capture.path(photo) for photo in done.capture.index.photographs]
    return Answer(result, text + last_line(done), files=files)


def _board_pictures(
    source: str, board: "Board", seed: int, views: int, workspace: "Workspace", scratch: Path
) -> Iterable[Path]:
    from scissorcal.vision.live import pick_frames
    from scissorcal.vision.sim.sim_camera import render_board_photographs
    from scissorcal.vision.targets.boards import Chessboard

    if source != "sim":
        return pick_frames(source, board, scratch, views)
    if isinstance(board, Chessboard):
        raise InputError("Only printed boards with markers are rendered: leave --board out.")
    return render_board_photographs(board, scratch, seed, "board", count=views)


def _plate_pictures(
    source: str, seed: int, views: int, workspace: "Workspace", scratch: Path
) -> Iterable[Path]:
    from scissorcal.vision.live import pick_at_rest
    from scissorcal.vision.sim.sim_camera import render_plate_photographs, standing_plate
    from scissorcal.vision.targets.boards import PLATE_BOARD, PLATE_STRIP

    if source == "sim":
        recipe = workspace.recipe()
        stands = standing_plate(recipe)
        return render_plate_photographs(recipe, scratch, seed, count=views, rig_plate=stands)
    return pick_at_rest(source, (PLATE_BOARD, PLATE_STRIP), scratch, views)


def _refuse_two_sources(images: list[Path] | None, source: str | None) -> None:
    if bool(images) == bool(source):
        raise InputError("Give photographs with --image, or a camera or video with --camera.")


def _refuse_contradictions(
    both: bool,
    no_mat: bool,
    scale: float | None,
    length_mm: float | None,
    pivot: tuple[float, float] | None,
) -> None:
    if no_mat and not both:
        raise InputError("A blade alone needs the mat; --no-mat goes with --both.")
    if (scale is not None or length_mm is not None) and not no_mat:
        raise InputError("The mat gives the scale: --scale and --length-mm go with --no-mat.")
    if scale is not None and length_mm is not None:
        raise InputError("Give --scale or --length-mm, not both.")
    for name, value in (("--scale", scale), ("--length-mm", length_mm)):
        if value is not None and not 0.0 < value < 1e4:
            raise InputError(f"{name} must be a positive number.")
    if pivot is not None and both:
        raise InputError("Open scissors show their own pivot: leave --pivot out.")
