"""Sensors' zeros from idle periods: motors off and blades at rest."""

from dataclasses import dataclass, replace

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.signals.segments import pieces_of, stretches
from scissorcal.recording.recording import Recording
from scissorcal.recording.resolution import noise_of, resolution_of

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


@dataclass(frozen=True)
class IdlePeriod:
    """Means over one idle period, around ``time_s`` on the device's clock.

    ``force_N`` is 0 where no handle force is measured; ``drive`` (N m or N) is both together,
    with its standard error ``drive_sd``.
    """

    time_s: float
    torque: float
    force_N: float
    drive: float
    drive_sd: float
    seconds: float


def idle_zero(recordings: tuple[Recording, ...]) -> Zero | None:
    """The drive (N m) over the idle periods of recordings; None without any."""
    spans = [(recording, span) for recording in recordings for span in idle_spans(recording)]
    if not spans:
        return None
    every = np.concatenate(
        [replace(one, samples=one.samples[span]).drive_effort for one, span in spans]
    )
    seconds = sum(_tick(recording) * (span.stop - span.start) for recording, span in spans)
    return Zero(float(every.mean()), _standard_error(every, seconds), seconds)


def idle_noise(recordings: tuple[Recording, ...]) -> float:
    """White noise of the drive's sensors (sd, N m or N) over idle periods; 0 without any."""
    found = []
    for recording in recordings:
        effort = recording.drive_effort
        found += [noise_of(effort[span]) for span in idle_spans(recording)]
    return float(np.median(found)) if found else 0.0


def idle_periods(recording: Recording) -> tuple[IdlePeriod, ...]:
    """Means over each idle period of a recording, in order of time."""
    found = []
    has_force = bool(np.isfinite(recording.handle_radius_m))
    spans = idle_spans(recording)
    effort, time = recording.drive_effort, recording.device_time_s
    tick = _tick(recording)
    for span in spans:
        samples, drive = recording.samples[span], effort[span]
        seconds = tick * len(drive)
        found.append(
            IdlePeriod(
                time_s=float(time[span].mean()),
                torque=float(samples["motor_torque"].mean()),
                force_N=float(samples["handle_force"].mean()) if has_force else 0.0,
                drive=float(drive.mean()),
                drive_sd=_standard_error(drive, seconds),
                seconds=seconds,
            )
        )
    return tuple(found)


def idle_spans(recording: Recording) -> list[slice]:
    """Samples of idle periods: no command, blades at rest and no stroke for ``IDLE_S``.

    A period begins when the blades have come to where they rest at its end. Where no stroke has a
    command, nothing shows when motors were off, or a hand moves the handles and may hold them at
    rest: there are none.
    """
    if not is_driven(recording):
        return []
    samples = recording.samples
    command = np.asarray(samples["torque_command"], dtype=np.float64)
    opening = np.asarray(samples["opening"], dtype=np.float64)
    still = resolution_of(opening)
    still = max(STILL_STEPS * still if np.isfinite(still) else 0.0, STILL[recording.joint.kind])
    quiet = (command == 0.0) & (np.asarray(samples["stroke"]) < 0)
    tick, found = _tick(recording), []
    for first, last in pieces_of(recording):
        for low, high in zip(*stretches(quiet[first:last]), strict=True):
            begin, end = first + int(low), first + int(high)
            away = np.flatnonzero(np.abs(opening[begin:end] - opening[end - 1]) > still)
            begin += int(away[-1]) + 1 if len(away) else 0
            if (end - begin) * tick >= IDLE_S:
                found.append(slice(begin, end))
    return found


def is_driven(recording: Recording) -> bool:
    """Whether motors move the joint in strokes, by the commands."""
    samples = recording.samples
    return bool(np.any(samples["torque_command"][samples["stroke"] >= 0]))


def _tick(recording: Recording) -> float:
    return float(np.median(np.diff(recording.device_time_s)))


def _standard_error(values: Array, seconds: float) -> float:
    blocks = np.array_split(values, max(2, int(BLOCKS_PER_S * seconds)))
    means = np.array([float(block.mean()) for block in blocks])
    return float(means.std(ddof=1) / np.sqrt(len(means)))
