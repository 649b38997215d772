"""Motion and terms that cannot determine friction: refused, with what to record instead."""

import numpy as np

from scissorcal.calibration.signals.filtering import Bins
from scissorcal.calibration.signals.interruptions import interruptions
from scissorcal.calibration.signals.sensors import Sensors
from scissorcal.calibration.signals.weak_form import Windows
from scissorcal.errors import InputError
from scissorcal.model.friction_terms import TERMS, terms_of
from scissorcal.recipe.schema import FitFriction
from scissorcal.recording.recording import Joint, Recording
from scissorcal.recording.resolution import resolution_of

FEWEST_BINS = 200
LEAST_TRAVEL_S = 0.1
"""Travel of so many seconds at the slowest certain rate is motion, if a slow one."""


def refuse_friction(
    recordings: tuple[Recording, ...],
    settings: FitFriction,
    every: Windows,
    windows: Windows,
    sensors: Sensors,
) -> None:
    """Raise InputError where the moving windows cannot determine what ``settings`` ask for."""
    joint = recordings[0].joint
    _refuse_poor_motion(windows.bins, every.bins, recordings, joint, sensors)
    _refuse_terms(settings, windows, joint)


def _refuse_poor_motion(
    bins: Bins, every: Bins, recordings: tuple[Recording, ...], joint: Joint, sensors: Sensors
) -> None:
    names = ", ".join(recording.source or "the recording" for recording in recordings)
    if len(bins.rate) < FEWEST_BINS:
        travel = float(np.ptp(every.opening)) if len(every.opening) else 0.0
        if sensors.verdict.status == "fail":
            raise InputError(f"{names}: too few samples are left to fit. {sensors.verdict.why}")
        broken = interruptions(recordings)
        if broken.decide:
            raise InputError(f"{names}: too few samples are left to fit. {broken.sentence}")
        if 0 < LEAST_TRAVEL_S * every.rate_floor < travel:
            raise InputError(
                f"{names}: the joint travels {travel:.3g} {joint.position_unit}, but nearly always "
                f"below {every.rate_floor:.2g} {joint.position_unit}/s, where the encoder does not "
                "show its direction: record faster sweeps, or lower fit.friction.cutoff_Hz."
            )
        raise InputError(
            f"{names}: there is hardly any motion ({travel:.3g} {joint.position_unit} of travel, "
            f"{len(bins.rate) * bins.bin_s:.2g} s of it moving). Friction needs at least "
            f"{FEWEST_BINS * bins.bin_s:.1g} s of motion: capture sweeps in both directions at "
            f"several speeds.{_coarse(recordings, every, joint)}"
        )
    if not (np.any(bins.rate > 0) and np.any(bins.rate < 0)):
        missing = "negative (closing)" if np.all(bins.rate > 0) else "positive (opening)"
        raise InputError(
            f"{names}: the motion has one direction only; the {missing} one is missing. "
            "Friction and an offset are not distinguishable: capture sweeps in both directions."
        )
    if float(np.ptp(bins.drive)) <= 1e-9 * float(np.abs(bins.drive).max()):
        raise InputError(
            f"{names}: the drive torque is constant while the joint moves; check the "
            "motor_torque column or the sensor's connection."
        )


def _coarse(recordings: tuple[Recording, ...], every: Bins, joint: Joint) -> str:
    """That the encoder's step hides the motion, where it has one and the sweeps are slower."""
    steps = [resolution_of(np.asarray(one.samples["opening"], float)) for one in recordings]
    step = max((one for one in steps if np.isfinite(one)), default=0.0)
    moved = any(np.ptp(one.samples["opening"]) > step for one in recordings)
    if not step or not every.rate_floor or not moved:
        return ""
    shown = f"{step:.3g} {joint.position_unit}"
    if joint.kind == "rotary":
        shown += f" ({np.degrees(step):.3g} deg)"
    return (
        f" The encoder's step of {shown} hides motion below {every.rate_floor:.2g} "
        f"{joint.position_unit}/s: use a finer encoder, or faster sweeps."
    )


def _refuse_terms(settings: FitFriction, windows: Windows, joint: Joint) -> None:
    """Refuse terms that these recordings cannot determine: of a load or angle that they lack."""
    named = "" if settings.rung == "auto" else settings.rung
    own = terms_of(named) if named else ()
    wanted = [f'fit.friction.rung = "{named}"'] if any(one.needs_load for one in own) else []
    wanted += [f'the term "{name}"' for name in settings.adopt if TERMS[name].needs_load]
    if wanted and not windows.bears_load:
        raise InputError(
            f"{wanted[0]} needs the load that the joint bears, and these recordings have none, or "
            "one that hardly varies: record sweeps in which motor and handle work against each "
            "other by various amounts (motor_torque and handle_force, with handle_radius), or "
            "choose a law without load."
        )
    angles = [name for name in settings.adopt if TERMS[name].rotary]
    if angles and joint.kind == "linear":
        raise InputError(f'The term "{angles[0]}" needs an angle, and this joint is linear.')
    known = {name for one in own or terms_of("coulomb") for name in one.covers}
    for name in settings.adopt:
        if name in known or settings.adopt.count(name) > 1:
            raise InputError(
                f'fit.friction.adopt names "{name}", which the law has already: remove it.'
            )
