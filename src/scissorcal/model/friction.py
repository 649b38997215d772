"""Friction against opening, rate and load: Coulomb, viscous, Stribeck, place, load, presliding."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from scissorcal.model.terms import TERMS, Motion

Array = NDArray[np.float64]


@dataclass(frozen=True)
class FrictionLaw:
    """The friction ladder's parameters; a rung leaves those it lacks at zero.

    F = A(theta) {z [Fc + S exp(-(|w| / w_s)^2) + mu |L|] + sgn(w) Fv |w|} + terms
    A = 1 + a_1 (theta - c) + a_2 (theta - c)^2
    z = (1 - p) sgn(w) + p z_d,     length dz_d/dtheta = 1 - z_d sgn(w)

    with Fc and Fv taken for the direction of motion: ``_pos`` where the rate w is positive (the
    blades open), ``_neg`` where it is negative. S = ``stribeck`` is what static friction exceeds
    Coulomb friction by, w_s = ``stribeck_rate`` (Armstrong-Helouvry et al. 1994,
    doi:10.1016/0005-1098(94)90209-7). mu = ``load_share`` of the load L that the joint bears.
    After a reversal the share p = ``presliding_share`` of dry friction builds up over
    ``presliding_length`` (Dahl 1976, doi:10.2514/3.61511; see :func:`presliding_state`), the
    Stribeck part with the rest (Canudas de Wit et al. 1995, doi:10.1109/9.376053). Levels in N m
    (N for a linear joint), rates in rad/s (m/s). ``terms`` are names of
    :data:`scissorcal.model.terms.TERMS` with their ``coefficients``; those of the rate alone count
    as levels, and A multiplies them too. Fields may be arrays that broadcast with what they are
    evaluated on.
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
    load_share: float | Array = 0.0
    load_gain: float | Array = 0.0
    presliding_share: float | Array = 0.0
    presliding_length: float | Array = 1.0
    terms: tuple[str, ...] = ()
    coefficients: tuple[float | Array, ...] = ()


def friction_torque(
    law: FrictionLaw,
    opening: ArrayLike,
    rate: ArrayLike,
    load: ArrayLike = 0.0,
    state: ArrayLike | None = None,
) -> Array:
    """Friction that the drive must overcome: it has the sign of the rate, and is 0 at rest.

    ``opening`` (rad), ``rate`` (rad/s) and ``load`` (N m, what the joint bears) broadcast with each
    other and with the law's fields. ``state`` is z_d of :func:`presliding_state`; without it
    friction is that of long strokes, fully built up. ``load_gain`` times the load is added: what a
    transmission takes off or a sensor's scale is wrong by, which is no friction but comes with it.

    >>> law = FrictionLaw(coulomb_pos=0.010, coulomb_neg=0.012, viscous_neg=0.002)
    >>> friction_torque(law, 0.3, [-1.0, 0.0, 1.0])
    array([-0.014,  0.   ,  0.01 ])
    """
    w = np.asarray(rate, dtype=np.float64)
    borne = np.asarray(load, dtype=np.float64)
    speed, sign = np.abs(w), np.sign(w)
    forward = w > 0
    dry = np.where(forward, law.coulomb_pos, law.coulomb_neg) + law.load_share * np.abs(borne)
    if np.any(np.asarray(law.stribeck) != 0.0):
        dry = dry + law.stribeck * np.exp(-((speed / law.stribeck_rate) ** 2))
    sliding = np.where(forward, law.viscous_pos, law.viscous_neg) * speed
    built_up = sign
    if state is not None:
        built_up = sign + law.presliding_share * (np.asarray(state, dtype=np.float64) - sign)
    levels = built_up * dry + sign * sliding + _adopted(law, opening, w, borne, of_rate_only=True)
    others = _adopted(law, opening, w, borne, of_rate_only=False)
    return np.asarray(levels * angle_factor(law, opening) + law.load_gain * borne + others)


def angle_factor(law: FrictionLaw, opening: ArrayLike) -> Array:
    """The factor by which friction changes with the opening; 1 at the law's centre."""
    away = np.asarray(opening, dtype=np.float64) - law.angle_center
    return np.asarray(1.0 + away * (law.angle_slope + law.angle_curvature * away))


def presliding_state(opening: Array, length: float) -> Array:
    """How far dry friction has built up since the last reversal, between -1 and 1, shape (n,).

    Dahl's law length dz/dtheta = 1 - z sgn(dtheta) along a path, in closed form between turns:
    it depends on where the joint has been and not on how fast. ``opening`` (n,) is in order of
    time, ``length`` in its unit. The path is taken to begin fully built up in its first direction.

    >>> presliding_state(np.array([0.0, 1.0, 0.9, 0.8, -1.0]), 0.1).round(3)
    array([ 1.   ,  1.   , -0.264, -0.729, -1.   ])
    """
    steps = np.diff(opening)
    moves = np.flatnonzero(steps)
    if len(moves) == 0:
        return np.zeros(len(opening))
    signs = np.sign(steps[moves])
    turns = moves[np.concatenate([[True], signs[1:] != signs[:-1]])]
    ends = np.concatenate([turns[1:], [len(opening) - 1]])
    state = np.empty(len(opening))
    state[: turns[0] + 1] = reached = float(signs[0])
    for low, high in zip(turns.tolist(), ends.tolist(), strict=True):
        sign, run = math.copysign(1.0, steps[low]), slice(low + 1, high + 1)
        travelled = np.abs(opening[run] - opening[low])
        state[run] = sign - (sign - reached) * np.exp(-travelled / length)
        reached = float(state[high])
    return state


def _adopted(
    law: FrictionLaw, opening: ArrayLike, rate: Array, load: Array, *, of_rate_only: bool
) -> Array:
    """Sum of the law's named terms of one sort; those of the rate alone are 0 at rest."""
    total = np.zeros(())
    named = [
        (TERMS[name], coefficient)
        for name, coefficient in zip(law.terms, law.coefficients, strict=True)
        if TERMS[name].of_rate_only == of_rate_only
    ]
    if not named:
        return total
    places = np.asarray(opening, dtype=np.float64)
    place, moving, still, borne = np.broadcast_arrays(places, rate, 0.0, load)
    motion = Motion(place, moving, still, borne)
    for term, coefficient in named:
        total = total + coefficient * term.value(motion)
    return np.where(rate == 0.0, 0.0, total) if of_rate_only else total
