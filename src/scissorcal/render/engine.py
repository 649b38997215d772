"""Render a package on a rig within limits, record it, and judge it."""

from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

from scissorcal.device.motion import BLOCK_S, IDLE, STOP_MARGIN_RAD, LoopTask, Motion
from scissorcal.device.port_motion import open_motion
from scissorcal.device.session import Confirm, RigSession, is_simulator, refuse_nobody, rig_facts
from scissorcal.device.timing import FeltLag
from scissorcal.device.watching import let_go_damping, watches_of
from scissorcal.errors import InputError
from scissorcal.kernel import ConfigKey, Identity, PlateConfig, ServoConfig
from scissorcal.package import ModelPackage
from scissorcal.recipe.schema import Limits
from scissorcal.recording import Joint, RecordingFacts, RecordingWriter
from scissorcal.recording.probe import UNKNOWN_REST, RestFacts
from scissorcal.render import on_device
from scissorcal.render.admission import (
    Admission,
    admit_package,
    passivity_config,
    rendered_tables,
)
from scissorcal.render.admission_rule import RATE_CUTOFF_HZ
from scissorcal.render.pose_placer import EVERY_S, PosePlacer, plate_config, pose_placer
from scissorcal.render.result import (
    LOOK_EVERY_S,
    AppliedLimits,
    RenderResult,
    Watch,
    felt_verdict,
    render_verdicts,
)
from scissorcal.render.rig_facts import RigFacts, find_mismatch, refuse_other_rig
from scissorcal.tracking.plate_pose import PoseSource

SUPERVISOR_S = 0.2
"""Time without heartbeat after which only damping is left; after five times as much it stops.
The heartbeat ends where the supervisor takes no block for a second: see Heartbeat."""

FALLBACK_DAMPING = 0.02
FAULT_CLEARINGS = 20
FAULT_CLEARINGS_PER_S = 0.2
"""Faults that are cleared, each with a new ramp from zero; one more stops the loop."""

TRAVEL_SHARE = 0.2
LIMITED_WARNING = 0.01
STILL_WARNING_S = 2.0
"""Chosen: a hand that makes strokes turns round faster."""

REQUEST = (
    "Take everything out from between the blades, and hold the handles loosely: they push "
    "back as soon as you continue."
)


@dataclass(frozen=True)
class VirtualStrokes:
    """Strokes of a simulator's hand: number of closing strokes, and their mean rate (rad/s)."""

    count: int = 4
    rate_rad_per_s: float = 0.3


@dataclass(frozen=True)
class Rendering:
    """How a package is rendered: for how long, what a simulator's hand does, what a person accepts.

    ``accept_derated``: what is felt may differ from the package's by more than the scene's
    tolerance. ``allow_mismatch``: the package may be of another rig (`mismatch`). ``on_device``:
    the device renders by itself, and this computer watches.
    """

    seconds: float = 30.0
    strokes: VirtualStrokes = VirtualStrokes()
    accept_derated: bool = False
    allow_mismatch: bool = False
    on_device: bool = False


def render(
    session: RigSession,
    package: ModelPackage,
    how: Rendering = Rendering(),
    *,
    writer: RecordingWriter | None = None,
    rig: RigFacts | None = None,
    plate: PoseSource | None = None,
) -> RenderResult:
    """Render a package for ``how.seconds`` of the device's time, a fresh sheet between the blades.

    Of a package with a drawn plate that plate is rendered.

    The loop runs in a separate process, paced by the device's frames, or frame by frame in
    virtual time on a LockstepLink. It keeps to the tightest of three limits: the recipe's, the
    package's own, the device's. Force is ramped up from zero, also after a fault. On a simulator
    the virtual hand makes ``how.strokes``, and the rendering ends with them; on a real rig a person
    is asked to clear the blades before any force.
    ``writer`` records every sample; see `open_writer`. What is wrong with the package or does not
    match the device becomes a note of the recording at the start, and ``warnings`` of the result.

    Where the package's scene has ``plate_pose = "estimated"``, the torque is that of the plate
    where ``plate`` has it, or without one where the package's fitted pose has it. The force falls
    while the pose is lost or too uncertain for the scene's tolerance
    (`pose_placer.PosePlacer`), and the result's ``plate`` states it. Packages with a known pose
    take no heed of ``plate``.

    Before any force, `admission.admit_package` compares the package's stiffness with what the rig
    renders stably, and softens it where that is less; ``rig`` is what is known of friction,
    inertia, delay and the force sensor's zero, by default the package's friction fit. The result's
    ``admission`` states it. Where the felt torque then differs from the package's by more than the
    scene's tolerance, the verdict *felt torque* fails, unless a person wants it so
    (``how.accept_derated``), which result and recording then state.

    With ``how.on_device`` the device is given the admitted package and its limits, renders by
    itself from its own measurements, and this computer records and watches what the device states.

    Raises InputError, before anything moves, where package and device do not match, where the rig
    cannot render the package stably, or nobody can be asked; MissingError where an estimated plate
    has no pose; DeviceError where the rig fails, and what was recorded is kept.
    """
    identity, operator = session.identity, session.operator
    _refuse_impossible(session, how.seconds)
    start = _judged(session, package, how, rig)
    tables = rendered_tables(package.tables, start.admission)
    follower = pose_placer(package, plate, tables, start.limits.torque_Nm, writer)
    config = replace(
        _servo_config(start, identity, how.seconds, rig.rest if rig else UNKNOWN_REST),
        motor_sign=session.recipe.rig.motor_sign,
        plate=plate_config(tables) if follower else PlateConfig(),
    )
    if writer:
        for sentence in start.warnings:
            writer.note(sentence)
        if start.admission.is_felt:
            writer.note(felt_verdict(start.admission, accepted=start.accepted).why)
    by_device = how.on_device
    limit = start.limits.torque_Nm if by_device else None
    watch = Watch(_travel(package), writer, operator.progress, how.seconds, limit)
    task = LoopTask(tables, package.pieces or None)
    if by_device:
        loaded = on_device.load(session, package, config, tables)
        config, task = on_device.watching(config), IDLE
        if writer:
            writer.note(loaded.sentence)
    every_s = EVERY_S if follower else BLOCK_S
    with open_motion(session.link, config, task, every_s) as motion:
        watch.wanted = _prepare(motion, how.strokes, operator.confirm)
        motion.fresh_sheet(0.0)
        if by_device:
            motion.configure(ConfigKey.RENDER, 1.0)
        with follower or nullcontext():
            if follower:
                follower.follow(motion, motion.step())
            rendered = motion.watch(how.seconds) if by_device else motion.render(how.seconds)
            for samples in rendered:
                if follower:
                    follower.follow(motion, samples)
                done = watch.take(samples)
                if by_device:
                    on_device.check_renders(samples)
                if done:
                    break
        for samples in motion.idle(LOOK_EVERY_S):
            watch.record(samples)
        if by_device:
            motion.configure(ConfigKey.RENDER, 0.0)
        if session.simulated:
            motion.configure(ConfigKey.HAND_SPEED_rad_per_s, 0.0)
    result = _result(motion, watch, package, start, follower)
    if by_device:
        lag = FeltLag.of_device(motion.tick_s)
        verdicts = on_device.watched_verdicts(result.verdicts)
        result = replace(result, lag=lag, verdicts=verdicts)
    if writer:
        _note(writer, result, result.warnings[len(start.warnings) :])
    return result


class _Start(NamedTuple):
    """What is known before any force: limits, admission, whether it is accepted, warnings."""

    limits: AppliedLimits
    admission: Admission
    accepted: bool
    warnings: tuple[str, ...]


def _judged(
    session: RigSession, package: ModelPackage, how: Rendering, rig: RigFacts | None
) -> _Start:
    """Compare the package with the rig; InputError where it cannot be rendered there."""
    identity = session.identity
    limits = _applied(package, session.recipe.limits, identity)
    other_rig, notes = find_mismatch(package, identity)
    if not how.allow_mismatch:
        refuse_other_rig(package, identity)
    admission = admit_package(package, identity, rig, limits.torque_Nm)
    warnings = package.warnings + other_rig + notes + _admitted(admission)
    return _Start(limits, admission, how.accept_derated and admission.is_felt, warnings)


def _result(
    motion: Motion,
    watch: Watch,
    package: ModelPackage,
    start: _Start,
    follower: PosePlacer | None,
) -> RenderResult:
    """Figures of a rendering that has ended."""
    report, tick_us = motion.report(), motion.identity.tick_us
    out_s = report.counters.plate_out_frames * motion.tick_s
    plate = follower.report(watch.frames * motion.tick_s, out_s) if follower else None
    limited = watch.limited / max(1, watch.frames)
    return RenderResult(
        seconds=watch.frames * motion.tick_s,
        frames=report.counters.frames,
        strokes=watch.strokes,
        latency=watch.latency,
        interval=report.interval,
        lag=report.lag,
        rights=report.rights,
        misses=report.counters.misses,
        garbled=report.garbled,
        stalls=report.stalls,
        unsent=report.unsent,
        overrun=report.overrun,
        faults=report.counters.faults,
        fallback_frames=report.counters.fallback_frames,
        limited_share=limited,
        largest_torque_Nm=watch.largest_torque,
        ledger=report.ledger,
        limits=start.limits,
        admission=start.admission,
        accepted_derated=start.accepted,
        plate=plate,
        package_hash=package.manifest.content_hash,
        verdicts=render_verdicts(
            report, watch.latency, tick_us, start.admission, plate, accepted=start.accepted
        ),
        warnings=start.warnings
        + _limited_warning(limited, start.limits)
        + _still_warning(watch.still_s)
        + (plate.sentences if plate else ()),
    )


def open_writer(session: RigSession, package: ModelPackage, path: Path) -> RecordingWriter:
    """Open the recording of a rendering; the package's manifest travels in it.

    Raises as RecordingWriter does.
    """
    identity = session.identity
    writer = RecordingWriter(
        path,
        "render",
        Joint("rotary"),
        facts=RecordingFacts(
            recipe_toml=session.recipe_toml,
            device=rig_facts(identity, session.recipe.rig.motor_sign, session.probe),
            handle_radius_m=identity.handle_radius,
            min_travel=_travel(package),
        ),
    )
    manifest = package.manifest.model_dump_json(indent=2).encode("utf-8")
    writer.attach("package-manifest.json", manifest, "application/json")
    return writer


def _refuse_impossible(session: RigSession, seconds: float) -> None:
    if not 0.0 < seconds < float("inf"):
        raise InputError(
            f"Rendering for {seconds:g} s is not possible: give a finite time above 0."
        )
    why = "Rendering must ask a person to clear the blades first"
    refuse_nobody(session.identity, session.operator.confirm, why)


def _applied(package: ModelPackage, recipe: Limits, identity: Identity) -> AppliedLimits:
    stated = package.manifest.limits
    translates = "translation_force" in package.manifest.mechanics.render
    return AppliedLimits(
        torque_Nm=min(recipe.torque_Nm, stated.torque_Nm, identity.torque_limit),
        torque_slew_Nm_per_s=min(recipe.torque_slew_Nm_per_s, stated.torque_slew_Nm_per_s),
        force_N=min(recipe.force_N, stated.force_N, identity.force_limit) if translates else 0.0,
        force_slew_N_per_s=min(recipe.force_slew_N_per_s, stated.force_slew_N_per_s),
        engagement_ramp_s=max(recipe.engagement_ramp_s, stated.engagement_ramp_s),
        held_at_limit_s=recipe.held_at_limit_s,
    )


def _servo_config(
    start: _Start, identity: Identity, seconds: float, rest: RestFacts
) -> ServoConfig:
    applied = start.limits
    return ServoConfig(
        torque_limit=applied.torque_Nm,
        torque_slew=applied.torque_slew_Nm_per_s,
        force_limit=applied.force_N,
        force_slew=applied.force_slew_N_per_s,
        ramp_s=applied.engagement_ramp_s,
        damping_Nm_s_per_rad=FALLBACK_DAMPING,
        let_go_damping_Nm_s_per_rad=let_go_damping(identity, rest),
        rate_cutoff_Hz=RATE_CUTOFF_HZ,
        opening_low=identity.opening_min - STOP_MARGIN_RAD,
        opening_high=identity.opening_max + STOP_MARGIN_RAD,
        supervisor_ms=round(SUPERVISOR_S * 1e3),
        fault_clearings=FAULT_CLEARINGS + round(FAULT_CLEARINGS_PER_S * seconds),
        tick_us=identity.tick_us,
        passivity=passivity_config(start.admission, identity),
        watch=watches_of(identity, applied.torque_Nm, applied.held_at_limit_s, rest),
    )


def _admitted(admission: Admission) -> tuple[str, ...]:
    """What a person at the rig has to know of the admission: nothing where it took nothing back."""
    if admission.evaluated and not admission.derated:
        return ()
    cures = f" What would cure it: {' '.join(admission.cures)}" if admission.cures else ""
    return (f"{' '.join(admission.reasons)}{cures}",)


def _prepare(motion: Motion, strokes: VirtualStrokes, confirm: Confirm | None) -> int | None:
    """Clear the blades and start the virtual hand; return how many strokes it will make, if any."""
    if not is_simulator(motion.identity):
        assert confirm is not None
        with motion.paused():
            confirm(REQUEST)
        return None
    motion.configure(ConfigKey.MATERIAL, 0.0)
    motion.configure(ConfigKey.HAND_STROKES, float(strokes.count))
    motion.configure(ConfigKey.HAND_SPEED_rad_per_s, strokes.rate_rad_per_s)
    return strokes.count


def _travel(package: ModelPackage) -> float:
    low, high = package.manifest.ranges.opening_rad
    return TRAVEL_SHARE * (high - low)


def _limited_warning(share: float, applied: AppliedLimits) -> tuple[str, ...]:
    if share <= LIMITED_WARNING:
        return ()
    return (
        f"In {share:.0%} of the frames the model asked for more than the limits allow "
        f"({applied.torque_Nm:g} N m): the rendered force was weaker than the model.",
    )


def _still_warning(still_s: float) -> tuple[str, ...]:
    if still_s <= STILL_WARNING_S:
        return ()
    return (
        f"The opening did not change by a single count in the last {still_s:.1f} s. If the blades "
        "moved meanwhile, the encoder is stuck: check it and its cable, then run 'scissorcal "
        "device probe'.",
    )


def _note(writer: RecordingWriter, result: RenderResult, late: tuple[str, ...]) -> None:
    """Note how it went, with the warnings that were not known (and noted) at the start."""
    writer.note(f"Rendered package {result.package_hash} for {result.seconds:.1f} s.")
    writer.note(result.lag.sentence)
    if result.rights:
        writer.note(result.rights.sentence)
    for sentence in late:
        writer.note(sentence)
    for count, words in (
        (result.misses, "frames were lost."),
        (result.garbled, "frames were garbled."),
        (result.faults, "times the device latched a fault."),
        (result.overrun, "samples were read too late and lost."),
    ):
        if count:
            writer.note(f"{count} {words}")
