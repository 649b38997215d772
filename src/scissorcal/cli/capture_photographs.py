"""``scissorcal capture camera``, ``blade`` and ``plate``: photographs."""

import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Annotated, Any, Literal

import typer

from scissorcal.cli.opening import open_workspace
from scissorcal.cli.options import RIG, Folder, options_of
from scissorcal.cli.output import Answer, command, note
from scissorcal.errors import InputError, warn_of_old_word

if TYPE_CHECKING:
    from scissorcal.recipe.schema import Recipe
    from scissorcal.vision.targets.boards import Board
    from scissorcal.workday.photographs import BladeSetup, Taken
    from scissorcal.workday.workspace import Workspace


@dataclass(frozen=True)
class Photographs:
    """Where photographs come from: files, or ``source`` (a camera, a video or "sim")."""

    images: list[Path] | None = None
    more: list[Path] | None = None
    source: str | None = None
    seed: int = 0
    views: int = 20

    @property
    def files(self) -> tuple[Path, ...]:
        """The files that were given."""
        return (*(self.images or ()), *(self.more or ()))

    def refuse_two_sources(self, otherwise: str = "a camera or video with --camera") -> None:
        """InputError where there is no source of pictures, or two."""
        if bool(self.images) == bool(self.source):
            raise InputError(f"Give photographs with --image, or {otherwise}.")


_FILES = {
    "images": typer.Option("--image", "-i", help="A photograph; repeat the option for each."),
    "more": typer.Argument(metavar="FILE", help="More photographs: what --image *.jpg expands to."),
    "seed": RIG["seed"],
}
_SOURCE = typer.Option(
    "--camera",
    metavar="NUMBER|VIDEO|sim",
    help="Take pictures from a camera or a video file, while the target is held still; sim: "
    "render them.",
)
_VIEWS_HELP = "Pictures to take from --camera; Ctrl-C ends it sooner."


@command
@options_of({**_FILES, "source": _SOURCE, "views": typer.Option(min=3, help=_VIEWS_HELP)})
def camera(
    photographs: Photographs,
    words: Annotated[
        str,
        typer.Option(
            "--board",
            help="The printed camera board, or another: chessboard:9x6:25 (inner corners, mm), "
            "charuco:5x7:40:20:DICT_6X6_250 (squares, mm, mm); followed by :legacy where OpenCV "
            "before 4.6 drew an even number of rows.",
        ),
    ] = "camera",
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
    from scissorcal.workday.runs.camera import capture_camera

    photographs.refuse_two_sources()
    board = board_from_words(words)
    workspace = open_workspace(folder)
    with _pictures(photographs, partial(_board_pictures, photographs, board)) as pictures:
        taken, wanted = capture_camera(workspace, pictures, board, note)
    facts = {"board": board.name, "wanted": wanted.wanted}
    return _answer(workspace, taken, f"the {board.name}", facts, f"\n{wanted.sentence()}")


@dataclass(frozen=True)
class BladePhotographs(Photographs):
    """Photographs of a blade, which no running camera takes."""

    source: Literal["sim"] | None = None


@dataclass(frozen=True)
class BladePlacing:
    """How a blade was laid down, as the command line states it."""

    both: bool = False
    no_mat: bool = False
    scale: float | None = None
    length_mm: float | None = None
    edge_side: Literal["down", "up"] = "down"
    pivot: tuple[float, float] | None = None

    def setup(self) -> "BladeSetup":
        """The same, as a workspace keeps it; InputError where options are at odds."""
        from scissorcal.workday.photographs import BladeSetup

        if self.no_mat and not self.both:
            raise InputError("A blade alone needs the mat; --no-mat goes with --both.")
        if (self.scale is not None or self.length_mm is not None) and not self.no_mat:
            raise InputError("The mat gives the scale: --scale and --length-mm go with --no-mat.")
        if self.scale is not None and self.length_mm is not None:
            raise InputError("Give --scale or --length-mm, not both.")
        for name, value in (("--scale", self.scale), ("--length-mm", self.length_mm)):
            if value is not None and not 0.0 < value < 1e4:
                raise InputError(f"{name} must be a positive number.")
        if self.pivot is not None and self.both:
            raise InputError("Open scissors show their own pivot: leave --pivot out.")
        return BladeSetup(
            both=self.both,
            mat=not self.no_mat,
            edge_side=self.edge_side,
            scale_mm_per_px=self.scale,
            length_mm=self.length_mm,
            pivot_px=self.pivot,
        )


OTHER_LAMP = (
    "Photographs under one lamp share its shadow, and their agreement is no evidence: take others "
    "with the scissors turned by 90 deg, or the lamp elsewhere."
)
_BLADE = {
    "source": typer.Option(
        "--camera", help="sim: three rendered photographs of the recipe's virtual blade."
    ),
    "both": typer.Option("--both", help="Open scissors: both blades in each photograph."),
    "no_mat": typer.Option("--no-mat", help="With --both: no mat; shapes have no scale."),
    "scale": typer.Option(help="With --no-mat: millimetres per pixel."),
    "length_mm": typer.Option(help="With --no-mat: the blade's length, pivot to tip."),
    "edge_side": typer.Option("--edge", help="Which side of the mat the edge faces."),
    "pivot": typer.Option(help="Pivot in pixels, where no hole marks it."),
}


@command
@options_of({**_FILES, **_BLADE})
def blade(photographs: BladePhotographs, placing: BladePlacing, folder: Folder = None) -> Answer:
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
    from scissorcal.workday.demo.photographs import specimen_blade
    from scissorcal.workday.runs.blade import capture_blade

    photographs.refuse_two_sources("--camera sim")
    setup = placing.setup()
    workspace = open_workspace(folder)

    def rendered(scratch: Path) -> Iterable[Path]:
        virtual = specimen_blade(workspace.recipe())
        return render_blade_photographs(virtual, scratch, photographs.seed, both=setup.both)

    with _pictures(photographs, rendered) as pictures:
        taken = capture_blade(workspace, list(pictures), setup, note)
    if setup.both:
        return _answer(workspace, taken, "open scissors", {}, f"\n{OTHER_LAMP}")
    return _answer(workspace, taken, "the blade")


@dataclass(frozen=True)
class PlatePhotographs(Photographs):
    """Photographs of the plate's target; fewer do."""

    views: int = 5


@command
@options_of({**_FILES, "source": _SOURCE, "views": typer.Option(min=1, help=_VIEWS_HELP)})
def plate(
    photographs: PlatePhotographs,
    positions: Annotated[
        str | None,
        typer.Option(
            metavar="FILE|sim",
            help="The photographs are of the card on the rig's moving blade; this CSV file says "
            "where the rig stood in each: file,advance_mm,opening_deg. sim goes with --camera sim.",
        ),
    ] = None,
    stances: Annotated[
        str | None, typer.Option(hidden=True, help="The old name of --positions.")
    ] = None,
    folder: Folder = None,
) -> Answer:
    """Take in photographs of the plate's target, or of the rig's card at known positions.

    Take five from one place, without touching camera or plate, and not squarely from the front.
    With --positions, the photographs locate the camera in the rig's frame: photograph the card at
    several advances and openings.

    \b
    Example:
      $ scissorcal capture plate --image plate-*.jpg
      plate-01.jpg: 24 of 24 corners of the plate board, 62 px a side
      ...
    """
    from scissorcal.vision.rig_positions import read_rig_positions
    from scissorcal.vision.sim.sim_camera import render_card_photographs, standing_plate
    from scissorcal.workday.runs.plate import capture_plate

    photographs.refuse_two_sources()
    if stances:
        warn_of_old_word("--stances", "--positions")
        positions = positions or stances
    source = photographs.source
    if source and positions and (source, positions) != ("sim", "sim"):
        raise InputError(
            "The rig's positions are not known in pictures of a running camera: --positions goes "
            "with --image, or --positions sim with --camera sim."
        )
    known = read_rig_positions(Path(positions)) if positions and not source else None
    workspace = open_workspace(folder)

    def made(scratch: Path) -> Iterable[Path]:
        nonlocal known
        recipe = workspace.recipe()
        if not positions:
            return _plate_pictures(photographs, recipe, scratch)
        known = {
            path.name: position
            for path, position in render_card_photographs(
                recipe, scratch, photographs.seed, standing_plate(recipe)
            ).items()
        }
        return [scratch / name for name in known]

    with _pictures(photographs, made) as pictures:
        taken = capture_plate(workspace, pictures, note, positions=known)
    board = taken.capture.index.board
    assert board is not None, "every photograph that is kept shows a target"
    name = board.name
    return _answer(workspace, taken, f"the {name}", {"target": name})


@contextmanager
def _pictures(
    photographs: Photographs, made: Callable[[Path], Iterable[Path]]
) -> Iterator[Iterable[Path]]:
    """The files that were given, or what is ``made`` in a temporary folder where none were."""
    with tempfile.TemporaryDirectory() as scratch:
        yield made(Path(scratch)) if photographs.source else photographs.files


def _answer(
    workspace: "Workspace",
    taken: "Taken",
    target: str,
    facts: Mapping[str, Any] = MappingProxyType({}),
    last_line: str = "",
) -> Answer:
    """What was taken in of a ``target``, alike for all captures of photographs."""
    count = len(taken.taken)
    plural = "s" if count > 1 else ""
    text = f"{workspace.relative(taken.capture.folder)}: {count} photograph{plural} of {target}"
    if taken.refused:
        text += f", {len(taken.refused)} left out"
    result = {
        "capture": taken.capture.folder,
        "photographs": taken.taken,
        "left_out": taken.refused,
        **facts,
    }
    files = [taken.capture.path(photo) for photo in taken.capture.index.photographs]
    return Answer(result, text + last_line, files=files)


def _board_pictures(photographs: Photographs, board: "Board", scratch: Path) -> Iterable[Path]:
    from scissorcal.vision.live import pick_frames
    from scissorcal.vision.sim.sim_camera import render_board_photographs
    from scissorcal.vision.targets.boards import Chessboard

    source, views = photographs.source, photographs.views
    assert source is not None
    if source != "sim":
        return pick_frames(source, board, scratch, views)
    if isinstance(board, Chessboard):
        raise InputError("Only printed boards with markers are rendered: leave --board out.")
    return render_board_photographs(board, scratch, photographs.seed, "board", count=views)


def _plate_pictures(photographs: Photographs, recipe: "Recipe", scratch: Path) -> Iterable[Path]:
    from scissorcal.vision.live import pick_at_rest
    from scissorcal.vision.sim.sim_camera import render_plate_photographs, standing_plate
    from scissorcal.vision.targets.boards import PLATE_BOARD, PLATE_STRIP

    source, views = photographs.source, photographs.views
    assert source is not None
    if source == "sim":
        return render_plate_photographs(
            recipe, scratch, photographs.seed, count=views, rig_plate=standing_plate(recipe)
        )
    return pick_at_rest(source, (PLATE_BOARD, PLATE_STRIP), scratch, views)
