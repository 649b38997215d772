"""What is true about the second virtual rig: mechanism, motor, sensors, blades, sheet and hand.

Everything is SI and radians, units stand in the names. The words are those of
docs/conventions.md; a fit never sees any of it.
"""

import math
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

RIGID_RAD = 4e-6
RIGID_M = 5e-7
"""Presliding that no sensor of the rig can see: friction that is rigid for every purpose."""


@dataclass(frozen=True)
class Friction:
    """Dry and viscous friction of the opening axis, with memory and with load.

    F = [u (Fc + S exp(-(w / w_s)^2)) + Fv w] [1 + a (th - c) + b (th - c)^2] + u mu |tau_cut|,
    levels by direction. u follows the path: the distance |sgn(w) - u| falls by its power
    ``presliding_shape`` over ``presliding_rad`` of way (1 is Dahl's law of 1968, larger ones take
    longer at the end), so that a reversal takes some way to build the friction up again.
    """

    coulomb_opening_Nm: float = 0.0135
    coulomb_closing_Nm: float = 0.0155
    viscous_opening_Nm_s_per_rad: float = 0.0021
    viscous_closing_Nm_s_per_rad: float = 0.0019
    stribeck_Nm: float = 0.0035
    stribeck_rate_rad_per_s: float = 0.07
    angle_slope_per_rad: float = 0.15
    angle_curvature_per_rad2: float = 0.1
    angle_center_rad: float = math.radians(30.0)
    presliding_rad: float = RIGID_RAD
    presliding_shape: float = 1.0
    load_share: float = 0.0


@dataclass(frozen=True)
class Mechanism:
    """The opening axis and the sledge. ``torque_offset_Nm`` is what a motor at rest must hold."""

    inertia_kg_m2: float = 2.2e-4
    torque_offset_Nm: float = 4e-4
    handle_radius_m: float = 0.060
    opening_range_rad: tuple[float, float] = (math.radians(8.0), math.radians(55.0))
    friction: Friction = Friction()
    sledge_mass_kg: float = 0.6
    sledge_coulomb_N: float = 0.4
    sledge_viscous_N_s_per_m: float = 6.0
    sledge_presliding_m: float = RIGID_M
    sledge_range_m: tuple[float, float] = (-0.080, 0.250)


@dataclass(frozen=True)
class Motor:
    """How late the motors follow (delay plus first-order lag, in ticks), limits and cogging."""

    delay_ticks: float = 0.25
    lag_ticks: float = 0.25
    torque_limit_Nm: float = 1.5
    force_limit_N: float = 40.0
    cogging_Nm: float = 0.0
    cogging_periods_per_turn: int = 140
    cogging_phase_rad: float = 0.7
    brake_Nm_s_per_rad: float = 0.02


@dataclass(frozen=True)
class Sensors:
    """Sample rate, counts, and noise: white plus a slow first-order autoregressive part."""

    sample_rate_Hz: float = 1000.0
    counts_per_turn: int = 500_000
    sledge_step_m: float = 1e-6
    torque_white_Nm: float = 7e-4
    torque_slow_Nm: float = 5e-4
    torque_zero_Nm: float = 0.0
    force_white_N: float = 0.008
    force_slow_N: float = 0.005
    force_zero_N: float = 0.0
    noise_time_s: float = 0.015
    clock_drift_ppm: float = -45.0


@dataclass(frozen=True)
class Servo:
    """Cascade of the blades (rate wanted from the place, torque from the rate), PID of the sledge.

    ``rate_gain`` in N m s/rad, ``position_gain`` in 1/s, ``integral_gain`` in N m/rad; the
    sledge's in N/m, N s/m and N/(m s). ``feed_*`` is what the servo believes of the mechanism.
    """

    rate_gain: float = 0.06
    position_gain: float = 45.0
    integral_gain: float = 1.2
    observer_hz: float = 300.0
    feed_inertia_kg_m2: float = 2.0e-4
    feed_coulomb_Nm: float = 0.012
    feed_viscous_Nm_s_per_rad: float = 0.002
    sledge_kp: float = 6000.0
    sledge_kd: float = 70.0
    sledge_ki: float = 30_000.0
    sledge_observer_hz: float = 150.0


@dataclass(frozen=True)
class Blades:
    """Edge e(s) = offset + s tan(taper) + curvature s^2 / 2 + cubic s^3 of each moving blade.

    Beyond ``length_m`` the tip is rounded with ``tip_radius_m``: the edge turns away.
    """

    moving: Literal["both", "upper"] = "both"
    offset_m: float = -0.008
    taper_rad: float = math.radians(2.0)
    curvature_per_m: float = 0.0
    cubic_per_m2: float = 0.0
    length_m: float = 0.075
    tip_radius_m: float = 0.001


@dataclass(frozen=True)
class Material:
    """Response of the sheet to one edge, and what its crack takes.

    ``power`` G (d / ref)^n; ``exponential`` G (e^(n d / ref) - 1) / (e^n - 1); ``two_slopes`` is
    straight, and ``knee_ratio`` times as steep beyond ``knee_m``. The force is multiplied by
    1 + damping d(depth)/dt, never below zero. The crack starts at J and stops at kappa J (kappa
    = 1: smooth); J(X) = mean of the sheet (1 + variation xi(X)), means of sheets scatter by
    ``sheet_sd``. ``fracture_energy_N`` is J_c h, None where nothing is cut.
    """

    name: str
    thickness_m: float
    force_N: float
    exponent: float
    reference_m: float = 0.3e-3
    law: Literal["power", "exponential", "two_slopes"] = "power"
    knee_m: float = 0.2e-3
    knee_ratio: float = 2.0
    damping_s_per_m: float = 0.0
    fracture_energy_N: float | None = None
    kappa: float = 1.0
    variation: float = 0.0
    correlation: Literal["ou", "gaussian"] = "ou"
    correlation_m: float = 1.5e-3
    sheet_sd: float = 0.0
    sheet_length_m: float = 0.180


@dataclass(frozen=True)
class Hand:
    """A hand: springs to paths of its own, with tremor, limited strength and uneven speed.

    ``unevenness`` is the standard deviation of the logarithm of each stroke's speed,
    ``aim_m`` that of where it starts along the cut, ``turn_rad`` that of where it turns.
    """

    stiffness_Nm_per_rad: float = 5.0
    damping_Nm_s_per_rad: float = 0.05
    strength_N: float = 25.0
    push_N_per_m: float = 2500.0
    push_N_s_per_m: float = 50.0
    push_limit_N: float = 25.0
    tremor_N: float = 0.15
    tremor_Hz: float = 8.5
    unevenness: float = 0.3
    aim_m: float = 1.5e-3
    turn_rad: float = math.radians(1.0)


@dataclass(frozen=True)
class Rig:
    """The whole truth of one day. ``step_s`` bounds the integrator's steps."""

    material: Material
    mechanism: Mechanism = Mechanism()
    motor: Motor = Motor()
    sensors: Sensors = Sensors()
    servo: Servo = Servo()
    blades: Blades = Blades()
    hand: Hand = field(default_factory=Hand)
    step_s: float = 2.0e-4

    @property
    def moving_blades(self) -> int:
        """1 or 2."""
        return 2 if self.blades.moving == "both" else 1

    @property
    def upper_face_m(self) -> float:
        """Height of the sheet's upper face: h / 2 where both blades move, h where one does."""
        return self.material.thickness_m / self.moving_blades

    @property
    def tick_s(self) -> float:
        """Seconds from sample to sample."""
        return 1.0 / self.sensors.sample_rate_Hz


def draw_truth(
    rig: Rig,
    rng: np.random.Generator,
    spread: float = 0.3,
    shape: Literal["uniform", "lognormal"] = "uniform",
) -> Rig:
    """Draw a day's truth about a rig: material, friction and inertia by factors of 1 +- spread.

    ``uniform`` factors lie within [1 - spread, 1 + spread]; ``lognormal`` ones have that standard
    deviation in the logarithm, halved. Force, exponent, toughness, 1 - kappa, inertia and every
    level of friction are drawn apart; the cogging's phase and the offset anew.
    """

    def factor() -> float:
        if shape == "uniform":
            return float(rng.uniform(1.0 - spread, 1.0 + spread))
        return float(np.exp(0.5 * spread * rng.standard_normal()))

    sheet, friction, mechanism = rig.material, rig.mechanism.friction, rig.mechanism
    energy = sheet.fracture_energy_N
    sheet = replace(
        sheet,
        force_N=sheet.force_N * factor(),
        exponent=sheet.exponent * factor(),
        fracture_energy_N=None if energy is None else energy * factor(),
        kappa=1.0 - (1.0 - sheet.kappa) * factor(),
    )
    friction = replace(
        friction,
        coulomb_opening_Nm=friction.coulomb_opening_Nm * factor(),
        coulomb_closing_Nm=friction.coulomb_closing_Nm * factor(),
        viscous_opening_Nm_s_per_rad=friction.viscous_opening_Nm_s_per_rad * factor(),
        viscous_closing_Nm_s_per_rad=friction.viscous_closing_Nm_s_per_rad * factor(),
        stribeck_Nm=friction.stribeck_Nm * factor(),
        stribeck_rate_rad_per_s=friction.stribeck_rate_rad_per_s * factor(),
    )
    mechanism = replace(
        mechanism,
        inertia_kg_m2=mechanism.inertia_kg_m2 * factor(),
        torque_offset_Nm=float(rng.normal(0.0, 5e-4)),
        friction=friction,
    )
    motor = replace(rig.motor, cogging_phase_rad=float(rng.uniform(0.0, 2.0 * math.pi)))
    return replace(rig, material=sheet, mechanism=mechanism, motor=motor)
