"""Capture friction and cuts: drive the rig, or record while a hand moves it."""

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

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
from scissorcal.device.link import Link
from scissorcal.device.lockstep_motion import Exchanging
from scissorcal.device.motion import STOP_MARGIN_RAD, LoopTask, Motion, MotionReport
from scissorcal.device.parts import Part
from scissorcal.device.port_motion import open_motion
from scissorcal.device.recorder import Recorder, Tally
from scissorcal.device.session import Loader, RigSession, rig_facts
from scissorcal.device.trajectory import Plan, advance_plan, friction_plan, refuse_without_motor
from scissorcal.device.watching import let_go_damping, watches_of
from scissorcal.kernel import Identity, ServoConfig
from scissorcal.recipe.requirements import CaptureKind, DesignedKind
from scissorcal.recipe.schema import Recipe
from scissorcal.recording import Joint, Recording, RecordingFacts, RecordingWriter, Stroke
from scissorcal.recording.probe import UNKNOWN_REST, RestFacts
from scissorcal.recording.recording import UNLOADED_MARK

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
    recorder = Recorder(writer, coverage_of(session.recipe, session.identity, kind, hand))
    operator = session.operator
    with _motion_for(session, plan, _gains_for(session, kind, writer)) as motion:
        loader = Loader(motion, recorder, operator.confirm)
        if plan is None:
            hand_strokes(motion, session.recipe, recorder, loader, operator.progress)
            return _finish(recorder, motion)
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
        return _finish(recorder, motion)


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


def _gains_for(session: RigSession, kind: CaptureKind, writer: RecordingWriter) -> CaptureGains:
    """Gains by what the probe found; what is said of them is noted."""
    gains = capture_gains(session.recipe, session.identity, kind, Probed.of(session.probe))
    for verdict in gains.verdicts if session.probe else ():
        writer.note(verdict.why)
    return gains


def _motion_for(
    session: RigSession, plan: Plan | None, gains: CaptureGains, *, duration_s: float = 0.0
) -> Motion:
    """Start the servo for a plan, or for references of ``duration_s`` if that is longer."""
    identity = session.identity
    lasts_s = max(plan.duration_s if plan else 0.0, duration_s)
    config = servo_config(session.recipe, identity, lasts_s, gains, session.rest)
    longest = max((len(segment.reference) for segment in plan.segments), default=0) if plan else 0
    longest = max(longest, round(duration_s * 1e6 / identity.tick_us))
    return open_motion(session.link, config, LoopTask(longest_reference=longest))


def _finish(recorder: Recorder, motion: Motion) -> CaptureReport:
    """Note how the servo ran and what was lost, and report."""
    report = motion.report()
    recorder.writer.note(report.lag.sentence)
    if report.held_up_s and recorder.tally.lost:
        recorder.writer.note(
            f"This computer did not run the loop for up to {1e3 * report.held_up_s:.0f} ms: what "
            "the device sent meanwhile may be what was lost. Close programs that load it."
        )
    if report.rights:
        recorder.writer.note(report.rights.sentence)
    recorder.finish(report.overrun)
    return CaptureReport(
        recorder.sample_count, recorder.coverage, recorder.tally, report, tuple(recorder.empty)
    )


def _ticks(plan: Plan) -> int:
    return sum(len(segment.reference) for segment in plan.segments)


NextPart = Callable[[Recording, float], Part | None]
"""Chooses what comes next from what was recorded so far and where the carriage stands (m); None
ends the capture. It runs in a second thread while the rig idles, in virtual time between
two ticks."""

CHOOSING_S = 1.0
"""Least time with the motors off between two parts: the zeros of the sensors are measured anew. In
virtual time the choice takes exactly so long."""
CHOOSING = "motors off, the fit is brought up to date"


def capture_by_parts(
    session: RigSession,
    kind: DesignedKind,
    writer: RecordingWriter,
    next_part: NextPart,
    *,
    longest_s: float,
    chosen: Callable[[], None] | None = None,
) -> CaptureReport:
    """Drive one part after the other until ``next_part`` has none.

    Between two parts the motors are off, the blades rest open, and samples are recorded while
    ``next_part`` works; the material stays where it is unless the next part asks for a fresh piece.
    ``chosen`` is called after each choice, in this thread, between the samples before and after.
    ``longest_s`` bounds the capture, for the faults that it may clear. ``writer`` was opened
    without strokes. Raises as `capture` does, and what ``next_part`` raises; whatever was
    recorded stays in the writer.
    """
    recipe, identity, operator = session.recipe, session.identity, session.operator
    recorder = _KeepingRecorder(writer, coverage_of(recipe, identity, kind))
    gains = _gains_for(session, kind, writer)
    plan = friction_plan(recipe, identity)
    with _motion_for(session, plan, gains, duration_s=longest_s) as motion:
        loader = Loader(motion, recorder, operator.confirm)
        if not session.cleared:
            loader.clear(CLEAR_REQUEST if kind == "cut" else plan.segments[0].request)
        strokes: list[Stroke] = []
        drive = Drive(motion, recorder, strokes, operator.progress, 1, cuts=kind == "cut")
        facts = rig_facts(identity, recipe.rig.motor_sign, session.probe)

        def recorded() -> Recording:
            return Recording(
                kind=kind,
                samples=recorder.samples,
                strokes=tuple(strokes),
                joint=Joint(recipe.rig.joint),
                handle_radius_m=identity.handle_radius,
                device=facts,
                source=str(writer.path),
                marks=tuple((UNLOADED_MARK, str(stroke.index)) for stroke in recorder.empty),
            )

        drive.idle()
        notify = chosen or (lambda: None)
        with _chooser(session.link, motion, drive) as choose:
            while True:
                part = choose(next_part, recorded())
                notify()
                if part is None:
                    break
                strokes += part.strokes
                writer.state_strokes(tuple(strokes))
                drive.expect(len(part.segment.reference) + round(part.then_s / motion.tick_s))
                if part.fresh:
                    loader.retract()
                    drive.go_to_start(part.segment)
                    loader.load(drive.warning() + part.segment.request)
                drive.follow(part.segment)
        drive.idle()
        return _finish(recorder, motion)


class _KeepingRecorder(Recorder):
    """A recorder that keeps the samples, so that they can be fitted while the capture runs."""

    def __init__(self, writer: RecordingWriter, coverage: CoverageGrid) -> None:
        super().__init__(writer, coverage)
        self._blocks: list[NDArray[np.void]] = []

    def take(self, samples: NDArray[np.void], garbled: int = 0, cause: int = 0) -> None:
        super().take(samples, garbled, cause)
        if len(samples):
            self._blocks.append(samples.copy())

    @property
    def samples(self) -> NDArray[np.void]:
        """All samples so far, (N,)."""
        return np.concatenate(self._blocks)


_Choose = Callable[[NextPart, Recording], Part | None]


@contextmanager
def _chooser(link: Link, motion: Motion, drive: Drive) -> Iterator[_Choose]:
    """How the next part is chosen while the rig idles; a choice that is not over is left behind."""
    if isinstance(link, Exchanging):

        def at_once(next_part: NextPart, recording: Recording) -> Part | None:
            part = next_part(recording, motion.position[1])
            drive.idle(CHOOSING_S, CHOOSING)
            return part

        yield at_once
        return
    pool = ThreadPoolExecutor(1)

    def meanwhile(next_part: NextPart, recording: Recording) -> Part | None:
        chosen = pool.submit(next_part, recording, motion.position[1])
        drive.idle(CHOOSING_S, CHOOSING)
        while not chosen.done():
            drive.idle(0.1, CHOOSING)
        return chosen.result()

    try:
        yield meanwhile
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
