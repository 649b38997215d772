"""What the filter is told: a picture's pose, a contact, the direction of a contact's force.

Each row is a residual (measured minus predicted), its slopes by the state's error, and its noise.
"""

import math
from dataclasses import dataclass

import numpy as np

from scissorcal.aliases import Array
from scissorcal.model.surface import Surface
from scissorcal.tracking.filter import (
    BIAS,
    COMPLIANCE,
    FRICTION,
    OFFSET,
    PLACE,
    POSE,
    RIG_BIAS,
    RIG_PLACE,
    RIG_TURN,
    SIZE,
    SPEED,
    SPIN,
    TURN,
    ZERO,
    FilterState,
)
from scissorcal.tracking.plate_pose import cross, cross_matrix, rotation_vector
from scissorcal.tracking.settings import ContactErrors, ForceErrors

KNOWN_SLIDING = 3.0
"""The direction of sliding is known where its speed is so many standard deviations of itself."""
BILINEAR_S = 1.0

_IDENTITY = np.eye(3)
_CAMERA_SLOPES = np.zeros((6, SIZE))
_CAMERA_SLOPES[:, POSE] = _CAMERA_SLOPES[:, BIAS] = np.eye(6)


@dataclass(frozen=True)
class CameraPose:
    """A picture's pose of the plate in the rig's frame, at the time of its exposure.

    ``rotation`` (3, 3), ``place_m`` (3,), ``covariance`` (6, 6) of rotation vector (rad) and place
    (m), in the rig's axes, without the bias that all pictures share. ``certain`` is False where the
    mirrored pose that a plane allows explains the picture about equally well.
    """

    time_s: float
    rotation: Array
    place_m: Array
    covariance: Array
    certain: bool = True


@dataclass(frozen=True)
class Contact:
    """A contact at one time, in the rig's frame.

    ``point_m`` (3,) is the tool's tip by the rig's own encoders, ``force_N`` the force along the
    surface's normal, ``smooth_force_N`` that force behind the filter of the settings, ``since_s``
    the time since the contact before.
    """

    time_s: float
    point_m: Array
    force_N: float
    smooth_force_N: float
    since_s: float


@dataclass(frozen=True)
class ForceDirection:
    """The mean force on the tool (3,) over some samples, its tip's place and velocity (3,) then."""

    time_s: float
    point_m: Array
    force_N: Array
    velocity_m_per_s: Array
    samples: int


def camera_row(state: FilterState, pose: CameraPose) -> tuple[Array, Array, Array]:
    """Residual (6,), slopes (6, 30), noise (6, 6) of a picture's pose.

    [Log(R_m R^T) - b_r; o_m - o - b_t]
    """
    residual = np.empty(6)
    residual[:3] = rotation_vector(pose.rotation @ state.rotation.T)
    residual[3:] = pose.place_m - state.mean[PLACE]
    residual -= state.mean[BIAS]
    return residual, _CAMERA_SLOPES, pose.covariance


def contact_row(
    state: FilterState, contact: Contact, surface: Surface, errors: ContactErrors
) -> tuple[float, Array, float]:
    """Residual, slopes (30,), noise (m^2) of a contact: 0 = phi/|grad phi| + c force - b_c.

    The slope by the compliance is the smoothed force: the raw one's noise moves nothing, so a
    regression on it takes the plate for stiffer than it is. The noise grows by the terms of second
    order that the row leaves out: d_phi x d_o along the normal, and the surface's curvature times
    the error of place along it. Neighbouring rows share them, so they count for as many rows as
    ``bilinear_time_s`` holds. The rig's bias moves the tip as the opposite error of pose would, so
    both have one slope; what the bias itself changes of it is left out.
    """
    mean, turn = state.mean, state.rotation
    away = contact.point_m - mean[PLACE]
    away = away - mean[RIG_PLACE] - cross(mean[RIG_TURN], away)
    here = surface.at(away @ turn)
    steep = math.sqrt(float(here.gradient @ here.gradient))
    normal = turn @ (here.gradient / steep)
    residual = mean[OFFSET] - here.level / steep - mean[COMPLIANCE] * contact.force_N
    slope = np.zeros(SIZE)
    slope[TURN] = cross(normal, away)
    slope[PLACE] = -normal
    slope[RIG_BIAS] = slope[POSE]
    slope[OFFSET] = -1.0
    slope[COMPLIANCE] = contact.smooth_force_N
    noise = errors.white_m**2 + (float(mean[COMPLIANCE]) * errors.force_sd_N) ** 2
    if errors.bilinear_time_s > 0.0:
        repeats = max(1.0, errors.bilinear_time_s / contact.since_s)
        bend = turn @ (here.hessian / steep) @ turn.T if here.hessian.any() else None
        noise += 0.5 * repeats * _second_order(state.covariance, away, normal, bend)
    return residual, slope, noise


def force_row(
    state: FilterState, felt: ForceDirection, surface: Surface, errors: ForceErrors
) -> tuple[Array, Array, Array] | None:
    """Residual (2,), slopes (2, 30), noise (2, 2) of a force's direction; None where there is none.

    f/|f| = (n - mu t)/|n - mu t|, with t the direction in which the tip slides over the plate; the
    row is its part across the predicted direction.
    """
    mean, turn = state.mean, state.rotation
    away = felt.point_m - mean[PLACE]
    here = surface.at(away @ turn)
    steep = math.sqrt(float(here.gradient @ here.gradient))
    normal = turn @ (here.gradient / steep)
    sliding = felt.velocity_m_per_s - mean[SPEED] - cross(mean[SPIN], away)
    sliding = sliding - normal * float(normal @ sliding)
    speed = math.sqrt(float(sliding @ sliding))
    force = felt.force_N - mean[ZERO]
    size = math.sqrt(float(force @ force))
    lever = cross_matrix(away)
    drift = state.covariance[SPEED, SPEED] + lever @ state.covariance[SPIN, SPIN] @ lever.T
    known = max(errors.least_speed_m_per_s, KNOWN_SLIDING * math.sqrt(float(np.trace(drift))))
    if speed < known or size < errors.least_force_N:
        return None
    along, friction = sliding / speed, float(mean[FRICTION])
    share = 1.0 / math.sqrt(1.0 + friction * friction)
    predicted = share * (normal - friction * along)
    across = np.stack([cross(along, normal), share * (along + friction * normal)])
    # The normal turns with the plate, and with the place on a curved surface.
    tangent = np.eye(3) - np.outer(normal, normal)
    bend = tangent @ turn @ (here.hessian / steep) @ turn.T
    by_turn = -cross_matrix(normal) + bend @ lever
    by_place = -bend
    lean = share * (np.eye(3) + friction * np.outer(normal, along))
    slopes = np.zeros((2, SIZE))
    slopes[:, TURN] = across @ lean @ by_turn
    slopes[:, PLACE] = across @ lean @ by_place
    slopes[:, FRICTION] = across @ (-(along + friction * normal) * share**3)
    slopes[:, ZERO] = across / size
    # The sliding direction's own error: the plate's velocity is known to some share of the tip's.
    swing = across @ (-share * friction / speed * (tangent - np.outer(along, along)))
    slopes[:, SPEED] = -swing
    slopes[:, SPIN] = swing @ lever
    residual = across @ (force / size - predicted)
    turns = state.covariance[TURN, TURN]
    second = 0.5 * float(np.trace(turns)) ** 2 * max(1.0, BILINEAR_S / errors.every_s)
    return residual, slopes, np.eye(2) * ((errors.noise_N / size) ** 2 / felt.samples + second)


def _second_order(covariance: Array, away: Array, normal: Array, bend: Array | None) -> float:
    """tr(P_phi) tr(P_o) across the normal, and the curvature's share tr((B P)^2)."""
    turns, places = covariance[TURN, TURN], covariance[PLACE, PLACE]
    variances: list[float] = covariance.diagonal()[POSE].tolist()
    tilt: float = sum(variances[:3]) - float(normal @ turns @ normal)
    slid: float = sum(variances[3:]) - float(normal @ places @ normal)
    if bend is None:
        return tilt * slid
    by_pose = np.concatenate((-cross_matrix(away), _IDENTITY), axis=1)
    bent = bend @ (by_pose @ covariance[POSE, POSE] @ by_pose.T)
    return tilt * slid + float(np.vdot(bent, bent.T))
