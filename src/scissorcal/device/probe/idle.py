"""The idle second: what the device sends with its motors off."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.device.probe.talk import MEASURED, RELEASE, Stage, Talk
from scissorcal.kernel import Identity, StateFlag
from scissorcal.recording.probe import Estimate
from scissorcal.recording.recording import missing_frames

SETTLE_S = 0.1
IDLE_S = 1.0
LONGEST_SETTLING = 5
"""Seconds for blades that were let go to come to rest."""
REST_RAD = 2e-3
"""At rest: a drift of 2 mrad/s is slower than anything that a probe measures."""
CLEARINGS = 100
"""As in the protocol: a fault that remains after so many commands with CLEAR_FAULT stays."""
CHUNKS = 16
WINDOW = 10.0
LAGS = 50
JITTER_RAD = 2e-3
"""A rate over 10 ms then has a noise of 0.3 rad/s, a fifth of what a probe may reach: beyond it no
push within rig.probe is told from noise."""
WHITE_STEPS = 1.0
"""Readings that go to and fro between two steps, as those of an encoder without noise may where it
rests between them, are off by half a step at most."""
WHITE_CORRELATION = 0.3
"""Ten standard errors over an idle second of 1 kHz. A vibration repeats itself: it nears 1."""
LEAST_STEPS = 4
"""Differences between readings that tell the encoder's step."""


PLACES = ("opening", "advance")


@dataclass(frozen=True)
class Idle:
    """What the idle second showed; ``nan`` where it cannot be told.

    ``not_finite`` names fields that were no number. ``clock_ratio`` is the device's clock by
    ``tick_us``, ``host_ratio`` by the host's clock with its standard error; ``step_rad`` the
    encoder's step as seen, ``moved_rad`` how far the blades moved, ``jitter_rad`` the standard
    deviation of the opening about its slow motion and ``jitter_correlation`` the largest
    magnitude of its autocorrelation. ``zeros`` and ``noises`` (standard deviations) are of all that
    is measured but places, by its name. Shares are of the frames that were due, without those that
    this computer missed while it did not listen, for ``held_up_s`` at the longest. ``fault_cause``
    is that of a fault that stays.
    """

    fault_stays: bool
    encoder_fault: bool
    not_finite: tuple[str, ...]
    opening_low: float
    opening_high: float
    moved_rad: float
    jitter_rad: float
    jitter_correlation: float
    zeros: Mapping[str, Estimate]
    noises: Mapping[str, float]
    clock_ratio: float
    clock_stands: bool
    host_ratio: float
    host_ratio_se: float
    lost_share: float
    garbled_share: float
    duplicate_share: float
    fault_cause: int = 0
    held_up_s: float = 0.0

    @property
    def swings(self) -> bool:
        """Whether the opening goes to and fro as blades do, not as an encoder that jitters."""
        return _swing(self.jitter_rad, self.jitter_correlation)


def idle(talk: Talk) -> Idle:
    """Listen for a second with the motors off; clears a fault that is latched from before."""
    faults = talk.play(_cleared(talk))
    for _ in range(LONGEST_SETTLING):
        begin, garbled, duplicates = talk.mark(), talk.link.garbled, talk.duplicates
        talk.play(_quiet(talk, IDLE_S))
        heard = talk.heard(begin)
        opening = heard["opening"]
        slow = _slow(opening)
        swings = _swing(float(np.std(opening - slow)), largest_correlation(opening - slow))
        if not (np.ptp(slow) > REST_RAD or swings):
            break
    opening = heard["opening"][np.isfinite(heard["opening"])]
    if len(opening) == 0:
        opening = np.array([math.nan])
    ticks = np.diff(heard["sequence"])
    clock = np.diff(heard["device_us"])
    missing = missing_frames(heard["sequence"]).copy()
    held_up = talk.held_up(begin)
    own = 0
    for row, seconds in held_up:  # what the system still kept comes first, then what was lost
        after = slice(max(row - 1, 0), row + talk.ticks(seconds))
        own += int(missing[after].sum())
        missing[after] = 0
    due = max(1, int(heard["sequence"][-1] - heard["sequence"][0]) + 1 - own)
    lost = int(missing.sum())
    ratio, error = host_ratio(heard["host_s"], heard["device_us"])
    loads = {name: heard[name][np.isfinite(heard[name])] for name in MEASURED if name not in PLACES}
    slow = _slow(opening)
    return Idle(
        fault_stays=faults[0],
        encoder_fault=faults[1],
        not_finite=tuple(name for name in MEASURED if not np.isfinite(heard[name]).all()),
        opening_low=float(opening.min()),
        opening_high=float(opening.max()),
        moved_rad=float(np.ptp(slow)),
        jitter_rad=float(np.std(opening - slow)),
        jitter_correlation=largest_correlation(opening - slow),
        zeros={name: mean_of(values) for name, values in loads.items()},
        noises={name: _sd(values) for name, values in loads.items()},
        clock_ratio=float(np.median(clock / ticks)) / talk.identity.tick_us,
        clock_stands=bool(np.mean(clock == 0) > 0.5),
        host_ratio=ratio,
        host_ratio_se=error,
        lost_share=lost / due,
        garbled_share=(talk.link.garbled - garbled) / due,
        duplicate_share=(talk.duplicates - duplicates) / due,
        fault_cause=faults[2],
        held_up_s=max((seconds for _, seconds in held_up), default=0.0),
    )


def jitters(found: Idle, identity: Identity) -> bool:
    """Whether the encoder alone, at rest, repeats no reading for long: noise, and no vibration."""
    return (
        found.jitter_rad >= WHITE_STEPS * identity.opening_resolution > 0.0
        and found.jitter_correlation < WHITE_CORRELATION
    )


def mean_of(values: Array) -> Estimate:
    """Mean of a series and the standard error that its autocorrelation leaves.

    The error is sd sqrt(2 t / n), with the integrated autocorrelation time t of `correlation_time`,
    and is widened as Student's t for the independent values n / 2t that it rests on.

    >>> mean_of(np.array([1.0, 3.0] * 500)).mean
    2.0
    """
    n = len(values)
    if n < 20:
        return Estimate(math.nan, math.nan)
    mean, sd = float(values.mean()), _sd(values)
    independent = max(4.0, n / (2.0 * correlation_time(values)))
    widened = math.sqrt((independent - 1.0) / (independent - 3.0))
    return Estimate(mean, sd / math.sqrt(independent) * widened)


def correlation_time(values: Array) -> float:
    """Integrated autocorrelation time of a series in samples, at least a half (white noise).

    Summed up to where the window is ten times as long (Sokal 1997,
    doi:10.1007/978-1-4899-0319-8_6), and corrected for the mean that was taken off (Wolff 2004,
    doi:10.1016/S0010-4655(03)00467-3, equation 49).
    """
    n = len(values)
    spectrum = np.fft.rfft(values - values.mean(), 2 * n)
    covariance = np.fft.irfft(spectrum * np.conj(spectrum))[: max(2, n // 4)]
    if not covariance[0] > 0.0:
        return 0.5
    times = 0.5 + np.cumsum(covariance[1:] / covariance[0])
    inside = np.arange(1, len(times) + 1) >= WINDOW * times
    window = int(np.argmax(inside)) if inside.any() else len(times) - 1
    return max(0.5, float(times[window]) * (1.0 + (2.0 * window + 1.0) / n))


def host_ratio(host_s: Array, device_us: NDArray[np.int64]) -> tuple[float, float]:
    """How fast the device's clock runs by the host's, with the standard error; NaN if too short.

    Frames are late and never early, so a line is laid through the earliest of each chunk.
    """
    if len(host_s) < 4 * CHUNKS:
        return math.nan, math.nan
    host, device = host_s - host_s[0], (device_us - device_us[0]) * 1e-6
    chunks = np.array_split(np.arange(len(host)), CHUNKS)
    best = [int(chunk[np.argmax(device[chunk] - host[chunk])]) for chunk in chunks]
    x, y = host[best] - host[best].mean(), device[best] - device[best].mean()
    slope = float(x @ y / (x @ x))
    left = y - slope * x
    error = math.sqrt(float(left @ left) / (CHUNKS - 2) / float(x @ x))
    return slope, error


def observed_step(openings: Array) -> float:
    """The encoder's step as readings show it: their smallest common spacing; NaN if too few.

    Readings travel as 32-bit floats, so spacings within their rounding are one.
    """
    levels = np.unique(openings[np.isfinite(openings)])
    gaps = np.diff(levels)
    gaps = gaps[gaps > 4.0 * np.finfo(np.float32).eps * max(1.0, float(np.abs(levels).max()))]
    if len(gaps) < LEAST_STEPS:
        return math.nan
    smallest = float(gaps.min())
    counts = np.round(gaps / smallest)
    near = np.abs(gaps - counts * smallest) < 0.1 * smallest
    if near.mean() < 0.9:
        return math.nan
    return float(gaps[near].sum() / counts[near].sum())


def _cleared(talk: Talk) -> Stage[tuple[bool, bool, int]]:
    """Clear a fault from before; whether one stays, whether the encoder has one, its cause."""
    state = yield RELEASE
    asked = 0
    for _ in range(talk.ticks(SETTLE_S) + CLEARINGS):
        faulty = bool(state.flags & StateFlag.FAULT_LATCHED)
        asked += faulty
        if asked > CLEARINGS:
            break
        state = yield RELEASE._replace(clear=faulty)
    faulty = bool(state.flags & StateFlag.FAULT_LATCHED)
    return faulty, bool(state.flags & StateFlag.ENCODER_FAULT), state.cause


def _quiet(talk: Talk, seconds: float) -> Stage[None]:
    for _ in range(talk.ticks(seconds)):
        yield RELEASE


def _swing(spread_rad: float, correlation: float) -> bool:
    return spread_rad > JITTER_RAD and correlation >= WHITE_CORRELATION


def _slow(values: Array) -> Array:
    """A moving mean over a tenth of the values, constant at both ends."""
    width = max(1, len(values) // 10)
    padded = np.pad(values, (width // 2, width - 1 - width // 2), mode="edge")
    return np.convolve(padded, np.full(width, 1.0 / width), mode="valid")


def largest_correlation(values: Array) -> float:
    """Largest magnitude of the autocorrelation over up to `LAGS` samples; 1 for a constant."""
    n = len(values)
    off = values - values.mean()
    power = float(off @ off)
    if n <= LAGS or not power > 0.0:
        return 1.0
    return max(abs(float(off[lag:] @ off[:-lag])) for lag in range(1, LAGS + 1)) / power


def _sd(values: Array) -> float:
    return float(values.std(ddof=1)) if len(values) > 1 else math.nan
