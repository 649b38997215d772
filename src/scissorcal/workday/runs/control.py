"""Follow a path on a plate with a workspace's rig, and record it."""

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from scissorcal.calibration.result import FitResult
from scissorcal.control.control_result import ControlResult
from scissorcal.control.follow import Job, control
from scissorcal.control.mechanics import FASTEST_rad_per_s, RigMechanics
from scissorcal.control.path_file import SurfacePoints, read_path
from scissorcal.control.settings import Material, ask_for_plate
from scissorcal.device.session import Operator, RigSession, rig_facts
from scissorcal.errors import InputError, MissingError
from scissorcal.foreign import read_foreign
from scissorcal.foreign.formats import PATH
from scissorcal.model.blade_point import BladePoint
from scissorcal.model.edge import Edge
from scissorcal.model.friction import FrictionLaw, friction_torque
from scissorcal.recipe.euler_angles import quaternion_words
from scissorcal.recipe.plate_surface import plate_surface
from scissorcal.recording import Joint, RecordingFacts, RecordingWriter
from scissorcal.tracking.plate_pose import PoseSource, fixed_pose
from scissorcal.workday.engine import Engine
from scissorcal.workday.options import NONE, ControlOptions, RigOptions
from scissorcal.workday.runs.at_rig import RigRun, RigTask, run_at_rig
from scissorcal.workday.runs.cut import blade_edge
from scissorcal.workday.runs.fit import load_result
from scissorcal.workday.runs.friction import angle_centre, axis_of_fit
from scissorcal.workday.tracking.stated_pose import stated_pose
from scissorcal.workday.tracking.tracking_camera import TrackingCamera
from scissorcal.workday.workspace import Workspace

LATE_TICKS = 2.0
"""Where no probe measured the delay: one tick for line and host, one for the motor."""
LACK_OF_FIT = 0.03
"""Of dry friction, by which a fitted law may be wrong beyond its posterior: friction of virtual
days differs by 0.25 mN m between speeds where 15 are fitted."""
SLOW = 0.05
"""Of the tabulated rates, at which the uncertainty of sliding friction is taken."""
UNMEASURED_NOISE_Nm = 1e-3


def control_workspace(
    workspace: Workspace,
    rig: RigOptions,
    options: ControlOptions,
    operator: Operator | None = None,
    source: PoseSource | None = None,
) -> RigRun[ControlResult]:
    """Press on the plate and follow a path with a rig.

    The plate stands where ``source`` says, or the options do. A person is asked for the plate
    before a source or camera looks for it, else once the blades are over its place. Mass, inertia
    and friction are those of the fits of both axes; the surface and what it is made of are the
    recipe's (plate.surface, plate.touch). Samples and telemetry go to
    captures/control-<stamp>.mcap. A rig without a probe that counts is probed first.

    Raises MissingError where a fit or the pose is missing, InputError where the pose is stated
    twice or the camera does not go with the device, and what `scissorcal.control.follow.control`
    raises.
    """
    engine = Engine.of(workspace)
    points = read_path(options.path_file).stated(options.force_N, 1e-3 * options.speed_mm_per_s)
    if source is not None and (options.pose is not None or options.camera != NONE):
        raise InputError(
            "The plate's pose comes from a source, a stated pose or a camera: give one."
        )
    tracked = source is not None or options.camera != NONE
    camera = _camera(engine, rig, options)
    task = _ControlTask(
        engine=engine,
        options=options,
        points=points,
        tracked=tracked,
        camera=camera,
        source=source if tracked else _pose_source(engine, options.pose),
        held_N=float(points.force.min()),
        fits=_fits(engine),
        edge=blade_edge(engine, engine.recipe),
    )
    if options.pose is not None and operator is not None:
        operator.say(f"The plate stands {task.pose_origin}.")
    return run_at_rig(workspace, task, rig, operator, record=not options.no_record)


@dataclass(frozen=True, eq=False, kw_only=True)
class _ControlTask(RigTask["ControlResult"]):
    """Following ``points``; a plate is ``tracked`` where it stands before the blades move."""

    kind = "control"
    engine: Engine
    options: ControlOptions
    points: SurfacePoints
    tracked: bool
    fits: tuple[FitResult, FitResult]
    edge: Edge

    def prepare(self, session: RigSession) -> None:
        if self.tracked:
            ask_for_plate(session)

    def open_writer(self, session: RigSession, path: Path) -> RecordingWriter:
        identity, sign = session.identity, session.recipe.rig.motor_sign
        writer = RecordingWriter(
            path,
            self.kind,
            Joint("rotary"),
            facts=RecordingFacts(
                recipe_toml=session.recipe_toml,
                device=rig_facts(identity, sign, session.probe),
                handle_radius_m=identity.handle_radius,
            ),
        )
        writer.attach("path.csv", read_foreign(self.options.path_file, PATH), "text/csv")
        return writer

    def do(
        self,
        session: RigSession,
        writer: RecordingWriter | None,
        source: PoseSource | None,
    ) -> ControlResult:
        assert source is not None
        recipe = session.recipe
        touch = recipe.plate.touch
        job = Job(
            self.points,
            plate_surface(recipe.plate.surface, self.engine.workspace.root),
            source,
            Material(1e3 * touch.stiffness_N_per_mm, touch.friction, touch.peak_N),
            1e-3 * recipe.material.sheet_length_mm,
            self.tracked,
        )
        result = control(session, _mechanics(self.fits, self.edge, session), job, writer)
        if writer is not None:
            writer.note(_note(result, self.pose_origin))
        return result

    @property
    def pose_origin(self) -> str:
        """Where the plate's pose was from, as an end of a sentence."""
        if self.options.pose is None:
            return "where it was tracked" if self.tracked else "as it was fitted"
        stated = stated_pose(self.options.pose)
        place = ", ".join(f"{1e3 * value:.2f}" for value in stated.translation_m)
        turn = f"{stated.euler_angles.words}; {quaternion_words(stated.quaternion)}"
        return f"as it was stated, ({place}) mm, {turn}"


def _camera(engine: Engine, rig: RigOptions, options: ControlOptions) -> TrackingCamera | None:
    """The camera that follows the plate; None without one."""
    if options.camera == NONE:
        return None
    if options.pose is not None:
        raise InputError("The plate stands where --pose or where --camera has it: give one.")
    return TrackingCamera(engine, options.camera, rig)


def _pose_source(engine: Engine, pose: str | None) -> PoseSource:
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
    pose_of_fit = fit.rig_plate
    return fixed_pose(
        pose_of_fit.matrix, np.asarray(pose_of_fit.translation_m), pose_of_fit.covariance
    )


def _fits(engine: Engine) -> tuple[FitResult, FitResult]:
    """The fits of friction of both axes; MissingError with what to run."""
    return load_result(engine, "friction"), load_result(engine, "friction-advance")


def _mechanics(fits: tuple[FitResult, FitResult], edge: Edge, session: RigSession) -> RigMechanics:
    recipe, probe = session.recipe, session.probe
    assert probe is not None
    tick_s = session.identity.tick_us * 1e-6
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


def _sliding_sd(fit: FitResult, law: FrictionLaw) -> float:
    """Standard deviation of the opening's friction while it slides slowly, N m."""
    rates, centre = SLOW * FASTEST_rad_per_s * np.array([-1.0, 1.0]), angle_centre(fit)
    drawn = {p.name: fit.draws[:, [i]] for i, p in enumerate(fit.parameters)}
    sliding = friction_torque(FrictionLaw.of_fit(drawn, centre), centre, rates)
    level = float(np.abs(friction_torque(law, centre, rates)).max())
    return math.hypot(float(np.std(sliding, axis=0).max()), LACK_OF_FIT * level)


def _note(done: ControlResult, pose_origin: str) -> str:
    figures = done.figures
    return (
        f"Followed {figures.way_mm:.1f} mm of path with {done.wanted_N:g} N, the plate standing "
        f"{pose_origin}: force off by {figures.force_rms_N:.3f} N (rms), path by "
        f"{figures.path_rms_mm:.3f} mm (rms)."
    )
