"""Error-state Kalman filter over a plate's pose: the state, its way through time, one correction.

The state's error has 30 numbers, in this order: a rotation vector (R = Exp(d_phi) R^) and a
translation in the rig's axes; angular and linear velocity; the camera's bias (turn, place); the
offset of the contact; the plate's compliance; the friction coefficient; the force sensor's zero;
the bias of the rig's own places (turn, place).
Rotations are matrices, so no orientation is special (Sola, Deray and Atchuthan 2018,
arXiv:1812.01537).
"""

import math
from dataclasses import dataclass

import numpy as np

from scissorcal.aliases import Array
from scissorcal.tracking.plate_pose import nearest_rotation, rotation_of
from scissorcal.tracking.settings import PlateMotion, TrackingSettings

SIZE = 30
TURN, PLACE, SPIN, SPEED = slice(0, 3), slice(3, 6), slice(6, 9), slice(9, 12)
POSE, RATES, BIAS = slice(0, 6), slice(6, 12), slice(12, 18)
OFFSET, COMPLIANCE, FRICTION = 18, 19, 20
ZERO = slice(21, 24)
RIG_TURN, RIG_PLACE, RIG_BIAS = slice(24, 27), slice(27, 30), slice(24, 30)

_SERIES_BELOW = 1e-2

# Diagonals of blocks of a flattened covariance.
_NEXT = SIZE + 1
_POSE_ON_POSE = slice(0, 6 * _NEXT, _NEXT)
_RATES_ON_POSE = slice(6, 6 * _NEXT, _NEXT)
_POSE_ON_RATES = slice(6 * SIZE, 12 * SIZE, _NEXT)
_RATES_ON_RATES = slice(6 * _NEXT, 12 * _NEXT, _NEXT)
_IDENTITY = np.eye(SIZE)


@dataclass
class FilterState:
    """Time (s), rotation (3, 3), the other means (30,), whose first three are 0, and covariance.

    ``copy`` is what a rewind returns to.
    """

    time_s: float
    rotation: Array
    mean: Array
    covariance: Array

    def copy(self) -> "FilterState":
        """An independent copy."""
        return FilterState(
            self.time_s, self.rotation.copy(), self.mean.copy(), self.covariance.copy()
        )


def start_state(
    settings: TrackingSettings, time_s: float, rotation: Array, place: Array, covariance: Array
) -> FilterState:
    """The state after a first pose from the camera: rotation (3, 3), place (3,), covariance (6, 6).

    Pose and bias are anticorrelated from then on: the camera's first pose holds both.
    """
    camera, contact, force = settings.camera, settings.contact, settings.force
    bias = camera.bias_covariance
    spread = np.zeros((SIZE, SIZE))
    spread[POSE, POSE] = covariance + bias
    spread[BIAS, BIAS] = bias
    spread[POSE, BIAS] = spread[BIAS, POSE] = -bias
    if not settings.plate.still:
        sds = np.repeat([settings.plate.spin_rad_per_s, settings.plate.speed_m_per_s], 3)
        spread[RATES, RATES] = np.diag(sds**2)
    spread[OFFSET, OFFSET] = contact.slow_m**2
    spread[COMPLIANCE, COMPLIANCE] = contact.compliance_sd_m_per_N**2
    spread[FRICTION, FRICTION] = force.friction_sd**2
    spread[ZERO, ZERO] = (force.zero_sd_N or 0.0) ** 2 * np.eye(3)
    sds = np.repeat([contact.turn_bias_rad, contact.place_bias_m], 3)
    spread[RIG_BIAS, RIG_BIAS] = np.diag(sds**2)
    mean = np.zeros(SIZE)
    mean[PLACE] = place
    mean[COMPLIANCE], mean[FRICTION] = contact.compliance_m_per_N, force.friction
    return FilterState(time_s, nearest_rotation(rotation), mean, spread)


def predict(state: FilterState, settings: TrackingSettings, time_s: float) -> None:
    """Take the state to a later time, in place; an earlier or equal time changes nothing.

    Velocities decay as exp(-dt / time), exactly; the pose follows their integral. The process
    noise is the exact one of the integrated process.
    """
    elapsed = time_s - state.time_s
    if elapsed <= 0.0:
        return
    state.time_s = time_s
    mean, spread = state.mean, state.covariance
    slow = settings.contact
    keep = math.exp(-elapsed / slow.slow_time_s)
    mean[OFFSET] *= keep
    if settings.plate.still:
        spread[OFFSET] *= keep
        spread[:, OFFSET] *= keep
    else:
        state.covariance = spread = _move(state, settings.plate, elapsed, keep)
    spread[OFFSET, OFFSET] += slow.slow_m**2 * (1.0 - keep * keep)


def _move(state: FilterState, plate: PlateMotion, elapsed: float, keep: float) -> Array:
    """Turn and move the means; the covariance after that, without the offset's noise."""
    mean, time = state.mean, plate.time_s
    fades = math.exp(-elapsed / time)
    reach = -time * math.expm1(-elapsed / time)
    turned = rotation_of(reach * mean[SPIN])
    state.rotation = turned @ state.rotation
    mean[PLACE] += reach * mean[SPEED]
    mean[RATES] *= fades
    through = _IDENTITY.copy()
    through[TURN, TURN] = turned
    through.ravel()[_RATES_ON_POSE] = reach
    through.ravel()[_RATES_ON_RATES] = fades
    through[OFFSET, OFFSET] = keep
    spread = np.asarray(through @ state.covariance @ through.T)
    rate, cross, place = _walk(elapsed / time)
    variance = np.array([plate.spin_rad_per_s**2] * 3 + [plate.speed_m_per_s**2] * 3)
    flat = spread.ravel()
    flat[_POSE_ON_POSE] += variance * (time * time * place)
    flat[_RATES_ON_POSE] += variance * (time * cross)
    flat[_POSE_ON_RATES] += variance * (time * cross)
    flat[_RATES_ON_RATES] += variance * rate
    return spread


def correct(state: FilterState, step: Array, covariance: Array) -> None:
    """Add an error (30,) to the state, in place, and take a covariance (30, 30)."""
    state.mean += step
    state.rotation = nearest_rotation(rotation_of(step[TURN]) @ state.rotation)
    state.mean[TURN] = 0.0
    state.covariance = covariance


def update(
    state: FilterState, residual: Array, slopes: Array, noise: Array, gate: float
) -> tuple[float, bool]:
    """Correct by a row of several numbers; give its NIS and whether the gate let it in.

    ``residual`` (m,) is measured minus predicted, ``slopes`` (m, 30) of the prediction, ``noise``
    (m, m). NIS is the residual's square by its covariance, chi-square with m degrees of freedom
    where the filter is consistent.
    """
    spread = state.covariance
    shared = spread @ slopes.T
    total = slopes @ shared + noise
    gained = np.linalg.solve(total, shared.T)
    step = residual @ gained
    nis = float(residual @ np.linalg.solve(total, residual))
    if not nis <= gate:
        return nis, False
    spread = spread - shared @ gained
    correct(state, step, 0.5 * (spread + spread.T))
    return nis, True


def update_by_one(
    state: FilterState, residual: float, slope: Array, noise: float, gate: float
) -> tuple[float, bool]:
    """Correct by a row of one number, as `update` does; ``slope`` is (30,)."""
    shared = state.covariance @ slope
    total = float(slope @ shared) + noise
    nis = residual * residual / total
    if not nis <= gate:
        return nis, False
    scaled = shared / math.sqrt(total)
    correct(state, shared * (residual / total), state.covariance - scaled[:, None] * scaled)
    return nis, True


def _walk(share: float) -> tuple[float, float, float]:
    """Noise of a Gauss-Markov velocity of unit variance and time, after ``share`` of that time.

    Variance of the velocity, its covariance with the way, and the variance of the way, which is a
    series where its closed form would cancel.
    """
    fades = math.exp(-share)
    rate = -math.expm1(-2.0 * share)
    cross = math.expm1(-share) ** 2
    if share < _SERIES_BELOW:
        place = share**3 * (2.0 / 3.0 - share * (0.5 - share * (7.0 / 30.0 - share / 12.0)))
    else:
        place = 2.0 * share - 3.0 + 4.0 * fades - fades * fades
    return rate, cross, place
