"""What widens the posterior of a cut: laws averaged, recordings that differ, lack of fit."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from scissorcal.aliases import Array, Mask
from scissorcal.calibration.between import BetweenRecordings, gather_recordings
from scissorcal.calibration.cut.model import CutExperiment
from scissorcal.calibration.fit_candidate import FittedCandidate
from scissorcal.inference import Posterior, find_optimum, infer
from scissorcal.inference.curvature import gradient, natural_step
from scissorcal.recording.recording import Recording

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
    budget: "Budget | None"


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
        (candidate, d)
        for candidate, d in fitted
        if replace(d.law, loaded=False, knots_m=()) == replace(design.law, loaded=False, knots_m=())
    ]
    if len(twins) == 1:
        return [AveragedLaw(chosen, design)]
    twins.sort(key=lambda twin: not twin[1].law.loaded)
    (loaded, its_design), plain = twins
    if its_design.layout.natural(loaded.optimum.point).get("load_share", 1.0) <= 0.0:
        return [AveragedLaw(replace(plain[0], equivalent=chosen.equivalent), plain[1])]
    logs = np.array([log_evidence(candidate) for candidate, _ in twins])
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
    share = round(count * richest.law.probability)
    filled = np.zeros((count, len(names)))
    filled[:, [names.index(name) for name in poorer.posterior.names]] = poorer.posterior.draws
    draws = rng.permutation(np.concatenate([richest.posterior.draws[:share], filled[share:]]))
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
        key=lambda drawn: (
            not drawn.posterior.status.trusted,
            np.nan_to_num(drawn.posterior.k_hat),
        ),
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


NOT_KNOWN = (
    "One recording: the variation of material and rig between recordings is unknown, and the "
    "intervals do not include it. Record the same material again, after a new set-up or on another "
    "day."
)


def compare_cuts(
    design: CutExperiment,
    point: Array,
    recordings: tuple[Recording, ...],
    usual: float,
    rng: np.random.Generator,
) -> BetweenRecordings | None:
    """Fit every recording alone, and from the others; None where fewer than two can be fitted.

    ``design`` is the law over all recordings, ``point`` (p,) its optimum, from which each search
    begins, ``usual`` the share by which recordings usually differ. No two recordings share a sheet,
    so that segments belong to one each. The line of the teeth is left out, since it is one number
    for all recordings.
    """
    design = replace(design, likelihood=replace(design.likelihood, line=None), _last={})
    candidate = replace(design.candidate(design.observed), starts=point[None, :])

    def alone(here: Mask) -> Posterior:
        problem = candidate.problem(design.series, here)
        return infer(problem, "draft", rng, optimum=find_optimum(problem))

    def others(here: Mask) -> Array:
        return find_optimum(candidate.problem(design.series, ~here)).point

    return gather_recordings(design, point, recordings, (alone, others), usual, rng)


def between_notes(between: BetweenRecordings | None, nuisance: tuple[str, ...]) -> tuple[str, ...]:
    """Notes on the differences between recordings, or that they are unknown."""
    return between.notes(nuisance) if between else (NOT_KNOWN,)


PERTURBATION = 1e-3
LOAD_ERROR = 0.1
"""Share by which friction that grows with the load may depart from proportion: with 0.1 of the
torque as friction, a rig of other construction was recovered within 1.3 % of the force."""


@dataclass(frozen=True)
class Budget:
    """How far each kind of segment would move the parameters if the law were wrong in it.

    ``shifts`` has by kind the change (p,) of the unconstrained parameters for a relative error of
    one; ``shares`` the relative error that is allowed for in each kind.
    """

    shares: Mapping[str, float]
    shifts: Mapping[str, Array]

    @property
    def sd(self) -> Array:
        """Standard deviation (p,) that the budget adds, in unconstrained parameters."""
        rows = [self.shares[kind] * shift for kind, shift in self.shifts.items()]
        return np.asarray(np.sqrt(np.sum(np.square(rows), axis=0)))

    def widen(self, draws: Array, rng: np.random.Generator) -> Array:
        """Draws (n, p), each with an independent error of every kind added."""
        wider = draws.copy()
        for kind, shift in self.shifts.items():
            wider += self.shares[kind] * rng.standard_normal((len(draws), 1)) * shift
        return wider


def budget_of(design: CutExperiment, point: Array, covariance: Array, share: float) -> Budget:
    """Compute how an error of each kind of segment moves the optimum at ``point`` (p,).

    A relative error e of a kind's torques (of the line's period) moves the optimum by
    C d(score)/de, with C the covariance (p, p) of the normal approximation. A law that is wrong in
    the same way in every stroke leaves no trace in the residuals, so the recipe states its size.
    """
    problem = design.candidate(design.observed).problem(design.series)
    step = 0.1 * natural_step(problem.log_posterior, point, 0.1 * problem.prior_sd)
    shifts = {}
    for kind, changed in changed_designs(design).items():
        other = changed.candidate(changed.observed).problem(changed.series)

        def gained(u: Array, other: object = other, problem: object = problem) -> Array:
            return np.array([other.log_likelihood(u) - problem.log_likelihood(u)])  # type: ignore[attr-defined]

        score = gradient(gained, point, step)[0] / PERTURBATION
        shifts[kind] = covariance @ score
    return Budget(error_shares(design, point, share), shifts)


def error_shares(design: CutExperiment, point: Array, share: float) -> dict[str, float]:
    """The relative error that is allowed for in each kind of segment of a design."""
    load = float(design.layout.natural(point).get("load_share", 0.0))
    elastic = float(np.hypot(share, LOAD_ERROR * load))
    return {kind: elastic if "loading" in kind else share for kind in changed_designs(design)}


def changed_designs(design: CutExperiment) -> dict[str, CutExperiment]:
    """Designs in which one kind of segment was measured larger by ``PERTURBATION``.

    Elastic segments may also be wrong in proportion to their torque, from less to more within a
    piece: the exponent follows from that.
    """
    segments = design.likelihood.segments
    none = np.zeros(0)
    opening = [np.full(len(p.torque), float(p.kind == "unloading")) for p in segments.pieces]
    slopes = [2.0 * p.torque / float(np.abs(p.torque).max()) - 1.0 for p in segments.pieces]
    unloading, slope = np.concatenate([*opening, none]), np.concatenate([*slopes, none])
    elastic, count = len(unloading), len(design.observed)
    rest = np.zeros(count - elastic)
    weights = {
        "loading": np.concatenate([1.0 - unloading, rest]),
        "unloading": np.concatenate([unloading, rest]),
        "loading, by its torque": np.concatenate([(1.0 - unloading) * slope, rest]),
        "unloading, by its torque": np.concatenate([unloading * slope, rest]),
        "running": (np.arange(count) >= elastic).astype(np.float64),
    }
    kinds = {}
    for kind, weight in weights.items():
        if np.any(weight):
            measured = (1.0 + PERTURBATION * weight) * design.likelihood.torque
            likelihood = replace(design.likelihood, measured=measured)
            kinds[kind] = replace(design, likelihood=likelihood, _last={})
    line = design.likelihood.line
    if line is not None:
        moved = replace(line, log_period=line.log_period + PERTURBATION)
        kinds["line"] = replace(design, likelihood=replace(design.likelihood, line=moved), _last={})
    return kinds
