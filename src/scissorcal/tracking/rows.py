"""What the filter is told: a picture's pose, a contact, the direction of a contact's force.

Each row is a residual (measured minus predicted), its slopes by the state's error, and its noise.
`TipContacts` finds the contacts in a rig's samples.
"""

import math
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from scissorcal.aliases import Array
from scissorcal.model.blade_point import BladePoint
from scissorcal.model.friction import AxisLaw
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


EVERY_S = 0.01
"""Contacts at 100 Hz know as much as at 1 kHz: their errors repeat from sample to sample."""
LEAST_LEVER_M = 10e-3
"""With a shorter lever of the opening to the normal, a torque says nothing of the force."""

_FITTED = 5


@dataclass(frozen=True, eq=False)
class TipContact:
    """Where the tip was at ``time_s`` (s), in the rig's frame, and its force along the normal.

    ``hidden_N`` of the force may be dry friction of blades that stand.
    """

    time_s: float
    point_m: Array
    force_N: float
    hidden_N: float = 0.0


class TipContacts:
    """Turns a rig's samples into contacts of the blade's tip.

    No sensor measures the force: it follows from the balance of the opening axis,

        I theta'' + F(theta, theta') + offset = drive + lever * force,

    with lever = n dp/d(opening) along the plate's normal n, and the drive of motor and handles.
    Samples are averaged over `EVERY_S`; rate and acceleration are those of a parabola through five
    such means, so a contact comes 20 ms late. While blades stand, dry friction holds any torque
    up to its level: the force is then known to that level over the lever only, its ``hidden_N``.
    ``opening`` is the axis as it was identified; without it friction and inertia are left out.

    >>> tip = BladePoint(station_m=0.075, offset_m=-0.005, moving_blades=2)
    >>> contacts = TipContacts(tip)
    >>> time, up = 1e-3 * np.arange(100), np.array([0.0, 1.0, 0.0])
    >>> found = contacts.take(time, 0.3 + 0 * time, 0 * time, -0.074 + 0 * time, up)
    >>> round(found[-1].force_N, 2), found[-1].point_m.round(4)
    (1.98, array([0.0749, 0.0063, 0.    ]))
    """

    def __init__(self, tip: BladePoint, opening: AxisLaw | None = None) -> None:
        self._tip = tip
        self._axis = opening
        self._means: deque[tuple[float, float, float, float]] = deque(maxlen=_FITTED)
        self._part: list[Array] = []
        self._slot = -1

    def place(self, opening: float, advance: float) -> Array:
        """Where the tip is (3,), in the rig's frame."""
        return self._tip.place((opening, advance))

    def take(
        self, time_s: Array, opening: Array, advance: Array, drive: Array, normal: Array
    ) -> list[TipContact]:
        """Contacts that these samples, (n,) each in s, rad, m and N m, complete.

        ``drive`` is what opens the blades: the motor's torque less the handle radius times the
        handle force. ``normal`` (3,) is the plate's under the tip, as it is estimated. Forces are
        as they come out, also negative ones: what is a contact is the caller's matter. After a gap
        in the times it begins anew.
        """
        contacts = []
        rows = np.stack([time_s, opening, advance, drive], axis=1)
        slots = np.floor(rows[:, 0] / EVERY_S + 1e-6).astype(np.int64)
        for slot in np.unique(slots).tolist():
            if slot != self._slot:
                contact = self._closed(normal)
                if contact is not None:
                    contacts.append(contact)
                if slot != self._slot + 1:
                    self._means.clear()
                self._slot = slot
            self._part.append(rows[slots == slot])
        return contacts

    def _closed(self, normal: Array) -> TipContact | None:
        """Average the samples of a finished slot; the contact in the middle of the last five."""
        if self._part:
            time, opening, advance, drive = np.concatenate(self._part).mean(axis=0).tolist()
            self._means.append((time, opening, advance, drive))
            self._part = []
        if len(self._means) < _FITTED:
            return None
        time, opening, advance, drive = self._means[_FITTED // 2]
        rate, bend = _parabola(self._means)
        lever = float(normal @ self._tip.jacobian((opening, advance))[:, 0])
        if abs(lever) < LEAST_LEVER_M:
            return None
        borne, held = -drive, 0.0
        axis = self._axis
        if axis is not None:
            borne += bend * axis.inertia + float(axis.effort(opening, rate))
            if abs(rate) < axis.rest_rate:
                ends = axis.effort(opening, np.array([-axis.rest_rate, axis.rest_rate]))
                held = 0.5 * float(ends[1] - ends[0])
        force = float(borne) / lever
        if not math.isfinite(force):
            return None
        return TipContact(time, self.place(opening, advance), force, held / abs(lever))


def _parabola(means: Iterable[tuple[float, float, float, float]]) -> tuple[float, float]:
    """Rate and acceleration of the opening at the middle of five means, by least squares."""
    times, openings = zip(*((mean[0], mean[1]) for mean in means), strict=True)
    step = (times[4] - times[0]) / 4.0
    first, second, third, fourth, fifth = openings
    rate = (2.0 * (fifth - first) + fourth - second) / (10.0 * step)
    bend = (2.0 * (first + fifth) - second - 2.0 * third - fourth) / (7.0 * step * step)
    return rate, bend
