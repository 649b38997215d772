"""Render a workspace's package on a rig, and record what happened."""

from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from scissorcal.errors import ScissorcalError
from scissorcal.recipe.load import read_text
from scissorcal.workday.geometry import expected_package_hash
from scissorcal.workday.rigs import open_rig
from scissorcal.workday.runs.fit import current_fits
from scissorcal.workday.workspace import Workspace

if TYPE_CHECKING:
    from scissorcal.device.loading import Confirm
    from scissorcal.render import RenderResult, VirtualStrokes
    from scissorcal.render.engine import Progress


@dataclass(frozen=True)
class Rendered:
    """A finished rendering: its result, its recording (None if not wanted), and the rig."""

    result: "RenderResult"
    recording: Path | None
    rig: str


def render_workspace(
    workspace: Workspace,
    device: str,
    *,
    package_path: Path | None = None,
    seconds: float = 30.0,
    strokes: "VirtualStrokes | None" = None,
    record: bool = True,
    seed: int = 0,
    progress: "Progress | None" = None,
    confirm: "Confirm | None" = None,
) -> Rendered:
    """Render the workspace's package (or another) on ``device``, within the recipe's limits.

    ``device`` is a port, or "sim" for a virtual rig whose virtual hand makes ``strokes``. The
    samples go to captures/render-<stamp>.mcap unless ``record`` is False. Raises MissingError
    where there is no package, and what opening it, the rig and the rendering raise.
    """
    from scissorcal.package import open_package
    from scissorcal.render import open_writer, render

    recipe = workspace.recipe()
    package = open_package(package_path or workspace.package_path(recipe), warn=False)
    with open_rig(device, recipe.specimen, seed) as link:
        rig = f"{link.identity.name} {link.identity.serial}"
        path = workspace.new_recording("render") if record else None
        text = read_text(workspace.recipe_path)
        recording = open_writer(path, link, package, text) if path else nullcontext()
        with recording as writer:
            done = render(
                link,
                package,
                seconds=seconds,
                limits=recipe.limits,
                strokes=strokes,
                writer=writer,
                progress=progress,
                confirm=confirm,
            )
    return Rendered(done, path, rig)


def package_warnings(workspace: Workspace, package_path: Path | None = None) -> tuple[str, ...]:
    """What is wrong with the package that would be rendered, its review and fits, as sentences.

    Empty where there is none that can be opened, which rendering it then says.
    """
    from scissorcal.package import open_package

    try:
        package = open_package(
            package_path or workspace.package_path(workspace.recipe()), warn=False
        )
    except ScissorcalError:
        return ()
    return package.warnings


def package_has_fallen_behind(workspace: Workspace) -> bool:
    """Whether the workspace's package is of other fits or another recipe than there are now.

    False where there is none that can be opened, which rendering it then says.
    """
    from scissorcal.package import open_package

    recipe = workspace.recipe()
    try:
        manifest = open_package(workspace.package_path(recipe), warn=False).manifest
    except ScissorcalError:
        return False
    try:
        fits = current_fits(workspace, recipe)
    except ScissorcalError:
        return True
    expected = expected_package_hash(workspace, recipe, fits)
    return manifest.provenance.inputs_hash != expected
