"""Friction against opening and rate: Coulomb, viscous, Stribeck, angle-dependent."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FrictionLaw:
    """The friction ladder's parameters; a rung leaves those it lacks at zero.

    F = sgn(w) [Fc + S exp(-(|w| / w_s)^2) + Fv |w|] [1 + a_1 (theta - c) + a_2 (theta - c)^2]

    with Fc and Fv taken for the direction of motion: ``_pos`` where the rate w is positive (the
    blades open), ``_neg`` where it is negative. S = ``stribeck`` is what static friction exceeds
    Coulomb friction by, w_s = ``stribeck_rate`` (Armstrong-Helouvry et al. 1994,
    doi:10.1016/0005-1098(94)90209-7). Levels in N m (N for a linear joint), rates in rad/s (m/s).
    Fields may be arrays that broadcast with what they are evaluated on.
    """

    coulomb_pos: float | Array = 0.0
    coulomb_neg: float | Array = 0.0
    viscous_pos: float | Array = 0.0
    viscous_neg: float | Array = 0.0
    stribeck: float | Array = 0.0
    stribeck_rate: float | Array = 1.0
    angle_slope: float | Array = 0.0
    angle_curvature: float | Array = 0.0
    angle_center: float = 0.0


def friction_torque(law: FrictionLaw, opening: ArrayLike, rate: ArrayLike) -> Array:
    """Friction that the drive must overcome: it has the sign of the rate, and is 0 at rest.

    ``opening`` (rad) and ``rate`` (rad/s) broadcast with each other and with the law's fields.

    >>> law = FrictionLaw(coulomb_pos=0.010, coulomb_neg=0.012, viscous_neg=0.002)
    >>> friction_torque(law, 0.3, [-1.0, 0.0, 1.0])
    array([-0.014,  0.   ,  0.01 ])
    """
    w = np.asarray(rate, dtype=np.float64)
    speed = np.abs(w)
    forward = w > 0
    coulomb = np.where(forward, law.coulomb_pos, law.coulomb_neg)
    viscous = np.where(forward, law.viscous_pos, law.viscous_neg)
    level = coulomb + viscous * speed
    if np.any(np.asarray(law.stribeck) != 0.0):
        level = level + law.stribeck * np.exp(-((speed / law.stribeck_rate) ** 2))
    return np.asarray(np.sign(w) * level * angle_factor(law, opening))


def angle_factor(law: FrictionLaw, opening: ArrayLike) -> Array:
    """The factor by which friction changes with the opening; 1 at the law's centre."""
    away = np.asarray(opening, dtype=np.float64) - law.angle_center
    return np.asarray(1.0 + away * (law.angle_slope + law.angle_curvature * away))
