"""How a plate moves: clamped, as a body on springs that is bumped, or as a hand carries it."""

from collections.abc import Callable
from math import pi, radians, sqrt

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import cont2discrete, fftconvolve, lfilter
from scipy.spatial.transform import Rotation

from scissorcal.aliases import Array

Motion = Callable[[Array], tuple[Array, Array]]
"""Rotations (n, 3, 3) and places (n, 3) of a plate at times (n,)."""

SPEED_M_PER_S, SPIN_RAD_PER_S = 0.02, radians(5.0)
"""Rms of each axis, which is what is stated of a moving plate."""
STEP_S, MARGIN_S, WARM_S = 1e-3, 0.2, 6.0
BUMPS_PER_S, BUMP_S = 4.0, (0.05, 0.2)
MODES_HZ, DAMPING = (0.5, 1.0), (0.15, 0.4)
REACHES_PER_S, REACH_S = 2.0, (0.7, 1.4)
TREMOR_HZ, TREMOR_SHARE = (8.0, 10.0), 0.05


def moved(kind: str, seconds: float, rng: np.random.Generator) -> Motion:
    """Draw a motion: "clamped", "springs" or "hand"."""
    begin = Rotation.from_rotvec(rng.uniform(-0.4, 0.4, 3))
    middle = np.array([0.1, 0.0, 0.0]) + rng.uniform(-0.02, 0.02, 3)
    if kind == "clamped":
        return lambda times: (
            np.tile(begin.as_matrix(), (len(times), 1, 1)),
            np.tile(middle, (len(times), 1)),
        )
    count = round((seconds + WARM_S + 2.0 * MARGIN_S) / STEP_S)
    times = STEP_S * np.arange(count) - WARM_S - MARGIN_S
    ways = _springs(count, rng) if kind == "springs" else _hand(count, rng)
    # Six independent axes are mixed, as by a centre of mass that is nobody's origin.
    for part, size in ((slice(0, 3), SPIN_RAD_PER_S), (slice(3, 6), SPEED_M_PER_S)):
        mixed, _ = np.linalg.qr(rng.standard_normal((3, 3)))
        ways[:, part] = size * ways[:, part] @ mixed.T
    from_zero = ways - ways[np.searchsorted(times, 0.0)]
    spline = CubicSpline(times, from_zero)

    def at(when: Array) -> tuple[Array, Array]:
        way = spline(when)
        return (Rotation.from_rotvec(way[:, :3]) * begin).as_matrix(), middle + way[:, 3:]

    return at


def _springs(count: int, rng: np.random.Generator) -> Array:
    """Six damped modes under half-sine bumps; velocities of unit rms."""
    ways = np.empty((count, 6))
    for axis in range(6):
        own, damping = 2.0 * pi * rng.uniform(*MODES_HZ), rng.uniform(*DAMPING)
        push = np.zeros(count)
        for _ in range(rng.poisson(BUMPS_PER_S * count * STEP_S)):
            bump = np.sin(np.linspace(0.0, pi, round(rng.uniform(*BUMP_S) / STEP_S)))
            at = int(rng.integers(0, count))
            part = push[at : at + len(bump)]
            part += rng.standard_normal() * bump[: len(part)]
        over, under, _ = cont2discrete(([1.0], [1.0, 2.0 * damping * own, own**2]), STEP_S)
        # Campbell's theorem with a bump of mean length; its shape changes the rms by a few percent.
        bump = np.sin(np.linspace(0.0, pi, round(0.5 * sum(BUMP_S) / STEP_S)))
        answer = lfilter(over.ravel(), under, np.concatenate([bump, np.zeros(20_000)]))
        rms = sqrt(BUMPS_PER_S * STEP_S * float(np.sum((np.diff(answer) / STEP_S) ** 2)))
        ways[:, axis] = lfilter(over.ravel(), under, push) / rms
    return ways


def _hand(count: int, rng: np.random.Generator) -> Array:
    """Overlapping reaches of least jerk (Flash and Hogan 1985) and a tremor; unit rms of velocity.

    doi:10.1523/JNEUROSCI.05-07-01688.1985
    """
    ways = np.empty((count, 6))
    times = STEP_S * np.arange(count)
    for axis in range(6):
        begins = np.zeros(count)
        velocity = np.zeros(count)
        for length in rng.uniform(*REACH_S, 8):
            begins[:] = 0.0
            reaches = rng.poisson(REACHES_PER_S / 8.0 * count * STEP_S)
            np.add.at(begins, rng.integers(0, count, reaches), rng.standard_normal(reaches))
            share = np.linspace(0.0, 1.0, round(length / STEP_S))
            bell = 30.0 * (share * (1.0 - share)) ** 2
            size = sqrt(REACHES_PER_S * STEP_S * float(np.sum(bell**2)))
            velocity += fftconvolve(begins, bell)[:count] / size
        tremor = 2.0 * pi * rng.uniform(*TREMOR_HZ)
        velocity += TREMOR_SHARE * sqrt(2.0) * np.sin(tremor * times + rng.uniform(0.0, 2.0 * pi))
        ways[:, axis] = np.cumsum(velocity) * STEP_S
    return ways
