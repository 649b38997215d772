"""Blades and carriage: inertia, viscous and dry friction, stops; a hand and a sheet act on them."""

import math
from dataclasses import dataclass

SUBSTEPS = 4


@dataclass
class Axis:
    """One coordinate with dry friction that sticks; explicit Euler with friction as an impulse."""

    inertia: float
    viscous: float
    dry: float
    low: float
    high: float
    place: float
    rate: float = 0.0

    def push(self, effort: float, dt: float) -> None:
        """Let an effort act for ``dt``."""
        rate = self.rate + dt * (effort - self.viscous * self.rate) / self.inertia
        loss = dt * self.dry / self.inertia
        self.rate = 0.0 if abs(rate) <= loss else rate - math.copysign(loss, rate)
        self.place += dt * self.rate
        if not self.low <= self.place <= self.high:
            self.place = min(max(self.place, self.low), self.high)
            self.rate = 0.0

    @property
    def at_stop(self) -> bool:
        return self.place <= self.low or self.place >= self.high


@dataclass
class Hand:
    """A hand that swings the handles between two openings (rad), as a spring and a damper."""

    low: float = 0.25
    high: float = 0.75
    period_s: float = 2.0
    stiffness: float = 6.0
    damping: float = 0.08
    strokes: int = 4

    def torque(self, time_s: float, opening: float, rate: float) -> float:
        """Torque on the blades (N m), positive where it opens them."""
        turn = 2.0 * math.pi / self.period_s
        phase = min(time_s * turn, 2.0 * math.pi * self.strokes)
        half = 0.5 * (self.high - self.low)
        wanted = self.low + half * (1.0 + math.cos(phase))
        moving = phase < 2.0 * math.pi * self.strokes
        wanted_rate = -half * turn * math.sin(phase) if moving else 0.0
        return self.stiffness * (wanted - opening) + self.damping * (wanted_rate - rate)


@dataclass
class Sheet:
    """A sheet that resists closing like a spring until it is cut at a constant torque.

    The cut tip lies ``reach`` (m) before the pivot for closed blades, less for open ones.
    """

    torque: float = 0.12
    give: float = 0.8e-3
    reach: float = 0.08
    length: float = 0.2
    cut: float = 0.0

    def resists(self, opening: float, advance: float) -> float:
        """Torque on the blades (N m, opens them) at this place; the cut grows where it must."""
        edge = advance + self.reach * (1.0 - opening)
        pressed = edge - self.cut
        if pressed <= 0.0 or not 0.0 <= edge <= self.length:
            return 0.0
        if pressed > self.give:
            self.cut = edge - self.give
            pressed = self.give
        return self.torque * pressed / self.give
