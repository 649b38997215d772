"""A plate's pose from pictures that come late and contacts that come at once."""

import math
from bisect import bisect_right
from dataclasses import dataclass, replace
from enum import Enum

import numpy as np

from scissorcal.aliases import Array
from scissorcal.errors import InputError
from scissorcal.model.surface import Surface
from scissorcal.tracking.filter import (
    COMPLIANCE,
    FRICTION,
    OFFSET,
    PLACE,
    POSE,
    RATES,
    FilterState,
    predict,
    start_state,
    update,
    update_by_one,
)
from scissorcal.tracking.rows import (
    CameraPose,
    Contact,
    ForceDirection,
    camera_row,
    contact_row,
    force_row,
)
from scissorcal.tracking.settings import TrackingSettings

Row = CameraPose | Contact | ForceDirection


class Outcome(Enum):
    """What became of a row."""

    USED = "used"
    REFUSED = "refused: farther from the prediction than 99.9 % of such rows"
    RESTARTED = "the filter started again from this picture"
    WAITING = "no pose to start from yet"
    TOO_LATE = "older than the horizon"
    NO_CONTACT = "the force is too small for a contact"


@dataclass(frozen=True)
class Counts:
    """Rows so far: used, refused by the gate, too late; and how often the filter began again."""

    pictures: int = 0
    refused_pictures: int = 0
    late_pictures: int = 0
    contacts: int = 0
    refused_contacts: int = 0
    restarts: int = 0


@dataclass(frozen=True)
class PoseEstimate:
    """The plate's pose in the rig's frame at ``time_s``, and what else the filter knows.

    ``covariance`` (6, 6) is of a rotation vector (rad) and of the place (m), in the rig's axes;
    ``rates`` (6,) turn (rad/s) and move (m/s). ``picture_age_s`` and ``contact_age_s`` are the
    times since the last such row that was used, infinite without one.
    """

    time_s: float
    rotation: Array
    place_m: Array
    covariance: Array
    rates: Array
    contact_offset_m: float
    compliance_m_per_N: float
    compliance_sd_m_per_N: float
    friction: float
    picture_age_s: float
    contact_age_s: float
    counts: Counts


class PoseTracker:
    """Follows a plate whose shape is ``surface``, by ``settings``.

    Rows may come in any order within the horizon: a late one is applied at its own time, and what
    came after it again (rewind and replay). The state after each row of the last ``horizon_s``
    is kept for that. A row beyond the gate is refused; after a run of refused certain pictures, or
    of refused contacts, the filter starts again from the next certain picture.

    >>> from scissorcal.model.surface import Plane
    >>> tracker = PoseTracker(Plane())
    >>> seen = CameraPose(0.0, np.eye(3), np.zeros(3), 1e-6 * np.eye(6))
    >>> tracker.picture(seen)[0].name
    'RESTARTED'
    >>> tracker.estimate(0.1).place_m
    array([0., 0., 0.])
    """

    def __init__(self, surface: Surface, settings: TrackingSettings | None = None) -> None:
        self._surface = surface
        self._settings = settings or TrackingSettings()
        self._times: list[float] = []
        self._rows: list[Row] = []
        self._states: list[FilterState] = []
        self._counts = Counts()
        self._refused_pictures = 0
        self._refused_contacts = 0
        self._restart = True
        self._smooth_force = math.nan
        self._last_contact_s = math.nan
        self._used_picture_s = self._used_contact_s = -math.inf
        self._felt: list[tuple[Array, Array, Array]] = []
        self._felt_since_s = math.nan

    @property
    def started(self) -> bool:
        """Whether there is a pose."""
        return bool(self._states)

    def picture(self, pose: CameraPose) -> tuple[Outcome, float]:
        """Take a picture's pose, at the time of its exposure; its outcome and its NIS.

        Raises InputError where it is no pose.
        """
        _check(
            "The picture's pose", pose.time_s, pose.rotation, pose.place_m, np.diag(pose.covariance)
        )
        if self._restart or not self.started:
            if not pose.certain:
                return Outcome.WAITING, math.nan
            self._begin(pose)
            return Outcome.RESTARTED, math.nan
        if pose.time_s < self._times[0]:
            self._counts = replace(self._counts, late_pictures=self._counts.late_pictures + 1)
            return Outcome.TOO_LATE, math.nan
        nis, used = self._insert(pose)
        if used:
            self._refused_pictures = 0
            self._used_picture_s = max(self._used_picture_s, pose.time_s)
            self._counts = replace(self._counts, pictures=self._counts.pictures + 1)
            return Outcome.USED, nis
        self._refused_pictures += int(pose.certain)
        refused = self._counts.refused_pictures + 1
        self._counts = replace(self._counts, refused_pictures=refused)
        self._restart = self._refused_pictures >= self._settings.camera.refused_until_restart
        return Outcome.REFUSED, nis

    def contact(
        self,
        time_s: float,
        point_m: Array,
        force_N: float,
        force_vector_N: Array | None = None,
        velocity_m_per_s: Array | None = None,
        hidden_N: float = 0.0,
    ) -> tuple[Outcome, float]:
        """Take a contact at a place (3,) in the rig's frame, with its force along the normal.

        What of the force may be dry friction, ``hidden_N``, does not count towards the least of a
        contact: blades that stand in the air touch nothing. Where a sensor measures all of the
        force on the tool, ``force_vector_N`` (3,) and the tip's ``velocity_m_per_s`` (3,) tell the
        normal's direction as well. Raises InputError where a number is not finite.
        """
        _check("The contact", time_s, point_m, np.array([force_N]))
        contact = self._smoothed(time_s, point_m, force_N)
        if force_N - hidden_N < self._settings.contact.least_force_N:
            return Outcome.NO_CONTACT, math.nan
        if not self.started:
            return Outcome.WAITING, math.nan
        if time_s < self._times[0]:
            return Outcome.TOO_LATE, math.nan
        nis, used = self._insert(contact)
        if used:
            self._refused_contacts = 0
            self._used_contact_s = max(self._used_contact_s, time_s)
            self._counts = replace(self._counts, contacts=self._counts.contacts + 1)
        else:
            self._refused_contacts += 1
            refused = self._counts.refused_contacts + 1
            self._counts = replace(self._counts, refused_contacts=refused)
            if self._refused_contacts >= self._settings.contact.refused_until_restart:
                self._restart = True
        if force_vector_N is not None and velocity_m_per_s is not None:
            self._feel(time_s, point_m, force_vector_N, velocity_m_per_s)
        return (Outcome.USED if used else Outcome.REFUSED), nis

    def estimate(self, time_s: float | None = None) -> PoseEstimate:
        """The pose at a time, by default that of the last row. Raises InputError without any."""
        if not self.started:
            raise InputError(
                "There is no pose of the plate yet: show the camera its target, without its "
                "mirrored pose being as likely (closer, or at a larger tilt)."
            )
        state = self._states[-1].copy()
        if time_s is not None:
            predict(state, self._settings, time_s)
        return PoseEstimate(
            time_s=state.time_s,
            rotation=state.rotation,
            place_m=state.mean[PLACE],
            covariance=state.covariance[POSE, POSE],
            rates=state.mean[RATES],
            contact_offset_m=float(state.mean[OFFSET]),
            compliance_m_per_N=float(state.mean[COMPLIANCE]),
            compliance_sd_m_per_N=math.sqrt(float(state.covariance[COMPLIANCE, COMPLIANCE])),
            friction=float(state.mean[FRICTION]),
            picture_age_s=state.time_s - self._used_picture_s,
            contact_age_s=state.time_s - self._used_contact_s,
            counts=self._counts,
        )

    def shift_time(self, by_s: float) -> None:
        """Take all times for so much later: the clock that they are told by has begun anew."""
        self._times = [time + by_s for time in self._times]
        self._rows = [replace(row, time_s=row.time_s + by_s) for row in self._rows]
        for state in self._states:
            state.time_s += by_s
        self._last_contact_s += by_s
        self._used_picture_s += by_s
        self._used_contact_s += by_s
        self._felt_since_s += by_s

    def _begin(self, pose: CameraPose) -> None:
        state = start_state(
            self._settings, pose.time_s, pose.rotation, pose.place_m, pose.covariance
        )
        again = self._counts.restarts + (1 if self.started else 0)
        self._counts = replace(self._counts, pictures=self._counts.pictures + 1, restarts=again)
        later = [row for row in self._rows if row.time_s > pose.time_s]
        self._times, self._rows, self._states = [pose.time_s], [pose], [state]
        self._refused_pictures = self._refused_contacts = 0
        self._restart = False
        self._felt = []
        self._used_picture_s, self._used_contact_s = pose.time_s, -math.inf
        for row in later:
            if not isinstance(row, CameraPose):
                self._insert(row)

    def _insert(self, row: Row) -> tuple[float, bool]:
        """Apply a row at its time, then again what is later; its own NIS and whether it counts."""
        at = bisect_right(self._times, row.time_s)
        state = self._states[at - 1].copy()
        nis, used = self._apply(state, row)
        self._times.insert(at, row.time_s)
        self._rows.insert(at, row)
        self._states.insert(at, state)
        for index in range(at + 1, len(self._rows)):
            state = state.copy()
            self._apply(state, self._rows[index])
            self._states[index] = state
        old = bisect_right(self._times, self._times[-1] - self._settings.horizon_s) - 1
        if old > 0:
            del self._times[:old], self._rows[:old], self._states[:old]
        return nis, used

    def _apply(self, state: FilterState, row: Row) -> tuple[float, bool]:
        predict(state, self._settings, row.time_s)
        if isinstance(row, CameraPose):
            return update(state, *camera_row(state, row), self._settings.camera.gate)
        if isinstance(row, ForceDirection):
            force = force_row(state, row, self._surface, self._settings.force)
            return update(state, *force, self._settings.force.gate) if force else (math.nan, False)
        errors = self._settings.contact
        found = contact_row(state, row, self._surface, errors)
        return update_by_one(state, *found, errors.gate)

    def _smoothed(self, time_s: float, point_m: Array, force_N: float) -> Contact:
        """The contact with its force behind the filter, which begins anew after a pause."""
        since = time_s - self._last_contact_s
        filter_s = self._settings.contact.force_filter_s
        if not 0.0 < since < 10.0 * max(filter_s, 0.01) or math.isnan(self._smooth_force):
            self._smooth_force, since = force_N, 0.01 if not since > 0.0 else since
        else:
            keep = math.exp(-since / filter_s) if filter_s > 0.0 else 0.0
            self._smooth_force += (1.0 - keep) * (force_N - self._smooth_force)
        self._last_contact_s = time_s
        return Contact(time_s, np.asarray(point_m), force_N, self._smooth_force, since)

    def _feel(self, time_s: float, point: Array, force: Array, velocity: Array) -> None:
        """Collect force vectors; their mean is a row each ``every_s``."""
        errors = self._settings.force
        if errors.zero_sd_N is None:
            return
        _check("The force", time_s, force, velocity)
        if not self._felt:
            self._felt_since_s = time_s
        self._felt.append((point, force, velocity))
        if time_s - self._felt_since_s < errors.every_s:
            return
        middle = [np.mean(part, axis=0) for part in zip(*self._felt, strict=True)]
        halfway = 0.5 * (self._felt_since_s + time_s)
        count, self._felt = len(self._felt), []
        if halfway >= self._times[0]:
            self._insert(ForceDirection(halfway, middle[0], middle[1], middle[2], count))


def _check(what: str, time_s: float, *numbers: Array) -> None:
    if math.isfinite(time_s) and all(np.isfinite(array).all() for array in numbers):
        return
    raise InputError(
        f"{what} at {time_s:g} s has a number that is not finite: check the sensor and its cable; "
        "the row was not used."
    )
