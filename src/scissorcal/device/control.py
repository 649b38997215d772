"""The capture's controller on one axis as a sampled loop: response, margins, poles. Pure.

The servo's PID (sc_motion.c, sc_servo.c) acts on

    m y'' + b y' = u(t - delay),    u held from tick to tick,

by effort = kp e + kd (rate wanted - rate) + ki T (sum of e), with rate a backward difference behind
a first-order low-pass. Held efforts and a delay that is no whole number of ticks are exact (Astrom
and Wittenmark, Computer-Controlled Systems, 1997, sections 2.3 and 3.2).
"""

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array

Responses = tuple[NDArray[np.complex128], NDArray[np.complex128], NDArray[np.complex128]]
"""Of the place, its rate and its integral, to a unit of gain each."""

PHASE_MARGIN_deg = 45.0
GAIN_MARGIN = 2.0
"""Margins that a design keeps. Usual are 30 to 60 degrees and 2 to 5 (Astrom and Murray, Feedback
Systems, 2008, section 9.3, ISBN 978-0-691-13576-2)."""
GRID = 400
LOWEST = 1e-4
"""Frequencies of the response begin at this share of the highest, half a turn a tick."""
SETTLING_TICKS = 4000
NO_FRICTION = 1e-8
"""Share of a rate that viscous friction takes in a time, below which it is left out: the exact
forms divide differences of nearly equal numbers by it."""
FALL_STEPS = 10
"""Halvings that give the greatest fall of friction to 0.1 % of the rate's gain."""
INTEGRAL = 4
"""Place of the integral among the loop's states."""


class Gains(NamedTuple):
    """PID of one axis: effort per error, per rate error, per error and second."""

    kp: float
    kd: float
    ki: float


@dataclass(frozen=True)
class Axis:
    """One axis as the controller meets it, in SI units and radians (or metres).

    ``inertia`` may be wrong by the factor ``inertia_factor`` either way. ``delay_s`` passes from a
    measurement to the effort that answers it: line, computer and motor, without the time for which
    an effort is held. ``step`` is the encoder's, of which one count may change the effort by
    ``most_per_count``; ``coulomb`` is dry friction.
    """

    inertia: float
    viscous: float
    coulomb: float
    delay_s: float
    tick_s: float
    step: float
    rate_cutoff_Hz: float
    most_per_count: float
    inertia_factor: float

    def filtered(self, rate_cutoff_Hz: float) -> "Axis":
        """The axis with another filter of its rate."""
        return replace(self, rate_cutoff_Hz=rate_cutoff_Hz)


class Margins(NamedTuple):
    """How far a loop is from oscillation, at the worst inertia within its factor.

    ``gain`` is the least factor by which the loop's gain may change either way. Both are 0 where
    the loop is unstable. ``crossover_rad_per_s`` is that at the nominal inertia.
    """

    phase_deg: float
    gain: float
    crossover_rad_per_s: float

    @property
    def stable(self) -> bool:
        """Whether the sampled loop settles at every inertia within the factor."""
        return self.phase_deg > 0.0

    @property
    def enough(self) -> bool:
        """Whether both margins are those of a design."""
        return self.phase_deg >= PHASE_MARGIN_deg and self.gain >= GAIN_MARGIN


def loop_margins(axis: Axis, gains: Gains) -> Margins:
    """Phase and gain margin of the sampled loop, at the worst inertia within its factor."""
    middle, *others = (_margins(one, gains) for one in _inertias(axis))
    if not all(_settles(one, gains) for one in _inertias(axis)):
        return Margins(0.0, 0.0, middle.crossover_rad_per_s)
    every = (middle, *others)
    return Margins(
        min(one.phase_deg for one in every),
        min(one.gain for one in every),
        middle.crossover_rad_per_s,
    )


def keeps_margins(axis: Axis, gains: Gains) -> bool:
    """Whether `loop_margins` are enough, looking no further than at what fails."""
    every = _inertias(axis)
    return all(_margins(one, gains).enough for one in every) and all(
        _settles(one, gains) for one in every
    )


def loop_poles(axis: Axis, gains: Gains) -> NDArray[np.complex128]:
    """Poles of the sampled loop: it settles where all are inside the unit circle.

    States are place, rate, the estimated rate, the last place, the integral (unless ``ki`` is 0),
    and the efforts on their way. (The limits of effort and of its slew are not in it.)
    """
    matrix = _loop(axis, gains)[0]
    if gains.ki == 0.0:
        matrix = np.delete(np.delete(matrix, INTEGRAL, axis=0), INTEGRAL, axis=1)
    return np.asarray(np.linalg.eigvals(matrix))


def open_loop(axis: Axis, gains: Gains, omega: Array | float) -> NDArray[np.complex128]:
    """Response (n,) of the open loop at angular frequencies (n,), from error to place."""
    return _combined(_responses(axis, omega), gains)


def sag(axis: Axis, gains: Gains) -> float:
    """Largest deviation after a step of effort from outside, per unit of that step.

    The loop is advanced tick by tick until it has turned back.
    """
    matrix, pushed = _loop(axis, gains)
    state, most = np.zeros(len(matrix)), 0.0
    for _ in range(SETTLING_TICKS):
        state = matrix @ state + pushed
        if abs(state[0]) < 0.5 * most:
            break
        most = max(most, abs(float(state[0])))
    return most


def greatest_fall(axis: Axis, gains: Gains) -> float:
    """Steepest fall of friction with rate at which sliding stays steady, in effort per rate.

    While friction falls by f per rate it feeds any deviation as a viscous friction of -f would. The
    loop settles up to the result at every inertia within the factor; with a quick loop it is
    kd + viscous. 0 where it does not settle at all.
    """
    low, high = 0.0, gains.kd + axis.viscous
    for _ in range(FALL_STEPS):
        middle = 0.5 * (low + high)
        fallen = replace(axis, viscous=axis.viscous - middle)
        if all(_settles(one, gains) for one in _inertias(fallen)):
            low = middle
        else:
            high = middle
    return low


def spread_of_error(axis: Axis, gains: Gains) -> float:
    """Root of the integral of the squared error after a unit step of effort from outside.

    By Parseval's theorem, from the closed loop's response; it grows with sag and with duration.
    """
    omega, responses = _on_grid(axis)
    moved = np.abs(responses[0] / (1.0 + _combined(responses, gains))) / omega
    return float(np.sqrt(np.trapezoid(moved**2, omega) / math.pi))


def count_effort(axis: Axis, gains: Gains) -> float:
    """Change of effort by one count of the encoder."""
    return axis.step * (
        gains.kp + gains.kd * rate_weight(axis.rate_cutoff_Hz, axis.tick_s) / axis.tick_s
    )


def rate_weight(cutoff_Hz: float, tick_s: float) -> float:
    """Share of a fresh difference in the estimated rate, as sc_motion.c takes it; 0 Hz: no filter.

    >>> round(rate_weight(100.0, 1e-3), 3)
    0.386
    """
    if cutoff_Hz <= 0.0:
        return 1.0
    passed = 2.0 * math.pi * cutoff_Hz * tick_s
    return passed / (1.0 + passed)


def _loop(axis: Axis, gains: Gains) -> tuple[Array, Array]:
    """The loop from tick to tick (n, n), and what a unit effort from outside adds (n,)."""
    turn, keep, fresh, stale, ticks = _sampled(axis)
    size = 5 + ticks + 1
    place, rate, seen, last, integral = *range(4), INTEGRAL
    late = 5  # the effort of the tick before, then those before it
    weight = rate_weight(axis.rate_cutoff_Hz, axis.tick_s)
    # What a tick's measurement makes of the state, as rows over the state before.
    estimate = np.zeros(size)
    estimate[seen] = 1.0 - weight
    estimate[place] += weight / axis.tick_s
    estimate[last] -= weight / axis.tick_s
    total = np.zeros(size)
    total[integral] = 1.0
    total[place] -= axis.tick_s
    effort = gains.ki * total - gains.kd * estimate
    effort[place] -= gains.kp
    efforts = [effort, *np.eye(size)[late : late + ticks + 1]]
    matrix = np.zeros((size, size))
    matrix[place, place], matrix[place, rate], matrix[rate, rate] = 1.0, turn, keep
    matrix[[place, rate]] += np.outer(fresh, efforts[ticks]) + np.outer(stale, efforts[ticks + 1])
    matrix[seen], matrix[integral] = estimate, total
    matrix[last, place] = 1.0
    for index in range(ticks + 1):
        matrix[late + index] = efforts[index]
    outside = np.zeros(size)
    outside[[place, rate]] = _pushed(axis, axis.tick_s)
    return matrix, outside


def _margins(axis: Axis, gains: Gains) -> Margins:
    """Margins at the stated inertia, of a loop that settles."""
    omega, responses = _on_grid(axis)
    loop = _combined(responses, gains)
    size, phase = np.abs(loop), np.unwrap(np.angle(loop))
    phase -= 2.0 * math.pi * np.ceil(phase[0] / (2.0 * math.pi))
    crossed = np.flatnonzero((size[:-1] >= 1.0) != (size[1:] >= 1.0))
    away = np.abs(np.remainder(phase[crossed], 2.0 * math.pi) - math.pi)
    opposed = np.flatnonzero(np.diff(np.floor((phase + math.pi) / (2.0 * math.pi))) != 0)
    apart = np.exp(np.abs(np.log(size[opposed])))
    last = float(omega[crossed[-1]]) if len(crossed) else math.nan
    return Margins(
        math.degrees(float(away.min(initial=math.pi))), float(apart.min(initial=math.inf)), last
    )


def _inertias(axis: Axis) -> tuple[Axis, Axis, Axis]:
    """The axis as stated, and with the lightest and the heaviest inertia."""
    light, heavy = axis.inertia / axis.inertia_factor, axis.inertia * axis.inertia_factor
    return axis, replace(axis, inertia=light), replace(axis, inertia=heavy)


def _settles(axis: Axis, gains: Gains) -> bool:
    return bool(np.abs(loop_poles(axis, gains)).max() < 1.0)


@lru_cache(maxsize=64)  # a design looks at hundreds of gains of one axis
def _on_grid(axis: Axis) -> tuple[Array, Responses]:
    """Angular frequencies (n,), and the responses there."""
    omega = np.asarray(np.geomspace(LOWEST, 0.9999, GRID) * math.pi / axis.tick_s)
    return omega, _responses(axis, omega)


def _responses(axis: Axis, omega: Array | float) -> Responses:
    """What a unit of each gain makes of the open loop."""
    z = np.exp(1j * omega * axis.tick_s)
    turn, keep, fresh, stale, ticks = _sampled(axis)
    forced = np.multiply.outer(fresh, z**-ticks) + np.multiply.outer(stale, z ** -(ticks + 1))
    place = (forced[0] + turn * forced[1] / (z - keep)) / (z - 1.0)
    weight = rate_weight(axis.rate_cutoff_Hz, axis.tick_s)
    rate = weight * (1.0 - 1.0 / z) / axis.tick_s / (1.0 - (1.0 - weight) / z)
    return place, place * rate, place * axis.tick_s * z / (z - 1.0)


def _combined(responses: Responses, gains: Gains) -> NDArray[np.complex128]:
    place, rate, integral = responses
    return np.asarray(gains.kp * place + gains.kd * rate + gains.ki * integral)


def _sampled(axis: Axis) -> tuple[float, float, Array, Array, int]:
    """The axis from tick to tick: place after a rate, rate kept, and what efforts add.

    The third and fourth are what the efforts of ``ticks`` and of ``ticks`` + 1 ticks ago add to
    place and rate.
    """
    ticks = int(axis.delay_s / axis.tick_s)
    part = axis.delay_s - ticks * axis.tick_s
    turn, keep = _free(axis, axis.tick_s)
    fresh = _pushed(axis, axis.tick_s - part)
    early = _pushed(axis, part)
    glides, slows = _free(axis, axis.tick_s - part)
    stale = np.array([early[0] + glides * early[1], slows * early[1]])
    return turn, keep, fresh, stale, ticks


def _free(axis: Axis, time_s: float) -> tuple[float, float]:
    """Way that a unit of rate makes in a time, and what is left of it."""
    if _is_free(axis, time_s):
        return time_s, 1.0
    slows = -math.expm1(-axis.viscous * time_s / axis.inertia)
    return slows * axis.inertia / axis.viscous, 1.0 - slows


def _pushed(axis: Axis, time_s: float) -> Array:
    """Place and rate after a unit of effort for a time, from rest."""
    way, _ = _free(axis, time_s)
    if _is_free(axis, time_s):
        return np.array([0.5 * time_s * time_s, time_s]) / axis.inertia
    return np.array([(time_s - way) / axis.viscous, way / axis.inertia])


def _is_free(axis: Axis, time_s: float) -> bool:
    """Whether viscous friction changes a rate too little in a time for the exact forms."""
    return abs(axis.viscous) * time_s < NO_FRICTION * axis.inertia
