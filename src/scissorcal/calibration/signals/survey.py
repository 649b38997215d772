"""What a recording tells of its sensors before a fit: rate, steps, ends of range, dead bands."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from scissorcal.calibration.signals.sensors import (
    Channel,
    channels_of,
    ends_sentence,
    held_sentence,
    mark_sentence,
)
from scissorcal.recording.faulty_values import lone_excursion
from scissorcal.recording.layout import unit_of
from scissorcal.recording.recording import Recording
from scissorcal.recording.summarising import Gaps, find_gaps

SPREAD = (0.05, 0.95)
CHANNELS = ("opening", "motor_torque", "handle_force")


@dataclass(frozen=True)
class SensorSurvey:
    """One channel in SI: its resolution, range, and shares of samples that do not measure.

    ``step`` is None where none shows. ``at_low`` and ``at_high`` are the shares at the ends of the
    range where the channel looks cut off there, or stands at its ends for most of the time;
    ``dead`` is the share at exactly 0 while the joint moves.
    """

    channel: str
    unit: str
    constant: bool
    step: float | None
    low: float
    high: float
    at_low: float
    at_high: float
    dead: float


@dataclass(frozen=True)
class Survey:
    """Sampling, sensors and strokes of a recording.

    ``notes`` tell what is no measurement: marks of overflow, a sensor that stands at its ends.
    ``interval_low_ms`` and ``interval_high_ms`` are the 5 % and 95 % quantiles of the time between
    two samples, ``longest_ms`` the longest.
    """

    rate_Hz: float
    interval_low_ms: float
    interval_high_ms: float
    longest_ms: float
    gaps: Gaps
    sensors: tuple[SensorSurvey, ...]
    closings: int
    openings: int
    notes: tuple[str, ...] = ()


def survey(recording: Recording, measured: Iterable[str]) -> Survey:
    """Survey a recording of at least two samples; ``measured`` names the channels to look at."""
    intervals_ms = 1e3 * np.diff(recording.device_time_s)
    low_ms, high_ms = np.quantile(intervals_ms, SPREAD)
    counts = Counter(stroke.kind for stroke in recording.strokes)
    wanted = set(measured)
    channels = channels_of(recording, [name for name in CHANNELS if name in wanted])
    return Survey(
        rate_Hz=1e3 / float(np.median(intervals_ms)),
        interval_low_ms=float(low_ms),
        interval_high_ms=float(high_ms),
        longest_ms=float(intervals_ms.max()),
        gaps=find_gaps(recording.samples),
        sensors=tuple(_sensor(recording, channel) for channel in channels),
        closings=counts["closing"],
        openings=counts["opening"],
        notes=tuple(said for channel in channels for said in _notes_on(recording, channel)),
    )


def _notes_on(recording: Recording, channel: Channel) -> list[str]:
    """Sentences on a channel that holds what is no measurement."""
    unit = unit_of(channel.name, recording.joint)
    said = []
    if channel.marks:
        count = int(np.isin(recording.samples[channel.name], channel.marks).sum())
        said.append(mark_sentence(channel, count, unit))
    elif channel.saturated.any():
        said.append(
            f"{channel.name} looks cut off at an end of its range ({channel.low:.3g} to "
            f"{channel.high:.3g} {unit}) in {channel.saturated.mean():.2%} of the samples: what "
            "lies beyond was not measured. Use a sensor of larger range, or a smaller gain."
        )
    if held := held_sentence(channel, recording, unit):
        said.append(held)
    if channel.mostly_at_ends:
        said.append(ends_sentence(channel, unit))
    values = np.asarray(recording.samples[channel.name], dtype=np.float64)
    measured = np.flatnonzero(~np.isin(values, channel.marks))
    lone = None if channel.name == "opening" else lone_excursion(values[measured])
    if lone is not None:
        at = int(measured[lone])
        said.append(
            f"{channel.name} is {values[at]:.6g} {unit} at {recording.device_time_s[at]:.6g} s "
            "alone, farther from the samples before and after than it goes anywhere else. If this "
            "is no measurement, remove that row from the log."
        )
    return said


def _sensor(recording: Recording, channel: Channel) -> SensorSurvey:
    values = recording.samples[channel.name]
    cut = channel.saturated | channel.mostly_at_ends
    return SensorSurvey(
        channel=channel.name,
        unit=unit_of(channel.name, recording.joint),
        constant=channel.constant,
        step=channel.step if np.isfinite(channel.step) else None,
        low=channel.low,
        high=channel.high,
        at_low=float(np.mean(cut & (values == channel.low))),
        at_high=float(np.mean(cut & (values == channel.high))),
        dead=float(channel.dead.mean()),
    )
