"""Zeros and noise of the sensors, from idle periods."""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.signals.segments import pieces_of, stretches
from scissorcal.recording.probe import probe_of
from scissorcal.recording.recording import Recording
from scissorcal.recording.resolution import noise_of, resolution_of
from scissorcal.verdicts import TORQUE, Check, Verdict

SURE = 2.0
"""Standard deviations of what is left of a zero that a verdict counts."""
FELT = 0.07
"""Share of the drive that people can just notice: about 7 % of a force (docs/how-to-choose.md)."""
BRIDGE = 1.0 / np.sqrt(12.0)
"""A random walk that is known at both ends and differs by d there has a mean within d / sqrt(12) of
the straight line between them (variance of a Brownian bridge's mean)."""
FINEST = 1e-3
"""Least sd of a zero, as a share of that of one that nobody measured."""
SENSOR_ZEROS = Check(
    "fit sensor zeros", f"{TORQUE}sensors' zero over the drive (rms); it is subtracted", at_most=1.0
)
"""A zero beyond all that drives the joint (rms) is no zero: a sensor is loaded or damaged."""
ZERO_DRIFT = Check(
    "fit zero drift", f"{TORQUE}two sds of what is left of zeros over the drive (rms)", at_most=FELT
)


@dataclass(frozen=True)
class DriveZero:
    """What the sensors show while nothing drives the joint, over recordings or one idle period.

    ``torque`` (N m or N) and ``force_N`` are means, ``drive`` is both together at the joint and
    ``sd`` is how well that is known over a recording, with ``drift`` between its beginning and end
    (NaN where only one end shows it). ``seconds`` of idle time show them, 0 for none. ``force_N``
    is 0 where no handle force is measured; ``time_s`` is the middle of one idle period.
    """

    torque: float
    force_N: float
    drive: float
    sd: float
    drift: float
    seconds: float
    time_s: float = float("nan")

    @property
    def measured(self) -> bool:
        """Whether any idle period shows it."""
        return self.seconds > 0.0

    def as_dict(self) -> dict[str, float | None]:
        """Plain numbers, for the diagnostics of a fit."""
        return {
            "zero_torque": self.torque,
            "zero_force_N": self.force_N,
            "zero_drive": self.drive,
            "zero_drive_sd": self.sd,
            "zero_drift": self.drift if np.isfinite(self.drift) else None,
            "zero_idle_s": self.seconds,
        }

    @classmethod
    def from_dict(cls, plain: Any) -> "DriveZero | None":
        """Read what `as_dict` gave; None for a fit that knew no zeros."""
        if "zero_drive_sd" not in plain:
            return None
        drift = plain["zero_drift"]
        return cls(
            float(plain["zero_torque"]),
            float(plain["zero_force_N"]),
            float(plain["zero_drive"]),
            float(plain["zero_drive_sd"]),
            float("nan") if drift is None else float(drift),
            float(plain["zero_idle_s"]),
        )


def without_zeros(
    recordings: tuple[Recording, ...], unmeasured_sd: float, known: DriveZero | None = None
) -> tuple[tuple[Recording, ...], DriveZero | None]:
    """Subtract each recording's zeros from its torque and force; say what is left.

    A zero runs straight from one idle period to the next; what a probe found counts as one at the
    beginning if the recording has none there. ``unmeasured_sd`` is that of a recording without any;
    ``known``, if given, is then taken for it, as of a fit before. Without ``known`` the zero is
    None where no recording has commands in strokes: such files (imports, a hand's strokes) do not
    show when nothing drove the joint, and stay as they are.
    """
    if known is None and not any(_is_driven(recording) for recording in recordings):
        return recordings, None
    cleaned, zeros = [], []
    for recording in recordings:
        periods = _shown(recording)
        zero = _zero_of(periods, unmeasured_sd)
        if not zero.measured and known is not None:
            zero = replace(known, sd=max(known.sd, abs(known.drive) * BRIDGE), seconds=0.0)
        zeros.append(zero)
        cleaned.append(_subtracted(recording, periods, zero))
    return tuple(cleaned), _joined(zeros)


def zero_verdicts(
    zero: DriveZero | None, recordings: tuple[Recording, ...], drive_rms: float
) -> tuple[Verdict, ...]:
    """Judge size and drift of the zeros against what drives the joint (rms)."""
    if zero is None:
        why = (
            "No recording says when motors were off, so nothing shows the sensors' zeros; they are "
            "taken as 0."
        )
        return (SENSOR_ZEROS.not_evaluated(why),)
    unit = recordings[0].joint.effort_unit
    rest = SURE * zero.sd / drive_rms if drive_rms > 0.0 else float("inf")
    if not zero.measured:
        why = (
            f"No idle second shows the sensors' zeros: they are taken as {zero.drive:.2g} {unit} "
            f"with an sd of {zero.sd:.2g} {unit}, which is in the intervals of friction's levels. "
            "Record one second at idle, motors and hands off, at the beginning and at the end."
        )
        return (SENSOR_ZEROS.not_evaluated(why, rest, FELT),)
    share = abs(zero.drive) / drive_rms if drive_rms > 0.0 else float("inf")
    radius = recordings[0].handle_radius_m
    parts = {"the torque sensor": zero.torque, "the force sensor": -radius * zero.force_N}
    worst = max(parts, key=lambda name: abs(parts[name]) if np.isfinite(parts[name]) else 0.0)
    shown = f"{zero.torque:.2g} {unit}"
    if np.isfinite(radius):
        shown += f" of torque and {zero.force_N:.2g} N of force"
    said = (
        f"At idle ({zero.seconds:.2g} s) the sensors show {shown}, {zero.drive:.2g} {unit} at the "
        f"joint ({share:.0%} of the drive). It is subtracted."
    )
    large = f" That is no zero: unload {worst}, check its mounting, tare it and record again."
    if np.isfinite(zero.drift):
        moved = f"Zeros moved by {zero.drift:.2g} {unit} from beginning to end"
    else:
        moved = "Only one end of the recording shows zeros"
    moved += f"; what is left of them has an sd of {zero.sd:.2g} {unit}, which is in the intervals."
    warm = f" Let {worst} warm up for half an hour, tare it and record again."
    return (
        SENSOR_ZEROS.judge(share, said, said + large),
        ZERO_DRIFT.judge(rest, moved, moved + warm),
    )


def _shown(recording: Recording) -> tuple[DriveZero, ...]:
    """Idle periods of a recording, and before its first stroke what the probe of the rig found."""
    periods = idle_periods(recording)
    moving = np.flatnonzero(np.asarray(recording.samples["stroke"]) >= 0)
    first = float(recording.device_time_s[moving[0]]) if len(moving) else np.inf
    probe = probe_of(recording.device)
    early = any(period.time_s < first for period in periods)
    if early or probe is None or probe.torque_zero_Nm is None:
        return periods
    torque, force, radius = probe.torque_zero_Nm, probe.force_zero_N, 0.0
    if force is not None and np.isfinite(recording.handle_radius_m):
        radius = recording.handle_radius_m
    pushed = (0.0, 0.0) if force is None else (force.mean, force.sd)
    before = DriveZero(
        time_s=0.0,
        drift=float("nan"),
        torque=torque.mean,
        force_N=pushed[0],
        drive=torque.mean - radius * pushed[0],
        sd=float(np.hypot(torque.sd, radius * pushed[1])),
        seconds=IDLE_S,
    )
    return (before, *periods)


def _zero_of(periods: tuple[DriveZero, ...], unmeasured_sd: float) -> DriveZero:
    """The zero of one recording from its idle periods.

    With a single period it may have come from 0, at which sensors are tared, during the recording.
    """
    if not periods:
        return DriveZero(0.0, 0.0, 0.0, unmeasured_sd, float("nan"), 0.0)
    drive = np.array([period.drive for period in periods])
    errors = np.array([period.sd for period in periods])
    steps, drift = drive, float("nan")
    if len(periods) > 1:
        steps, drift = np.diff(drive), float(drive[-1] - drive[0])
    share = float(np.sqrt(np.mean(steps**2)) / np.sqrt(len(steps)))
    sd = np.hypot(np.sqrt(np.mean(errors**2) / len(periods)), BRIDGE * share)
    return DriveZero(
        torque=float(np.mean([period.torque for period in periods])),
        force_N=float(np.mean([period.force_N for period in periods])),
        drive=float(drive.mean()),
        sd=max(float(sd), FINEST * unmeasured_sd),
        drift=drift,
        seconds=float(sum(period.seconds for period in periods)),
    )


def _subtracted(recording: Recording, periods: tuple[DriveZero, ...], zero: DriveZero) -> Recording:
    """The recording less its zeros, on a line between idle periods."""
    samples = recording.samples.copy()
    time = [period.time_s for period in periods] or [0.0]
    at = recording.device_time_s
    torque = [period.torque for period in periods] or [zero.torque]
    samples["motor_torque"] -= np.interp(at, time, torque)
    if np.isfinite(recording.handle_radius_m):
        force = [period.force_N for period in periods] or [zero.force_N]
        samples["handle_force"] -= np.interp(at, time, force)
    return replace(recording, samples=samples)


def _joined(zeros: list[DriveZero]) -> DriveZero:
    """One zero for all recordings: means, and the worst of what is left."""
    worst = max(zeros, key=lambda zero: zero.sd)
    drifts = [zero.drift for zero in zeros if np.isfinite(zero.drift)]
    return DriveZero(
        torque=float(np.mean([zero.torque for zero in zeros])),
        force_N=float(np.mean([zero.force_N for zero in zeros])),
        drive=float(np.mean([zero.drive for zero in zeros])),
        sd=worst.sd,
        drift=max(drifts, key=abs) if len(drifts) == len(zeros) else float("nan"),
        seconds=min(zero.seconds for zero in zeros),
    )


IDLE_S = 1.0
"""Least duration of an idle period."""
STILL_STEPS = 2.0
STILL = {"rotary": 2e-3, "linear": 2e-4}
"""An opening at rest differs by steps of the encoder, or by rad (m, the same 0.1 m from a pivot):
over a second that is a twenty-fifth of the slowest stroke's rate. Blades that settle on what yields
before they slide, or an encoder of fine steps that jitters, are at rest."""
BLOCKS_PER_S = 10.0
"""The standard error of a mean is that of blocks so short, which slow noise leaves independent."""


@dataclass(frozen=True)
class Zero:
    """A sensor's mean at idle, with its standard error."""

    mean: float
    sd: float
    seconds: float


def idle_zero(recordings: tuple[Recording, ...]) -> Zero | None:
    """The drive (N m) over the idle periods of recordings; None without any."""
    spans = [(recording, span) for recording in recordings for span in _idle_spans(recording)]
    if not spans:
        return None
    drive = np.concatenate(
        [replace(one, samples=one.samples[span]).drive_effort for one, span in spans]
    )
    seconds = sum(_tick(recording) * (span.stop - span.start) for recording, span in spans)
    return Zero(float(drive.mean()), _standard_error(drive, seconds), seconds)


def idle_noise(recordings: tuple[Recording, ...]) -> float:
    """White noise of the drive's sensors (sd, N m or N) over idle periods; 0 without any."""
    noises = []
    for recording in recordings:
        effort = recording.drive_effort
        noises += [noise_of(effort[span]) for span in _idle_spans(recording)]
    return float(np.median(noises)) if noises else 0.0


def idle_periods(recording: Recording) -> tuple[DriveZero, ...]:
    """Means over each idle period of a recording, in order of time."""
    periods = []
    has_force = bool(np.isfinite(recording.handle_radius_m))
    spans = _idle_spans(recording)
    effort, time = recording.drive_effort, recording.device_time_s
    tick = _tick(recording)
    for span in spans:
        samples, drive = recording.samples[span], effort[span]
        seconds = tick * len(drive)
        periods.append(
            DriveZero(
                drift=float("nan"),
                time_s=float(time[span].mean()),
                torque=float(samples["motor_torque"].mean()),
                force_N=float(samples["handle_force"].mean()) if has_force else 0.0,
                drive=float(drive.mean()),
                sd=_standard_error(drive, seconds),
                seconds=seconds,
            )
        )
    return tuple(periods)


def _idle_spans(recording: Recording) -> list[slice]:
    """Samples of idle periods: no command, blades at rest and no stroke for ``IDLE_S``.

    A period begins when the blades have come to where they rest at its end. Where no stroke has a
    command, nothing shows when motors were off, or a hand moves the handles and may hold them at
    rest: there are none.
    """
    if not _is_driven(recording):
        return []
    samples = recording.samples
    command = np.asarray(samples["torque_command"], dtype=np.float64)
    opening = np.asarray(samples["opening"], dtype=np.float64)
    still = resolution_of(opening)
    still = max(STILL_STEPS * still if np.isfinite(still) else 0.0, STILL[recording.joint.kind])
    quiet = (command == 0.0) & (np.asarray(samples["stroke"]) < 0)
    tick, spans = _tick(recording), []
    for first, last in pieces_of(recording):
        for low, high in zip(*stretches(quiet[first:last]), strict=True):
            begin, end = first + int(low), first + int(high)
            away = np.flatnonzero(np.abs(opening[begin:end] - opening[end - 1]) > still)
            begin += int(away[-1]) + 1 if len(away) else 0
            if (end - begin) * tick >= IDLE_S:
                spans.append(slice(begin, end))
    return spans


def _is_driven(recording: Recording) -> bool:
    """Whether motors move the joint in strokes, by the commands."""
    samples = recording.samples
    return bool(np.any(samples["torque_command"][samples["stroke"] >= 0]))


def _tick(recording: Recording) -> float:
    return float(np.median(np.diff(recording.device_time_s)))


def _standard_error(values: Array, seconds: float) -> float:
    blocks = np.array_split(values, max(2, int(BLOCKS_PER_S * seconds)))
    means = np.array([float(block.mean()) for block in blocks])
    return float(means.std(ddof=1) / np.sqrt(len(means)))
