"""A ball-tipped tool that is pressed on the plate and dragged along it, at 1 kHz, row by row."""

from dataclasses import dataclass
from math import exp, hypot, pi, sqrt

import numpy as np
from scipy.spatial.transform import Rotation

from scissorcal.aliases import Array

from .motion import Motion
from .shapes import Shape

STEP_S, ROWS_EVERY = 1e-3, 10
COMPLIANCE, COMPLIANCE_SPREAD, AT_N = 1e-4, 0.2, 2.5
"""Way over force at 2.5 N; half of it is linear (the plate), half Hertz's two thirds (the tip)."""
HERTZ_SHARE, CREEP, CREEP_S = 0.5, 0.15, 0.4
STICK, SLIP, SIDE_N_PER_M = (0.2, 0.45), 0.7, 8e3
"""Friction coefficient at rest, the share of it that is left in a slip, the tool's side spring."""
TIP_CONSTANT_M, TIP_PERIODIC_M, TIP_PERIOD_M, TIP_PLAY_M = 0.05e-3, 0.06e-3, (0.04, 0.15), 0.04e-3
"""Errors of the rig's places: constant, repeating by place (sd), play that turns with direction."""
ENCODER_M, RING_M, RING_HZ = 5e-6, 0.018e-3, 23.0
ZERO_N, DRIFT_N_PER_ROOT_S, SENSOR_N, SENSOR_STEP_N, SKEW = 0.02, 0.01, 0.04, 0.02, 0.01
NORMAL_SD_RAD = 0.01
"""How well the normal is known along which the force is taken."""
CLOCK_SD_S, LATE_SHARE, LATE_S, LOST = 0.3e-3, 0.02, 3e-3, 0.01


@dataclass(frozen=True)
class Touches:
    """Rows of contact as a rig states them, and the truth of each.

    ``stamp_s`` (n,), ``point_m`` (n, 3) the tip's centre less its radius along the tool, which
    stands along the face's first normal; ``force_N`` (n,) along the expected normal. Truth:
    ``true_s`` (n,), ``arcs_m`` (n, 2) where the face is touched, ``pressed_N`` (n,).
    """

    stamp_s: Array
    point_m: Array
    force_N: Array
    true_s: Array
    arcs_m: Array
    pressed_N: Array


def touches(
    motion: Motion,
    shape: Shape,
    seconds: float,
    tip_radius_m: float,
    rng: np.random.Generator,
) -> Touches:
    """Press and drag a tip over the face; what the rig says of it, a hundred times a second."""
    count = round(seconds / STEP_S)
    drive = _scribble(count, shape.reach_m, rng)
    pressed = _pressed(count, rng)
    dents = _dents(pressed, rng)
    arcs = drive - _dragged(drive, pressed, rng)
    rows = np.arange(ROWS_EVERY, count - 5, ROWS_EVERY)
    rows = rows[rng.random(len(rows)) >= LOST]
    stamp = rows * STEP_S
    off = np.abs(CLOCK_SD_S * rng.standard_normal(len(rows)))
    off += LATE_S * (rng.random(len(rows)) < LATE_SHARE)
    true = stamp + off
    fine = STEP_S * np.arange(count)

    def now(values: Array) -> Array:
        return np.stack([np.interp(true, fine, part) for part in values.T], axis=1)

    arcs_now, lag, press, dent = now(arcs), now(drive - arcs), *now(np.stack([pressed, dents], 1)).T
    points, normals, frames = shape.walk(arcs_now)
    lifted = np.where(press > 0.0, 0.0, 1e-3)
    ball = points + normals * (tip_radius_m - dent + lifted)[:, None]
    ball += np.einsum("nij,nj->ni", frames[:, :, :2], lag)
    rotation, place = motion(true)
    where = place + np.einsum("nij,nj->ni", rotation, ball)
    outward = np.einsum("nij,nj->ni", rotation, normals)
    where = where - tip_radius_m * outward[0]
    where = where + _misplaced(where, rng)
    side = np.einsum("nij,njk,nk->ni", rotation, frames[:, :, :2], lag) * SIDE_N_PER_M
    force = _felt(outward * press[:, None] - side * (press > 0.0)[:, None], rng)
    tilted = Rotation.from_rotvec(NORMAL_SD_RAD * rng.standard_normal(3)).apply(outward)
    return Touches(stamp, where, np.sum(force * tilted, axis=1), true, arcs_now, press)


def _scribble(count: int, reach: float, rng: np.random.Generator) -> Array:
    """Where the tool is driven to, as arcs (n, 2): waves that never meet again."""
    times = STEP_S * np.arange(count)[:, None]
    rates = 2.0 * pi * np.array([0.17, 0.31, 0.53]) * rng.uniform(0.85, 1.15, (2, 1, 3))
    phases = rng.uniform(0.0, 2.0 * pi, (2, 1, 3))
    waves = np.array([0.55, 0.3, 0.15]) * np.sin(rates * times + phases)
    return reach * waves.sum(axis=2).T


def _pressed(count: int, rng: np.random.Generator) -> Array:
    """Force (n,): about 2.5 N with swell and flutter, and the tip lifted now and then."""
    times = STEP_S * np.arange(count)
    force = AT_N + 0.6 * np.sin(2.0 * pi * rng.uniform(0.3, 0.7) * times + rng.uniform(0.0, 6.3))
    force += 0.25 * np.sin(2.0 * pi * rng.uniform(3.0, 6.0) * times + rng.uniform(0.0, 6.3))
    at = rng.uniform(0.5, 2.0)
    ramp = round(0.06 / STEP_S)
    while at < times[-1]:
        first, last = round(at / STEP_S), round((at + rng.uniform(0.2, 0.5)) / STEP_S)
        force[first:last] = 0.0
        force[max(first - ramp, 0) : first] *= np.linspace(1.0, 0.0, ramp)[-min(first, ramp) :]
        part = force[last : last + ramp]
        part *= np.linspace(0.0, 1.0, ramp)[: len(part)]
        at += rng.uniform(1.5, 3.5)
    return np.maximum(force, 0.0)


def _dents(pressed: Array, rng: np.random.Generator) -> Array:
    """How far the face has given way (n,), with creep behind the force."""
    way = COMPLIANCE * (1.0 + COMPLIANCE_SPREAD * float(rng.standard_normal())) * AT_N
    share = pressed / AT_N
    own = way * ((1.0 - HERTZ_SHARE) * share + HERTZ_SHARE * share ** (2.0 / 3.0))
    keep, crept, dents = exp(-STEP_S / CREEP_S), 0.0, np.empty_like(own)
    for index, now in enumerate(own.tolist()):
        crept = keep * crept + (1.0 - keep) * CREEP * now
        dents[index] = (1.0 - CREEP) * now + crept
    return dents


def _dragged(drive: Array, pressed: Array, rng: np.random.Generator) -> Array:
    """How far the tip lags behind the tool (n, 2): it sticks, springs, and slips at once."""
    stick = rng.uniform(*STICK)
    lag, last, found = [0.0, 0.0], drive[0].tolist(), np.empty_like(drive)
    for index, (here, force) in enumerate(zip(drive.tolist(), pressed.tolist(), strict=True)):
        lag = [lag[0] + here[0] - last[0], lag[1] + here[1] - last[1]]
        last = here
        pull = SIDE_N_PER_M * hypot(*lag)
        if pull > stick * force:
            left = SLIP * stick * force / pull
            lag = [left * lag[0], left * lag[1]]
        found[index] = lag
    return found


def _misplaced(where: Array, rng: np.random.Generator) -> Array:
    """Errors (n, 3) of the rig's places: what repeats, what turns with direction, what is new."""
    count = len(where)
    off = np.tile(TIP_CONSTANT_M * rng.standard_normal(3), (count, 1))
    for axis in range(3):
        along = rng.standard_normal(3)
        wave = 2.0 * pi / rng.uniform(*TIP_PERIOD_M) / np.linalg.norm(along) * along
        phase = rng.uniform(0.0, 2.0 * pi)
        off[:, axis] += TIP_PERIODIC_M * sqrt(2.0) * np.sin(where @ wave + phase)
        going = np.gradient(where @ along)
        off[:, axis] += TIP_PLAY_M * np.tanh(going / (1e-5 * np.linalg.norm(along)))
        rings = RING_M * np.convolve(rng.standard_normal(count + 8), _ring(), "valid")[:count]
        off[:, axis] += rings
    step = 2.0 * sqrt(3.0) * ENCODER_M
    return step * np.round((where + off) / step) - where


def _ring() -> Array:
    """A damped oscillation of the arm, nine rows long, of unit square."""
    ring = np.exp(-0.5 * np.arange(9)) * np.cos(2.0 * pi * RING_HZ * 0.01 * np.arange(9))
    return ring / np.linalg.norm(ring)


def _felt(force: Array, rng: np.random.Generator) -> Array:
    """What the sensor says (n, 3): skewed, off by a zero that drifts, noisy, in whole steps."""
    skew = np.eye(3) + SKEW * rng.standard_normal((3, 3))
    drift = DRIFT_N_PER_ROOT_S * sqrt(0.01) * rng.standard_normal(force.shape)
    zero = ZERO_N * rng.standard_normal(3) + np.cumsum(drift, axis=0)
    noisy = force @ skew.T + zero + SENSOR_N * rng.standard_normal(force.shape)
    return SENSOR_STEP_N * np.round(noisy / SENSOR_STEP_N)
