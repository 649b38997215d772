"""One law that stands for a posterior of friction: what cuts take off and packages render."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.result import FitResult
from scissorcal.model import FrictionLaw, friction_torque

RATES = np.array([-1.0, -0.5, -0.25, -0.1, 0.1, 0.25, 0.5, 1.0])
"""Rates (rad/s) at which two laws of friction are compared."""


def at_typical(friction: FitResult) -> FitResult:
    """The fit with its typical values in the place of the mode."""
    values = typical_values(friction)
    point = np.array([float(values[p.name]) for p in friction.parameters])
    return replace(friction, map_point=point)


def typical_values(friction: FitResult) -> dict[str, Array]:
    """Values by name: means, or the mode, whichever has torques closer to the posterior median.

    Along a curved ridge the mean lies beside it. Where slow friction is not measured, the mode may
    lie far out on a ridge of static friction and Stribeck speed: 37 mN m for 5 at a median of 13.
    """
    centre = float(friction.structure["angle_center"])
    means = {p.name: np.asarray(p.mean) for p in (*friction.parameters, *friction.nuisance)}
    names = [p.name for p in friction.parameters]
    highest = {**means, **dict(zip(names, np.asarray(friction.map_point), strict=True))}
    draws = {name: friction.column(name) for name in names}
    middle = np.median([friction_and_offset(draws, centre, rate) for rate in RATES], axis=1)

    def away(values: dict[str, Array]) -> float:
        levels = [float(friction_and_offset(values, centre, rate)) for rate in RATES]
        return float(np.abs(np.array(levels) - middle).max())

    return min((means, highest), key=away)


def friction_and_offset(values: Mapping[str, Array], centre: float, rate: float) -> Array:
    """Friction and offset together at one rate, of one set of values or of many draws."""
    torque = friction_torque(FrictionLaw.of_fit(values, centre), centre, rate)
    return np.asarray(torque + values.get("offset", np.asarray(0.0)))
