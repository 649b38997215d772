"""The drive's zero from idle periods: motors off and blades at rest."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.signals.segments import pieces_of, stretches
from scissorcal.calibration.signals.sensors import resolution_of
from scissorcal.recording.recording import Recording

Array = NDArray[np.float64]

IDLE_S = 1.0
"""Least duration of an idle period."""
STILL_STEPS = 2.0
"""Steps of the encoder by which an opening at rest may differ."""


@dataclass(frozen=True)
class Zero:
    """A sensor's mean at idle, with its standard error."""

    mean: float
    sd: float
    seconds: float


def idle_zero(recordings: tuple[Recording, ...]) -> Zero | None:
    """The drive (N m) over idle periods; None without any.

    Idle means no command, blades at rest and no stroke for ``IDLE_S``. Recordings without any
    command do not show when motors were off, and are skipped.
    """
    found: list[Array] = []
    seconds = 0.0
    for recording in recordings:
        samples = recording.samples
        command = np.asarray(samples["torque_command"], dtype=np.float64)
        if not np.any(command):
            continue
        opening = np.asarray(samples["opening"], dtype=np.float64)
        still = resolution_of(opening)
        still = STILL_STEPS * still if np.isfinite(still) else 0.0
        quiet = (command == 0.0) & (np.asarray(samples["stroke"]) < 0)
        tick = float(np.median(np.diff(recording.device_time_s)))
        for first, last in pieces_of(recording):
            for low, high in zip(*stretches(quiet[first:last]), strict=True):
                part = slice(first + int(low), first + int(high))
                long = (high - low) * tick >= IDLE_S
                if not long or np.ptp(opening[part]) > still:
                    continue
                found.append(np.asarray(recording.drive_effort[part], dtype=np.float64))
                seconds += float((high - low) * tick)
    if not found:
        return None
    every = np.concatenate(found)
    blocks = np.array_split(every, max(2, int(10 * seconds)))
    means = np.array([float(block.mean()) for block in blocks])
    return Zero(float(every.mean()), float(means.std(ddof=1) / np.sqrt(len(means))), seconds)
