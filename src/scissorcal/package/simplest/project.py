"""Project a fitted law onto a simpler candidate: the nearest torque over the scene, by draw.

Projection predictive inference (Piironen, Paasiniemi and Vehtari 2020, doi:10.1214/20-EJS1711):
the simpler law is not fitted to the data again but to what the fitted law predicts, once for each
posterior draw, so that its draws keep the uncertainty of the fit.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from scissorcal.package.simplest.difference import (
    PROJECTING,
    Difference,
    Felt,
    Scene,
    difference,
    felt,
)
from scissorcal.package.simplest.law import (
    ASPECTS,
    Aspect,
    Candidate,
    Law,
    fitted_candidate,
    simpler_candidates,
)
from scissorcal.package.simplest.nearest import nearest
from scissorcal.package.simplest.record import Cost, TriedCandidate
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


NOT_CHEAPER: tuple[Aspect, ...] = ("closure",)
"""Both closures take the same tables and the same time of a step, and only ``work`` derives from
the stored energy: nothing would be gained (docs/decisions/126-the-simplest-law-that-is-enough.md).
"""


@dataclass(frozen=True)
class Walked:
    """One aspect: the fitted candidate, the one used, each that was tried.

    ``before`` and ``after`` are the projections with and without this omission, the same object
    where nothing was left out; ``alone`` is the cost of this omission by itself.
    """

    aspect: Aspect
    fitted: Candidate
    used: Candidate
    tried: tuple[TriedCandidate, ...]
    before: Projection
    after: Projection
    alone: Cost | None


def walk(reference: Reference, allowed: float, confidence: float) -> tuple[Walked, ...]:
    """Take the cheapest candidate of each aspect that is within ``allowed`` of the reference.

    A candidate is judged together with what earlier aspects left out, so that the last projection
    holds jointly. It is enough where the worst difference over the places of the scene is at most
    ``allowed`` (a share of the local torque) at the MAP point and with ``confidence`` over the
    draws. One that fails at the MAP point already is not projected for the draws.
    """
    found: list[Walked] = []
    current = Projection.none(reference)
    for aspect in ASPECTS:
        walked = _walk_one(reference, aspect, current, allowed, confidence)
        found.append(walked)
        current = walked.after
    return tuple(found)


def cost_of(found: Difference, allowed: float, confidence: float) -> Cost:
    """The cost of a difference, with confidence over the draws where it has any."""
    worst, rms, newton_metres = (_four_digits(value) for value in found.at(confidence))
    drawn = len(found.worst_share) > 1
    probability = found.probability(allowed) if drawn else None
    return Cost(worst_share=worst, rms_share=rms, worst_Nm=newton_metres, probability=probability)


def _four_digits(value: float) -> float:
    """More digits of a difference say nothing, and make a manifest long."""
    return float(f"{value:.4g}")


def _walk_one(
    reference: Reference, aspect: Aspect, current: Projection, allowed: float, confidence: float
) -> Walked:
    fitted = fitted_candidate(reference.law, aspect)
    tried: list[TriedCandidate] = []
    for candidate in simpler_candidates(reference.law, aspect):
        central = project(reference.centre, candidate, current.centre(reference))
        cost = cost_of(central.difference, allowed, confidence)
        if aspect in NOT_CHEAPER:
            tried.append(TriedCandidate(name=candidate.name, verdict="not cheaper", cost=cost))
            continue
        if central.difference.worst_share[0] > allowed:
            tried.append(TriedCandidate(name=candidate.name, verdict="not enough", cost=cost))
            continue
        projected = project(reference, candidate, current)
        cost = cost_of(projected.difference, allowed, confidence)
        enough = projected.difference.within(allowed, confidence)
        tried.append(
            TriedCandidate(
                name=candidate.name, verdict="enough" if enough else "not enough", cost=cost
            )
        )
        if enough:
            alone = cost
            if current.law is not reference.law:
                by_itself = project(reference, candidate)
                alone = cost_of(by_itself.difference, allowed, confidence)
            return Walked(aspect, fitted, candidate, tuple(tried), current, projected, alone)
    return Walked(aspect, fitted, fitted, tuple(tried), current, current, None)
