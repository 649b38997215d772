"""Render a workspace's package on a rig, and record what happened."""

import json
import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from scissorcal.device.session import Operator, RigSession
from scissorcal.device.upload import refuse_without_rendering
from scissorcal.errors import InputError, MissingError, ScissorcalError, VerdictError
from scissorcal.files import replacing
from scissorcal.package import ModelPackage, open_package
from scissorcal.package.keys import read_public_keys
from scissorcal.recipe.plate_surface import CLAMPED_deg_per_s, CLAMPED_mm_per_s, PlateTracking
from scissorcal.recipe.schema import Recipe
from scissorcal.recording import RecordingWriter
from scissorcal.render import (
    Rendering,
    RenderResult,
    RigFacts,
    VirtualStrokes,
    open_writer,
    render,
)
from scissorcal.render.rig_facts import fitted_facts, refuse_other_rig, rig_facts, with_probe
from scissorcal.tracking.plate_pose import PoseSource
from scissorcal.workday.engine import Engine
from scissorcal.workday.options import NONE, RenderOptions, RigOptions
from scissorcal.workday.runs.at_rig import RigRun, RigTask, run_at_rig
from scissorcal.workday.runs.fit import available, load_result
from scissorcal.workday.states import State
from scissorcal.workday.tracking.tracking_camera import TrackingCamera
from scissorcal.workday.workspace import Workspace


def render_workspace(
    workspace: Workspace,
    rig: RigOptions,
    options: RenderOptions = RenderOptions(),
    operator: Operator | None = None,
    source: PoseSource | None = None,
) -> RigRun[RenderResult]:
    """Render the workspace's package (or another) on a rig, within the recipe's limits.

    A rig without a probe that counts is probed first (`ensure_probed`). ``source`` tracks a plate
    whose pose the scene estimates, or the camera of the options does; without them the pose fitted
    to photographs is taken. Samples go to captures/render-<stamp>.mcap.

    Raises MissingError where there is no package or no pose, or where the package is stale,
    InputError where it is of another rig, both unless the options allow it, InputError where a
    camera is named for a known pose or does not go with the device, VerdictError where nobody
    trusted signed the package, and what opening them and the rendering raise.
    """
    recipe, of_workspace = workspace.recipe(), options.package_path is None
    package = open_package(options.package_path or workspace.package_path(recipe), warn=False)
    if options.trusted_key:
        _refuse_untrusted(package, read_public_keys(options.trusted_key))
    stale = _stale(Engine.of(workspace)) if of_workspace else ""
    if not options.allow_mismatch:
        if stale:
            raise MissingError(f"{stale} To render it all the same: --allow-mismatch.")
        _refuse_other_blades(recipe, package)
    task = _RenderTask(
        workspace=workspace,
        package=package,
        options=options,
        stale=stale,
        camera=_camera(workspace, package, rig, options),
        source=source,
        taps_s=options.taps_s,
    )
    run = run_at_rig(workspace, task, rig, operator, record=not options.no_record)
    if of_workspace:
        _write_admission(workspace.package_path(recipe), run.result, run.rig)
    return run


@dataclass(frozen=True, eq=False, kw_only=True)
class _RenderTask(RigTask["RenderResult"]):
    """Rendering a package; a recording notes that it is stale."""

    kind = "render"
    workspace: Workspace
    package: ModelPackage
    options: RenderOptions
    stale: str

    def check(self, session: RigSession) -> None:
        if self.options.on_device:
            refuse_without_rendering(session.identity)
        if not self.options.allow_mismatch:
            refuse_other_rig(self.package, session.identity)

    def open_writer(self, session: RigSession, path: Path) -> RecordingWriter:
        writer = open_writer(session, self.package, path)
        if self.stale:
            writer.note(self.stale)
        return writer

    def do(
        self,
        session: RigSession,
        writer: RecordingWriter | None,
        source: PoseSource | None,
    ) -> RenderResult:
        options = self.options
        how = Rendering(
            options.seconds,
            VirtualStrokes(options.strokes, options.rate_rad_per_s),
            options.accept_derated,
            options.allow_mismatch,
            options.on_device,
        )
        facts = with_probe(_known_rig(self.workspace, self.package), session.probe)
        return render(session, self.package, how, writer=writer, rig=facts, plate=source)


def _stale(engine: Engine) -> str:
    """A sentence where the workspace's own package is not of its fits and recipe, else empty."""
    state = engine.state("package build")
    if state.state != "stale":
        return ""
    return f"The package is stale: {state.found}. Run '{state.command}'."


def _refuse_untrusted(package: ModelPackage, trusted: "Sequence[str]") -> None:
    """Raise VerdictError where none of the public keys signed what was loaded."""
    said = package.against_review(trusted)
    if said:
        raise VerdictError(f"{' '.join(said)} Nothing was rendered.")


def _refuse_other_blades(recipe: Recipe, package: ModelPackage) -> None:
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
    workspace: Workspace, package: ModelPackage, rig: RigOptions, options: RenderOptions
) -> TrackingCamera | None:
    """The camera that follows the plate of an estimated scene; None without one."""
    if options.camera == NONE:
        if options.taps_s:
            raise InputError("Taps tell where a tracked plate is: name a camera too (--camera).")
        return None
    if package.manifest.plate_pose == "known":
        raise InputError(
            f"The scene of {package.manifest.name} has a known plate pose, so no camera is used in "
            'its rendering: leave --camera out, or set plate_pose = "estimated" in [scene] and run '
            "'scissorcal package build'."
        )
    engine = Engine.of(workspace)
    if options.taps_s:
        _refuse_clamped(engine.recipe.plate.tracking)
    return TrackingCamera(engine, options.camera, rig, cut=True)


def _refuse_clamped(tracking: PlateTracking) -> None:
    """Pictures of a plate that is carried would be refused, and what taps told would be lost."""
    speed, turn = tracking.speed_mm_per_s, tracking.turn_deg_per_s
    if speed > CLAMPED_mm_per_s and turn > CLAMPED_deg_per_s:
        return
    raise InputError(
        f"plate.tracking takes the plate to be clamped ({speed:g} mm/s, {turn:g} deg/s), and after "
        "taps it is carried to where it is cut: state how it is moved, such as speed_mm_per_s = 5 "
        "and turn_deg_per_s = 2 in [plate.tracking], or leave --taps out. Of a plate that stays "
        "where it was tapped, state a little more than a clamped one's (0.02 and 0.004)."
    )


def _known_rig(workspace: Workspace, package: ModelPackage) -> RigFacts:
    """What is known of the rig: the package's friction fit, or the workspace's.

    A scene that renders no friction has none in its package, and the rig has friction all the same.
    """
    known = rig_facts(package)
    engine = Engine.of(workspace)
    if known.coulomb_Nm is not None or "friction" not in available(engine, ("friction",)):
        return known
    fit = load_result(engine, "friction")
    return fitted_facts((*fit.parameters, *fit.nuisance), 1.0, "the workspace's friction fit")


def _write_admission(package_path: Path, done: RenderResult, rig: str) -> None:
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
    engine = Engine.of(workspace)
    try:
        package = open_package(package_path or engine.file("package build"), warn=False)
    except ScissorcalError:
        return ()
    if package_path is not None:
        return package.warnings
    return (*(sentence for _, sentence in unsettled_states(engine)), *package.warnings)


def unsettled_states(engine: Engine) -> tuple[tuple[State, str], ...]:
    """A package that is stale and fits that are unverified: each state with a sentence on it."""
    stale = _stale(engine)
    unsettled: list[tuple[State, str]] = [("stale", stale)] if stale else []
    for name in ("fit friction", "fit cut"):
        fit = engine.state(name)
        if fit.state == "unverified":
            sentence = (
                f"The {name.replace('fit', 'fit of')} is unverified: no verification says whether "
                f"its intervals hold ('{fit.command}')."
            )
            unsettled.append((fit.state, sentence))
    return tuple(unsettled)
