"""Try the candidates of each aspect of a law, cheapest first, until one is enough for a scene."""

from __future__ import annotations

from dataclasses import dataclass

from scissorcal.package.simplest.candidates import (
    ASPECTS,
    Aspect,
    Candidate,
    fitted_candidate,
    simpler_candidates,
)
from scissorcal.package.simplest.difference import Difference
from scissorcal.package.simplest.project import Projection, Reference, project
from scissorcal.package.simplest.record import Cost, TriedCandidate

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
