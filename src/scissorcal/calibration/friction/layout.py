"""The parameters of a friction fit: rows of the table of terms, with priors and typical values."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.parameters import Layout, Parameter
from scissorcal.calibration.result import FitResult
from scissorcal.model import FrictionLaw, friction_torque
from scissorcal.model.friction_terms import PARAMETERS, REFERENCE, TERMS, terms_of
from scissorcal.model.terms import Term
from scissorcal.recipe.priors import FrictionPriors
from scissorcal.recording.recording import Joint

SIDES = {"": "", "_pos": ", positive rate", "_neg": ", negative rate"}


@dataclass(frozen=True)
class LawChoice:
    """The discrete choices of a friction law: its terms, symmetry and adopted terms.

    ``cogging`` is the number of periods a turn of a torque that repeats over the opening, 0 where
    there is none. ``zero_sd`` is how well the sensors' zeros are known that were subtracted, None
    where nothing shows them.
    """

    name: str
    symmetric: bool
    adopt: tuple[str, ...] = ()
    cogging: float = 0.0
    zero_sd: float | None = None

    @classmethod
    def of(cls, structure: Mapping[str, Any], zero_sd: float | None = None) -> "LawChoice":
        """The choices of a finished fit, from its structure."""
        return cls(
            str(structure["law"]),
            bool(structure["symmetric"]),
            tuple(structure.get("adopt", ())),
            float(structure.get("cogging_periods_per_turn", 0.0)),
            zero_sd,
        )


def friction_layout(
    choice: LawChoice, joint: Joint, priors: FrictionPriors, held_tick_s: float | None = None
) -> Layout:
    """Lay out the parameters of a law and of the terms that it adopts; ``noise`` stands last.

    ``held_tick_s`` is the sampling interval where the drive is held by commands, so that it is
    measured late; None where it is not.
    The offset of a symmetric law is free. Unequal Coulomb levels contain one: that of an asymmetric
    law is what is left of the sensors' zeros, and has their standard deviation as its prior.
    """
    symmetric, adopt = choice.symmetric, choice.adopt
    left_out = {
        "offset": not symmetric and choice.zero_sd is None,
        "cogging_cos": not choice.cogging,
        "cogging_sin": not choice.cogging,
        "delay": held_tick_s is None,
    }
    terms = terms_of(choice.name)
    rows: list[Parameter] = []
    for term in PARAMETERS.values():
        if left_out.get(term.name, bool(term.part) and term not in terms):
            continue
        if term.nuisance and adopt:
            rows += _adopted(adopt, joint, priors)
            adopt = ()
        if term.name == "offset" and not symmetric:
            assert choice.zero_sd is not None
            rows.append(_zero(term, joint, choice.zero_sd))
            continue
        rows += _rows(term, symmetric, joint, priors, held_tick_s or 1.0)
    return Layout(tuple(rows))


def friction_precision(layout: Layout) -> Array:
    """Precision (p, p) of the prior: levels that stand in proportion to others go with them."""
    precision = np.diag(1.0 / layout.sd**2)
    for place, name in enumerate(layout.names):
        term = PARAMETERS.get(name)
        if term is None or term.prior is None or not term.prior.beside:
            continue
        symmetric = term.prior.beside in layout.names
        levels = PARAMETERS[term.prior.beside].names(symmetric)
        ratio = np.zeros(len(layout.names))
        ratio[[layout.names.index(level) for level in levels]] = -1.0 / len(levels)
        ratio[place] = 1.0
        precision[place, place] = 0.0
        precision += np.outer(ratio, ratio) / layout.sd[place] ** 2
    return precision


def _rows(
    term: Term, symmetric: bool, joint: Joint, priors: FrictionPriors, tick_s: float
) -> list[Parameter]:
    mean, sd = priors.of(term, joint.kind)
    if term.prior is not None and term.prior.in_ticks:
        mean, sd = mean * tick_s, sd * tick_s
    unit = term.unit(joint.position_unit, joint.effort_unit)
    return [
        Parameter(
            name, unit, term.transform, mean, sd, term.meaning + SIDES[name.removeprefix(term.name)]
        )
        for name in term.names(symmetric)
    ]


def _zero(term: Term, joint: Joint, sd: float) -> Parameter:
    unit = term.unit(joint.position_unit, joint.effort_unit)
    meaning = "what is left of the sensors' zeros"
    return Parameter(term.name, unit, term.transform, 0.0, sd, meaning, measured_prior=True)


def _adopted(names: tuple[str, ...], joint: Joint, priors: FrictionPriors) -> list[Parameter]:
    """Adopted terms: normal around 0, with the recipe's sd of their effort at the reference."""
    rows = []
    for term in (TERMS[name] for name in names):
        size = abs(float(term.column(REFERENCE[joint.kind])))
        unit = term.unit(joint.position_unit, joint.effort_unit)
        sd = priors.adopted(joint.kind) / size
        rows.append(Parameter(term.name, unit, term.transform, 0.0, sd, f"adopted: {term.meaning}"))
    return rows


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
