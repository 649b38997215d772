"""The posterior over two laws at once: with and without friction that grows with the load."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from scissorcal.calibration.cut.lack_of_fit import Budget
from scissorcal.calibration.cut.model import CutExperiment
from scissorcal.calibration.fit_candidate import FittedCandidate
from scissorcal.inference import Posterior

LEAST_PROBABILITY = 0.05
"""A law that is less probable is left out of the average."""


@dataclass(frozen=True)
class AveragedLaw:
    """A law after its fit, with its design and its probability among those averaged over."""

    fitted: FittedCandidate
    design: CutExperiment
    probability: float = 1.0


@dataclass(frozen=True)
class Inferred:
    """A law's posterior, its draws widened by the budget of lack of fit (None: not at all)."""

    law: AveragedLaw
    posterior: Posterior
    budget: Budget | None


def by_load(
    chosen: FittedCandidate, fitted: Sequence[tuple[FittedCandidate, CutExperiment]]
) -> list[AveragedLaw]:
    """The chosen law and its twin with or without load-dependent friction, the richest first.

    Which of the two holds moves force and fracture energy by as much as the share itself, so where
    the data leave both possible an interval has to cover both. Friction takes energy: where the
    best share is not above zero, the law without one is taken alone. Probabilities come from the
    evidence by Laplace's method, equal before data (Kass and Raftery 1995,
    doi:10.1080/01621459.1995.10476572).
    """
    design = next(d for c, d in fitted if c.candidate.name == chosen.candidate.name)
    twins = [
        (one, d)
        for one, d in fitted
        if replace(d.law, loaded=False, knots_m=()) == replace(design.law, loaded=False, knots_m=())
    ]
    if len(twins) == 1:
        return [AveragedLaw(chosen, design)]
    twins.sort(key=lambda twin: not twin[1].law.loaded)
    (loaded, its_design), plain = twins
    if its_design.layout.natural(loaded.optimum.point).get("load_share", 1.0) <= 0.0:
        return [AveragedLaw(replace(plain[0], equivalent=chosen.equivalent), plain[1])]
    logs = np.array([log_evidence(one) for one, _ in twins])
    odds = np.exp(logs - logs.max())
    kept = [i for i in range(len(twins)) if odds[i] / odds.sum() > LEAST_PROBABILITY]
    total = sum(odds[i] for i in kept)
    return [
        AveragedLaw(
            replace(twins[i][0], equivalent=chosen.equivalent), twins[i][1], float(odds[i] / total)
        )
        for i in kept
    ]


def log_evidence(fitted: FittedCandidate) -> float:
    """Laplace's approximation of the evidence's logarithm, up to what the data alone decide."""
    prior = fitted.candidate.prior_precision
    ratio = np.linalg.slogdet(fitted.information + prior)[1] - np.linalg.slogdet(prior)[1]
    return float(fitted.optimum.value - 0.5 * ratio)


def average(
    laws: Sequence[AveragedLaw],
    infer_one: Callable[[AveragedLaw], Inferred],
    rng: np.random.Generator,
) -> Inferred:
    """Infer each law and draw from each as often as it is probable, in the richest one's terms.

    Where the poorer law lacks a parameter its draws have zero: no friction by the load. The draws
    of both are shuffled, so that any part of them stands for the whole. The best point is that of
    the more probable law.
    """
    richest, *others = [infer_one(law) for law in laws]
    if not others:
        return richest
    (poorer,) = others
    names = richest.posterior.names
    count = len(richest.posterior.draws)
    own = round(count * richest.law.probability)
    filled = np.zeros((count, len(names)))
    filled[:, [names.index(name) for name in poorer.posterior.names]] = poorer.posterior.draws
    draws = rng.permutation(np.concatenate([richest.posterior.draws[:own], filled[own:]]))
    law = richest.law
    if poorer.law.probability > law.probability:
        optimum = law.fitted.optimum
        point = np.zeros(len(names))
        point[[names.index(n) for n in poorer.posterior.names]] = poorer.posterior.optimum.point
        moved = replace(law.fitted, optimum=replace(optimum, point=point))
        law = replace(law, fitted=moved)
    worst = max(
        richest,
        poorer,
        key=lambda one: (not one.posterior.status.trusted, np.nan_to_num(one.posterior.k_hat)),
    )
    averaged = replace(
        richest.posterior,
        draws=draws,
        k_hat=worst.posterior.k_hat,
        effective=min(richest.posterior.effective, poorer.posterior.effective),
        status=worst.posterior.status,
        sentence=worst.posterior.sentence,
        effort_reached=worst.posterior.effort_reached,
        ensembles=worst.posterior.ensembles,
        evaluations=richest.posterior.evaluations + poorer.posterior.evaluations,
    )
    return replace(richest, law=law, posterior=averaged)


def load_note(laws: Sequence[AveragedLaw]) -> tuple[str, ...]:
    """How probable friction that grows with the load is, where the data leave it open."""
    if len(laws) == 1:
        return ()
    probability = laws[0].probability
    return (
        f"Friction that grows with the load of the cut is {probability:.0%} probable by these "
        "data; intervals are averaged over the laws with and without it. Strokes that bear a load "
        "and cut nothing would decide it.",
    )
