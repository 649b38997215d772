"""Rates, PID and limits of the servo in plain Python and float64: truth of the golden vectors."""

import math
from dataclasses import dataclass, field

from scissorcal.kernel import ServoConfig

ENABLE = 1


@dataclass
class ReferenceServo:
    """TRACK and DAMP without faults; ``reference`` is (opening, rate, advance) per tick."""

    config: ServoConfig
    reference: list[tuple[float, float, float]] = field(default_factory=list)
    mode: str = "idle"
    rates: list[float] = field(default_factory=lambda: [0.0, 0.0])
    integrals: list[float] = field(default_factory=lambda: [0.0, 0.0])
    sent: list[float] = field(default_factory=lambda: [0.0, 0.0])
    last: tuple[int, int, float, float] | None = None
    engaged_at: int | None = None

    def engage(self, mode: str) -> None:
        self.mode = mode
        self.engaged_at = None
        self.integrals = [0.0, 0.0]

    def step(self, sequence: int, us: int, opening: float, advance: float) -> tuple[float, ...]:
        """Torque, force and the estimated rates."""
        dt = self._measure(sequence, us, opening, advance)
        if self.engaged_at is None:
            self.engaged_at = sequence
        if self.mode == "idle":
            self.sent = [0.0, 0.0]
            return (0.0, 0.0, *self.rates)
        wanted = [0.0, 0.0]
        if self.mode == "damp":
            wanted[0] = -self.config.damping_Nm_s_per_rad * self.rates[0]
        elif self.mode == "track":
            wanted = self._track((sequence - self.engaged_at) % 2**32, opening, advance, dt)
        c = self.config
        limits = ((c.torque_limit, c.torque_slew), (c.force_limit, c.force_slew))
        for axis, (limit, slew) in enumerate(limits):
            change = slew * self.config.tick_us * 1e-6
            aim = min(max(wanted[axis], -limit), limit)
            low, high = self.sent[axis] - change, self.sent[axis] + change
            self.sent[axis] = min(max(aim, low), high)
        return (*self.sent, *self.rates)

    def _measure(self, sequence: int, us: int, opening: float, advance: float) -> float:
        last, self.last = self.last, (sequence, us, opening, advance)
        if last is None:
            return 0.0
        by_ticks = (sequence - last[0]) % 2**32 * self.config.tick_us
        stated = (us - last[1] + 2**31) % 2**32 - 2**31
        passed = stated if by_ticks <= 2 * stated <= 4 * by_ticks else by_ticks
        weight = 2 * math.pi * self.config.rate_cutoff_Hz * passed * 1e-6
        share = weight / (1 + weight) if self.config.rate_cutoff_Hz > 0 else 1.0
        for axis, moved in enumerate((opening - last[2], advance - last[3])):
            self.rates[axis] += share * (moved / (passed * 1e-6) - self.rates[axis])
        return min(passed * 1e-6, 0.01)

    def _track(self, index: int, opening: float, advance: float, dt: float) -> list[float]:
        c = self.config
        at = min(index, len(self.reference) - 1)
        aim, aim_rate, aim_advance = self.reference[at]
        advance_rate = 0.0
        if at + 1 < len(self.reference):
            advance_rate = (self.reference[at + 1][2] - aim_advance) / (c.tick_us * 1e-6)
        else:
            aim_rate = 0.0
        axes = (
            (c.opening_kp, c.opening_kd, c.opening_ki, c.torque_limit),
            (c.advance_kp, c.advance_kd, c.advance_ki, c.force_limit),
        )
        errors = (aim - opening, aim_advance - advance)
        slips = (aim_rate - self.rates[0], advance_rate - self.rates[1])
        wanted = []
        for axis, (kp, kd, ki, limit) in enumerate(axes):
            grown = self.integrals[axis] + ki * errors[axis] * dt
            direct = kp * errors[axis] + kd * slips[axis]
            runs_away = abs(direct + grown) > limit and errors[axis] * (direct + grown) > 0
            if not runs_away:
                self.integrals[axis] = min(max(grown, -limit), limit)
            wanted.append(direct + self.integrals[axis])
        return wanted
