"""Blade on sheet: the edge's place over the crack tip, and every force that follows from it.

All forces are gradients of one stored energy E(theta, x_n, X) = m w(s) G(delta), with G the
integral of the response, s the station on the blade above the crack tip, and w a weight that is 1
along the blade and fades to 0 beyond its tip. So nothing that the simulation does to the blades
can make energy: torque = -dE/d(theta), force on the pivot = -dE/d(x_n), and -dE/dX drives the
crack.
"""

import math
from typing import NamedTuple

from scissorcal.device.sim.material import Response
from scissorcal.device.sim.specimen import Specimen


class Touch(NamedTuple):
    """What the edge does at the crack tip.

    ``torque`` (N m) opens the blades; ``drive`` (N) = -dE/dX, and the force on the pivot is its
    negative; ``lever`` = d(phi)/d(beta) (m) and ``slope`` = tan(psi) turn rates into the rate of
    indentation; ``share`` is the tip's weight w.
    """

    torque: float
    drive: float
    lever: float
    slope: float
    share: float


APART = Touch(0.0, 0.0, 0.0, 0.0, 0.0)


class BladeOnSheet:
    """The exact contact law of one specimen. Angles in rad, lengths in m, forces in N."""

    __slots__ = (
        "curvature",
        "fade",
        "length",
        "moving",
        "offset",
        "response",
        "taper",
        "upper_face",
    )

    def __init__(self, specimen: Specimen) -> None:
        blade = specimen.blade
        self.moving = float(blade.moving_blades)
        self.offset = blade.offset_mm * 1e-3
        self.taper = math.tan(math.radians(blade.taper_deg))
        self.curvature = blade.curvature_per_m
        self.length = blade.length_mm * 1e-3
        self.fade = blade.tip_fade_mm * 1e-3
        self.upper_face = specimen.upper_face_m
        self.response = Response(specimen.material)

    def touch(self, opening: float, contact: float) -> Touch:
        """Forces with the crack tip ``contact`` metres from the pivot."""
        beta = opening / self.moving
        sine = math.sin(beta)
        cosine = math.cos(beta)
        station = self._station(sine, cosine, contact)
        beyond = station - self.length
        if beyond >= self.fade:
            return APART
        bend = self.curvature * station if station > 0.0 else 0.0
        edge = self.offset + station * (self.taper + 0.5 * bend)
        height = station * sine + edge * cosine
        indentation = self.upper_face - height
        if indentation <= 0.0:
            return APART
        taper = self.taper + bend
        run = cosine - taper * sine
        slope = (sine + taper * cosine) / run
        lever = contact + height * slope
        force = self.response.force(indentation)
        if beyond <= 0.0:
            return Touch(force * lever, self.moving * force * slope, lever, slope, 1.0)
        weight, grade = self._fading(beyond)
        lost = grade * self.response.energy(indentation) / run
        return Touch(
            weight * force * lever - lost * height,
            self.moving * (weight * force * slope - lost),
            lever,
            slope,
            weight,
        )

    def indentation(self, opening: float, contact: float) -> float:
        """How deep the edge stands below the sheet's upper face; negative where it is above."""
        beta = opening / self.moving
        sine, cosine = math.sin(beta), math.cos(beta)
        station = self._station(sine, cosine, contact)
        bend = self.curvature * station if station > 0.0 else 0.0
        edge = self.offset + station * (self.taper + 0.5 * bend)
        return self.upper_face - station * sine - edge * cosine

    def energy(self, opening: float, contact: float) -> float:
        """Energy in joules that the sheet stores, all moving blades together."""
        beta = opening / self.moving
        beyond = self._station(math.sin(beta), math.cos(beta), contact) - self.length
        weight = 1.0 if beyond <= 0.0 else self._fading(beyond)[0]
        if weight == 0.0:
            return 0.0
        return self.moving * weight * self.response.energy(self.indentation(opening, contact))

    def crossing(self, opening: float) -> float:
        """Distance from the pivot at which the edge passes the sheet's upper face.

        From s sin(beta) + e(s) cos(beta) = y_top, quadratic in s; inf where the edge never
        comes up.
        """
        beta = opening / self.moving
        sine, cosine = math.sin(beta), math.cos(beta)
        rise = self.upper_face - self.offset * cosine
        grade = sine + self.taper * cosine
        below = grade * grade + 2.0 * (self.curvature if rise > 0.0 else 0.0) * cosine * rise
        if below < 0.0:
            return math.inf
        base = grade + math.sqrt(below)
        if base <= 0.0:
            return math.inf
        station = 2.0 * rise / base
        bend = self.curvature * station if station > 0.0 else 0.0
        edge = self.offset + station * (self.taper + 0.5 * bend)
        return station * cosine - edge * sine

    def _station(self, sine: float, cosine: float, contact: float) -> float:
        """Solve contact = s cos(beta) - e(s) sin(beta), a quadratic in s, for its near root.

        Written so that it neither divides by the curvature nor cancels. Behind the pivot the
        edge goes on straight. Where a curved edge never stands over ``contact``, a station beyond
        its tip is given.
        """
        run = cosine - self.taper * sine
        reach = contact + self.offset * sine
        if self.curvature == 0.0 or reach <= 0.0:
            return reach / run
        below = run * run - 2.0 * self.curvature * sine * reach
        return 2.0 * reach / (run + math.sqrt(below)) if below > 0.0 else 2.0 * reach / run

    def _fading(self, beyond: float) -> tuple[float, float]:
        """Weight w and its derivative with the station, ``beyond`` metres past the blade's tip."""
        along = beyond / self.fade
        if along >= 1.0:
            return 0.0, 0.0
        weight = 1.0 - along * along * (3.0 - 2.0 * along)
        return weight, -6.0 * along * (1.0 - along) / self.fade
