"""Project a fitted law onto a simpler candidate: the nearest torque over the scene, by draw.

Projection predictive inference (Piironen, Paasiniemi and Vehtari 2020, doi:10.1214/20-EJS1711):
the simpler law is not fitted to the data again but to what the fitted law predicts, once for each
posterior draw, so that its draws keep the uncertainty of the fit.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from scissorcal.package.simplest.candidates import Candidate
from scissorcal.package.simplest.difference import (
    PROJECTING,
    Difference,
    Felt,
    Scene,
    difference,
    felt,
)
from scissorcal.package.simplest.law import Law
from scissorcal.package.simplest.nearest import nearest
from scissorcal.package.simplest.restructure import restructure, settled
from scissorcal.recipe.schema import Recipe


@dataclass(frozen=True)
class Reference:
    """The law that projections are compared with: that of the fit.

    ``near`` is what it renders at the places over which laws are projected, ``felt`` at those where
    the result is judged, which are others.
    """

    law: Law
    projecting: Scene
    judging: Scene
    near: Felt
    felt: Felt

    @classmethod
    def of(cls, law: Law, recipe: Recipe) -> Reference:
        """Evaluate a fitted law over a recipe's scene, once for all projections."""
        projecting, judging = Scene.of(recipe, PROJECTING), Scene.of(recipe)
        return cls(law, projecting, judging, felt(law, projecting), felt(law, judging))

    @cached_property
    def centre(self) -> Reference:
        """The same at the MAP point alone."""
        law = self.law.at(0)
        near, at_judged = felt(law, self.projecting), felt(law, self.judging)
        return Reference(law, self.projecting, self.judging, near, at_judged)


@dataclass(frozen=True)
class Projection:
    """A law projected onto a candidate.

    ``law`` has a row for each of the reference's, the MAP point first; ``felt`` is what it renders,
    ``difference`` how far that is from the reference.
    """

    law: Law
    felt: Felt
    difference: Difference

    @classmethod
    def none(cls, reference: Reference) -> Projection:
        """The reference itself: nothing is simplified yet."""
        return cls(reference.law, reference.felt, difference(reference.felt, reference.felt))

    def centre(self, reference: Reference) -> Projection:
        """The same at the MAP point alone."""
        law = self.law.at(0)
        found = felt(law, reference.judging)
        return Projection(law, found, difference(reference.centre.felt, found))


def project(
    reference: Reference, candidate: Candidate, start: Projection | None = None
) -> Projection:
    """Project onto a candidate, whose parameters then render the torque nearest the reference.

    ``start`` is an earlier projection whose omissions stay omitted; without it the fitted law is
    simplified in this aspect alone. What the candidate does not touch keeps its values: friction
    while the edge is simplified, say. The nearest torque is that of least squares over the scene,
    of differences as shares of the local torque.

    Raises ValueError for a candidate that the law has no simpler law for.
    """
    start = start or Projection.none(reference)
    simpler, free = restructure(start.law, candidate, reference.projecting)
    found = nearest(simpler, free, reference.near, reference.projecting)
    found = settled(found, candidate, free)
    rendered = felt(found, reference.judging, start.felt)
    return Projection(found, rendered, difference(reference.felt, rendered))
