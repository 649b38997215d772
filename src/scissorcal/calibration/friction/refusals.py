"""Motion and terms that cannot determine friction: refused, with what to record instead."""

import numpy as np
from scipy.special import stdtrit

from scissorcal.calibration.signals.filtering import Bins, position_error
from scissorcal.calibration.signals.segments import gaps_in_words
from scissorcal.calibration.signals.sensors import Sensors
from scissorcal.calibration.signals.soundness import interruptions
from scissorcal.calibration.signals.usage import EDGE, GAP, INVALID, SLOW, Usage
from scissorcal.calibration.signals.weak_form import Windows
from scissorcal.errors import InputError
from scissorcal.model.friction_terms import TERMS, terms_of
from scissorcal.recipe.schema import FitFriction
from scissorcal.recording.recording import Joint, Recording

FEWEST_BINS = 200
LEAST_TRAVEL_S = 0.1
"""Travel of so many seconds at the slowest certain rate is motion, if a slow one."""
DRIFT_RATE = 1e-3
"""Chance with which an interval that says of a drift that it exceeds friction is wrong."""
STROKE_WINDOWS = 2.0
"""In strokes of so many windows' length half of the windows hold a turn, in shorter ones most."""


def refuse_friction(
    recordings: tuple[Recording, ...],
    settings: FitFriction,
    recorded: Windows,
    windows: Windows,
    sensors: Sensors,
    usage: Usage,
) -> None:
    """Raise InputError where the moving windows cannot determine what ``settings`` ask for."""
    joint = recordings[0].joint
    if len(windows.first) < FEWEST_BINS:
        raise _too_little(recordings, recorded, windows, sensors, usage)
    _refuse_poor_motion(windows.bins, recordings, joint)
    _refuse_drift(windows.bins, recordings, joint)
    _refuse_terms(settings, windows, joint)


def _too_little(
    recordings: tuple[Recording, ...],
    recorded: Windows,
    windows: Windows,
    sensors: Sensors,
    usage: Usage,
) -> InputError:
    """The error of recordings of which too little is left: what became of them, and the cause.

    The cause is what most of the time was lost to, not the last filter that found nothing.
    """
    lost, broken = usage.lost, interruptions(recordings)
    needed_s, used_s = FEWEST_BINS * recorded.bins.bin_s, len(windows.first) * recorded.bins.bin_s
    parted = lost.get(GAP, 0.0) + lost.get(EDGE, 0.0)
    slow, invalid = lost.get(SLOW, 0.0), lost.get(INVALID, 0.0)
    if invalid > max(slow, parted) and sensors.verdict.status == "fail":
        cause = sensors.verdict.why
    elif broken.decide:
        cause = broken.sentence
    elif parted > max(slow, invalid):
        cause = (
            f"Most of the rest went to gaps and the ends of pieces: {gaps_in_words(recordings)} "
            "Record for longer, and without losing samples."
        )
    else:
        cause = _motion_cause(recordings, recorded)
    names = ", ".join(recording.source or "the recording" for recording in recordings)
    return InputError(
        f"{names}: {used_s:.3g} s of motion are left to fit, and friction needs at least "
        f"{needed_s:.3g} s. {cause} {usage.counted}: {len(windows.first)} of {len(recorded.first)} "
        "windows."
    )


def _motion_cause(recordings: tuple[Recording, ...], recorded: Windows) -> str:
    """Why the joint's own motion leaves too few windows without a rest or a turn."""
    unit, floor = recordings[0].joint.position_unit, recorded.bins.rate_floor
    travel = max(float(np.ptp(recording.samples["opening"])) for recording in recordings)
    below = float(np.mean(np.abs(recorded.rate) <= floor)) if len(recorded.rate) else 1.0
    window_s, stroke_s = len(recorded.weights) * recorded.tick_s, _stroke_s(recordings)
    if stroke_s < STROKE_WINDOWS * window_s:
        return (
            f"The joint turns too soon: half of the strokes last less than {stroke_s:.2g} s, and "
            f"windows of {window_s:.2g} s are needed that hold no turn. Make longer strokes, or "
            "log them at a higher rate."
        )
    if travel > LEAST_TRAVEL_S * floor > 0.0 and below > 0.5:
        return (
            f"The joint travels {travel:.3g} {unit}, but {below:.0%} of the time below "
            f"{floor:.2g} {unit}/s, where {_hiding(recordings, unit)} does not show its direction: "
            "record faster sweeps, or lower fit.friction.cutoff_Hz."
        )
    hidden = ""
    if floor > 0.0 and travel > 0.0:
        hidden = f" Below {floor:.2g} {unit}/s {_hiding(recordings, unit)} hides the motion."
    return (
        f"There is hardly any motion ({travel:.3g} {unit} of travel): capture sweeps in both "
        f"directions at several speeds.{hidden}"
    )


def _stroke_s(recordings: tuple[Recording, ...]) -> float:
    """Median time of the strokes; infinite where there are none."""
    found = [
        float(np.median(np.diff(recording.device_time_s))) * np.bincount(label[label >= 0])
        for recording in recordings
        if np.any((label := np.asarray(recording.samples["stroke"], dtype=np.int64)) >= 0)
    ]
    return float(np.median(np.concatenate(found))) if found else float("inf")


def _hiding(recordings: tuple[Recording, ...], unit: str) -> str:
    """What hides the sense of motion: the encoder's step, or the noise of the position."""
    errors = [
        position_error(np.asarray(recording.samples["opening"], float)) for recording in recordings
    ]
    step, sd = max(errors, key=lambda error: error[1])
    if np.isfinite(step) and sd < step:
        turned = f" ({np.degrees(step):.3g} deg)" if unit == "rad" else ""
        return f"the encoder's step of {step:.3g} {unit}{turned}"
    return f"the position's noise of {sd:.2g} {unit}"


def _refuse_poor_motion(bins: Bins, recordings: tuple[Recording, ...], joint: Joint) -> None:
    names = ", ".join(recording.source or "the recording" for recording in recordings)
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


def _refuse_drift(bins: Bins, recordings: tuple[Recording, ...], joint: Joint) -> None:
    """Refuse a torque whose zero drifts over a recording by more than friction.

    The means of runs of one direction are regressed on time and direction; only where both
    intervals are clear of each other is it said, at a false-alarm rate of ``DRIFT_RATE`` each.
    """
    for index in np.unique(bins.recording):
        own = bins.where(bins.recording == index)
        run = np.cumsum(np.diff(np.sign(own.rate), prepend=np.sign(own.rate[0])) != 0)
        counts = np.bincount(run)
        time, drive, way = (
            np.bincount(run, values) / counts
            for values in (own.time_s, own.drive, np.sign(own.rate))
        )
        freedom = len(counts) - 3
        if freedom < 3 or np.ptp(time) == 0.0:
            continue
        columns = np.column_stack([(time - time.mean()) / np.ptp(time), way, np.ones(len(time))])
        found, *_ = np.linalg.lstsq(columns, drive, rcond=None)
        size = np.sqrt(np.sum((drive - columns @ found) ** 2) / freedom)
        error = size * np.sqrt(np.diag(np.linalg.pinv(columns.T @ columns)))
        reach = float(stdtrit(freedom, 1.0 - DRIFT_RATE / 2.0)) * error
        drift, friction = np.abs(found[:2]).tolist()
        if drift - reach[0] > friction + reach[1]:
            unit = joint.effort_unit
            raise InputError(
                f"{recordings[index].source or 'the recording'}: the torque's zero drifts by "
                f"{drift:.2g} {unit} (+- {reach[0]:.1g}) from {time.min():.3g} to {time.max():.3g} "
                f"s, more than friction holds ({friction:.2g} +- {reach[1]:.1g} {unit}), so that "
                "friction is not to be told from it. Let the sensor warm up, or record shorter "
                "logs with the joint at rest and the motors off before and after, and import "
                "them again."
            )


def _refuse_terms(settings: FitFriction, windows: Windows, joint: Joint) -> None:
    """Refuse terms that these recordings cannot determine: of a load or angle that they lack."""
    named = "" if settings.law == "auto" else settings.law
    own = terms_of(named) if named else ()
    wanted = [f'fit.friction.law = "{named}"'] if any(one.needs_load for one in own) else []
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
