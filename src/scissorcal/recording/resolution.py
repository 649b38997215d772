"""What samples can tell apart: a sensor's step and noise, the least stroke, gaps of the clock."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.recording.recording import Joint

STEADY_STEP, NEAR_WHOLE, SAME = 0.9, 0.05, 1e-9

TRAVEL_SHARE = 0.05
LEAST_TRAVEL = {"rotary": 5e-3, "linear": 5e-4}
"""Least travel of a stroke: 5 % of the range, and 5 mrad or 0.5 mm."""
STEPS_OF_STROKE = 3.0
"""A resting encoder moves between two neighbouring values; with noise of a step, between three."""
NOISE_OF_STROKE = 10.0
"""Of 10^6 samples of white normal noise, the largest and the smallest lie 9.8 sd apart (mean)."""
MOST_NOISE_SHARE = 0.25
"""Of the range: what is taken for noise never makes a stroke of a larger share no stroke."""
ORDERS = range(2, 9)
"""Differences from which noise is told: a motion of x rad a sample leaves (2 sin(x/2))^k of it."""

GAP_FACTOR = 1.5
"""A step longer than this many usual ones is a gap: a sample is missing."""
EDGE_S = 0.05
"""Time left out at both ends of a piece, where a zero-phase filter sees no neighbours; gaps up to
this length are bridged."""
EDGES = 4
"""Least length of a piece in edges, so that at least half of it can be used."""
FEWEST_SAMPLES = 20
"""Samples that a piece must exceed for a 4th-order filter and a window of one knot to fit in."""


@dataclass(frozen=True)
class StrokeThreshold:
    """Least travel of a stroke [rad, or m], and in words what decided it."""

    travel: float
    reason: str


def stroke_threshold(position: Array, joint: Joint) -> StrokeThreshold:
    """Choose the least travel that noise and steps of the sensor ``position`` (m,) cannot make.

    >>> angle = np.round(np.cos(np.arange(0.0, 30.0, 0.01)) / 0.1) * 0.1
    >>> stroke_threshold(angle, Joint())
    StrokeThreshold(travel=0.3, reason='3 steps of the sensor')
    """
    step, noise = resolution_of(position), noise_of(position)
    choices = {
        f"{TRAVEL_SHARE:.0%} of the range": TRAVEL_SHARE * float(np.ptp(position)),
        f"the least for a {joint.kind} joint": LEAST_TRAVEL[joint.kind],
        f"{STEPS_OF_STROKE:.0f} steps of the sensor": STEPS_OF_STROKE * step,
        f"{NOISE_OF_STROKE:.0f} standard deviations of its noise": min(
            NOISE_OF_STROKE * noise, MOST_NOISE_SHARE * float(np.ptp(position))
        ),
    }
    known = {reason: travel for reason, travel in choices.items() if np.isfinite(travel)}
    reason = max(known, key=lambda name: known[name])
    return StrokeThreshold(float(f"{known[reason]:.6g}"), reason)


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


def noise_of(values: Array) -> float:
    """Standard deviation of white noise on a smooth signal (m,), from its differences.

    Those of order k of white noise have (2k)! / k!^2 times its variance, those of a smooth motion
    vanish, the sooner the higher k is: the least of several orders counts, which a log of few
    samples a stroke needs. The median is not moved by turns. NaN for less than three values.

    >>> rng = np.random.default_rng(0)
    >>> round(noise_of(np.sin(np.arange(0, 9, 1e-3)) + rng.normal(0, 0.02, 9000)), 3)
    0.02
    """
    if len(values) < 3:
        return float("nan")
    orders = [order for order in ORDERS if order < len(values)]
    return min(_noise_from(values, order) for order in orders)


def _noise_from(values: Array, order: int) -> float:
    # 0.6745: the median of |x| for a standard normal x.
    spread = float(np.median(np.abs(np.diff(values, order)))) / 0.6745
    return spread / math.sqrt(math.comb(2 * order, order))


def edge_samples(rate_Hz: float) -> int:
    """Samples that ``EDGE_S`` lasts at a sampling rate, one at least.

    >>> edge_samples(1000.0), edge_samples(200.0)
    (50, 10)
    """
    return max(1, round(EDGE_S * rate_Hz))


def is_short(step: Array, usual: float) -> NDArray[np.bool_]:
    """Which steps (n,) of a clock miss no more samples than an edge has: such gaps are bridged."""
    return np.asarray(np.rint(step / usual) - 1 <= edge_samples(1.0 / usual))


def long_enough(samples: int, usual: float) -> bool:
    """Whether a stretch of so many samples is long enough for a rate."""
    return samples > max(EDGES * edge_samples(1.0 / usual), FEWEST_SAMPLES)
