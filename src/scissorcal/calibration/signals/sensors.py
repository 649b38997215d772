"""What the sensors did to a recording: steps, ends of range, dead bands, silence."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.signals.segments import stretches
from scissorcal.recording.recording import Recording
from scissorcal.verdicts import Status, Verdict

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

SPOILT_LIMIT = 0.05
"""Share of samples that a sensor may have spoilt before a fit is no calibration."""
LONG_RUN = 5
FEWEST_SPOILT = 20
NOISY = 0.2
"""A channel whose neighbouring samples are equal this often has no noise, and then a stretch of
equal values says nothing about its sensor."""
STEADY_STEP, NEAR_WHOLE, SAME = 0.9, 0.05, 1e-9
HANDLE_FORCE_SATURATED, ENCODER_FAULT = 32, 64
"""Flags of a device's state frame (docs/protocol.md)."""


@dataclass(frozen=True)
class Channel:
    """One sensor over one recording.

    ``step`` is its resolution (NaN: none to be seen), ``saturated`` and ``dead`` (m,) mark
    samples at an end of its range and within a dead band; ``low`` and ``high`` are those ends.
    """

    name: str
    constant: bool
    step: float
    saturated: Mask
    dead: Mask
    low: float
    high: float


@dataclass(frozen=True)
class Sensors:
    """All sensors over all recordings: which samples may be used, sentences, and a verdict."""

    usable: tuple[Mask, ...]
    notes: tuple[str, ...]
    verdict: Verdict


def inspect_sensors(recordings: tuple[Recording, ...]) -> Sensors:
    """Look for what sensors do to data, and mark the samples that they spoilt.

    Saturation is a stretch of equal values at a channel's largest or smallest one, a dead band
    such a stretch at zero while the joint moves, both only in channels that have noise elsewhere.
    A sample that is spoilt is no measurement and is left out of the likelihood; where more than
    ``SPOILT_LIMIT`` are, what is left cannot stand for the whole, and the verdict fails.
    """
    usable, notes = [], []
    worst, named = 0.0, ""
    for recording in recordings:
        channels = channels_of(recording)
        spoilt = _flagged(recording)
        source = recording.source or "the recording"
        for channel in channels:
            spoilt |= channel.saturated | channel.dead
            notes += [f"{source}: {said}" for said in _sentences(channel, recording)]
            for share, what in (
                (float(channel.saturated.mean()), "is at the end of its range"),
                (float(channel.dead.mean()), "does not respond around zero"),
            ):
                if share > worst:
                    worst, named = share, f"{channel.name} of {source} {what}"
        usable.append(~spoilt)
    return Sensors(tuple(usable), tuple(notes), _verdict(worst, named))


def channels_of(recording: Recording) -> tuple[Channel, ...]:
    """Inspect the channels that a fit of this recording uses, the position first."""
    samples = recording.samples
    names = ["opening", "motor_torque"]
    if np.isfinite(recording.handle_radius_m):
        names.append("handle_force")
    opening = np.asarray(samples["opening"], dtype=np.float64)
    moves = _moves(opening)
    return tuple(
        _inspect(name, np.asarray(samples[name], dtype=np.float64), moves) for name in names
    )


def resolution_of(values: Array) -> float:
    """Step of a quantised channel (m,), NaN where its values are not multiples of one.

    >>> f"{resolution_of(np.round(np.sin(np.arange(1000.0)) / 0.01) * 0.01):.6f}"
    '0.010000'
    """
    levels = np.unique(values)
    apart = np.diff(levels)
    apart = apart[apart > SAME * np.ptp(values)]
    if len(apart) < 2:
        return float("nan")
    least = float(apart.min())
    step = float(apart.sum() / np.round(apart / least).sum())
    away = np.abs(apart / step - np.round(apart / step))
    return step if np.mean(away < NEAR_WHOLE) > STEADY_STEP else float("nan")


def _inspect(name: str, values: Array, moves: Mask) -> Channel:
    low, high = float(values.min()), float(values.max())
    none = np.zeros(len(values), dtype=bool)
    constant = low == high
    if constant or name == "opening":
        return Channel(name, constant, resolution_of(values), none, none, low, high)
    equal = values[1:] == values[:-1]
    inside = (values[1:] > low) & (values[1:] < high) & (values[1:] != 0.0)
    noisy = bool(np.any(inside)) and float(np.mean(equal[inside])) < NOISY
    saturated = (
        (_long_stretches(values == low) | _long_stretches(values == high)) if noisy else none
    )
    dead = _long_stretches((values == 0.0) & moves) if noisy and low < 0.0 < high else none
    return Channel(
        name,
        constant,
        resolution_of(values),
        saturated if np.count_nonzero(saturated) >= FEWEST_SPOILT else none,
        dead if np.count_nonzero(dead) >= FEWEST_SPOILT else none,
        low,
        high,
    )


def _long_stretches(held: Mask) -> Mask:
    """The runs of ``held`` (m,) that are too long for chance."""
    low, high = stretches(held)
    lengths = high - low
    long_enough = np.repeat(lengths >= LONG_RUN, lengths)
    result = np.zeros(len(held), dtype=bool)
    result[np.flatnonzero(held)] = long_enough
    return result


def _moves(opening: Array) -> Mask:
    """Samples (m,) near which the position changes."""
    reach = 50
    changed = np.concatenate([[0], np.cumsum(np.diff(opening, prepend=opening[:1]) != 0)])
    index = np.arange(len(opening))
    ahead = changed[np.minimum(index + reach, len(opening))]
    return np.asarray(ahead - changed[np.maximum(index - reach, 0)] > 2)


def _flagged(recording: Recording) -> Mask:
    """Samples that the device itself says it could not measure."""
    flags = np.asarray(recording.samples["flags"], dtype=np.int64)
    wrong = ENCODER_FAULT
    if np.isfinite(recording.handle_radius_m):
        wrong |= HANDLE_FORCE_SATURATED
    return np.asarray((flags & wrong) != 0)


def _sentences(channel: Channel, recording: Recording) -> list[str]:
    joint = recording.joint
    unit = {"opening": joint.position_unit, "motor_torque": joint.effort_unit}.get(
        channel.name, "N"
    )
    said = []
    if channel.constant:
        said.append(f"{channel.name} is {channel.low:.6g} {unit} throughout.")
    elif np.isfinite(channel.step):
        said.append(f"{channel.name} comes in steps of {channel.step:.3g} {unit}.")
    if channel.saturated.any():
        said.append(
            f"{channel.name} is at an end of its range ({channel.low:.3g} to {channel.high:.3g} "
            f"{unit}) in {channel.saturated.mean():.2%} of the samples, which are left out."
        )
    if channel.dead.any():
        said.append(
            f"{channel.name} is exactly 0 in {channel.dead.mean():.2%} of the samples although "
            "the joint moves: a dead band. They are left out."
        )
    return said


def _verdict(worst: float, named: str) -> Verdict:
    if worst == 0.0:
        why = "No sensor reached an end of its range, and none was silent around zero."
        return Verdict("fit.friction", "sensors", "pass", 0.0, SPOILT_LIMIT, why)
    status: Status = "pass" if worst <= SPOILT_LIMIT else "fail"
    why = f"{named} in {worst:.1%} of the samples; they are left out."
    if status == "fail":
        why += (
            " That is too many for what is left to stand for the whole: record again with a "
            "sensor of a larger range, or slower and with gentler turns."
        )
    return Verdict("fit.friction", "sensors", status, worst, SPOILT_LIMIT, why)
