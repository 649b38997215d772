"""A designed law on the plant: where it starts, what it follows."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from scissorcal.control import ContactLoop, HybridGains, choose_gains, friction_rates
from scissorcal.kernel import HybridConfig
from tests.control.plant import Blade, Disc, Plant
from tests.control.steering import Known, Steering, Wish

MASSES_KG = (0.04, 0.055)
"""Of the blade along the normals of the disc's upper part."""


def loop_of(blade: Blade, disc: Disc, mass_kg: float, **changes: Any) -> ContactLoop:
    """The loop that a plant is, nothing compensated being known as damping."""
    cutoff = 1.0 / (2.0 * math.pi * blade.force_lag_s) if blade.force_lag_s else 0.0
    settings = {
        "stiffness_N_per_m": disc.stiffness,
        "mass_kg": mass_kg,
        "viscous_N_s_per_m": 0.0,
        "delay_s": blade.delay_s,
        "motor_lag_s": blade.lag_s,
        "tick_s": 1e-3,
        "rate_cutoff_Hz": 400.0,
        "force_cutoff_Hz": cutoff,
        "step_m": blade.step[0] * blade.length,
    }
    return ContactLoop(**{**settings, **changes})


def mass_at(blade: Blade, opening: float) -> float:
    """1 / (n^T J D^-1 J^T n) with the normal upright."""
    off = -blade.coupling * math.sin(opening)
    inertia = np.array([[blade.inertia, off], [off, blade.mass]])
    lever = np.array([blade.length * math.cos(opening), 0.0])
    return float(1.0 / (lever @ np.linalg.solve(inertia, lever)))


def designed(blade: Blade, disc: Disc, peak_N: float = 1.0) -> HybridGains:
    """Gains for a blade on a disc."""
    return choose_gains([loop_of(blade, disc, mass) for mass in MASSES_KG], peak_N=peak_N)


def steered(
    blade: Blade | None = None,
    disc: Disc | None = None,
    known: Known | None = None,
    gap: float = 1e-3,
    **settings: Any,
) -> Steering:
    """The law with the gains designed for a plant, above the disc's top; ``settings`` change it."""
    blade, disc = blade or Blade(), disc or Disc()
    gains = designed(blade, disc)
    dry = tuple(max(level, 1e-3) for level in blade.dry)
    config = {
        **gains.settings(),
        "axes": 2,
        "force_most": 5.0,
        "effort_limit": (0.5, 30.0),
        "friction_rate": friction_rates(gains, (blade.inertia, blade.mass), dry),
        **settings,
    }
    place = [math.asin((disc.centre[1] + disc.radius + gap) / blade.length), 0.0]
    place[1] = disc.centre[0] - blade.length * math.cos(place[0])
    return Steering(Plant(blade, disc, place=place), HybridConfig(**config), known or Known())


def resting(force: float = 2.0, angle: float = 0.0) -> Callable[[float], Wish]:
    """A wish for a force at one place."""
    return lambda time: Wish(angle, force=force)


def swinging(amplitude: float, hertz: float, force: float = 2.0) -> Callable[[float], Wish]:
    """A wish to swing over the disc's top, from rest after half a second."""

    def angle(time: float) -> float:
        grown = min(max(2.0 * (time - 0.5), 0.0), 1.0)
        size = amplitude * grown * grown * (3.0 - 2.0 * grown)
        return size * math.sin(2.0 * math.pi * hertz * (time - 0.5))

    def wish(time: float) -> Wish:
        step = 1e-4
        before, at, after = angle(time - step), angle(time), angle(time + step)
        bend = (after - 2.0 * at + before) / (step * step)
        return Wish(at, 0.5 * (after - before) / step, bend, force)

    return wish
