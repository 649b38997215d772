"""What the rig measures: encoder steps, limits, and autocorrelated noise."""

import math
from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from scissorcal.device.sim.specimen import Sensors

BLOCK = 4096


class Measured(NamedTuple):
    """One tick as the device reports it: SI units, and three flags.

    ``opening`` (rad), ``advance`` (m), ``motor_torque`` (N m, positive opens the blades),
    ``handle_force`` (N, positive pushes the handles closed).
    """

    opening: float
    advance: float
    motor_torque: float
    handle_force: float
    at_stop: bool
    torque_saturated: bool
    force_saturated: bool


class NoiseChannel:
    """White noise plus a first-order autoregressive part, one number per tick."""

    __slots__ = ("_drawn", "_gain", "_keep", "_slow", "_white")

    def __init__(
        self, white: float, slow: float, time_ms: float, tick_ms: float, drawn: Iterator[float]
    ) -> None:
        """``white`` and ``slow`` are standard deviations, ``drawn`` gives standard normals."""
        self._keep = math.exp(-tick_ms / time_ms)
        self._gain = slow * math.sqrt(1.0 - self._keep * self._keep)
        self._white = white
        self._drawn = drawn
        self._slow = slow * next(drawn)

    def next(self) -> float:
        """Noise of the next tick."""
        self._slow = self._keep * self._slow + self._gain * next(self._drawn)
        return self._slow + self._white * next(self._drawn)


class SensorSet:
    """All sensors of one rig, with one stream of random numbers."""

    __slots__ = (
        "_advance_step",
        "_force",
        "_force_limit",
        "_force_zero",
        "_opening_step",
        "_torque",
        "_torque_zero",
    )

    def __init__(self, sensors: Sensors, tick_s: float, rng: np.random.Generator) -> None:
        drawn = standard_normals(rng)
        tick_ms = tick_s * 1e3
        self._opening_step = sensors.opening_step_rad
        self._advance_step = sensors.advance_step_um * 1e-6
        self._force_limit = sensors.handle_force_limit_N
        self._torque_zero = sensors.torque_zero_Nm
        self._force_zero = sensors.force_zero_N
        self._torque = NoiseChannel(
            sensors.torque_white_Nm, sensors.torque_slow_Nm, sensors.noise_time_ms, tick_ms, drawn
        )
        self._force = NoiseChannel(
            sensors.force_white_N, sensors.force_slow_N, sensors.noise_time_ms, tick_ms, drawn
        )

    def read(
        self,
        opening: float,
        advance: float,
        motor_torque: float,
        handle_force: float,
        at_stop: bool,
        torque_saturated: bool,
    ) -> Measured:
        """Turn true values into measured ones."""
        force = handle_force + self._force_zero + self._force.next()
        limit = self._force_limit
        saturated = not -limit < force < limit
        if saturated:
            force = limit if force > 0.0 else -limit
        return Measured(
            self._opening_step * math.floor(opening / self._opening_step + 0.5),
            self._advance_step * math.floor(advance / self._advance_step + 0.5),
            motor_torque + self._torque_zero + self._torque.next(),
            force,
            at_stop,
            torque_saturated,
            saturated,
        )


def standard_normals(rng: np.random.Generator) -> Iterator[float]:
    """Infinite standard normals as plain floats, drawn in blocks."""
    while True:
        yield from rng.standard_normal(BLOCK).tolist()
