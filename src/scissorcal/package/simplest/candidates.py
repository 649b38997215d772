"""The laws that are simpler than a fitted one: candidates of each aspect, cheapest first."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from scissorcal.model.friction_terms import law_names, parts_of
from scissorcal.package.simplest.law import Law

Aspect = Literal["friction", "fracture", "edge", "damping", "response", "closure"]

ASPECTS: tuple[Aspect, ...] = ("friction", "fracture", "edge", "damping", "response", "closure")
"""In the order in which they are walked: what saves most of a step and of a package first."""

FAMILIES = {
    "edge": ("line", "arc", "cubic", "spline"),
    "response": ("power", "exponential", "spline"),
    "fracture": ("smooth", "rippled"),
    "closure": ("eq4", "work"),
}
"""Cheapest first. A scene without a cut has neither fracture nor its candidates."""

NONE = "none"


@dataclass(frozen=True)
class Candidate:
    """One candidate of an aspect: the name of a family, of a friction law, or "none"."""

    aspect: Aspect
    name: str


def fitted_candidate(law: Law, aspect: Aspect) -> Candidate:
    """The candidate of an aspect that a law has.

    A friction law's name ends in "+adopted" where it has terms of ``fit.friction.adopt``.
    """
    structure = law.cut.structure
    if aspect == "friction":
        if law.friction is None:
            return Candidate(aspect, NONE)
        adopted = "+adopted" if law.friction.structure.get("adopt") else ""
        return Candidate(aspect, f"{law.friction.structure['law']}{adopted}")
    if aspect == "damping":
        return Candidate(aspect, "damped" if structure.get("rate_damping") else NONE)
    if aspect == "edge":
        return Candidate(aspect, str(structure["edge"]["family"]))
    return Candidate(aspect, str(structure[aspect]))


def simpler_candidates(law: Law, aspect: Aspect) -> tuple[Candidate, ...]:
    """The candidates of an aspect below the one that a law has, cheapest first.

    Fracture is left out only where nothing is cut, which the scene says and not this choice.
    """
    fitted = fitted_candidate(law, aspect).name
    if fitted == NONE:
        return ()
    if aspect == "friction":
        return tuple(Candidate(aspect, name) for name in (NONE, *_simpler_friction(fitted)))
    if aspect == "damping":
        return (Candidate(aspect, NONE),)
    names = FAMILIES[aspect]
    return tuple(Candidate(aspect, name) for name in names[: names.index(fitted)])


def _simpler_friction(fitted: str) -> list[str]:
    """Names of the friction laws whose parts are some of the fitted law's, fewest parts first."""
    law, adopted, _ = fitted.partition("+adopted")
    parts = set(parts_of(law))
    found = [name for name in law_names() if set(parts_of(name)) <= parts]
    found = [name for name in found if name != law or adopted]
    return sorted(found, key=lambda name: len(parts_of(name)))
