"""Capture friction and cuts: drive the rig, or record while a hand moves it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from scissorcal.device.capture_gains import (
    ADVANCE_ERROR_M,
    OPENING_ERROR_RAD,
    CaptureGains,
    Probed,
    capture_gains,
)
from scissorcal.device.coverage import CoverageGrid, cut_coverage, friction_coverage
from scissorcal.device.cut_trajectory import cut_plan
from scissorcal.device.hand import hand_strokes, hand_travel
from scissorcal.device.link import Link
from scissorcal.device.loading import Confirm, Loader
from scissorcal.device.motion import STOP_MARGIN_RAD, Motion, MotionReport, Samples
from scissorcal.device.open_motion import open_motion
from scissorcal.device.recorder import Recorder, Tally, unloaded_sentence
from scissorcal.device.trajectory import Plan, Segment, friction_plan
from scissorcal.device.unloaded import LoadWatch
from scissorcal.device.watching import watches_of
from scissorcal.kernel import Identity, ServoConfig
from scissorcal.recipe.schema import Recipe
from scissorcal.recording import Joint, Kind, RecordingWriter, Stroke
from scissorcal.recording.probe import PROBE_KEY, ProbeResult

CaptureProgress = Callable[[float, str, Recorder], None]
"""Called with the share done (0 to 1), a sentence, and what was recorded so far."""

SUPERVISOR_S = 0.3
"""Without heartbeat, which ends where this process takes no block for a second: see Heartbeat."""
FAULT_CLEARINGS = 20
FAULT_CLEARINGS_PER_S = 1.0
IDLE_S = 1.5
"""Time with the motors off at the beginning and end of a capture: it shows the sensors' zeros."""

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
    probe: ProbeResult | None = None,
) -> RecordingWriter:
    """Open the recording of a capture and write all that is known before it starts.

    ``recipe_toml`` is the recipe's text, unchanged; ``probe`` what a probe of this
    rig found. Raises as RecordingWriter does, and as the plan of the capture does.
    """
    identity = link.identity
    strokes: tuple[Stroke, ...] = ()
    if not hand:
        plan = friction_plan if kind == "friction" else cut_plan
        strokes = plan(recipe, identity).strokes
    return RecordingWriter(
        path,
        kind,
        Joint(recipe.rig.joint),
        recipe_toml,
        rig_facts(identity, recipe.rig.motor_sign, probe),
        identity.handle_radius,
        strokes,
        min_travel=hand_travel(recipe, identity) if hand else None,
    )


def capture_friction(
    link: Link,
    recipe: Recipe,
    writer: RecordingWriter,
    progress: CaptureProgress | None = None,
    *,
    confirm: Confirm | None = None,
    probe: ProbeResult | None = None,
) -> CaptureReport:
    """Drive sweeps with empty blades and an excitation, and record them.

    ``confirm`` asks a person to clear the blades; a simulator clears them itself. The gains follow
    from ``probe`` where there is one; DeviceError where none could follow the plan. What was
    recorded stays in the writer, whatever happens. Raises DeviceError where the rig fails (limits,
    faults that do not clear, an unplugged cable), InputError where the recipe does not fit it.
    """
    coverage = friction_coverage(recipe, link.identity)
    recorder = Recorder(writer, coverage)
    plan = friction_plan(recipe, link.identity)
    gains = _gains(link, recipe, "friction", probe, writer)
    with _motion_for(link, recipe, plan, gains, probe) as motion:
        Loader(motion, recorder, confirm).clear(plan.segments[0].request)
        plan = friction_plan(recipe, link.identity, advance=motion.position[1])
        drive = _Drive(motion, recorder, plan, progress)
        drive.idle()
        drive.follow(plan.segments[0])
        drive.idle()
        return _finish(recorder, motion)


def capture_cut(
    link: Link,
    recipe: Recipe,
    writer: RecordingWriter,
    hand: bool = False,
    progress: CaptureProgress | None = None,
    confirm: Confirm | None = None,
    probe: ProbeResult | None = None,
) -> CaptureReport:
    """Drive strokes through sheets (or presses), or record those of a hand.

    With ``hand`` the motors are off while the hand moves; strokes are found from the motion. On
    a simulator the virtual hand does it, and motors bring the rig back before each sheet.
    ``confirm`` asks a person to load each sheet; a simulator loads by itself. Otherwise as
    capture_friction.
    """
    identity = link.identity
    coverage = cut_coverage(recipe, identity, hand=hand)
    recorder = Recorder(writer, coverage)
    gains = _gains(link, recipe, "cut", probe, writer)
    if hand:
        with _motion_for(link, recipe, None, gains, probe) as motion:
            loader = Loader(motion, recorder, confirm)
            tell = progress or _silent
            hand_strokes(
                motion, recipe, recorder, loader, lambda done, what: tell(done, what, recorder)
            )
            return _finish(recorder, motion)
    plan = cut_plan(recipe, identity)
    with _motion_for(link, recipe, plan, gains, probe) as motion:
        loader = Loader(motion, recorder, confirm)
        loader.clear(CLEAR_REQUEST)
        drive = _Drive(motion, recorder, plan, progress)
        drive.idle()
        for segment in plan.segments:
            loader.retract()
            drive.go_to_start(segment)
            loader.load(drive.warning() + segment.request)
            drive.follow(segment)
        drive.idle()
        return _finish(recorder, motion)


def servo_config(
    recipe: Recipe,
    identity: Identity,
    duration_s: float = 0.0,
    gains: CaptureGains | None = None,
    handle_zero_N: float = 0.0,
) -> ServoConfig:
    """Limits and gains of a motor-driven capture: the tighter of recipe's and device's limits.

    ``gains`` are those of `capture_gains`, by default those of a rig that nobody probed;
    ``handle_zero_N`` is what the force sensor shows without a hand.

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
            watches_of(identity, torque_limit, limits.held_at_limit_s, handle_zero_N),
            still_rad=control.still_rad,
        ),
    )


def identity_facts(identity: Identity) -> dict[str, Any]:
    """The identity as plain numbers and strings, for a recording; the hash in hexadecimal."""
    facts = identity._asdict()
    del facts["nonce_echo"]
    return {**facts, "schema_hash": f"{identity.schema_hash:016x}"}


def rig_facts(identity: Identity, motor_sign: int, probe: ProbeResult | None) -> dict[str, Any]:
    """What a recording holds of its rig: the identity, a motor sign of -1, and the probe.

    Torques in the recording are of the corrected sign.
    """
    facts = identity_facts(identity)
    if motor_sign != 1:
        facts["motor_sign"] = motor_sign
    if probe is not None:
        facts[PROBE_KEY] = probe.as_dict()
    return facts


def identity_of(facts: Mapping[str, Any]) -> Identity:
    """The identity that a recording's facts state, as `identity_facts` wrote them."""
    known = {name: facts[name] for name in Identity._fields if name in facts}
    known["schema_hash"] = int(str(facts["schema_hash"]), 16)
    return Identity(**{**known, "nonce_echo": 0})


class _Drive:
    """Runs segments of a plan and reports progress."""

    def __init__(
        self, motion: Motion, recorder: Recorder, plan: Plan, progress: CaptureProgress | None
    ) -> None:
        self._motion = motion
        self._recorder = recorder
        self._plan = plan
        self._tell = progress or _silent
        self._total = sum(len(segment.reference) for segment in plan.segments)
        self._done = 0
        identity, cuts = motion.identity, any(stroke.sheet >= 0 for stroke in plan.strokes)
        self._load = LoadWatch(plan.strokes, identity.handle_radius) if cuts else None
        self._warned = 0

    def warning(self) -> str:
        """What to tell the person who loads the next piece about the last; empty if it was cut."""
        empty, self._warned = self._recorder.empty[self._warned :], len(self._recorder.empty)
        return f"{unloaded_sentence(empty[-1])} " if empty else ""

    def go_to_start(self, segment: Segment) -> None:
        """Bring the rig to where a segment starts, so that material can be loaded there."""
        for samples in self._motion.track(segment.reference.head()):
            self._take(samples, "moving to where the next piece is loaded")

    def follow(self, segment: Segment) -> None:
        """Run a segment and record it."""
        begun = self._done
        for samples in self._motion.track(segment.reference):
            passed = self._motion.track_index - self._motion.approach_ticks
            self._done = max(self._done, begun + min(passed, len(segment.reference)))
            self._take(samples, self._doing(samples))
        self._done = begun + len(segment.reference)

    def idle(self) -> None:
        """Record with the motors off, which shows the sensor zeros."""
        for samples in self._motion.idle(IDLE_S):
            if self._load and self._done == 0:
                self._load.rest(samples)
            self._take(samples, "motors off, measuring sensor zeros")

    def _take(self, samples: Samples, sentence: str) -> None:
        self._recorder.take(samples, self._motion.garbled)
        for stroke in self._load.take(samples) if self._load and len(samples) else ():
            self._recorder.unloaded(stroke)
            self._tell(self._done / self._total, unloaded_sentence(stroke), self._recorder)
        self._tell(self._done / self._total, sentence, self._recorder)

    def _doing(self, samples: Samples) -> str:
        labels = samples["stroke"]
        if len(labels) == 0 or labels[-1] < 0:
            return "between strokes"
        stroke = self._plan.strokes[int(labels[-1])]
        speed = f" at {stroke.speed:g} rad/s" if np.isfinite(stroke.speed) else ""
        sheet = f", piece {stroke.sheet + 1}" if stroke.sheet >= 0 else ""
        of = f"stroke {stroke.index + 1} of {len(self._plan.strokes)}{sheet}"
        return f"{stroke.kind}{speed} ({of})"


def _gains(
    link: Link, recipe: Recipe, kind: Kind, probe: ProbeResult | None, writer: RecordingWriter
) -> CaptureGains:
    """Gains by what the probe found; what is said of them is noted."""
    gains = capture_gains(recipe, link.identity, kind, Probed.of(probe))
    for verdict in gains.verdicts if probe else ():
        writer.note(verdict.why)
    return gains


def _motion_for(
    link: Link, recipe: Recipe, plan: Plan | None, gains: CaptureGains, probe: ProbeResult | None
) -> Motion:
    zero_N = probe.handle_zero_N if probe else 0.0
    config = servo_config(recipe, link.identity, plan.duration_s if plan else 0.0, gains, zero_N)
    longest = max((len(segment.reference) for segment in plan.segments), default=0) if plan else 0
    return open_motion(link, config, longest_reference=longest)


def _finish(recorder: Recorder, motion: Motion) -> CaptureReport:
    report = motion.report()
    recorder.writer.note(report.lag.sentence)
    if report.rights:
        recorder.writer.note(report.rights.sentence)
    recorder.finish(report.overrun)
    return CaptureReport(
        recorder.sample_count, recorder.coverage, recorder.tally, report, tuple(recorder.empty)
    )


def _silent(done: float, sentence: str, recorder: Recorder) -> None:
    pass
