"""What each build of docs/build is made of, in figures, and the rig that follows from them.

A figure has its source in the table of parts of its page; ``ESTIMATES`` names those that come from
no data sheet.
"""

import math
from dataclasses import dataclass, replace

import numpy as np

from ..random_rigs.rigs import RigParameters

ESTIMATES = (
    "blades_inertia",
    "transmission_inertia",
    "dry",
    "viscous",
    "cogging",
    "reading_noise_A",
    "jitter_counts",
    "motor_lag",
)


STEPS_12_BIT = 4096
SPREAD = math.log(1.5)


@dataclass(frozen=True)
class Build:
    """One build; SI and radians, at the motor where not said otherwise.

    ``ratio`` is turns of the motor for one of the blades, ``counts`` those of the encoder for a
    turn of the motor. ``ampere_per_step`` is a step of the current's converter, ``reading_noise_A``
    the sd of one reading, ``readings`` how many are averaged for a tick. ``jitter_counts`` is the
    sd of the encoder's count after averaging. Inertias and friction are at the blades.
    """

    name: str
    torque_per_ampere: float
    ratio: float
    peak_A: float
    continuous_A: float
    sensor_range_A: float
    ampere_per_step: float
    reading_noise_A: float
    readings: int
    counts: int
    jitter_counts: float
    rotor_inertia: float
    transmission_inertia: float
    blades_inertia: float
    dry: float
    viscous: float
    cogging: float
    cogging_periods: float
    tick_us: int
    delay_ticks: int
    motor_lag: float
    force_sensor: bool

    @property
    def blades_torque_per_ampere(self) -> float:
        return self.torque_per_ampere * self.ratio

    @property
    def torque_limit(self) -> float:
        return self.blades_torque_per_ampere * self.peak_A

    @property
    def continuous_torque(self) -> float:
        return self.blades_torque_per_ampere * self.continuous_A

    @property
    def torque_noise(self) -> float:
        """The sd of ``motor_torque`` in one STATE (N m)."""
        return self.blades_torque_per_ampere * self.reading_noise_A / math.sqrt(self.readings)

    @property
    def single_reading_noise(self) -> float:
        """The sd of ``motor_torque`` where one reading makes a STATE (N m)."""
        return self.blades_torque_per_ampere * self.reading_noise_A

    @property
    def blades_counts(self) -> int:
        return round(self.counts * self.ratio)

    @property
    def inertia(self) -> float:
        reflected = self.rotor_inertia * self.ratio**2
        return reflected + self.transmission_inertia + self.blades_inertia

    def rig(self, seed: int) -> RigParameters:
        """The build as a rig of tests/random_rigs, as one person builds it.

        Each seed draws inertia within 20 % and friction within a factor of 1.5 of the estimates,
        half its asymmetry within 10 %, and what holds the blades before they slide.
        """
        rng = np.random.default_rng([seed, len(self.name)])
        dry = self.dry * float(np.exp(rng.uniform(-SPREAD, SPREAD)))
        asymmetry = rng.uniform(-0.1, 0.1)
        step = self.blades_torque_per_ampere * self.ampere_per_step / self.readings
        return RigParameters(
            inertia=self.inertia * rng.uniform(0.8, 1.2),
            coulomb_opening=dry * (1.0 + asymmetry),
            coulomb_closing=dry * (1.0 - asymmetry),
            viscous=self.viscous * float(np.exp(rng.uniform(-SPREAD, SPREAD))),
            rise_share=rng.uniform(0.0, 0.3),
            fine_rad=float(np.exp(rng.uniform(np.log(3e-4), np.log(3e-3)))),
            cogging=self.cogging,
            cogging_periods=self.cogging_periods,
            counts=self.blades_counts,
            encoder_jitter_steps=self.jitter_counts,
            torque_noise=self.torque_noise,
            torque_step=step,
            tick_us=self.tick_us,
            delay_ticks=self.delay_ticks,
            motor_lag=self.motor_lag,
            torque_limit=self.torque_limit,
            low=math.radians(8.0),
            high=math.radians(55.0),
            seed=seed,
        )


def rpm_per_volt(speed_constant: float) -> float:
    """Torque per ampere (N m/A) of a speed constant in rpm/V: 60 / (2 pi KV)."""
    return 60.0 / (2.0 * math.pi * speed_constant)


COURSE = Build(
    name="course",
    torque_per_ampere=23.4e-3,
    ratio=10.0,
    peak_A=1.25,
    continuous_A=1.24,
    sensor_range_A=1.65,
    ampere_per_step=3.3 / STEPS_12_BIT / 1.0,
    reading_noise_A=3.0 * 3.3 / STEPS_12_BIT / 1.0,
    readings=8,
    counts=4 * 512,
    jitter_counts=0.3,
    rotor_inertia=10.3e-7,
    transmission_inertia=1.5e-4,
    blades_inertia=3e-4,
    dry=15e-3,
    viscous=3e-3,
    cogging=0.0,
    cogging_periods=84.0,
    tick_us=1000,
    delay_ticks=1,
    motor_lag=5e-4,
    force_sensor=True,
)
LAB = Build(
    name="lab",
    torque_per_ampere=23.4e-3,
    ratio=10.0,
    peak_A=2.5,
    continuous_A=1.24,
    sensor_range_A=1.65 / (0.003 * 64.0 / 7.0),
    ampere_per_step=3.3 / STEPS_12_BIT / (0.003 * 64.0 / 7.0),
    reading_noise_A=1.75 * 3.3 / STEPS_12_BIT / (0.003 * 64.0 / 7.0),
    readings=24,
    counts=4 * 512,
    jitter_counts=0.3,
    rotor_inertia=10.3e-7,
    transmission_inertia=1.5e-4,
    blades_inertia=3e-4,
    dry=10e-3,
    viscous=2e-3,
    cogging=0.0,
    cogging_periods=84.0,
    tick_us=1000,
    delay_ticks=1,
    motor_lag=5e-4,
    force_sensor=False,
)
BEST = Build(
    name="best",
    torque_per_ampere=38.9e-3,
    ratio=6.0,
    peak_A=4.5,
    continuous_A=2.5,
    sensor_range_A=1.65 / 0.3,
    ampere_per_step=3.3 / STEPS_12_BIT / 0.3,
    reading_noise_A=2.0 * 3.3 / STEPS_12_BIT / 0.3,
    readings=8,
    counts=4 * 5000,
    jitter_counts=0.0,
    rotor_inertia=6.81e-6,
    transmission_inertia=1.0e-4,
    blades_inertia=3e-4,
    dry=6e-3,
    viscous=1e-3,
    cogging=0.0,
    cogging_periods=84.0,
    tick_us=500,
    delay_ticks=1,
    motor_lag=2e-4,
    force_sensor=True,
)
GIMBAL = Build(
    name="gimbal",
    torque_per_ampere=rpm_per_volt(80.0),
    ratio=1.0,
    peak_A=1.25,
    continuous_A=0.6,
    sensor_range_A=3.3,
    ampere_per_step=3.3 / STEPS_12_BIT / 0.5,
    reading_noise_A=3.0 * 3.3 / STEPS_12_BIT / 0.5,
    readings=8,
    counts=16384,
    jitter_counts=0.06 / math.sqrt(8.0) * 16384 / 360.0,
    rotor_inertia=5e-5,
    transmission_inertia=0.0,
    blades_inertia=3e-4,
    dry=12e-3,
    viscous=2e-3,
    cogging=5e-4,
    cogging_periods=264.0,
    tick_us=2000,
    delay_ticks=1,
    motor_lag=5e-4,
    force_sensor=False,
)
"""A gimbal motor on the pivot with a magnetic encoder, which firmware/boards does not commutate."""
BUILDS = {build.name: build for build in (COURSE, LAB, BEST)}

ACS712_SD = 75e-3 / 6.0 / 0.185
"""A. 75 mV from peak to peak in 50 kHz, six standard deviations, 185 mV/A."""
NOT_WORKING = {
    "lab, current of a 40 A ESC, one reading": replace(LAB, readings=1),
    "course, ACS712 of 5 A, one reading": replace(
        COURSE, ampere_per_step=3.3 / STEPS_12_BIT / 0.185, reading_noise_A=ACS712_SD, readings=1
    ),
    "gimbal, AS5048A, one reading": replace(GIMBAL, jitter_counts=0.06 * 16384 / 360.0),
    "lab at 100 Hz, as a VESC sends its position": replace(LAB, tick_us=10_000),
}
"""Builds with one part that does not serve, by what it is."""
