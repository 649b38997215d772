"""Render a workspace's package on a rig, and record what happened."""

import json
import math
from contextlib import ExitStack, nullcontext
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from scissorcal.aliases import Say
from scissorcal.errors import InputError, MissingError, ScissorcalError, VerdictError
from scissorcal.files import replacing
from scissorcal.recipe.load import read_text
from scissorcal.workday.engine import Engine
from scissorcal.workday.rigs import line_of, open_rig
from scissorcal.workday.runs.fit import available, load_result
from scissorcal.workday.runs.probe import ensure_probed
from scissorcal.workday.workspace import Workspace

if TYPE_CHECKING:
    from collections.abc import Sequence

    from scissorcal.aliases import Progress
    from scissorcal.device.loading import Confirm
    from scissorcal.package import ModelPackage
    from scissorcal.recipe.plate_surface import PlateTracking
    from scissorcal.recipe.schema import Recipe
    from scissorcal.render import PoseSource, RenderResult, RigFacts, VirtualStrokes
    from scissorcal.workday.tracking.plate_camera import PlateCamera, TrackedRun

NONE = "none"


@dataclass(frozen=True)
class Rendered:
    """A finished rendering: its result, its recording (None if not wanted), and the rig.

    ``tracked`` is what became of a camera's pictures and of taps, None without a camera.
    """

    result: "RenderResult"
    recording: Path | None
    rig: str
    tracked: "TrackedRun | None" = None


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
    plate: "PoseSource | None" = None,
    camera: str = NONE,
    taps_s: float = 0.0,
    accept_derated: bool = False,
    allow_mismatch: bool = False,
    trusted: "Sequence[str] | None" = None,
) -> Rendered:
    """Render the workspace's package (or another) on ``device``, within the recipe's limits.

    ``device`` is a port, or "sim" for a virtual rig whose virtual hand makes ``strokes``, in
    virtual time unless ``realtime``; ``baud`` takes the place of the recipe's rate. The samples go
    to captures/render-<stamp>.mcap unless ``record`` is False. A rig without a probe that counts is
    probed first (`ensure_probed`), and ``say`` tells so. ``plate`` tracks a plate whose pose the
    scene estimates, or ``camera`` does (a camera's number, or "sim" with the device "sim"); without
    them the pose fitted to photographs is taken. Before the rendering a person taps the tracked
    plate with the blade's tip for ``taps_s``, motors off. ``accept_derated``: a person wants what
    is felt to differ by more than the scene's tolerance, see `scissorcal.render.render`.

    Raises MissingError where there is no package or no pose, or where the package is stale,
    InputError where it is of another rig, both unless ``allow_mismatch``, InputError where a camera
    is named for a known pose or does not go with the device, and what opening them and the
    rendering raise.
    """
    from scissorcal.package import open_package
    from scissorcal.render import open_writer, render
    from scissorcal.render.mismatch import refuse_other_rig
    from scissorcal.render.rig_facts import with_probe

    recipe = workspace.recipe()
    package = open_package(package_path or workspace.package_path(recipe), warn=False)
    if trusted is not None:
        _refuse_untrusted(package, trusted)
    stale = "" if package_path else _stale(Engine.of(workspace))
    if not allow_mismatch:
        if stale:
            raise MissingError(f"{stale} To render it all the same: --allow-mismatch.")
        _refuse_other_blades(recipe, package)
    eye = _camera(workspace, package, camera, device, taps_s, seed=seed, realtime=realtime)
    line = line_of(recipe, baud)
    with ExitStack() as stack:
        opened = (
            eye.open_rig(device, seed, line)
            if eye
            else open_rig(device, recipe.specimen, seed, realtime=realtime, line=line)
        )
        link = stack.enter_context(opened)
        rig = f"{link.identity.name} {link.identity.serial}"
        if not allow_mismatch:
            refuse_other_rig(package, link.identity)
        probe = ensure_probed(workspace, link, recipe, confirm=confirm, say=say)
        path = workspace.new_recording("render") if record else None
        text = read_text(workspace.recipe_path)
        sign = recipe.rig.motor_sign
        recording = (
            open_writer(path, link, package, text, motor_sign=sign, probe=probe)
            if path
            else nullcontext()
        )
        with recording as writer, ExitStack() as seeing:
            if stale and writer:
                writer.note(stale)
            if eye:
                plate = seeing.enter_context(eye.follow(link, writer, taps_s=taps_s, say=say))
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
                rig=with_probe(_known_rig(workspace, package), probe),
                plate=plate,
                accept_derated=accept_derated,
                allow_mismatch=allow_mismatch,
            )
    if package_path is None:
        _write_admission(workspace.package_path(recipe), done, rig)
    return Rendered(done, path, rig, eye.tracked() if eye else None)


def _stale(engine: Engine) -> str:
    """A sentence where the workspace's own package is not of its fits and recipe, else empty."""
    state = engine.state("package build")
    if state.state != "stale":
        return ""
    return f"The package is stale: {state.found}. Run '{state.command}'."


def _refuse_untrusted(package: "ModelPackage", trusted: "Sequence[str]") -> None:
    """Raise VerdictError where none of the public keys signed what was loaded."""
    said = package.against_review(trusted)
    if said:
        raise VerdictError(f"{' '.join(said)} Nothing was rendered.")


def _refuse_other_blades(recipe: "Recipe", package: "ModelPackage") -> None:
    """Raise InputError where recipe and package are of rigs whose joints or blades differ."""
    stated = package.recipe.rig
    for key, was, now in (
        ("joint", stated.joint, recipe.rig.joint),
        ("moving", stated.moving, recipe.rig.moving),
    ):
        if was != now:
            raise InputError(
                f"The package {package.manifest.name} is of another rig: its recipe has rig.{key} "
                f'= "{was}", and this workspace\'s has "{now}". Take the workspace of that rig, or '
                "render it all the same with --allow-mismatch."
            )


def _camera(
    workspace: Workspace,
    package: "ModelPackage",
    camera: str,
    device: str,
    taps_s: float,
    *,
    seed: int,
    realtime: bool,
) -> "PlateCamera | None":
    """The camera that follows the plate of an estimated scene; None without one."""
    from scissorcal.workday.tracking.plate_camera import PlateCamera

    if camera == NONE:
        if taps_s:
            raise InputError("Taps tell where a tracked plate is: name a camera too (--camera).")
        return None
    if package.manifest.plate_pose == "known":
        raise InputError(
            f"The scene of {package.manifest.name} has a known plate pose, so no camera is used in "
            'its rendering: leave --camera out, or set plate_pose = "estimated" in [scene] and run '
            "'scissorcal package build'."
        )
    engine = Engine.of(workspace)
    if taps_s:
        _refuse_clamped(engine.recipe.plate.tracking)
    return PlateCamera(
        engine, engine.recipe, camera, device, seed=seed, realtime=realtime, cut=True
    )


def _refuse_clamped(tracking: "PlateTracking") -> None:
    """Pictures of a plate that is carried would be refused, and what taps told would be lost."""
    from scissorcal.recipe.plate_surface import CLAMPED_deg_per_s, CLAMPED_mm_per_s

    speed, turn = tracking.speed_mm_per_s, tracking.turn_deg_per_s
    if speed > CLAMPED_mm_per_s and turn > CLAMPED_deg_per_s:
        return
    raise InputError(
        f"plate.tracking takes the plate to be clamped ({speed:g} mm/s, {turn:g} deg/s), and after "
        "taps it is carried to where it is cut: state how it is moved, such as speed_mm_per_s = 5 "
        "and turn_deg_per_s = 2 in [plate.tracking], or leave --taps out. Of a plate that stays "
        "where it was tapped, state a little more than a clamped one's (0.02 and 0.004)."
    )


def _known_rig(workspace: Workspace, package: "ModelPackage") -> "RigFacts":
    """What is known of the rig: the package's friction fit, or the workspace's.

    A scene that renders no friction has none in its package, and the rig has friction all the same.
    """
    from scissorcal.render.rig_facts import fitted_facts, rig_facts

    known = rig_facts(package)
    engine = Engine.of(workspace)
    if known.coulomb_Nm is not None or "friction" not in available(engine, ("friction",)):
        return known
    fit = load_result(engine, "friction")
    return fitted_facts((*fit.parameters, *fit.nuisance), 1.0, "the workspace's friction fit")


def _write_admission(package_path: Path, done: "RenderResult", rig: str) -> None:
    """State beside the package how much of it was rendered on this rig, and what would cure it."""
    admission = asdict(done.admission)
    plain = {
        name: None if isinstance(value, float) and not math.isfinite(value) else value
        for name, value in admission.items()
    }
    facts = {
        "format": "scissorcal-admission/1",
        "package_hash": done.package_hash,
        "rig": rig,
        "derated": done.admission.derated,
        "factor": done.admission.factor,
        "accepted_derated": done.accepted_derated,
        **plain,
    }
    with replacing(package_path.with_suffix(".admission.json")) as part:
        part.write_text(json.dumps(facts, indent=2, allow_nan=False) + "\n", encoding="utf-8")


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
    stale = _stale(engine)
    said = [stale] if stale else []
    said += [
        f"The {name.replace('fit', 'fit of')} is unverified: no trust check says whether its "
        f"intervals hold ('{engine.state(name).command}')."
        for name in ("fit friction", "fit cut")
        if engine.state(name).state == "unverified"
    ]
    return (*said, *package.warnings)
