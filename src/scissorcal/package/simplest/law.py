"""A fitted law at its MAP point and at posterior draws, with its parameters by name."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.calibration.result import FitResult
from scissorcal.model.friction_terms import law_names, parts_of
from scissorcal.package.exact import ExactModel, FitDraws, central_model, exact_model


@dataclass(frozen=True)
class Law:
    """The law of a cut and of friction: the MAP point in the first row, then posterior draws.

    Both have equally many rows. ``friction`` is None where none is rendered.
    """

    cut: FitDraws
    friction: FitDraws | None

    @classmethod
    def of_fits(cls, cut: FitResult, friction: FitResult | None, draws: Mapping[str, Array]) -> Law:
        """The law of two fits; ``draws`` are those of :func:`scissorcal.package.exact.pick_draws`.

        They have the keys "draws/cut.npy" and, with friction, "draws/friction.npy".
        """

        def rows(fit: FitResult) -> FitDraws:
            picked = draws[f"draws/{fit.what}.npy"]
            return FitDraws.of(fit, np.vstack([fit.map_point[None, :], picked]))

        return cls(rows(cut), rows(friction) if friction else None)

    @property
    def rows(self) -> int:
        """One more than there are draws."""
        return len(self.cut.draws)

    def model(self) -> ExactModel:
        """The exact model of all rows, its parameters of shape (rows, 1)."""
        return exact_model(self.cut, self.friction)

    def central(self) -> ExactModel:
        """The exact model at the MAP point, its parameters scalars: what tables are compiled of."""
        return central_model(self.cut, self.friction)

    def at(self, row: int) -> Law:
        """The law of one row alone."""
        return self.of_rows(np.array([row]))

    def of_rows(self, rows: NDArray[np.int64]) -> Law:
        """The law of some of the rows."""
        friction = self.friction and replace(self.friction, draws=self.friction.draws[rows])
        return Law(replace(self.cut, draws=self.cut.draws[rows]), friction)

    def part(self, what: str) -> FitDraws:
        """The draws of the fit called ``what``; ValueError for friction that is not rendered."""
        found = self.cut if what == "cut" else self.friction
        if found is None:
            raise ValueError("this law has no friction")
        return found

    def with_part(self, what: str, part: FitDraws | None) -> Law:
        """The law with another cut or friction."""
        if what == "friction":
            return replace(self, friction=part)
        if part is None:
            raise ValueError("a law has a cut")
        return replace(self, cut=part)


def column(part: FitDraws, name: str) -> Array:
    """One parameter over the rows, shape (rows,); KeyError if the law has none of this name."""
    if name not in part.names:
        raise KeyError(name)
    return part.draws[:, part.names.index(name)]


def with_columns(part: FitDraws, columns: Mapping[str, Array]) -> FitDraws:
    """The part with parameters (rows,) set by name; those that it lacks are added at the end."""
    names, draws = list(part.names), part.draws.copy()
    for name, values in columns.items():
        if name in names:
            draws[:, names.index(name)] = values
        else:
            names.append(name)
            draws = np.column_stack([draws, values])
    return FitDraws(part.structure, tuple(names), draws)


def without(part: FitDraws, names: Iterable[str]) -> FitDraws:
    """The part without the named parameters."""
    left_out = set(names)
    kept = [index for index, name in enumerate(part.names) if name not in left_out]
    return FitDraws(part.structure, tuple(part.names[i] for i in kept), part.draws[:, kept])


def structured(part: FitDraws, **changes: Any) -> FitDraws:
    """The part with other discrete choices."""
    return replace(part, structure={**part.structure, **changes})


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
