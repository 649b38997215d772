"""Contacts of the blade's tip from a rig's samples: where the tip is, and how hard it presses."""

import math
from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from scissorcal.aliases import Array
from scissorcal.model.blade_point import BladePoint
from scissorcal.model.friction import AxisLaw

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
