"""The table of friction terms: parameters, units, transforms, priors, and what each one adds.

Everything that knows a term takes it from here: the law and its name, the columns of the fit, the
curve of the model, a package's tables, the keys of the recipe and the labels of the report. A term
of a known role is added by adding its rows (docs/model.md, "Adding a friction term").
"""

from __future__ import annotations

import itertools
from collections.abc import Container
from typing import Any

from scissorcal.model.terms import LOG, LOGIT, Motion, Prior, Role, Term


def _of_speed(motion: Motion, scale: Any) -> Any:
    import numpy as np

    return np.exp(-((motion.speed / scale) ** 2))


def _sin(motion: Motion) -> Any:
    import numpy as np

    return np.sin(motion.opening)


def _cos(motion: Motion) -> Any:
    import numpy as np

    return np.cos(motion.opening)


def _one(motion: Motion) -> Any:
    return 1.0 + 0.0 * motion.rate


def _load(motion: Motion) -> Any:
    if motion.load is None:
        raise ValueError("this term needs a load, and none was measured")
    return motion.load


def _load_by_sign(motion: Motion) -> Any:
    return _load(motion) * motion.direction


def _load_by_rate(motion: Motion) -> Any:
    return _load(motion) * motion.rate


EFFORT, EFFORT_BY_RATE, FREE = (1, 0, 0), (1, -1, 1), (0, 0, 0)

_STATIC = (
    "static friction is about 1.3 times Coulomb friction (Armstrong-Helouvry et al. 1994, "
    "doi:10.1016/0005-1098(94)90209-7), and hardly 2.5 times; the factor is of their ratio"
)
_SURFACE = "lubricated metal has Stribeck speeds of 0.1 to 10 mm/s (Armstrong-Helouvry et al. 1994)"
_METAL = "sliding pairs of metal have 0.05 to 0.3"
_SCALES = "the scales of two sensors differ by less than a third"
_ASPERITIES = "asperities yield over 1 to 50 um"
_WHOLE = "all of it in the law of Dahl (1968), a tenth on EMPS; 0.18 to 0.997"
_HELD = "a held torque is late by half a tick, and its sensor by the filter: 1 or 2 ms"

_LAW = (
    Term(
        "inertia",
        "inertia of the moving joint",
        Role.DRIVE,
        (1, -1, 2),
        lambda m: m.acceleration,
        transform=LOG,
        prior=Prior(
            (3e-4, 100.0, "two blades of 30 to 100 g and 75 to 150 mm have 1e-4 to 1e-3 kg m^2"),
            (10.0, 100.0, "slides and axes of machines have 0.1 to 1000 kg"),
        ),
        units=("kg m^2", "kg"),
        remedy="check the signs of the torque and of the opening, and record a quicker excitation",
    ),
    Term(
        "offset",
        "constant offset",
        Role.DRIVE,
        EFFORT,
        _one,
        prior=Prior(
            (0.0, 0.1, "zero of the sensor, and weight: 100 g at 50 mm are 0.05 N m"),
            (0.0, 50.0, "zero of the sensor, and weight: 5 kg are 50 N"),
        ),
    ),
    Term(
        "coulomb",
        "Coulomb friction",
        Role.DRY,
        EFFORT,
        _one,
        part="coulomb",
        transform=LOG,
        sided=True,
        prior=Prior(
            (0.02, 100.0, "scissors that stay open hold a blade: 50 g at 40 mm are 0.02 N m"),
            (10.0, 100.0, "guides, screws and belts have 0.1 to 1000 N"),
        ),
        covers=("sign", "1"),
        remedy="the torque pushes with the motion: check its sign; or an offset larger than "
        "friction hides in an asymmetric law: set fit.friction.symmetry",
    ),
    Term(
        "viscous",
        "viscous friction",
        Role.SLIDING,
        EFFORT_BY_RATE,
        lambda m: m.rate,
        part="viscous",
        transform=LOG,
        sided=True,
        prior=Prior(
            (2e-3, 100.0, "a tenth of the usual Coulomb friction at 1 rad/s"),
            (50.0, 100.0, "half of the usual Coulomb friction at 0.1 m/s"),
        ),
        covers=("rate",),
        remedy='friction falls with the speed: compare laws with Stribeck friction (law = "auto"),'
        " check for a motor that compensates friction, and record faster sweeps",
    ),
    Term(
        "stribeck",
        "static minus Coulomb friction",
        Role.DRY,
        EFFORT,
        _of_speed,
        part="stribeck",
        transform=LOG,
        scale="stribeck_rate",
        prior=Prior(
            (6e-3, 5.0, _STATIC),
            (3.0, 5.0, _STATIC),
            beside="coulomb",
        ),
        remedy="static friction would be below Coulomb friction: record slower sweeps, or choose "
        "a law without Stribeck friction",
    ),
    Term(
        "stribeck_rate",
        "Stribeck speed",
        Role.SCALE,
        (0, 1, -1),
        part="stribeck",
        transform=LOG,
        prior=Prior(
            (0.1, 10.0, f"{_SURFACE}, and a pivot's surfaces lie 5 to 10 mm from its axis"),
            (0.01, 10.0, f"{_SURFACE}; plastic and rollers reach 0.1 m/s"),
        ),
    ),
    Term(
        "angle_slope",
        "change with angle",
        Role.PLACE,
        (0, -1, 0),
        part="angle",
        prior=Prior(
            (0.0, 1.5, "the set of the blades changes friction by its own size over 40 degrees"),
            (0.0, 5.0, "a guide's preload changes friction by its own size over 0.2 m"),
        ),
    ),
    Term(
        "angle_curvature",
        "curvature of the change with angle",
        Role.PLACE,
        (0, -2, 0),
        part="angle",
        prior=Prior(
            (0.0, 4.0, "as the slope: 2 / (0.7 rad)^2"), (0.0, 50.0, "as the slope: 2 / (0.2 m)^2")
        ),
    ),
    Term(
        "load_share",
        "friction per load",
        Role.DRY,
        FREE,
        lambda m: abs(_load(m)),
        part="load",
        transform=LOG,
        needs_load=True,
        prior=Prior((0.1, 12.0, _METAL), (0.1, 12.0, _METAL)),
        covers=("load", "load*sign"),
        remedy="friction would fall with the load: check the sign of the handle force",
    ),
    Term(
        "load_gain",
        "load that the drive bears in excess",
        Role.PLAIN,
        FREE,
        _load,
        part="load",
        needs_load=True,
        prior=Prior((0.0, 0.3, _SCALES), (0.0, 0.3, _SCALES)),
    ),
    Term(
        "presliding_share",
        "share of Coulomb friction that builds up after a reversal",
        Role.BUILD_UP,
        FREE,
        part="presliding",
        transform=LOGIT,
        prior=Prior((0.9, 40.0, _WHOLE), (0.9, 40.0, _WHOLE)),
    ),
    Term(
        "presliding_length",
        "way over which it builds up",
        Role.SCALE,
        (0, 1, 0),
        part="presliding",
        transform=LOG,
        prior=Prior(
            (0.01, 20.0, f"{_ASPERITIES}, 5 mm from an axis 2e-4 to 0.01 rad; shafts wind up more"),
            (3e-4, 20.0, f"{_ASPERITIES}; belts wind up over a millimetre and more"),
        ),
    ),
)
"""The drive's and the law's parameters, in the order in which fits have them."""

_REPEATS = "torque that repeats over the opening, in the drive"
_COGGING = Prior(
    (0.0, 0.02, "small motors cog by 1 to 20 mN m"),
    (0.0, 20.0, "motors cog by 1 to 20 N"),
    "cogging",
)
_NUISANCE = (
    *(
        Term(f"cogging_{wave}", _REPEATS, Role.DRIVE, EFFORT, prior=_COGGING, nuisance=True)
        for wave in ("cos", "sin")
    ),
    Term(
        "delay",
        "torque is measured late",
        Role.DRIVE,
        (0, 0, 1),
        nuisance=True,
        prior=Prior((0.5, 1.0, _HELD), (0.5, 1.0, _HELD), in_ticks=True),
    ),
    Term(
        "noise",
        "standard deviation of the residuals",
        Role.DRIVE,
        EFFORT,
        transform=LOG,
        nuisance=True,
        prior=Prior(
            (1e-3, 100.0, "a twentieth of the usual Coulomb friction"),
            (1.0, 100.0, "a tenth of the usual Coulomb friction"),
        ),
    ),
)

BY_PLACE, BY_PLACE_2 = (1, -1, 0), (1, -2, 0)
_SIGN = "Coulomb by place"

_ADOPTED = (
    Term("1", "constant", Role.SLIDING, EFFORT, _one),
    Term("sign", "Coulomb friction", Role.SLIDING, EFFORT, lambda m: m.direction),
    Term("rate", "viscous friction", Role.SLIDING, EFFORT_BY_RATE, lambda m: m.rate),
    Term("|rate|", "viscous, unequal", Role.SLIDING, EFFORT_BY_RATE, lambda m: m.speed),
    Term("rate^2", "quadratic, unequal", Role.SLIDING, (1, -2, 2), lambda m: m.rate**2),
    Term("rate*|rate|", "drag", Role.SLIDING, (1, -2, 2), lambda m: m.rate * m.speed),
    Term("rate^3", "cubic in the rate", Role.SLIDING, (1, -3, 3), lambda m: m.rate**3),
    Term("opening", "spring", Role.PLAIN, BY_PLACE, lambda m: m.opening),
    Term("opening^2", "spring, quadratic", Role.PLAIN, BY_PLACE_2, lambda m: m.opening**2),
    Term("sin(opening)", "weight", Role.PLAIN, EFFORT, _sin, rotary=True),
    Term("cos(opening)", "weight", Role.PLAIN, EFFORT, _cos, rotary=True),
    Term("sign*opening", _SIGN, Role.PLAIN, BY_PLACE, lambda m: m.direction * m.opening),
    Term(
        "sign*opening^2",
        f"{_SIGN}, quadratic",
        Role.PLAIN,
        BY_PLACE_2,
        lambda m: m.direction * m.opening**2,
    ),
    Term("rate*opening", "viscous by place", Role.PLAIN, (1, -2, 1), lambda m: m.rate * m.opening),
    Term(
        "rate^2*opening",
        "quadratic by place",
        Role.PLAIN,
        (1, -3, 2),
        lambda m: m.rate**2 * m.opening,
    ),
    Term("acceleration", "inertia", Role.DRIVE, (1, -1, 2), lambda m: m.acceleration),
    Term(
        "acceleration*opening",
        "inertia by place",
        Role.DRIVE,
        (1, -2, 2),
        lambda m: m.acceleration * m.opening,
    ),
    Term("load", "transmission", Role.PLAIN, FREE, _load, needs_load=True),
    Term("load*sign", "friction by load", Role.PLAIN, FREE, _load_by_sign, needs_load=True),
    Term("load*rate", "viscous by load", Role.PLAIN, (0, -1, 1), _load_by_rate, needs_load=True),
)

PARAMETERS = {term.name: term for term in (*_LAW, *_NUISANCE)}
"""Rows of a friction fit by the name of their parameter, without its direction."""
TERMS = {term.name: term for term in _ADOPTED}
"""Terms that the critic proposes and a recipe adopts, by name, simple ones first; what it searches
besides is in :mod:`~scissorcal.model.course_terms`."""
NUISANCE = tuple(term.name for term in _NUISANCE)
NEAR_REST = (
    *(n for t in _LAW if t.scale for n in (t.name, t.scale)),
    *(t.name for t in _LAW if t.part == "presliding"),
)
"""Parameters that matter below the slowest sweep alone, where no sweep is slow enough, or next to a
turn, where no window counts."""

ADOPTED = Prior(
    (0.0, 0.1, "five times the usual Coulomb friction, at 1 rad, 1 rad/s and 0.1 N m"),
    (0.0, 100.0, "ten times the usual Coulomb friction, at 0.1 m, 0.1 m/s and 100 N"),
    "adopted",
)
"""Prior of what an adopted term adds at :data:`REFERENCE`."""
ZERO = Prior(
    (0.0, 3e-3, "a force sensor that was tared some time ago is off by 0.05 N, at 60 mm"),
    (0.0, 1.0, "a force sensor of 1 kN is off by 0.1 % of its range"),
    "zero",
)
"""Prior of the drive that the sensors show at idle, where no idle second of a recording does."""
REFERENCE = {"rotary": Motion(1.0, 1.0, 0.0, 0.1), "linear": Motion(0.1, 0.1, 0.0, 100.0)}
"""Motion at which the prior of an adopted term is stated: 1 rad, 1 rad/s and 0.1 N m, or 0.1 m,
0.1 m/s and 100 N."""

BASES = {
    "coulomb": ("coulomb",),
    "coulomb+viscous": ("coulomb", "viscous"),
    "stribeck": ("coulomb", "viscous", "stribeck"),
}
"""What each beginning of a law's name brings."""

CANDIDATES = (
    "coulomb",
    "coulomb+viscous",
    "stribeck",
    "stribeck+angle",
    "stribeck+angle+load",
    "stribeck+angle+presliding",
    "stribeck+angle+load+presliding",
)
"""Laws that are compared where the recipe names none, cheapest first."""


def parts_of(law: str) -> tuple[str, ...]:
    """Parts that a law's name brings.

    >>> parts_of("stribeck+load")
    ('coulomb', 'viscous', 'stribeck', 'load')
    """
    base = next(name for name in reversed(BASES) if (law + "+").startswith(name + "+"))
    return (*BASES[base], *law.removeprefix(base).split("+")[1:])


def law_names() -> tuple[str, ...]:
    """Names of all laws: a beginning of :data:`BASES`, then other parts in the table's order.

    >>> law_names()[:3], len(law_names())
    (('coulomb', 'coulomb+angle', 'coulomb+load'), 24)
    """
    known = {part for parts in BASES.values() for part in parts}
    others = list(dict.fromkeys(t.part for t in _LAW if t.part and t.part not in known))
    chosen = [c for size in range(len(others) + 1) for c in itertools.combinations(others, size)]
    return tuple("+".join((base, *more)) for base in BASES for more in chosen)


def terms_of(law: str, adopt: tuple[str, ...] = ()) -> tuple[Term, ...]:
    """Rows of a law and of the terms that it adopts, without those of the drive."""
    parts = parts_of(law)
    return (*(term for term in _LAW if term.part in parts), *(TERMS[name] for name in adopt))


def needs_load(law: str) -> bool:
    """Whether a law has terms of the load."""
    return any(term.needs_load for term in terms_of(law))


def side_of(name: str, known: Container[str]) -> str | None:
    """The parameter among ``known`` that stands for ``name``: itself, or that of both directions.

    >>> side_of("coulomb_pos", {"coulomb"}), side_of("viscous_pos", {"coulomb"})
    ('coulomb', None)
    """
    stem = name.removesuffix("_pos").removesuffix("_neg")
    return name if name in known else stem if stem in known else None
