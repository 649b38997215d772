"""Render a workspace's package on a rig, and record what happened."""

from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from scissorcal.errors import ScissorcalError
from scissorcal.recipe.load import read_text
from scissorcal.workday.engine import Engine
from scissorcal.workday.rigs import line_of, open_rig
from scissorcal.workday.runs.probe import Say, ensure_probed
from scissorcal.workday.workspace import Workspace

if TYPE_CHECKING:
    from scissorcal.device.loading import Confirm
    from scissorcal.render import RenderResult, VirtualStrokes
    from scissorcal.render.watch import Progress


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
    baud: int | None = None,
    realtime: bool = False,
    progress: "Progress | None" = None,
    confirm: "Confirm | None" = None,
    say: "Say | None" = None,
) -> Rendered:
    """Render the workspace's package (or another) on ``device``, within the recipe's limits.

    ``device`` is a port, or "sim" for a virtual rig whose virtual hand makes ``strokes``, in
    virtual time unless ``realtime``; ``baud`` takes the place of the recipe's rate. The samples go
    to captures/render-<stamp>.mcap unless ``record`` is False. A rig without a probe that counts is
    probed first (`ensure_probed`), and ``say`` tells so. Raises MissingError
    where there is no package, and what opening it, the rig and the rendering raise.
    """
    from scissorcal.package import open_package
    from scissorcal.render import open_writer, render

    recipe = workspace.recipe()
    package = open_package(package_path or workspace.package_path(recipe), warn=False)
    line = line_of(recipe, baud)
    with open_rig(device, recipe.specimen, seed, realtime=realtime, line=line) as link:
        rig = f"{link.identity.name} {link.identity.serial}"
        probe = ensure_probed(workspace, link, recipe, confirm=confirm, say=say)
        path = workspace.new_recording("render") if record else None
        text = read_text(workspace.recipe_path)
        sign = recipe.rig.motor_sign
        recording = (
            open_writer(path, link, package, text, motor_sign=sign, probe=probe)
            if path
            else nullcontext()
        )
        with recording as writer:
            done = render(
                link,
                package,
                seconds=seconds,
                limits=recipe.limits,
                motor_sign=sign,
                strokes=strokes,
                writer=writer,
                progress=progress,
                confirm=confirm,
            )
    return Rendered(done, path, rig)


def package_warnings(workspace: Workspace, package_path: Path | None = None) -> tuple[str, ...]:
    """What is to be known before the package is rendered: its review, its fits, and their states.

    Empty where there is none that can be opened, which rendering it then says.
    """
    from scissorcal.package import open_package

    engine = Engine.of(workspace)
    try:
        package = open_package(package_path or engine.file("package build"), warn=False)
    except ScissorcalError:
        return ()
    if package_path is not None:
        return package.warnings
    state = engine.state("package build")
    said = []
    if state.state == "stale":
        said.append(f"The package is stale: {state.found}. Run '{state.command}'.")
    said += [
        f"The {name.replace('fit', 'fit of')} is unverified: no trust check says whether its "
        f"intervals hold ('{engine.state(name).command}')."
        for name in ("fit friction", "fit cut")
        if engine.state(name).state == "unverified"
    ]
    return (*said, *package.warnings)
