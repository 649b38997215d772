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
from scissorcal.device.coverage import (
    CoverageGrid,
    advance_coverage,
    cut_coverage,
    friction_coverage,
)
from scissorcal.device.cut_trajectory import cut_plan
from scissorcal.device.drive import CaptureProgress, Drive, silent
from scissorcal.device.hand import hand_strokes, hand_travel
from scissorcal.device.link import Link
from scissorcal.device.loading import Confirm, Loader
from scissorcal.device.motion import STOP_MARGIN_RAD, Motion, MotionReport
from scissorcal.device.open_motion import open_motion
from scissorcal.device.recorder import Recorder, Tally
from scissorcal.device.rig_record import rig_facts
from scissorcal.device.trajectory import Plan, friction_plan
from scissorcal.device.watching import let_go_damping, watches_of
from scissorcal.kernel import Identity, ServoConfig
from scissorcal.recipe.schema import Recipe
from scissorcal.recording import Joint, Kind, RecordingFacts, RecordingWriter, Stroke
from scissorcal.recording.probe import UNKNOWN_REST, ProbeResult, RestFacts

SUPERVISOR_S = 0.3
"""Without heartbeat, which ends where this process takes no block for a second: see Heartbeat."""
FAULT_CLEARINGS = 20
FAULT_CLEARINGS_PER_S = 1.0
CLEAR_REQUEST = (
    "Take everything out from between the blades and keep clear: they open, and the sledge "
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
    path: Path,
    kind: Kind,
    link: Link,
    recipe: Recipe,
    recipe_toml: str,
    *,
    hand: bool = False,
    by_parts: bool = False,
    probe: ProbeResult | None = None,
) -> RecordingWriter:
    """Open the recording of a capture and write all that is known before it starts.

    ``by_parts``: strokes are chosen later. ``recipe_toml`` is the recipe's text, unchanged;
    ``probe`` what a probe of this rig found. Raises as RecordingWriter does, and as the plan of the
    capture does.
    """
    identity = link.identity
    strokes: tuple[Stroke, ...] = ()
    if not hand and not by_parts:
        strokes = planned(recipe, identity, kind).strokes
    return RecordingWriter(
        path,
        kind,
        Joint(recipe.rig.joint),
        facts=RecordingFacts(
            recipe_toml=recipe_toml,
            device=rig_facts(identity, recipe.rig.motor_sign, probe),
            handle_radius_m=identity.handle_radius,
            strokes=strokes,
            min_travel=hand_travel(recipe, identity) if hand else None,
        ),
    )


def capture_friction(
    link: Link,
    recipe: Recipe,
    writer: RecordingWriter,
    progress: CaptureProgress | None = None,
    *,
    confirm: Confirm | None = None,
    probe: ProbeResult | None = None,
    cleared: bool = False,
) -> CaptureReport:
    """Drive sweeps with empty blades and an excitation, and record them.

    ``confirm`` asks a person to clear the blades, unless they are ``cleared``; a simulator clears
    them itself. The gains follow
    from ``probe`` where there is one; DeviceError where none could follow the plan. What was
    recorded stays in the writer, whatever happens. Raises DeviceError where the rig fails (limits,
    faults that do not clear, an unplugged cable), InputError where the recipe does not fit it.
    """
    coverage = friction_coverage(recipe, link.identity)
    recorder = Recorder(writer, coverage)
    plan = friction_plan(recipe, link.identity)
    gains = gains_for(link, recipe, "friction", probe, writer)
    with motion_for(link, recipe, plan, gains, probe) as motion:
        loader = Loader(motion, recorder, confirm)
        if not cleared:
            loader.clear(plan.segments[0].request)
        plan = friction_plan(recipe, link.identity, advance=motion.position[1])
        drive = Drive(motion, recorder, plan.strokes, progress, _ticks(plan))
        drive.idle()
        drive.follow(plan.segments[0])
        drive.idle()
        return finish(recorder, motion)


def capture_friction_advance(
    link: Link,
    recipe: Recipe,
    writer: RecordingWriter,
    progress: CaptureProgress | None = None,
    *,
    confirm: Confirm | None = None,
    probe: ProbeResult | None = None,
    cleared: bool = False,
) -> CaptureReport:
    """Drive sweeps of the sledge with empty, open blades and an excitation, and record them.

    As capture_friction. InputError for a rig without an advance motor, or without travel.
    """
    refuse_without_motor(link.identity)
    plan = advance_plan(recipe, link.identity)
    recorder = Recorder(writer, advance_coverage(recipe, link.identity))
    gains = gains_for(link, recipe, "friction-advance", probe, writer)
    with motion_for(link, recipe, plan, gains, probe) as motion:
        loader = Loader(motion, recorder, confirm)
        if not cleared:
            loader.clear(plan.segments[0].request)
        drive = Drive(motion, recorder, plan.strokes, progress, _ticks(plan))
        drive.idle()
        drive.follow(plan.segments[0])
        drive.idle()
        return finish(recorder, motion)


def capture_cut(
    link: Link,
    recipe: Recipe,
    writer: RecordingWriter,
    hand: bool = False,
    progress: CaptureProgress | None = None,
    confirm: Confirm | None = None,
    probe: ProbeResult | None = None,
    cleared: bool = False,
) -> CaptureReport:
    """Drive strokes through sheets (or presses), or record those of a hand.

    With ``hand`` the motors are off while the hand moves; strokes are found from the motion. On
    a simulator the virtual hand does it, and motors bring the rig back before each sheet.
    ``confirm`` asks a person to load each sheet; a simulator loads by itself. With ``hand`` a
    person is asked to clear the blades in any case. Otherwise as
    capture_friction.
    """
    identity = link.identity
    coverage = cut_coverage(recipe, identity, hand=hand)
    recorder = Recorder(writer, coverage)
    gains = gains_for(link, recipe, "cut", probe, writer)
    if hand:
        with motion_for(link, recipe, None, gains, probe) as motion:
            loader = Loader(motion, recorder, confirm)
            tell = progress or silent
            hand_strokes(
                motion, recipe, recorder, loader, lambda done, what: tell(done, what, recorder)
            )
            return finish(recorder, motion)
    plan = cut_plan(recipe, identity)
    with motion_for(link, recipe, plan, gains, probe) as motion:
        loader = Loader(motion, recorder, confirm)
        if not cleared:
            loader.clear(CLEAR_REQUEST)
        drive = Drive(motion, recorder, plan.strokes, progress, _ticks(plan))
        drive.idle()
        for segment in plan.segments:
            loader.retract()
            drive.go_to_start(segment)
            loader.load(drive.warning() + segment.request)
            drive.follow(segment)
        drive.idle()
        return finish(recorder, motion)


def planned(recipe: Recipe, identity: Identity, kind: Kind) -> Plan:
    """The plan that a capture of one kind follows. Raises InputError as the plans do."""
    if kind == "friction-advance":
        return advance_plan(recipe, identity)
    return friction_plan(recipe, identity) if kind == "friction" else cut_plan(recipe, identity)


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


def gains_for(
    link: Link, recipe: Recipe, kind: Kind, probe: ProbeResult | None, writer: RecordingWriter
) -> CaptureGains:
    """Gains by what the probe found; what is said of them is noted."""
    gains = capture_gains(recipe, link.identity, kind, Probed.of(probe))
    for verdict in gains.verdicts if probe else ():
        writer.note(verdict.why)
    return gains


def motion_for(
    link: Link,
    recipe: Recipe,
    plan: Plan | None,
    gains: CaptureGains,
    probe: ProbeResult | None,
    *,
    duration_s: float = 0.0,
) -> Motion:
    """Start the servo for a plan, or for references of ``duration_s`` if that is longer."""
    rest = probe.rest if probe else UNKNOWN_REST
    lasts_s = max(plan.duration_s if plan else 0.0, duration_s)
    config = servo_config(recipe, link.identity, lasts_s, gains, rest)
    longest = max((len(segment.reference) for segment in plan.segments), default=0) if plan else 0
    longest = max(longest, round(duration_s * 1e6 / link.identity.tick_us))
    return open_motion(link, config, longest_reference=longest)


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
