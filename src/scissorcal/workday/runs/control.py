"""Follow a path on a plate with a workspace's rig, and record it."""

import math
from contextlib import ExitStack, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from scissorcal.aliases import Say
from scissorcal.errors import InputError, MissingError
from scissorcal.foreign import read_foreign
from scissorcal.foreign.formats import PATH
from scissorcal.recipe.euler_angles import quaternion_words
from scissorcal.recipe.load import read_text
from scissorcal.workday.engine import Engine
from scissorcal.workday.rigs import line_of, open_rig
from scissorcal.workday.runs.cut import edge_of_photographs
from scissorcal.workday.runs.fit import load_result
from scissorcal.workday.runs.probe import ensure_probed
from scissorcal.workday.tracking.stated_pose import stated_pose
from scissorcal.workday.workspace import Workspace

if TYPE_CHECKING:
    from scissorcal.aliases import Progress
    from scissorcal.calibration.result import FitResult
    from scissorcal.control.mechanics import RigMechanics
    from scissorcal.control.result import ControlResult
    from scissorcal.device.link import Link
    from scissorcal.device.loading import Confirm
    from scissorcal.model.edge import Edge
    from scissorcal.model.friction import FrictionLaw
    from scissorcal.model.mechanism import AxisLaw
    from scissorcal.recipe.schema import Recipe
    from scissorcal.recording import RecordingWriter
    from scissorcal.recording.probe import ProbeResult
    from scissorcal.tracking.plate_pose import PoseSource
    from scissorcal.workday.tracking.plate_camera import PlateCamera, TrackedRun

NONE = "none"
LATE_TICKS = 2.0
"""Where no probe measured the delay: one tick for line and host, one for the motor."""
LACK_OF_FIT = 0.03
"""Of dry friction, by which a fitted law may be wrong beyond its posterior: friction of virtual
days differs by 0.25 mN m between speeds where 15 are fitted."""
SLOW = 0.05
"""Of the tabulated rates, at which the uncertainty of sliding friction is taken."""
UNMEASURED_NOISE_Nm = 1e-3


@dataclass(frozen=True)
class Controlled:
    """A path that was followed: its result, its recording (None if not wanted), and the rig.

    ``tracked`` is what became of a camera's pictures and of contacts, None without a camera.
    """

    result: "ControlResult"
    recording: Path | None
    rig: str
    tracked: "TrackedRun | None" = None


def control_workspace(
    workspace: Workspace,
    device: str,
    path_file: Path,
    *,
    force_N: float = 2.0,
    speed_mm_per_s: float = 10.0,
    pose: str | None = None,
    camera: str = NONE,
    source: "PoseSource | None" = None,
    record: bool = True,
    seed: int = 0,
    baud: int | None = None,
    realtime: bool = False,
    progress: "Progress | None" = None,
    confirm: "Confirm | None" = None,
    say: "Say | None" = None,
) -> Controlled:
    """Press on the plate and follow the path in ``path_file`` (CSV) with the rig on ``device``.

    ``force_N`` and ``speed_mm_per_s`` hold where the file does not state them. The plate stands
    where ``source`` says, or ``pose`` (text; `workday.tracking.stated_pose` reads it), or where
    ``camera`` (a camera's number, or "sim" with the device "sim") and contacts have it while the
    path is followed, or where the fit of its photographs found it. A person is asked for the plate
    before a source or camera looks for it, else once the
    blades are over its place. Mass, inertia and friction are those of the fits of both axes; the
    surface and what it is made of are the recipe's (plate.surface, plate.touch). Samples and
    telemetry go to captures/control-<stamp>.mcap unless ``record`` is False; with them the rows of
    a track. Otherwise as `render_workspace`.

    Raises MissingError where a fit or the pose is missing, InputError where the pose is stated
    twice or the camera does not go with the device, and what `scissorcal.control.follow.control`
    raises.
    """
    from scissorcal.control.follow import Job, control
    from scissorcal.control.path_file import read_path
    from scissorcal.control.plate_request import ask_for_plate
    from scissorcal.control.settings import Material
    from scissorcal.recipe.plate_surface import plate_surface

    recipe = workspace.recipe()
    engine = Engine.of(workspace)
    points = read_path(path_file).stated(force_N, 1e-3 * speed_mm_per_s)
    if source is not None and (pose is not None or camera != NONE):
        raise InputError(
            "The plate's pose comes from a source, a stated pose or a camera: give one."
        )
    eye = _camera(engine, camera, device, pose, seed=seed, realtime=realtime)
    known = None if eye else source or _pose_source(engine, pose)
    if pose is not None and say:
        say(f"The plate stands {_told(pose, camera, source)}.")
    touch = recipe.plate.touch
    fits = _fits(engine)
    edge = blade_edge(engine, recipe)
    line = line_of(recipe, baud)
    with ExitStack() as stack:
        opened = (
            eye.open_rig(device, seed, line)
            if eye
            else open_rig(device, recipe.specimen, seed, realtime=realtime, line=line)
        )
        link = stack.enter_context(opened)
        rig = f"{link.identity.name} {link.identity.serial}"
        probe = ensure_probed(workspace, link, recipe, confirm=confirm, say=say)
        tracked = eye is not None or source is not None
        if tracked:
            ask_for_plate(link.identity, confirm)
        path = workspace.new_recording("control") if record else None
        writer = _open_writer(path, link, workspace, path_file, probe) if path else nullcontext()
        with writer as recording, ExitStack() as seeing:
            if eye:
                known = seeing.enter_context(
                    eye.follow(link, recording, held_N=float(points.force.min()))
                )
            assert known is not None
            job = Job(
                points=points,
                surface=plate_surface(recipe.plate.surface, workspace.root),
                source=known,
                material=Material(1e3 * touch.stiffness_N_per_mm, touch.friction, touch.peak_N),
                length_m=1e-3 * recipe.material.sheet_length_mm,
                tracked=tracked,
            )
            done = control(
                link,
                recipe,
                _mechanics(fits, edge, recipe, link, probe),
                job,
                writer=recording,
                progress=progress,
                confirm=confirm,
                probe=probe,
            )
            seeing.close()
            if recording is not None:
                recording.note(_note(done, _told(pose, camera, source)))
    return Controlled(done, path, rig, eye.tracked() if eye else None)


def _camera(
    engine: Engine, camera: str, device: str, pose: str | None, *, seed: int, realtime: bool
) -> "PlateCamera | None":
    """The camera that follows the plate; None without one."""
    from scissorcal.workday.tracking.plate_camera import PlateCamera

    if camera == NONE:
        return None
    if pose is not None:
        raise InputError("The plate stands where --pose or where --camera has it: give one.")
    return PlateCamera(engine, engine.recipe, camera, device, seed=seed, realtime=realtime)


def _pose_source(engine: Engine, pose: str | None) -> "PoseSource":
    import numpy as np

    from scissorcal.tracking.plate_pose import fixed_pose

    if pose is not None:
        stated = stated_pose(pose)
        return fixed_pose(stated.matrix, np.asarray(stated.translation_m))
    try:
        fit = load_result(engine, "plate")
    except MissingError as error:
        raise MissingError(f"{error} Or state where the plate stands with --pose.") from None
    if fit.rig_plate is None:
        raise MissingError(
            "The fit of the plate has no pose in the rig's frame: photograph the rig's card too "
            "('scissorcal capture plate --help'), or state where the plate stands with --pose."
        )
    found = fit.rig_plate
    return fixed_pose(found.matrix, np.asarray(found.translation_m), found.covariance)


def _fits(engine: Engine) -> "tuple[FitResult, FitResult]":
    """The fits of friction of both axes; MissingError with what to run."""
    return load_result(engine, "friction"), load_result(engine, "friction-advance")


def blade_edge(engine: Engine, recipe: "Recipe") -> "Edge":
    """The edge of photographs, else the recipe's."""
    from scissorcal.calibration.cut.structure import edge_of

    belief, _ = edge_of_photographs(engine)
    return (belief or edge_of(recipe)).edge


def _mechanics(
    fits: "tuple[FitResult, FitResult]",
    edge: "Edge",
    recipe: "Recipe",
    link: "Link",
    probe: "ProbeResult",
) -> "RigMechanics":
    from scissorcal.control.mechanics import RigMechanics
    from scissorcal.model.blade_point import BladePoint

    tick_s = link.identity.tick_us * 1e-6
    zero = probe.torque_zero_Nm
    opening = axis_of_fit(fits[0], "kg m^2")
    return RigMechanics(
        tip=BladePoint.on_edge(edge, edge.length_m, recipe.rig.moving_blades),
        opening=opening,
        advance=axis_of_fit(fits[1], "kg"),
        friction_sd=_sliding_sd(fits[0], opening.friction),
        delay_s=LATE_TICKS * tick_s if probe.delay_s is None else max(probe.delay_s.mean, 0.0),
        torque_sd=probe.rest.torque_noise_Nm or UNMEASURED_NOISE_Nm,
        torque_zero_Nm=0.0 if zero is None else zero.mean,
        handle_zero_N=probe.rest.handle_zero_N,
    )


def axis_of_fit(fit: "FitResult", unit: str) -> "AxisLaw":
    """One axis from its fit of friction, at the medians of the posterior; ``unit`` of inertia."""
    from scissorcal.model.mechanism import AxisLaw

    values = {p.name: p.q50 for p in (*fit.parameters, *fit.nuisance)}
    if not values.get("inertia", 0.0) > 0.0:
        raise MissingError(
            f"The fit of {fit.what} has no inertia in {unit}: capture friction with an excitation "
            f"('scissorcal capture {fit.words}'), then 'scissorcal fit {fit.words}'."
        )
    return AxisLaw.of_fit(values, _centre(fit), 0.0)


def _centre(fit: "FitResult") -> float:
    import numpy as np

    centre = float(fit.structure.get("angle_center", float("nan")))
    return centre if math.isfinite(centre) else float(np.nanmedian(fit.series.opening))


def _sliding_sd(fit: "FitResult", law: "FrictionLaw") -> float:
    """Standard deviation of the opening's friction while it slides slowly, N m."""
    import numpy as np

    from scissorcal.control.mechanics import FASTEST_rad_per_s
    from scissorcal.model.friction import FrictionLaw, friction_torque

    rates, centre = SLOW * FASTEST_rad_per_s * np.array([-1.0, 1.0]), _centre(fit)
    drawn = {p.name: fit.draws[:, [i]] for i, p in enumerate(fit.parameters)}
    sliding = friction_torque(FrictionLaw.of_fit(drawn, centre), centre, rates)
    level = float(np.abs(friction_torque(law, centre, rates)).max())
    return math.hypot(float(np.std(sliding, axis=0).max()), LACK_OF_FIT * level)


def _open_writer(
    path: Path, link: "Link", workspace: Workspace, path_file: Path, probe: "ProbeResult"
) -> "RecordingWriter":
    from scissorcal.device.rig_record import rig_facts
    from scissorcal.recording import Joint, RecordingFacts, RecordingWriter

    recipe = workspace.recipe()
    writer = RecordingWriter(
        path,
        "control",
        Joint("rotary"),
        facts=RecordingFacts(
            recipe_toml=read_text(workspace.recipe_path),
            device=rig_facts(link.identity, recipe.rig.motor_sign, probe),
            handle_radius_m=link.identity.handle_radius,
        ),
    )
    writer.attach("path.csv", read_foreign(path_file, PATH), "text/csv")
    return writer


def _told(pose: str | None, camera: str, source: "PoseSource | None") -> str:
    """Where the plate's pose was from, as an end of a sentence."""
    if pose is not None:
        stated = stated_pose(pose)
        place = ", ".join(f"{1e3 * value:.2f}" for value in stated.translation_m)
        turn = f"{stated.euler_angles.words}; {quaternion_words(stated.quaternion)}"
        return f"as it was stated, ({place}) mm, {turn}"
    return "where it was tracked" if source or camera != NONE else "as it was fitted"


def _note(done: "ControlResult", told: str) -> str:
    figures = done.figures
    return (
        f"Followed {figures.way_mm:.1f} mm of path with {done.wanted_N:g} N, the plate standing "
        f"{told}: force off by {figures.force_rms_N:.3f} N (rms), path by "
        f"{figures.path_rms_mm:.3f} mm (rms)."
    )
