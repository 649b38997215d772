"""A workspace: a folder with a recipe.toml, and where everything in it lies."""

import contextlib
import shutil
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Literal, get_args

from scissorcal.errors import InputError, MissingError, check_known, file_error
from scissorcal.files import remove_left_over, replacing
from scissorcal.workday.workspace_steps import WorkspaceSteps

if TYPE_CHECKING:
    from scissorcal.recipe.schema import Recipe

RecordingKind = Literal["friction", "friction-advance", "cut", "render", "control", "track"]
FitKind = Literal["friction", "friction-advance", "cut"]

PHOTOGRAPH_INDEX = "capture.json"
RECIPE_FILE = "recipe.toml"
DEMO_MARKER = ".scissorcal-demo"


@dataclass(frozen=True)
class Workspace(WorkspaceSteps):
    """The file names of one workspace, and its steps as functions (`WorkspaceSteps`).

    captures/<kind>-<UTC stamp>.mcap, fits/friction.nc, fits/friction-advance.nc and fits/cut.nc
    with their verifications fits/<what>.verify.json, report/report.html and report/report.json with
    their signature report/signature.json, package/<recipe name>.zip, all below ``root``.
    """

    root: Path

    def __repr__(self) -> str:
        """One line: the folder."""
        return f"<workspace {self.root}>"

    @property
    def recipe_path(self) -> Path:
        return self.root / RECIPE_FILE

    @property
    def captures_dir(self) -> Path:
        return self.root / "captures"

    @property
    def exclusions_path(self) -> Path:
        """Which recordings fits do not use, and why."""
        return self.captures_dir / "excluded.json"

    @property
    def probe_path(self) -> Path:
        """What the last probe of a rig found."""
        return self.root / "device-probe.json"

    @property
    def design_path(self) -> Path:
        """The last list of captures that was designed."""
        return self.root / "captures" / "design.json"

    @property
    def report_html(self) -> Path:
        return self.root / "report" / "report.html"

    @property
    def report_json(self) -> Path:
        return self.root / "report" / "report.json"

    @property
    def trade_html(self) -> Path:
        return self.root / "bench" / "trade.html"

    @property
    def trade_json(self) -> Path:
        return self.root / "bench" / "trade.json"

    @property
    def trade_partial_path(self) -> Path:
        """Where 'bench trade' keeps each measurement as it is made."""
        return self.root / "bench" / "trade.partial.jsonl"

    @property
    def signature_path(self) -> Path:
        return self.root / "report" / "signature.json"

    def recipe(self) -> "Recipe":
        """Load the workspace's recipe; InputError where it is wrong."""
        from scissorcal.recipe.load import load_recipe

        return load_recipe(self.recipe_path)

    def recordings(self, kind: RecordingKind) -> tuple[Path, ...]:
        """Return all recordings of one kind, oldest first, also those that fits do not use.

        UnknownNameError, with the nearest name, for a kind that there is not.
        """
        check_known("kind of recording", kind, get_args(RecordingKind))
        longer = tuple(f"{k}-" for k in get_args(RecordingKind) if k.startswith(f"{kind}-"))
        found = self.captures_dir.glob(f"{kind}-*.mcap")
        own = [path for path in found if not path.name.startswith(longer)]
        return tuple(sorted(own, key=lambda path: path.stem))

    def photograph_indexes(self, kind: str) -> list[Path]:
        """Return the index of each finished capture of photographs, oldest first.

        A dot in the name of its folder marks one that is being taken or was interrupted.
        """
        found = self.captures_dir.glob(f"{kind}-*/{PHOTOGRAPH_INDEX}")
        return sorted(path for path in found if "." not in path.parent.name)

    def new_recording(self, kind: RecordingKind, now: datetime | None = None) -> Path:
        """Return a file name for a new recording that no file has yet; makes the folder."""
        stamp = (now or datetime.now(UTC)).astimezone(UTC).strftime("%Y%m%dT%H%M%SZ")
        self.captures_dir.mkdir(parents=True, exist_ok=True)
        path = self.captures_dir / f"{kind}-{stamp}.mcap"
        number = 1
        while any(self.captures_dir.glob(f"{path.name}*")):
            number += 1
            path = self.captures_dir / f"{kind}-{stamp}-{number}.mcap"
        return path

    def fit_path(self, what: str) -> Path:
        return self.root / "fits" / f"{what}.nc"

    def verify_partial_path(self, what: FitKind) -> Path:
        """Where a verification keeps each of its fits as it is done."""
        return self.root / "fits" / f"{what}.verify.partial.jsonl"

    def package_path(self, recipe: "Recipe") -> Path:
        return self.root / "package" / f"{recipe.name}.zip"

    @property
    def scene_choice_path(self) -> Path:
        """What the scene needs of the fits, as it was worked out last."""
        return self.root / "package" / "scene-choice.json"

    def remove_left_over(self) -> None:
        """Remove what killed commands left half-written; half a capture is recovered elsewhere."""
        inside = [one for one in self.root.iterdir() if one.is_dir() and one != self.captures_dir]
        fits = [one for one in (self.root / "fits").glob("*") if one.is_dir()]
        for folder in (self.root, *inside, *fits):
            remove_left_over(folder)
        remove_left_over(self.captures_dir, folders=False)

    def relative(self, path: Path) -> str:
        """Name a file of the workspace as seen from its root."""
        return str(path.relative_to(self.root)) if path.is_relative_to(self.root) else str(path)


def find_workspace(folder: Path | None = None) -> Workspace:
    """Find the workspace that ``folder`` (or where you stand) lies in, looking upward.

    Raises MissingError where no folder on the way up has a recipe.toml.
    """
    start = (folder or Path.cwd()).absolute()
    for candidate in (start, *start.parents):
        if (candidate / RECIPE_FILE).is_file():
            return Workspace(candidate)
    raise MissingError(
        f"There is no {RECIPE_FILE} in {start} or above it, so this is no workspace: start one "
        "with 'scissorcal init NAME --recipe paper-80gsm', or go into one."
    )


def create_workspace(folder: Path, recipe_name: str) -> Workspace:
    """Make a workspace: the folder, and a copy of a built-in recipe (or of a recipe file) in it.

    The drawings of the recipe's plate are copied with it. All is checked before a copy is made.
    Raises InputError where the folder already has a recipe, or another file of a drawing's name,
    or where the recipe is unknown or wrong, or a drawing of it.
    """
    from scissorcal.recipe.load import parse_recipe, read_text, recipe_file
    from scissorcal.recipe.plate_layers import plate_pieces

    workspace = Workspace(folder.absolute())
    if workspace.recipe_path.exists():
        raise InputError(
            f"{workspace.recipe_path} is there already, and was left as it is: choose another "
            "folder, or edit that recipe."
        )
    source = recipe_file(recipe_name)
    text = read_text(source)
    recipe = parse_recipe(text, str(source))
    plate_pieces(recipe.plate, source.parent)
    copies = _drawings_to_copy(recipe, source.parent, workspace.root)
    try:
        made = [one for one in (workspace.root, *workspace.root.parents) if not one.exists()]
        try:
            workspace.root.mkdir(parents=True, exist_ok=True)
            for path, data in copies.items():
                with replacing(path) as part:
                    part.write_bytes(data)
            with replacing(workspace.recipe_path) as part:
                part.write_text(text, encoding="utf-8")
        except BaseException:
            for path in copies:
                path.unlink(missing_ok=True)
            with contextlib.suppress(OSError):  # a folder that is not empty stays
                for folder in made:
                    folder.rmdir()
            raise
    except OSError as error:
        raise file_error(error, workspace.root) or error from None
    return workspace


def _drawings_to_copy(recipe: "Recipe", source: Path, target: Path) -> dict[Path, bytes]:
    """What is to be written for the drawings of a recipe; what lies there already is left."""
    from scissorcal.foreign import read_foreign
    from scissorcal.foreign.formats import DRAWING

    copies = {}
    for name in recipe.plate.drawings:
        data, path = read_foreign(source / name, DRAWING), target / name
        if not path.exists():
            copies[path] = data
        elif read_foreign(path, DRAWING) != data:
            raise InputError(
                f"{path} is there already, and is not the drawing of this recipe; it was left as "
                "it is: choose another folder, or move it away."
            )
    return copies


def demo_folder(folder: Path) -> Path:
    """Make an empty folder for a demo; one that an earlier demo made is cleared first.

    Raises InputError where the folder holds anything else, which is left as it is.
    """
    marker = folder / DEMO_MARKER
    try:
        if marker.is_file():
            shutil.rmtree(folder)
        if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
            raise InputError(
                f"{folder} is there already and no demo made it, so it was left as it is: name "
                "another folder with --folder."
            )
        folder.mkdir(parents=True, exist_ok=True)
        marker.write_text("A demo made this folder; the next one replaces it.\n", encoding="utf-8")
    except OSError as error:
        raise file_error(error, folder) or error from None
    return folder
