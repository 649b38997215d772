"""A blade on a carriage against an elastic disc, integrated in substeps; what the law controls.

Written for the tests alone: nothing of it is shared with the law, its gains or the virtual rig.
Everything is plain Python on numbers; a tick is `SUBSTEPS` steps of the midpoint rule.
"""

import math
from collections import deque
from dataclasses import dataclass, field

SUBSTEPS = 20


@dataclass(frozen=True)
class Blade:
    """A blade of length `length` on a carriage; its centre of mass is off the pivot.

    `dry` friction builds up over `bristle` of motion (Dahl). `coupling` is mass times distance of
    the centre of mass. Efforts act `delay_s` after the sample that they answer, behind motors of
    first order. Steps are those of the encoders.
    """

    length: float = 0.07
    inertia: float = 2e-4
    mass: float = 0.8
    coupling: float = 5e-4
    viscous: tuple[float, float] = (5e-4, 2.0)
    dry: tuple[float, float] = (5e-3, 0.8)
    bristle: tuple[float, float] = (3e-4, 2e-5)
    step: tuple[float, float] = (4.8e-5, 1e-6)
    delay_s: float = 0.0
    lag_s: float = 1.5e-3
    force_lag_s: float = 0.0


@dataclass(frozen=True)
class Disc:
    """An elastic disc: the point presses on it from outside. It may move up and down."""

    centre: tuple[float, float] = (0.05, 0.0)
    radius: float = 0.02
    stiffness: float = 1e4
    damping: float = 0.0
    friction: float = 0.0
    swing_m: float = 0.0
    swing_Hz: float = 1.0

    def raised(self, time: float) -> tuple[float, float]:
        """Height above the centre's place at rest, and its rate."""
        turn = 2.0 * math.pi * self.swing_Hz
        return self.swing_m * math.sin(turn * time), self.swing_m * turn * math.cos(turn * time)


@dataclass
class Plant:
    """The moving state; `tick` advances it under efforts that were given before."""

    blade: Blade
    disc: Disc
    tick_s: float = 1e-3
    place: list[float] = field(default_factory=lambda: [0.4, 0.0])
    time: float = 0.0

    def __post_init__(self) -> None:
        self.state = [*self.place, *[0.0] * 7]  # q, qd, motors, bristles, sensed force
        self.waiting: deque[tuple[float, tuple[float, float]]] = deque()
        self.effort = (0.0, 0.0)
        self.pressed = 0.0
        self.peak = 0.0

    def measured(self) -> tuple[float, float]:
        """Places as the encoders count them."""
        first, second = (
            step * math.floor(value / step + 0.5) if step else value
            for value, step in zip(self.state[:2], self.blade.step, strict=True)
        )
        return first, second

    def sensed(self) -> float:
        """Pressing force as its sensor gives it."""
        return self.state[8] if self.blade.force_lag_s else self.force()

    def force(self) -> float:
        """True pressing force, N."""
        return self._contact(self.state)[0]

    def gap(self) -> float:
        """True gap, below 0 where the point presses, m."""
        return self._contact(self.state)[3]

    def point(self) -> tuple[float, float]:
        """True place of the point, m."""
        opening, advance = self.state[:2]
        along, up = math.cos(opening), math.sin(opening)
        return advance + self.blade.length * along, self.blade.length * up

    def give(self, effort: tuple[float, float]) -> None:
        """Send an effort now; it acts after the delay."""
        self.waiting.append((self.time + self.blade.delay_s, effort))

    def tick(self) -> None:
        """Advance by a tick."""
        dt = self.tick_s / SUBSTEPS
        half = 0.5 * dt
        for _ in range(SUBSTEPS):
            while self.waiting and self.waiting[0][0] <= self.time + 1e-9:
                self.effort = self.waiting.popleft()[1]
            a, b, c, d, e, f, g, h, i = self.state
            da, db, dc, dd, de, df, dg, dh, di = self._slope(self.state)
            self.peak = max(self.peak, self.pressed)
            middle = [
                *(a + half * da, b + half * db, c + half * dc, d + half * dd, e + half * de),
                *(f + half * df, g + half * dg, h + half * dh, i + half * di),
            ]
            self.time += half
            da, db, dc, dd, de, df, dg, dh, di = self._slope(middle)
            self.state = [
                *(a + dt * da, b + dt * db, c + dt * dc, d + dt * dd, e + dt * de),
                *(f + dt * df, g + dt * dg, h + dt * dh, i + dt * di),
            ]
            self.time += half

    def _contact(self, state: list[float]) -> tuple[float, float, float, float]:
        """Pressing force, the force on the point (x, y), and the gap."""
        opening, advance, turning, moving = state[:4]
        length, disc = self.blade.length, self.disc
        raised, rising = disc.raised(self.time) if disc.swing_m else (0.0, 0.0)
        sine, cosine = length * math.sin(opening), length * math.cos(opening)
        x = advance + cosine - disc.centre[0]
        y = sine - disc.centre[1] - raised
        away = math.hypot(x, y)
        gap = away - disc.radius
        if gap >= 0.0:
            return 0.0, 0.0, 0.0, gap
        nx, ny = x / away, y / away
        vx = moving - sine * turning
        vy = cosine * turning - rising
        force = -disc.stiffness * gap - disc.damping * (vx * nx + vy * ny)
        if force < 0.0:
            force = 0.0
        if not disc.friction:
            return force, force * nx, force * ny, gap
        rub = -disc.friction * force * math.tanh((vy * nx - vx * ny) / 5e-4)
        return force, force * nx - rub * ny, force * ny + rub * nx, gap

    def _slope(self, state: list[float]) -> tuple[float, ...]:
        """Rates of the state, written out: it is what the tests of this folder spend."""
        opening, _, turning, moving, motor, drive, bent, pulled, seen = state
        blade = self.blade
        sine, cosine = math.sin(opening), math.cos(opening)
        force, fx, fy, _ = self._contact(state)
        self.pressed = force
        wanted, wanted_drive = self.effort
        lag = blade.lag_s
        if not lag:
            motor, drive = wanted, wanted_drive
        torque = motor - blade.viscous[0] * turning - blade.dry[0] * bent
        push = drive - blade.viscous[1] * moving - blade.dry[1] * pulled
        torque += blade.length * (cosine * fy - sine * fx)
        push += fx + blade.coupling * cosine * turning * turning
        off = -blade.coupling * sine
        determinant = blade.inertia * blade.mass - off * off
        return (
            turning,
            moving,
            (blade.mass * torque - off * push) / determinant,
            (blade.inertia * push - off * torque) / determinant,
            (wanted - motor) / lag if lag else 0.0,
            (wanted_drive - drive) / lag if lag else 0.0,
            (turning - abs(turning) * bent) / blade.bristle[0],
            (moving - abs(moving) * pulled) / blade.bristle[1],
            (force - seen) / blade.force_lag_s if blade.force_lag_s else 0.0,
        )
