"""Friction against opening, rate and load, as a sum over the rows of the table of terms.

`AxisLaw` adds inertia and offset: what the drive of one axis must give.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from scissorcal.aliases import Array
from scissorcal.model.checks import SMALLEST, check_name, check_numbers
from scissorcal.model.friction_terms import PARAMETERS, TERMS, side_of
from scissorcal.model.terms import LOG, LOGIT, Motion, Role, Term

COMPLEX_STEP = 1e-30
"""Imaginary step by which a term is differentiated: exact to rounding, as nothing is subtracted
(Squire and Trapp 1998, doi:10.1137/S003614459631241X)."""


@dataclass(frozen=True)
class FrictionLaw:
    """Friction with given parameters; those that are left out are zero.

    F = A(theta) {z [Fc + S exp(-(|w| / w_s)^2) + mu |L|] + Fv w} + terms
    A = 1 + a_1 (theta - c) + a_2 (theta - c)^2
    z = (1 - p) sgn(w) + p z_d,     length dz_d/dtheta = 1 - z_d sgn(w)

    with Fc and Fv taken for the direction of motion: ``_pos`` where the rate w is positive (the
    blades open), ``_neg`` where it is negative. S = ``stribeck`` is what static friction exceeds
    Coulomb friction by, w_s = ``stribeck_rate`` (Armstrong-Helouvry et al. 1994,
    doi:10.1016/0005-1098(94)90209-7). mu = ``load_share`` of the load L that the joint bears.
    After a reversal the share p = ``presliding_share`` of dry friction builds up over
    ``presliding_length`` (Dahl 1976, doi:10.2514/3.61511; see :func:`presliding_state`), the
    Stribeck part with the rest (Canudas de Wit et al. 1995, doi:10.1109/9.376053). Levels in N m
    (N for a linear joint), rates in rad/s (m/s).

    ``values`` are parameters by name (:mod:`scissorcal.model.friction_terms`), adopted terms among
    them; the place c is ``angle_center``. Values may be arrays that broadcast with what the law is
    evaluated on. ModelError for a name that is in no row, for a level, a scale or a length below
    0, a share outside 0 to 1, and what is not finite.
    """

    values: Mapping[str, float | Array] = field(default_factory=dict)
    angle_center: float = 0.0

    def __post_init__(self) -> None:
        for name, value in self.values.items():
            row = _row(name)
            if row is None:
                check_name("parameter of a friction law", name, _known_names())
            elif row.transform is LOG:
                check_numbers(f'"{name}" of a friction law', value, 0.0)
            elif row.transform is LOGIT:
                check_numbers(f'"{name}" of a friction law', value, 0.0, 1.0)
            else:
                check_numbers(f'"{name}" of a friction law', value)
        check_numbers("the centre of a friction law", self.angle_center)

    @classmethod
    def of_fit(cls, values: Mapping[str, float | Array], angle_center: float) -> "FrictionLaw":
        """The law among a fit's parameters by name; those of the drive and the noise are left."""
        return cls({n: v for n, v in values.items() if _row(n) is not None}, angle_center)

    def __getitem__(self, name: str) -> float | Array:
        """A parameter by name, 0 where the law lacks it; that of both directions for either."""
        found = side_of(name, self.values)
        return 0.0 if found is None else self.values[found]

    @property
    def terms(self) -> tuple[Term, ...]:
        """Rows of the table that the law has."""
        rows = [_row(name) for name in self.values]
        return tuple(dict.fromkeys(row for row in rows if row is not None))


def friction_torque(
    law: FrictionLaw,
    opening: ArrayLike,
    rate: ArrayLike,
    load: ArrayLike = 0.0,
    state: ArrayLike | None = None,
) -> Array:
    """Friction that the drive must overcome: it has the sign of the rate, and is 0 at rest.

    ``opening`` (rad), ``rate`` (rad/s) and ``load`` (N m, what the joint bears) broadcast with each
    other and with the law's values. ``state`` is z_d of :func:`presliding_state`; without it
    friction is that of long strokes, fully built up. ``load_gain`` times the load is added: what a
    transmission takes off or a sensor's scale is wrong by, which is no friction but comes with it.

    >>> law = FrictionLaw({"coulomb_pos": 0.010, "coulomb_neg": 0.012, "viscous_neg": 0.002})
    >>> friction_torque(law, 0.3, [-1.0, 0.0, 1.0])
    array([-0.014,  0.   ,  0.01 ])
    """
    moving, place, borne = (np.asarray(a, dtype=np.float64) for a in (rate, opening, load))
    motion = Motion(place, moving, np.zeros_like(moving), borne)
    built_up = motion.direction
    if state is not None:
        lacking = np.asarray(state, dtype=np.float64) - built_up
        built_up = built_up + law["presliding_share"] * lacking
    levels = built_up * _sum(law, motion, Role.DRY) + _sum(law, motion, Role.SLIDING)
    return np.asarray(levels * angle_factor(law, opening) + _sum(law, motion, Role.PLAIN))


def friction_level(law: FrictionLaw, sign: float, speed: Array) -> tuple[Array, Array]:
    """Magnitude of friction moving one way, and its slope over the speed, at the law's centre.

    ``sign`` is 1 where the blades open and -1 where they close; at rest the magnitude is its limit
    from that side. Without load, and without what the place changes in another way.
    """
    moving = np.maximum(speed, np.finfo(np.float64).tiny) + COMPLEX_STEP * 1j
    rate = sign * moving
    motion = Motion(np.zeros_like(rate), rate, np.zeros_like(rate), np.zeros_like(rate))
    level = _sum(law, motion, Role.DRY) + sign * _sum(law, motion, Role.SLIDING)
    return np.asarray(np.real(level)), np.asarray(np.imag(level) / COMPLEX_STEP)


def angle_factor(law: FrictionLaw, opening: ArrayLike) -> Array:
    """The factor by which friction changes with the opening; 1 at the law's centre."""
    away = np.asarray(opening, dtype=np.float64) - law.angle_center
    return np.asarray(1.0 + 0.0 * away + sum(c * away**power for c, power in _place(law)))


def angle_slope(law: FrictionLaw, opening: ArrayLike) -> Array:
    """Derivative of :func:`angle_factor` by the opening."""
    away = np.asarray(opening, dtype=np.float64) - law.angle_center
    return np.asarray(0.0 * away + sum(k * c * away ** (k - 1) for c, k in _place(law)))


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


@dataclass(frozen=True)
class AxisLaw:
    """One axis: inertia * acceleration + F(place, rate) + offset = drive.

    ``inertia`` in kg m^2 (kg for a sliding axis), ``offset`` in N m (N). Dry friction jumps at
    rest; below ``rest_rate`` (rad/s or m/s) friction is the damper F(rest_rate) / rest_rate, as a
    package's tables have it (0: it jumps, and no integrator of fixed steps stands still).
    ModelError for an inertia that is not positive.
    """

    inertia: float
    friction: FrictionLaw
    offset: float = 0.0
    rest_rate: float = 0.0

    def __post_init__(self) -> None:
        check_numbers("the inertia of an axis (kg m^2 or kg)", self.inertia, SMALLEST)
        check_numbers("the offset of an axis (N m or N)", self.offset)
        check_numbers("the rest rate of an axis (rad/s or m/s)", self.rest_rate, 0.0)

    @classmethod
    def of_fit(
        cls, values: Mapping[str, float], angle_center: float, rest_rate: float
    ) -> "AxisLaw":
        """The axis from a friction fit's parameters by name, at its MAP point or mean."""
        law = FrictionLaw.of_fit(values, angle_center)
        return cls(float(values["inertia"]), law, float(values.get("offset", 0.0)), rest_rate)

    def effort(self, place: ArrayLike, rate: ArrayLike) -> Array:
        """F + offset, what the drive must give at an even rate; places and rates broadcast.

        >>> carriage = AxisLaw(0.8, FrictionLaw({"coulomb": 0.8, "viscous": 4.0}), rest_rate=1e-3)
        >>> carriage.effort(0.0, [-0.1, 0.0, 5e-4, 0.1])
        array([-1.2  ,  0.   ,  0.402,  1.2  ])
        """
        speed = np.asarray(rate, dtype=np.float64)
        if self.rest_rate == 0.0:
            return friction_torque(self.friction, place, speed) + self.offset
        least = np.copysign(np.maximum(np.abs(speed), self.rest_rate), speed)
        share = np.abs(speed) / np.abs(least)
        return share * friction_torque(self.friction, place, least) + self.offset


def _place(law: FrictionLaw) -> list[tuple[float | Array, int]]:
    return [(law[term.name], term.power) for term in law.terms if term.role is Role.PLACE]


def _sum(law: FrictionLaw, motion: Motion, role: Role) -> Array:
    """Sum over the law's rows of one role: magnitudes of DRY ones, SLIDING ones are 0 at rest."""
    total = np.zeros(())
    for term in law.terms:
        if term.role is not role or term.value is None:
            continue
        coefficient = law[term.name]
        if term.sided:
            forward = motion.direction > 0
            coefficient = np.where(forward, law[f"{term.name}_pos"], law[f"{term.name}_neg"])
        if not np.any(coefficient):
            continue
        scale = (law[term.scale],) if term.scale else ()
        total = total + coefficient * term.value(motion, *scale)
    if role is Role.SLIDING:
        return np.where(motion.direction == 0.0, 0.0, total)
    return total


def _known_names() -> list[str]:
    rows = {name: _row(name) for name in (*PARAMETERS, *TERMS)}
    stems = [name for name, row in rows.items() if row is not None]
    sided = [f"{row.name}_{side}" for row in rows.values() if row for side in ("pos", "neg")]
    return stems + sided


def _row(name: str) -> Term | None:
    """The row of friction that a parameter belongs to, None for the drive's and unknown ones."""
    found = side_of(name, PARAMETERS)
    row = PARAMETERS[found] if found is not None else TERMS.get(name)
    return None if row is None or row.role is Role.DRIVE else row
