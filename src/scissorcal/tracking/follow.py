"""Follow a plate live: pictures and contacts, each by its own clock, into one filter."""

import math
from collections import Counter, deque
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from scissorcal.aliases import Array
from scissorcal.model.surface import Surface
from scissorcal.tracking.clocks import ClockFit, ClockWatch
from scissorcal.tracking.rows import CameraPose, TipContact
from scissorcal.tracking.settings import TrackingSettings
from scissorcal.tracking.tracker import Outcome, PoseEstimate, PoseTracker

RECENT_S = 0.5
"""A pose rests on what came within so long."""
CAMERA_REMEDY = "Use another camera or driver."
RIG_REMEDY = "Restart the device, and check its clock with 'scissorcal device doctor'."

_MOST_ROWS = 30_000


@dataclass(frozen=True, eq=False)
class FollowedRow:
    """One row that the filter was given, and what it knew after it.

    ``source`` is "picture" or "contact". ``estimate`` is None while there is no pose.
    """

    source: str
    time_s: float
    outcome: Outcome
    nis: float
    state: str
    estimate: PoseEstimate | None
    contact: TipContact | None = None


class ContactSource(Protocol):
    """What makes contacts of a rig's samples, as `TipContacts` does."""

    def place(self, opening: float, advance: float) -> Array: ...

    def take(
        self, time_s: Array, opening: Array, advance: Array, drive: Array, normal: Array
    ) -> list[TipContact]: ...


class PoseFollower:
    """Feeds a `PoseTracker` from a camera and a rig whose clocks are measured while it runs.

    The filter's time is the rig's, where there is one, else the camera's. ``camera_delay_s`` passes
    from a picture's exposure to its soonest arrival, which no times of arrival can show.
    ``contacts`` makes contacts of the rig's samples; without it, and while ``touching`` is False,
    samples only tell the time.
    Raises what `ClockWatch.add` does.
    """

    def __init__(
        self,
        surface: Surface,
        settings: TrackingSettings,
        *,
        camera_delay_s: float = 0.0,
        rig: bool = False,
        contacts: ContactSource | None = None,
    ) -> None:
        self.camera = ClockWatch("The camera's clock", CAMERA_REMEDY)
        self.rig = _rig_clock() if rig else None
        self.tracker = PoseTracker(surface, settings)
        self.outcomes: Counter[tuple[str, Outcome]] = Counter()
        self.nis: dict[str, list[float]] = {"picture": [], "contact": []}
        self.pictures: deque[CameraPose] = deque(maxlen=_MOST_ROWS)
        self.contacts: deque[TipContact] = deque(maxlen=_MOST_ROWS)
        self.away: tuple[float, float] | None = None
        self.touching = True
        self._surface = surface
        self._settings = settings
        self._delay_s = camera_delay_s
        self._tip = contacts
        self._now_s = -math.inf
        self._before: ClockFit | None = None

    def assume(self, settings: TrackingSettings) -> None:
        """Take other settings, before there is a pose: those that the first picture tells of."""
        if self.tracker.started:
            raise ValueError("settings cannot change once there is a pose")
        self._settings = settings
        self.tracker = PoseTracker(self._surface, settings)

    def start(self, rotation: Array, place_m: Array, covariance: Array) -> FollowedRow | None:
        """Begin with a pose that is known from elsewhere, without a camera.

        None while the rig has sent no time.
        """
        if not math.isfinite(self._now_s):
            return None
        pose = CameraPose(self._now_s, rotation, place_m, covariance)
        outcome, nis = self.tracker.picture(pose)
        return self._row("picture", self._now_s, outcome, nis)

    def restart_rig(self) -> None:
        """Expect that the rig's clock begins anew with the next samples, as by a new motion.

        The pose stays, and the jump is not held against the clock.
        """
        if self.rig is not None and self.rig.known:
            self._before, self.rig = self.rig.fit, _rig_clock()

    def samples(
        self, device_s: Array, host_s: Array, opening: Array, advance: Array, drive: Array
    ) -> list[FollowedRow]:
        """Take a rig's samples, (n,) each, as `TipContacts.take`; ``host_s`` is when they came."""
        if self.rig is None or not len(device_s):
            return []
        begun = self.rig.begun_anew
        before = self._line()
        self.rig.add(device_s, host_s)
        if before is not None and (self._before is not None or self.rig.begun_anew > begun):
            self._shift(self.rig.fit.own(float(host_s[-1])) - before.own(float(host_s[-1])))
        self._before = None
        self._now_s = max(self._now_s, float(device_s[-1]))
        if self._tip is None or not self.touching:
            return []
        normal = self._normal(float(opening[-1]), float(advance[-1]))
        contacts = self._tip.take(device_s, opening, advance, drive, normal)
        return [self._contact(contact) for contact in contacts]

    def picture(self, pose: CameraPose, arrived_s: float) -> FollowedRow | None:
        """Take a picture's pose; None while the rig has sent no time to put it at.

        Its ``time_s`` is the camera's stamp, ``arrived_s`` the host's time of its arrival.
        """
        stamp_s = pose.time_s
        begun = self.camera.begun_anew
        before = self.camera.fit if self.tracker.started else None
        self.camera.add([stamp_s], [arrived_s])
        if self.rig is None and before is not None and self.camera.begun_anew > begun:
            self._shift(self.camera.fit.own(arrived_s) - before.own(arrived_s))
        time, sd = self.exposed(stamp_s)
        if math.isnan(time):
            return None
        plate = self._settings.plate
        moved = np.repeat([plate.spin_rad_per_s, plate.speed_m_per_s], 3) * sd
        pose = replace(pose, time_s=time, covariance=pose.covariance + np.diag(moved**2))
        self.pictures.append(pose)
        outcome, nis = self.tracker.picture(pose)
        self._now_s = max(self._now_s, time)
        return self._row("picture", time, outcome, nis)

    def blank(self, stamp_s: float) -> None:
        """Take a picture without a pose: time passes, and the pose is known less and less."""
        if self.tracker.started and self.camera.known:
            time, _ = self.exposed(stamp_s)
            self._now_s = max(self._now_s, time)

    def exposed(self, stamp_s: float) -> tuple[float, float]:
        """The filter's time of a picture's exposure, and its standard deviation (s).

        The soonest arrivals are taken to come ``camera_delay_s`` after the exposure, and at once
        from the rig. NaN while the rig has sent no time.
        """
        fit = self.camera.fit
        if self.rig is None:
            return stamp_s - self._delay_s, 0.0
        rig = self._line()
        if rig is None:
            return math.nan, math.nan
        host = fit.host(stamp_s) - self._delay_s
        time = rig.own(host)
        return time, math.hypot(fit.sd_s(stamp_s), rig.sd_s(time))

    @property
    def picture_noise(self) -> Array:
        """Covariance (6, 6) of what is new in the newest picture. IndexError without one."""
        return self.pictures[-1].covariance

    def now(self) -> PoseEstimate | None:
        """The pose at the newest time that came; None while there is none."""
        return self.tracker.estimate(self._now_s) if self.tracker.started else None

    def estimate(self, host_s: float) -> PoseEstimate | None:
        """The pose at a time of the host's clock; None while there is none.

        Its ``time_s`` is the filter's.
        """
        if not self.tracker.started:
            return None
        rig = self._line()
        if rig is not None:
            return self.tracker.estimate(rig.own(host_s))
        return self.tracker.estimate(self.camera.fit.own(host_s + self._delay_s) - self._delay_s)

    @property
    def state(self) -> str:
        """What the pose rests on: waiting, fused, pictures, contacts or coasting."""
        now = self.now()
        return _state(now) if now else "waiting"

    def _line(self) -> ClockFit | None:
        """The rig's clock, as it was before a restart until it has sent a time again."""
        return self.rig.fit if self.rig is not None and self.rig.known else self._before

    def _shift(self, by_s: float) -> None:
        """Put what is known at the times of a clock that has begun anew, ``by_s`` later."""
        self.tracker.shift_time(by_s)
        self._now_s += by_s
        for known in (self.pictures, self.contacts):
            for _ in range(len(known)):  # once round
                row = known.popleft()
                known.append(replace(row, time_s=row.time_s + by_s))  # type: ignore[arg-type]

    def _contact(self, contact: TipContact) -> FollowedRow:
        self.contacts.append(contact)
        outcome, nis = self.tracker.contact(
            contact.time_s, contact.point_m, contact.force_N, hidden_N=contact.hidden_N
        )
        row = self._row("contact", contact.time_s, outcome, nis, contact)
        if outcome is Outcome.REFUSED and row.estimate is not None:
            away = self._away(contact, row.estimate)
            self.away = away, abs(away) / math.sqrt(nis)
        return row

    def _row(
        self,
        source: str,
        time: float,
        outcome: Outcome,
        nis: float,
        contact: TipContact | None = None,
    ) -> FollowedRow:
        self.outcomes[source, outcome] += 1
        if outcome in (Outcome.USED, Outcome.REFUSED):
            self.nis[source].append(nis)
        now = None
        if self.tracker.started:
            now = self.tracker.estimate(time if contact else self._now_s)
        state = _state(now) if now else "waiting"
        return FollowedRow(source, time, outcome, nis, state, now, contact)

    def _normal(self, opening: float, advance: float) -> Array:
        """The plate's normal under the tip, in the rig's frame; the rig's y without a pose."""
        if self._tip is None or not self.tracker.started:
            return np.array([0.0, 1.0, 0.0])
        estimate = self.tracker.estimate()
        local = (self._tip.place(opening, advance) - estimate.place_m) @ estimate.rotation
        gradient = self._surface.at(local).gradient
        return np.asarray(estimate.rotation @ (gradient / np.linalg.norm(gradient)))

    def _away(self, contact: TipContact, estimate: PoseEstimate) -> float:
        """How far a contact is outside of where the pressed surface is expected, in m."""
        here = self._surface.at((contact.point_m - estimate.place_m) @ estimate.rotation)
        gap = here.level / float(np.linalg.norm(here.gradient))
        return gap + estimate.compliance_m_per_N * contact.force_N - estimate.contact_offset_m


def _rig_clock() -> ClockWatch:
    return ClockWatch("The rig's clock", RIG_REMEDY)


def _state(estimate: PoseEstimate) -> str:
    seen, felt = estimate.picture_age_s < RECENT_S, estimate.contact_age_s < RECENT_S
    if seen and felt:
        return "fused"
    return "pictures" if seen else "contacts" if felt else "coasting"
