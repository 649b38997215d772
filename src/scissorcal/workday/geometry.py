"""The geometry that photographs give: camera, blade and plate, as far as a scene requires them."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from scissorcal.errors import InputError, MissingError
from scissorcal.recipe.requirements import GeometryKind, requirements
from scissorcal.verdicts import Verdict
from scissorcal.workday.photographs import photo_captures
from scissorcal.workday.runs.blade import blade_inputs_hash, blade_path, fit_workspace_blade
from scissorcal.workday.runs.camera import camera_inputs_hash, camera_path, fit_workspace_camera
from scissorcal.workday.runs.plate import fit_workspace_plate, plate_inputs_hash, plate_path
from scissorcal.workday.workspace import FitKind, Workspace

if TYPE_CHECKING:
    from scissorcal.calibration import FitResult
    from scissorcal.calibration.plate.result import PlateFit
    from scissorcal.inference import Effort
    from scissorcal.model import EdgeBelief
    from scissorcal.recipe.schema import Recipe

Progress = Callable[[float, str], None]


@dataclass(frozen=True)
class GeometryFit:
    """One fit of a workspace's photographs: its verdicts, files, and whether it was cached."""

    what: GeometryKind
    path: Path
    pictures: tuple[Path, ...]
    verdicts: tuple[Verdict, ...]
    cached: bool


@dataclass(frozen=True)
class GeometryState:
    """Whether photographs, or what is fitted to them, are there and current.

    ``damaged``: a fit is there that cannot be read, and only --force replaces it.
    """

    status: Literal["done", "missing", "stale"]
    state: str
    files: tuple[Path, ...] = ()
    damaged: bool = False


def fit_geometry(
    workspace: Workspace,
    what: GeometryKind,
    *,
    effort: "Effort | None" = None,
    seed: int = 0,
    force: bool = False,
    progress: Progress | None = None,
) -> GeometryFit:
    """Fit the camera, the blade or the plate to its photographs, where anything changed."""
    if what == "camera":
        camera = fit_workspace_camera(workspace, seed=seed, force=force, progress=progress)
        return GeometryFit(what, camera.path, camera.pictures, camera.fit.verdicts, camera.cached)
    if what == "blade":
        blade = fit_workspace_blade(
            workspace, effort=effort, seed=seed, force=force, progress=progress
        )
        return GeometryFit(what, blade.path, blade.pictures, blade.result.verdicts, blade.cached)
    plate = fit_workspace_plate(workspace, force=force)
    return GeometryFit(what, plate.path, plate.pictures, plate.fit.verdicts, plate.cached)


def edge_belief(workspace: Workspace, recipe: "Recipe") -> "EdgeBelief | None":
    """The edge that photographs gave, None where the recipe's own is to be taken.

    Raises MissingError where the recipe asks for photographs and they are not fitted, or have
    changed since, InputError where their shape has no scale.
    """
    from scissorcal.calibration import load
    from scissorcal.calibration.edge.result import BladeResult

    if not requirements(recipe).needs_geometry("blade"):
        return None
    state = fit_state(workspace, recipe, "blade")
    if state.status != "done":
        raise MissingError(
            f"The recipe takes the edge from photographs, and the blade's fit is {state.state}: "
            "run 'scissorcal fit blade' first."
        )
    return load(blade_path(workspace), BladeResult).belief


def edge_verdicts(workspace: Workspace, recipe: "Recipe") -> tuple[Verdict, ...]:
    """Verdicts on the fit that the edge is taken from; none where it is the recipe's own."""
    from scissorcal.calibration import load
    from scissorcal.calibration.edge.result import BladeResult

    if not requirements(recipe).needs_geometry("blade"):
        return ()
    return load(blade_path(workspace), BladeResult).verdicts


def scene_plate(workspace: Workspace, recipe: "Recipe") -> "PlateFit | None":
    """Where the plate stands, None where the scene does not ask for it.

    Raises MissingError where it does, and the fit is missing or has fallen behind.
    """
    from scissorcal.calibration import load
    from scissorcal.calibration.plate.result import PlateFit

    if not requirements(recipe).needs_geometry("plate"):
        return None
    state = fit_state(workspace, recipe, "plate")
    if state.status != "done":
        raise MissingError(
            f"The scene asks where the plate stands, and its fit is {state.state}: run 'scissorcal "
            "fit plate' first."
        )
    return load(plate_path(workspace), PlateFit)


def expected_package_hash(
    workspace: Workspace, recipe: "Recipe", fits: "Mapping[FitKind, FitResult]"
) -> str:
    """Inputs hash of a package built now; one that no package has where the plate is missing."""
    from scissorcal.package import package_inputs_hash

    try:
        plate = scene_plate(workspace, recipe)
    except (MissingError, InputError):
        return "no fit of the plate"
    return package_inputs_hash(recipe, fits.get("friction"), fits.get("cut"), plate)


def photograph_state(workspace: Workspace, what: GeometryKind) -> GeometryState:
    """Whether there are photographs of the camera's board, the blade or the plate."""
    try:
        captures = photo_captures(workspace, what)
    except InputError as error:
        return GeometryState("stale", str(error))
    if not captures and what == "camera" and camera_path(workspace).is_file():
        return GeometryState("done", "brought in from a file", (camera_path(workspace),))
    if not captures:
        return GeometryState("missing", "no photographs yet")
    count = sum(len(capture.index.photographs) for capture in captures)
    words = f"{count} photograph{'s' if count > 1 else ''}"
    return GeometryState("done", words, tuple(capture.folder for capture in captures))


def fit_state(workspace: Workspace, recipe: "Recipe", what: GeometryKind) -> GeometryState:
    """Whether the fit of photographs is there, readable and of what is there now."""
    from scissorcal.calibration import read_header

    path = _PATHS[what](workspace)
    if not path.is_file():
        return GeometryState("missing", "not fitted yet")
    try:
        stored = read_header(path)
    except InputError:
        return GeometryState("stale", f"{workspace.relative(path)} is damaged", damaged=True)
    try:
        current = stored.inputs_hash in _expected(workspace, recipe, what)
        current |= stored.origin == "imported" and not photo_captures(workspace, what)
    except InputError as error:
        return GeometryState("stale", str(error))
    if not current:
        return GeometryState("stale", "its inputs changed since")
    words = f"failed: {', '.join(stored.failed)}" if stored.failed else "fitted"
    return GeometryState("done", words, (path,))


_EFFORTS = ("draft", "standard", "thorough")
_PATHS: dict[GeometryKind, Callable[[Workspace], Path]] = {
    "camera": camera_path,
    "blade": blade_path,
    "plate": plate_path,
}


def _expected(workspace: Workspace, recipe: "Recipe", what: GeometryKind) -> set[str]:
    """Inputs hashes that a current fit may have: one for each effort where it has any."""
    if what == "camera":
        return {camera_inputs_hash(photo_captures(workspace, "camera"))}
    if what == "blade":
        captures = photo_captures(workspace, "blade")
        return {blade_inputs_hash(workspace, recipe, captures, effort) for effort in _EFFORTS}
    return {plate_inputs_hash(workspace, recipe)}
