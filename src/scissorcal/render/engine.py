"""Render a package on a rig within limits, record it, and judge it."""

from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path

from scissorcal.aliases import Progress
from scissorcal.device.link import Link
from scissorcal.device.loading import Confirm, is_simulator
from scissorcal.device.motion import BLOCK_S, STOP_MARGIN_RAD, Motion
from scissorcal.device.open_motion import open_motion
from scissorcal.device.rig_record import rig_facts
from scissorcal.device.watching import let_go_damping, watches_of
from scissorcal.errors import InputError
from scissorcal.kernel import ConfigKey, Identity, PlateConfig, ServoConfig
from scissorcal.package import ModelPackage
from scissorcal.recipe.schema import Limits
from scissorcal.recording import Joint, RecordingFacts, RecordingWriter
from scissorcal.recording.probe import UNKNOWN_REST, ProbeResult
from scissorcal.render.admission import (
    Admission,
    admit_package,
    passivity_config,
    rendered_tables,
)
from scissorcal.render.admission_rule import RATE_CUTOFF_HZ
from scissorcal.render.mismatch import find_mismatch, refuse_other_rig
from scissorcal.render.plate_pose import EVERY_S, PlatePlacer, plate_config
from scissorcal.render.plate_source import plate_placer
from scissorcal.render.result import (
    AppliedLimits,
    RenderResult,
    felt_verdict,
    render_verdicts,
)
from scissorcal.render.rig_facts import RigFacts
from scissorcal.render.watch import LOOK_EVERY_S, Watch
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


def render(
    link: Link,
    package: ModelPackage,
    *,
    seconds: float = 30.0,
    limits: Limits | None = None,
    motor_sign: int = 1,
    strokes: VirtualStrokes | None = None,
    writer: RecordingWriter | None = None,
    progress: Progress | None = None,
    confirm: Confirm | None = None,
    rig: RigFacts | None = None,
    plate: PoseSource | None = None,
    accept_derated: bool = False,
    allow_mismatch: bool = False,
) -> RenderResult:
    """Render a package for ``seconds`` of the device's time, a fresh sheet between the blades.

    Of a package with a drawn plate that plate is rendered.

    The loop runs in a separate process, paced by the device's frames, or frame by frame in
    virtual time on a LockstepLink; ``motor_sign`` is the recipe's. It keeps to the tightest of
    three limits: ``limits`` (a recipe's), the package's own, the device's. Force is ramped up from
    zero, also after a fault. On a simulator the virtual hand makes ``strokes`` (four, unless
    given), and the rendering ends with them; on a real rig ``confirm`` asks a person to clear the
    blades before any force.
    ``writer`` records every sample; see `open_writer`. What is wrong with the package or does not
    match the device becomes a note of the recording at the start, and ``warnings`` of the result.
    A package of another rig (`mismatch`) is refused unless ``allow_mismatch``.

    Where the package's scene has ``plate_pose = "estimated"``, the torque is that of the plate
    where ``plate`` has it, or without one where the package's fitted pose has it. The force falls
    while the pose is lost or too uncertain for the scene's tolerance
    (`plate_pose.PlatePlacer`), and the result's ``plate`` states it. Packages with a known pose
    take no heed of ``plate``.

    Before any force, `admission.admit_package` compares the package's stiffness with what the rig
    renders stably, and softens it where that is less; ``rig`` is what is known of friction,
    inertia, delay and the force sensor's zero, by default the package's friction fit. The result's
    ``admission`` states it. Where the felt torque then differs from the package's by more than the
    scene's tolerance, the verdict *felt torque* fails, unless a person wants it so
    (``accept_derated``), which result and recording then state.

    Raises InputError, before anything moves, where package and device do not match, where the rig
    cannot render the package stably, or nobody can be asked; MissingError where an estimated plate
    has no pose; DeviceError where the rig fails, and what was recorded is kept.
    """
    identity = link.identity
    _refuse_impossible(identity, seconds, confirm)
    applied = _applied(package, limits, identity)
    mismatch = find_mismatch(package, identity)
    if not allow_mismatch:
        refuse_other_rig(package, identity)
    admission = admit_package(package, identity, rig, applied.torque_Nm)
    differs = mismatch.other_rig + mismatch.notes
    warnings = package.warnings + differs + _admitted(admission)
    tables = rendered_tables(package.tables, admission)
    follower = plate_placer(package, plate, tables, applied.torque_Nm, writer)
    placed = plate_config(tables) if follower else PlateConfig()
    config = _servo_config(applied, admission, identity, seconds, rig, placed)
    config = replace(config, motor_sign=motor_sign)
    accepted = accept_derated and admission.is_felt
    if writer:
        for sentence in warnings:
            writer.note(sentence)
        if admission.is_felt:
            writer.note(felt_verdict(admission, accepted=accepted).why)
    watch = Watch(_travel(package), writer, progress or _silent, seconds)
    every_s, pieces = EVERY_S if follower else BLOCK_S, package.pieces or None
    with open_motion(link, config, tables, every_s=every_s, pieces=pieces) as motion:
        watch.wanted = _prepare(motion, strokes, confirm)
        motion.fresh_sheet(0.0)
        with follower or nullcontext():
            if follower:
                follower.follow(motion, motion.step())
            for samples in motion.render(seconds):
                if follower:
                    follower.follow(motion, samples)
                if watch.take(samples):
                    break
        for samples in motion.idle(LOOK_EVERY_S):
            watch.record(samples)
        if is_simulator(identity):
            motion.configure(ConfigKey.HAND_SPEED_rad_per_s, 0.0)
    result = _result(
        motion, watch, package, applied, admission, warnings, follower, accepted=accepted
    )
    if writer:
        _note(writer, result, result.warnings[len(warnings) :])
    return result


def _result(
    motion: Motion,
    watch: Watch,
    package: ModelPackage,
    applied: AppliedLimits,
    admission: Admission,
    warnings: tuple[str, ...],
    follower: PlatePlacer | None,
    *,
    accepted: bool,
) -> RenderResult:
    """Figures of a rendering that has ended; ``warnings`` are those known at its start."""
    report = motion.report()
    out_s = report.counters.plate_out_frames * motion.tick_s
    seconds = watch.frames * motion.tick_s
    plate = follower.report(seconds, out_s) if follower else None
    latency = watch.latency
    limited = watch.limited / max(1, watch.frames)
    return RenderResult(
        seconds=seconds,
        frames=report.counters.frames,
        strokes=watch.strokes,
        latency=latency,
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
        limits=applied,
        admission=admission,
        accepted_derated=accepted,
        plate=plate,
        package_hash=package.manifest.content_hash,
        verdicts=render_verdicts(
            report, latency, motion.identity.tick_us, admission, plate, accepted=accepted
        ),
        warnings=warnings
        + _limited_warning(limited, applied)
        + _still_warning(watch.still_s)
        + (plate.sentences if plate else ()),
    )


def open_writer(
    path: Path,
    link: Link,
    package: ModelPackage,
    recipe_toml: str = "",
    *,
    motor_sign: int = 1,
    probe: ProbeResult | None = None,
) -> RecordingWriter:
    """Open the recording of a rendering; the package's manifest travels in it.

    ``recipe_toml`` is the recipe's text, unchanged, ``probe`` what a probe of this
    rig found. Raises as RecordingWriter does.
    """
    writer = RecordingWriter(
        path,
        "render",
        Joint("rotary"),
        facts=RecordingFacts(
            recipe_toml=recipe_toml,
            device=rig_facts(link.identity, motor_sign, probe),
            handle_radius_m=link.identity.handle_radius,
            min_travel=_travel(package),
        ),
    )
    manifest = package.manifest.model_dump_json(indent=2).encode("utf-8")
    writer.attach("package-manifest.json", manifest, "application/json")
    return writer


def _refuse_impossible(identity: Identity, seconds: float, confirm: Confirm | None) -> None:
    if not 0.0 < seconds < float("inf"):
        raise InputError(
            f"Rendering for {seconds:g} s is not possible: give a finite time above 0."
        )
    if not is_simulator(identity) and confirm is None:
        raise InputError(
            "Rendering must ask a person to clear the blades first: pass a confirm callback that "
            "shows a sentence and returns when that is done."
        )


def _applied(package: ModelPackage, limits: Limits | None, identity: Identity) -> AppliedLimits:
    own = package.manifest.limits
    recipe = limits or own
    translates = "translation_force" in package.manifest.mechanics.render
    return AppliedLimits(
        torque_Nm=min(recipe.torque_Nm, own.torque_Nm, identity.torque_limit),
        torque_slew_Nm_per_s=min(recipe.torque_slew_Nm_per_s, own.torque_slew_Nm_per_s),
        force_N=min(recipe.force_N, own.force_N, identity.force_limit) if translates else 0.0,
        force_slew_N_per_s=min(recipe.force_slew_N_per_s, own.force_slew_N_per_s),
        engagement_ramp_s=max(recipe.engagement_ramp_s, own.engagement_ramp_s),
        held_at_limit_s=(limits or Limits()).held_at_limit_s,
    )


def _servo_config(
    applied: AppliedLimits,
    admission: Admission,
    identity: Identity,
    seconds: float,
    rig: RigFacts | None,
    plate: PlateConfig,
) -> ServoConfig:
    rest = rig.rest if rig else UNKNOWN_REST
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
        passivity=passivity_config(admission, identity),
        watch=watches_of(identity, applied.torque_Nm, applied.held_at_limit_s, rest),
        plate=plate,
    )


def _admitted(admission: Admission) -> tuple[str, ...]:
    """What a person at the rig has to know of the admission: nothing where it took nothing back."""
    if admission.evaluated and not admission.derated:
        return ()
    cures = f" What would cure it: {' '.join(admission.cures)}" if admission.cures else ""
    return (f"{' '.join(admission.reasons)}{cures}",)


def _prepare(motion: Motion, strokes: VirtualStrokes | None, confirm: Confirm | None) -> int | None:
    """Clear the blades and start the virtual hand; return how many strokes it will make, if any."""
    if not is_simulator(motion.identity):
        assert confirm is not None
        with motion.paused():
            confirm(REQUEST)
        return None
    strokes = strokes or VirtualStrokes()
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


def _silent(done: float, sentence: str) -> None:
    pass
