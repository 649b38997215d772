"""What a random rig is: ranges of healthy ones, and what is wrong with the others."""

import math
from dataclasses import dataclass, replace

import numpy as np

TICKS_US = (250, 500, 1000, 1000, 1000, 2000, 4000)
SMALLEST_COUNTS, LARGEST_COUNTS = 4096, 4_000_000


@dataclass(frozen=True)
class RigParameters:
    """SI and radians; ``delay_ticks`` each way together; shares of commands or of time."""

    inertia: float = 3e-4
    coulomb_opening: float = 0.015
    coulomb_closing: float = 0.016
    viscous: float = 2e-3
    rise_share: float = 0.2
    rise_rate: float = 0.1
    fine_rad: float = 5e-4
    slow_rad: float = 5e-3
    slow_share: float = 0.0
    bristle_damping_share: float = 0.7
    gravity: float = 0.0
    gravity_phase: float = 0.5
    cogging: float = 0.0
    cogging_periods: float = 84.0
    counts: int = 20_000
    encoder_jitter_steps: float = 0.0
    torque_noise: float = 7e-4
    torque_offset: float = 0.0
    torque_step: float = 1e-4
    tick_us: int = 1000
    delay_ticks: int = 0
    motor_lag: float = 5e-4
    torque_limit: float = 0.5
    low: float = 0.02
    high: float = 1.05
    stalls_per_s: float = 0.0
    stall_s: float = 0.02
    # wrong
    motor_sign: float = 1.0
    encoder_sign: float = 1.0
    encoder_scale: float = 1.0
    encoder_zero: float = 0.0
    stuck: bool = False
    motor_gain: float = 1.0
    report_gain: float = 1.0
    commands_lost: float = 0.0
    clock: str = "right"
    backlash: float = 0.0
    obstacle: float = -1.0
    stated_radius: float = 0.06
    seed: int = 0

    @property
    def step(self) -> float:
        """The encoder's step (rad)."""
        return 2.0 * math.pi / self.counts

    @property
    def stalls_share(self) -> float:
        return self.stalls_per_s * self.stall_s


def healthy(seed: int) -> RigParameters:
    """A healthy rig of the ranges that DESIGN 16 tried, the same for the same seed."""
    rng = np.random.default_rng(seed)

    def log(low: float, high: float) -> float:
        return float(np.exp(rng.uniform(math.log(low), math.log(high))))

    dry = log(1e-3, 60e-3)
    tick = int(rng.choice(TICKS_US))
    two = bool(rng.random() < 0.5)
    fine = log(1e-4, 30e-3)
    slow = log(1e-4, 30e-3)
    gravity = rng.uniform(-0.02, 0.02) if rng.random() < 0.3 else 0.0
    jitter = log(0.3, 3.0) if rng.random() < 0.2 else 0.0
    stalls = rng.random() < 0.4
    asymmetry = rng.uniform(-0.15, 0.15)
    return RigParameters(
        inertia=log(5e-5, 3e-3),
        coulomb_opening=dry * (1.0 + asymmetry),
        coulomb_closing=dry * (1.0 - asymmetry),
        viscous=log(3e-4, 10e-3),
        rise_share=rng.uniform(0.0, 0.35),
        rise_rate=log(0.04, 0.3),
        fine_rad=min(fine, slow) if two else fine,
        slow_rad=max(fine, slow),
        slow_share=rng.uniform(0.15, 0.6) if two else 0.0,
        bristle_damping_share=log(0.4, 1.5),
        gravity=gravity,
        gravity_phase=rng.uniform(-0.5, 1.5),
        cogging=rng.uniform(0.0, 0.05) * dry if rng.random() < 0.5 else 0.0,
        cogging_periods=float(rng.integers(7, 120)),
        counts=round(log(SMALLEST_COUNTS, LARGEST_COUNTS)),
        encoder_jitter_steps=jitter,
        torque_noise=log(1e-4, 3e-3),
        torque_offset=rng.normal(0.0, 1e-3),
        tick_us=tick,
        delay_ticks=int(rng.integers(0, 4)),
        motor_lag=rng.uniform(0.0, 3e-3),
        torque_limit=log(0.2, 2.0),
        low=rng.uniform(0.0, 0.1),
        high=rng.uniform(0.8, 1.3),
        stalls_per_s=rng.uniform(0.2, 4.0) if stalls else 0.0,
        stall_s=rng.uniform(0.01, 0.045) if stalls else 0.0,
        seed=seed,
    )


WRONG = {
    "motor reversed": {"motor_sign": -1.0},
    "encoder reversed": {"encoder_sign": -1.0},
    "both reversed": {"motor_sign": -1.0, "encoder_sign": -1.0},
    "report reversed": {"report_gain": -1.0},
    "report half": {"report_gain": 0.5},
    "counts x 2": {"encoder_scale": 2.0},
    "counts / 2": {"encoder_scale": 0.5},
    "stuck": {"stuck": True},
    "zero off": {"encoder_zero": 0.15},
    "radius": {"stated_radius": 0.6},
    "late": {"delay_ticks": 25},
    "clock down": {"clock": "down"},
    "clock random": {"clock": "random"},
    "clock stopped": {"clock": "stopped"},
    "5 % lost": {"commands_lost": 0.05},
    "backlash": {"backlash": 0.01},
    "ten times too strong": {"motor_gain": 10.0, "report_gain": 1.0},
}


def wrong(kind: str, seed: int) -> RigParameters:
    """A healthy rig with one thing wrong."""
    return replace(healthy(seed), **WRONG[kind])  # type: ignore[arg-type]


def falls(rig: RigParameters) -> bool:
    """Whether gravity is more than the friction that holds the blades somewhere on their way."""
    places = np.linspace(rig.low, rig.high, 50)
    carried = np.abs(rig.gravity * np.cos(places - rig.gravity_phase)).max()
    return bool(carried > min(rig.coulomb_opening, rig.coulomb_closing))
