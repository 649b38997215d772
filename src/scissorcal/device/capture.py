"""Capture friction and cuts: drive the rig, or record while a hand moves it."""

from dataclasses import dataclass, replace
from pathlib import Path

from scissorcal.device.advance_trajectory import advance_plan, refuse_without_motor
from scissorcal.device.capture_gains import (
    ADVANCE_ERROR_M,
    OPENING_ERROR_RAD,
    CaptureGains,
    Probed,
    capture_gains,
)
from scissorcal.device.coverage import CoverageGrid, coverage_of
from scissorcal.device.cut_trajectory import cut_plan
from scissorcal.device.drive import Drive
from scissorcal.device.hand import hand_strokes, hand_travel
from scissorcal.device.loading import Loader
from scissorcal.device.motion import STOP_MARGIN_RAD, LoopTask, Motion, MotionReport
from scissorcal.device.open_motion import open_motion
from scissorcal.device.recorder import Recorder, Tally
from scissorcal.device.rig_record import rig_facts
from scissorcal.device.session import RigSession
from scissorcal.device.trajectory import Plan, friction_plan
from scissorcal.device.watching import let_go_damping, watches_of
from scissorcal.kernel import Identity, ServoConfig
from scissorcal.recipe.requirements import CaptureKind
from scissorcal.recipe.schema import Recipe
from scissorcal.recording import Joint, RecordingFacts, RecordingWriter, Stroke
from scissorcal.recording.probe import UNKNOWN_REST, RestFacts

SUPERVISOR_S = 0.3
"""Without heartbeat, which ends where this process takes no block for a second: see Heartbeat."""
FAULT_CLEARINGS = 20
FAULT_CLEARINGS_PER_S = 1.0
CLEAR_REQUEST = (
    "Take everything out from between the blades and keep clear: they open, and the carriage "
    "moves to its start."
)


@dataclass(frozen=True)
class CaptureReport:
    """Samples, coverage, gaps and faults of a capture, and how the servo ran.

    ``empty`` are the closing strokes in which nothing was cut.
    """

    sample_count: int
    coverage: CoverageGrid
    tally: Tally
    motion: MotionReport
    empty: tuple[Stroke, ...] = ()


def open_writer(
    session: RigSession,
    kind: CaptureKind,
    path: Path,
    *,
    hand: bool = False,
    by_parts: bool = False,
) -> RecordingWriter:
    """Open the recording of a capture and write all that is known before it starts.

    ``by_parts``: strokes are chosen later. Raises as RecordingWriter does, and as the plan of the
    capture does.
    """
    recipe, identity = session.recipe, session.identity
    return RecordingWriter(
        path,
        kind,
        Joint(recipe.rig.joint),
        facts=RecordingFacts(
            recipe_toml=session.recipe_toml,
            device=rig_facts(identity, recipe.rig.motor_sign, session.probe),
            handle_radius_m=identity.handle_radius,
            strokes=() if hand or by_parts else planned(recipe, identity, kind).strokes,
            min_travel=hand_travel(recipe, identity) if hand else None,
        ),
    )


def capture(
    session: RigSession, kind: CaptureKind, writer: RecordingWriter, *, hand: bool = False
) -> CaptureReport:
    """Drive empty sweeps and an excitation of one axis, or strokes through sheets; record them.

    Friction is that of the blades, or of the carriage with the blades open. With ``hand`` (cuts
    only) the motors are off while a hand moves the handles, and strokes are found from the motion;
    on a simulator the virtual hand does it, and motors bring the rig back before each sheet. The
    person is asked to clear the blades, unless the session is ``cleared`` (a hand's capture asks in
    any case), and to load each sheet; a simulator does both itself. The gains follow from the
    session's probe where there is one. What was recorded stays in the writer, whatever happens.

    Raises DeviceError where the rig fails (limits, faults that do not clear, an unplugged cable) or
    no gains could follow the plan; InputError where the recipe does not fit the rig: a carriage
    without an advance motor or without travel, too.
    """
    if kind == "friction-advance":
        refuse_without_motor(session.identity)
    plan = None if hand else planned(session.recipe, session.identity, kind)
    recorder = Recorder(writer, coverage_of(session.recipe, session.identity, kind, hand=hand))
    operator = session.operator
    with motion_for(session, plan, gains_for(session, kind, writer)) as motion:
        loader = Loader(motion, recorder, operator.confirm)
        if plan is None:
            hand_strokes(motion, session.recipe, recorder, loader, operator.progress)
            return finish(recorder, motion)
        if not session.cleared:
            loader.clear(CLEAR_REQUEST if kind == "cut" else plan.segments[0].request)
        if kind == "friction":
            plan = friction_plan(session.recipe, session.identity, advance=motion.position[1])
        drive = Drive(motion, recorder, plan.strokes, operator.progress, _ticks(plan))
        drive.idle()
        for segment in plan.segments:
            if kind == "cut":
                loader.retract()
                drive.go_to_start(segment)
                loader.load(drive.warning() + segment.request)
            drive.follow(segment)
        drive.idle()
        return finish(recorder, motion)


def planned(recipe: Recipe, identity: Identity, kind: CaptureKind) -> Plan:
    """The plan that a capture of one kind follows. Raises InputError as the plans do."""
    if kind == "friction-advance":
        return advance_plan(recipe, identity)
    return (friction_plan if kind == "friction" else cut_plan)(recipe, identity)


def servo_config(
    recipe: Recipe,
    identity: Identity,
    duration_s: float = 0.0,
    gains: CaptureGains | None = None,
    rest: RestFacts = UNKNOWN_REST,
) -> ServoConfig:
    """Limits and gains of a motor-driven capture: the tighter of recipe's and device's limits.

    ``gains`` are those of `capture_gains`, by default those of a rig that nobody probed;
    ``rest`` is what a probe found of blades at rest.

    A delay of 10 ms in the computer makes the device brake and latch a fault. That spoils a few
    samples only, so the fault is cleared, unless there are more than one per second.
    """
    limits = recipe.limits
    torque_limit = min(limits.torque_Nm, identity.torque_limit)
    control = gains or capture_gains(recipe, identity, "cut", None)
    return ServoConfig(
        torque_limit=torque_limit,
        torque_slew=limits.torque_slew_Nm_per_s,
        force_limit=min(limits.force_N, identity.force_limit),
        force_slew=limits.force_slew_N_per_s,
        ramp_s=limits.engagement_ramp_s,
        let_go_damping_Nm_s_per_rad=let_go_damping(identity, rest),
        rate_cutoff_Hz=control.rate_cutoff_Hz,
        opening_kp=control.opening.kp,
        opening_kd=control.opening.kd,
        opening_ki=control.opening.ki,
        advance_kp=control.advance.kp,
        advance_kd=control.advance.kd,
        advance_ki=control.advance.ki,
        opening_error_limit=OPENING_ERROR_RAD,
        advance_error_limit=ADVANCE_ERROR_M,
        opening_low=identity.opening_min - STOP_MARGIN_RAD,
        opening_high=identity.opening_max + STOP_MARGIN_RAD,
        supervisor_ms=round(SUPERVISOR_S * 1e3),
        fault_clearings=FAULT_CLEARINGS + round(FAULT_CLEARINGS_PER_S * duration_s),
        tick_us=identity.tick_us,
        motor_sign=recipe.rig.motor_sign,
        watch=replace(
            watches_of(identity, torque_limit, limits.held_at_limit_s, rest),
            still_rad=control.still_rad,
        ),
    )


def gains_for(session: RigSession, kind: CaptureKind, writer: RecordingWriter) -> CaptureGains:
    """Gains by what the probe found; what is said of them is noted."""
    gains = capture_gains(session.recipe, session.identity, kind, Probed.of(session.probe))
    for verdict in gains.verdicts if session.probe else ():
        writer.note(verdict.why)
    return gains


def motion_for(
    session: RigSession, plan: Plan | None, gains: CaptureGains, *, duration_s: float = 0.0
) -> Motion:
    """Start the servo for a plan, or for references of ``duration_s`` if that is longer."""
    identity = session.identity
    lasts_s = max(plan.duration_s if plan else 0.0, duration_s)
    config = servo_config(session.recipe, identity, lasts_s, gains, session.rest)
    longest = max((len(segment.reference) for segment in plan.segments), default=0) if plan else 0
    longest = max(longest, round(duration_s * 1e6 / identity.tick_us))
    return open_motion(session.link, config, LoopTask(longest_reference=longest))


def finish(recorder: Recorder, motion: Motion) -> CaptureReport:
    """Note how the servo ran and what was lost, and report."""
    report = motion.report()
    recorder.writer.note(report.lag.sentence)
    if report.rights:
        recorder.writer.note(report.rights.sentence)
    recorder.finish(report.overrun)
    return CaptureReport(
        recorder.sample_count, recorder.coverage, recorder.tally, report, tuple(recorder.empty)
    )


def _ticks(plan: Plan) -> int:
    return sum(len(segment.reference) for segment in plan.segments)
