"""The hybrid law pressing on elastic material as a sampled loop: phase, poles, decay. Pure.

Along the normal the law (sc_hybrid.c) acts on

    m x'' + b x' + k x = u(t - delay) behind a motor of first order, u held from tick to tick,

x the indentation, by u = -m kd (estimated x' - w) + h, where h holds k_P times the error of the
measured force k x, behind its sensor's low-pass, and k_I T times the sum of its errors. The rate w
of the surface is 0, or what the law feels of it: the estimated x' plus compliance times the force's
rate, behind a low-pass. Held efforts and a delay that is no whole number of ticks are exact (Astrom
and Wittenmark, Computer-Controlled Systems, 1997, section 3.2). Without delay, lag and filters, and
with b as all the damping, its characteristic polynomial is
m s^3 + b s^2 + k (1 + k_P) s + k k_I, which is stable for k_I < (1 + k_P) b / m alone.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from scissorcal.aliases import Array
from scissorcal.device.control import rate_weight


@dataclass(frozen=True)
class ContactLoop:
    """What the law meets along the normal, in SI units.

    ``mass_kg`` is 1 / (n^T J D^-1 J^T n) (``HYBRID_OUTPUT_DTYPE``'s ``mass``); it may be wrong by
    ``mass_factor`` either way, and ``stiffness_N_per_m`` of the material by ``stiffness_factor``.
    ``viscous_N_s_per_m`` is damping that the law's bias does not compensate. ``delay_s`` passes
    from a measurement to the effort that answers it, without the time for which an effort is held;
    ``motor_lag_s`` is the motor's time constant. The filters' cutoffs are 0 where there is none.
    ``surface_cutoff_Hz`` is the corner below which the law feels the surface's rate
    (``HybridConfig``'s). ``step_m`` is a count of the encoder, along the
    normal, which may change the force by ``most_per_count_N`` (chosen: less than half of the
    0.12 N by which a force may be off).
    """

    stiffness_N_per_m: float
    mass_kg: float
    viscous_N_s_per_m: float
    delay_s: float
    motor_lag_s: float
    tick_s: float
    rate_cutoff_Hz: float
    force_cutoff_Hz: float = 0.0
    surface_cutoff_Hz: float = 0.0
    step_m: float = 0.0
    most_per_count_N: float = 0.05
    stiffness_factor: float = 1.25
    mass_factor: float = 1.15

    @property
    def phase_deg(self) -> float:
        """By how much the damping lags where mass and material swing: sqrt(k/m) times its delays.

        At 90 degrees damping gives no damping any more, and beyond it excites.
        """
        filtered = 0.0
        if self.rate_cutoff_Hz > 0.0:
            filtered = 1.0 / (2.0 * math.pi * self.rate_cutoff_Hz)
        late = 0.5 * self.tick_s + self.delay_s + self.motor_lag_s + filtered
        return math.degrees(math.sqrt(self.stiffness_N_per_m / self.mass_kg) * late)

    @property
    def corners(self) -> tuple[tuple[float, float], ...]:
        """Stiffness and mass, as stated and wrong by their factors."""
        return tuple(
            (self.stiffness_N_per_m * stiffer, self.mass_kg * heavier)
            for stiffer, heavier in product(
                (1.0, 1.0 / self.stiffness_factor, self.stiffness_factor),
                (1.0, 1.0 / self.mass_factor, self.mass_factor),
            )
        )


@dataclass(frozen=True)
class ContactGains:
    """Damping along the normal and the force's integral, both 1/s, and the share of the force's
    error that is answered at once; ``HybridConfig``'s names."""

    contact_kd: float
    force_ki: float
    force_kp: float = 0.0


def contact_decays(
    loop: ContactLoop, gains: Sequence[ContactGains], normal_kp: float = 0.0
) -> Array:
    """Slowest decay of the sampled loop, 1/s, with each of the gains (n,); unstable below 0.

    Stiffness and mass are wrong by their factors. All of the gains have an integral, or none
    (``force_ki = 0``); with ``normal_kp`` (1/s^2) as well it is the loop of ``NormalLaw.POSITION``
    while it presses. Minus infinity where mass and material swing faster than half the ticks, which
    none can see.

    >>> loop = ContactLoop(1e4, 0.05, 1.0, 0.0, 1.5e-3, 1e-3, rate_cutoff_Hz=400.0)
    >>> contact_decays(loop, [ContactGains(200.0, 20.0)]).round(1)
    array([8.])
    """
    worst = np.full(len(gains), math.inf)
    for corner in loop.corners:
        if math.sqrt(corner[0] / corner[1]) * loop.tick_s >= math.pi:
            return np.full(len(gains), -math.inf)
        poles = np.linalg.eigvals(_matrices(loop, corner, gains, normal_kp))
        worst = np.minimum(worst, -np.log(np.abs(poles).max(axis=1)) / loop.tick_s)
    return worst


def _matrices(
    loop: ContactLoop,
    corner: tuple[float, float],
    gains: Sequence[ContactGains],
    normal_kp: float,
) -> Array:
    """The loops from tick to tick (n, size, size); without the sum of errors where none is used."""
    weights = [(1.0, one.contact_kd, one.force_ki, normal_kp, one.force_kp) for one in gains]
    felt = loop.surface_cutoff_Hz if normal_kp == 0.0 else 0.0
    parts, total = _parts(replace(loop, surface_cutoff_Hz=felt), *corner)
    if not any(one.force_ki for one in gains):
        parts = np.delete(np.delete(parts, total, axis=1), total, axis=2)
    return np.tensordot(weights, parts, 1)


def _parts(loop: ContactLoop, stiffness: float, mass: float) -> tuple[Array, int]:
    """The loop from tick to tick (5, n, n): without gains, and what a unit of each gain adds.

    The second is the place of the sum of errors.

    States: what moves (`_moving`), the estimated rate, the last place, the sum of the force's
    errors, the efforts on their way, and (where it is felt) the surface's rate and the last force.
    The law knows the stated mass and stiffness.
    """
    free, fresh, stale, seen, ticks = _sampled(loop, stiffness, mass)
    moving, feels = len(free), loop.surface_cutoff_Hz > 0.0
    size = moving + 3 + ticks + 1 + 2 * feels
    estimate, last, total, late = range(moving, moving + 4)
    weight, tick = rate_weight(loop.rate_cutoff_Hz, loop.tick_s), loop.tick_s
    unit = np.eye(size)
    place, force = unit[0], np.zeros(size)
    force[:moving] = seen
    rate = (1.0 - weight) * unit[estimate] + weight / tick * (place - unit[last])
    error = unit[total] - tick * force
    parts = np.zeros((5, size, size))
    parts[0, :moving, :moving] = free
    parts[0, estimate], parts[0, last], parts[0, total] = rate, place, error
    parts[0, late + 1 : late + 1 + ticks, late : late + ticks] = np.eye(ticks)
    surface = np.zeros(size)
    if feels:
        felt, pressed = size - 2, size - 1
        corner = 2.0 * math.pi * loop.surface_cutoff_Hz
        presses_in = (force - unit[pressed]) / loop.stiffness_N_per_m
        moved = tick * (rate - unit[felt]) - presses_in
        surface = unit[felt] + corner / (1.0 + corner * tick) * moved
        parts[0, felt], parts[0, pressed] = surface, force
    efforts = np.zeros((5, size))
    efforts[1], efforts[2] = loop.mass_kg * (surface - rate), error
    efforts[3], efforts[4] = -loop.mass_kg * place, -force
    parts[:, late] = efforts
    if ticks == 0:
        parts[:, :moving] += fresh[:, None] * efforts[:, None, :]
    else:
        parts[0, :moving, late + ticks - 1] += fresh
    parts[0, :moving, late + ticks] += stale
    return parts, total


def _sampled(
    loop: ContactLoop, stiffness: float, mass: float
) -> tuple[Array, Array, Array, Array, int]:
    """From tick to tick: what moves by itself (n, n), what the efforts of ``ticks`` and of one more
    tick ago add to it (n,), and the row (n,) of the force that is measured."""
    slope, push, seen = _moving(loop, stiffness, mass)
    ticks = int(loop.delay_s / loop.tick_s + 1e-9)
    part = max(0.0, loop.delay_s - ticks * loop.tick_s)
    free, _ = _over(slope, push, loop.tick_s)
    rest, fresh = _over(slope, push, loop.tick_s - part)
    stale = rest @ _over(slope, push, part)[1]
    return free, fresh, stale, seen, ticks


def _moving(loop: ContactLoop, stiffness: float, mass: float) -> tuple[Array, Array, Array]:
    """Slopes (n, n) of place, rate, motor and force sensor, by a unit of effort (n,), and the row
    of the measured force."""
    lags, filters = loop.motor_lag_s > 0.0, loop.force_cutoff_Hz > 0.0
    size = 2 + lags + filters
    slope, push, seen = np.zeros((size, size)), np.zeros(size), np.zeros(size)
    slope[0, 1] = 1.0
    slope[1, :2] = -stiffness / mass, -loop.viscous_N_s_per_m / mass
    if lags:
        slope[1, 2], slope[2, 2], push[2] = (
            1.0 / mass,
            -1.0 / loop.motor_lag_s,
            1.0 / loop.motor_lag_s,
        )
    else:
        push[1] = 1.0 / mass
    if filters:
        corner = 2.0 * math.pi * loop.force_cutoff_Hz
        slope[-1, 0], slope[-1, -1], seen[-1] = corner * stiffness, -corner, 1.0
    else:
        seen[0] = stiffness
    return slope, push, seen


def _over(slope: Array, push: Array, time_s: float) -> tuple[Array, Array]:
    """What a state becomes in a time (n, n), and what a held unit of effort adds (n,)."""
    from scipy.linalg import expm

    size = len(slope)
    whole = np.zeros((size + 1, size + 1))
    whole[:size, :size], whole[:size, size] = slope * time_s, push * time_s
    done = expm(whole)
    return done[:size, :size], done[:size, size]
