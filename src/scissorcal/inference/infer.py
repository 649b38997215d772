"""One posterior at a chosen effort: draft (Laplace), standard (PSIS), thorough (ensembles)."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from scissorcal.aliases import Array
from scissorcal.inference.autocorrelation import long_run_covariance
from scissorcal.inference.importance import (
    DEFENSIVE,
    GOOD_K,
    ROUNDS,
    Sampled,
    sample_by_importance,
    sample_by_mixture,
    sample_by_proposal,
)
from scissorcal.inference.laplace import Laplace, Shape, laplace, local_covariance, polish
from scissorcal.inference.mixture import Mixture
from scissorcal.inference.nested import nested_mixture
from scissorcal.inference.optimise import Optimum, find_optimum
from scissorcal.inference.posterior import Effort, InferOptions, Posterior
from scissorcal.inference.problem import (
    Counter,
    NotFiniteError,
    Problem,
    SamplingStatus,
    SearchStatus,
    TimeUsedUpError,
    about,
    picked,
)
from scissorcal.inference.thorough import ENSEMBLES, Chains, fewest_evaluations, run_ensembles

BUDGET = {"draft": 0, "standard": 200_000, "thorough": 2_000_000}
"""Evaluations that sampling may take where the caller says nothing."""

FOLLOWING = 450_000
"""Evaluations beside these for following a posterior that bends: two lattices of 400 nodes, each
node in two or three rounds of (p + 1) (p + 2) / 2 + p with p of 12 to 16, and up to 100,000 draws
of either."""

MIXTURE_TAKES = 15
"""Evaluations, in the draws asked for, that a mixture is given at least: five rounds, the draws
that judge it, and four more batches. Only what is left beside them is kept for ensembles."""

LEAST_HELD = 1e-4
"""Curvature of a log-posterior, in units of the prior's width, below which nothing holds a point;
a normal prior alone gives one."""

RIVAL = 12.0
"""Optima this far below the highest one still get a share of the draws."""


def infer(
    problem: Problem,
    effort: Effort,
    rng: np.random.Generator,
    *,
    count: int = 2000,
    optimum: Optimum | None = None,
    options: InferOptions = InferOptions(),
) -> Posterior:
    """Infer a posterior whose likelihood terms may be autocorrelated.

    The optimum is that of the posterior as given. Its curvature H counts all terms, or the
    problem's share of them, as independent; the scores' long-run covariance J tells what they are
    worth along each direction. The likelihood is therefore stretched about its optimum so that its
    curvature becomes H J^-1 H, which gives intervals their stated coverage although the noise is
    coloured or the model not quite true (Chandler and Bate 2007, doi:10.1093/biomet/asm015). Where
    the problem says that its terms are independent, it is taken as written.

    ``effort`` draft draws from the normal approximation; standard draws by Pareto-smoothed
    importance sampling around every optimum; thorough runs independent ensembles. Where standard
    does not do well (k-hat above 0.5) it goes on by itself, unless ``options`` forbid it: with a
    proposal that follows the posterior along its ``curved`` parameters (:func:`nested_mixture`), if
    the problem names any, then with a mixture that adapts to it. Where that still fails its check
    (k-hat above 0.7, or 0.5 for a proposal that was adapted to draws and for the normal
    approximation of a problem with ``curved`` parameters; fewer effective draws of a mixture than
    ``count``), and the budget allows, it goes on with ensembles. What it became is said in the
    result.
    ``optimum`` may be passed if it is known already, ``count`` is the number of draws. Where the
    time allowed is used up, what is there by then is returned, with the status for it, and draws of
    the normal approximation where there are no better ones. The curvature is measured whatever the
    time.

    Raises NotFiniteError (a ValueError) where the log-posterior is not finite at any start or
    beside the optimum, or so large that rounding hides its shape.
    """
    tell, stop = options.progress or (lambda done, sentence: None), options.stop
    counter = Counter()
    counted = counter.over(problem)
    tell(0.0, "searching the optimum")
    best = optimum or find_optimum(problem, stop=stop)
    if best.status is SearchStatus.ROUNDED:
        raise NotFiniteError(best.sentence)
    tell(0.3, "measuring the curvature")
    best, shape = polish(counted, best)
    best = _held(problem, best, shape)
    worth = (
        None if problem.independent else long_run_covariance(counted, shape.scores, shape.slopes)
    )
    spread = worth.covariance if worth else None
    local = laplace(counted, shape, spread)
    proposal = _proposal(counted, best, local)
    if stop is not None:
        local = laplace(counter.over(problem, stop), shape, spread)
    beside = 0 if options.budget else FOLLOWING
    limits = replace(options, budget=options.budget or BUDGET[effort], progress=tell)
    nothing = np.full(len(problem.names), np.nan)
    start = Posterior(
        names=problem.names,
        optimum=best,
        draws=np.zeros((0, len(nothing))),
        covariance=local.covariance,
        k_hat=float("nan"),
        effective=float(count),
        inflation=local.inflation,
        null=local.null,
        effort=effort,
        effort_reached="draft",
        status=SamplingStatus.APPROXIMATED,
        sentence="",
        evaluations=0,
        r_hat=nothing,
        tau=nothing,
        ensembles=0,
        acceptance=float("nan"),
        log_posterior=laplace(problem, shape, spread).log_posterior,
        noise_orders=worth.orders if worth else (),
        dispersion=worth.dispersion if worth else 1.0,
    )
    run = _Run(problem, start, local, proposal, counter, rng, count, limits, beside)
    try:
        outcome = run.at(effort)
    except NotFiniteError as error:
        if best.success:
            raise
        raise NotFiniteError(f"{best.sentence} So nothing could be sampled: {error}") from None
    tell(1.0, outcome.sentence)
    return replace(outcome, evaluations=best.evaluations + counter.calls)


def _held(problem: Problem, best: Optimum, shape: Shape) -> Optimum:
    """Say of an optimum that neither data nor prior hold it, where its curvature shows that."""
    unit = np.outer(problem.prior_sd, problem.prior_sd)
    values, vectors = np.linalg.eigh((shape.information + shape.curvature_prior) * unit)
    loose = values < LEAST_HELD
    if not best.success or not np.any(loose):
        return best
    concerns = picked(problem.names, np.asarray(np.any(vectors[:, loose] ** 2 > 0.1, axis=1)))
    status = SearchStatus.PLATEAU
    sentence = about(status, concerns)
    return replace(best, status=status, success=False, sentence=sentence, concerns=concerns)


def _proposal(problem: Problem, best: Optimum, local: Laplace) -> Mixture:
    """A component for each optimum that may hold mass, in the posterior that is sampled."""
    centres, covariances, logs = [local.centre], [local.covariance], [0.0]
    own = np.linalg.slogdet(local.covariance)[1]
    for rival in best.optima[1:]:
        if not rival.settled or rival.value < best.value - RIVAL:
            continue
        covariance = local_covariance(problem, rival.point, local)
        if covariance is None:
            continue
        centres.append(local.stretched(rival.point))
        covariances.append(covariance)
        logs.append(rival.value - best.value + 0.5 * (np.linalg.slogdet(covariance)[1] - own))
    shares = np.exp(np.array(logs) - max(logs))
    weights = np.maximum(shares / shares.sum(), 0.05)
    return Mixture.of(weights, np.stack(centres), np.stack(covariances))


def _following(
    local: Laplace, along: tuple[int, ...], left: Callable[[], int]
) -> Iterator[Mixture]:
    """Proposals that follow a bent posterior, made in two sets of coordinates.

    In its own the prior is normal; in those of the likelihood before it was stretched the model is
    linear in what does not bend. Either may be what counts. ``left`` are the evaluations that a
    lattice may take.
    """
    many, stretch = local.log_posteriors, local.stretch
    own = nested_mixture(many, local.centre, local.covariance, along, left())
    if own is not None:
        yield own
    if np.array_equal(stretch, np.eye(len(stretch))):
        return
    written = nested_mixture(
        lambda points: many(local.stretched(points)),
        local.written(local.centre),
        stretch @ local.covariance @ stretch.T,
        along,
        left(),
    )
    if written is not None:
        yield written.mapped(local.stretched, np.asarray(np.linalg.inv(stretch)))


@dataclass(frozen=True)
class _Run:
    problem: Problem
    start: Posterior
    """The posterior without draws, as of the normal approximation."""
    local: Laplace
    proposal: Mixture
    counter: Counter
    rng: np.random.Generator
    count: int
    limits: InferOptions
    beside: int
    """Evaluations beside the budget that following a bend may take."""

    @property
    def budget(self) -> int:
        return self.limits.budget or 0

    def tell(self, done: float, sentence: str) -> None:
        if self.limits.progress:
            self.limits.progress(done, sentence)

    def at(self, effort: Effort) -> Posterior:
        try:
            if effort == "draft":
                return self.draft()
            if effort == "standard":
                return self.standard()
            return self.thorough()
        except TimeUsedUpError:
            return self.out_of_time()

    def draft(self) -> Posterior:
        draws = self.rng.multivariate_normal(
            self.local.centre, self.local.covariance, size=self.count, method="cholesky"
        )
        draws = np.clip(draws, self.problem.lower, self.problem.upper)
        status = SamplingStatus.FLAT if self.local.null else SamplingStatus.APPROXIMATED
        sentence = status.value
        if self.local.null:
            sentence += f" It concerns {'; '.join(self.local.null)}."
        return replace(self.start, draws=draws, status=status, sentence=sentence)

    def out_of_time(self) -> Posterior:
        status = SamplingStatus.BUDGET_USED_UP
        sentence = f"{status.value} The time ended first: the draws are the normal approximation's."
        return replace(self.draft(), status=status, sentence=sentence)

    def standard(self) -> Posterior:
        self.tell(0.4, "sampling")
        proposal, first, escalate = self.proposal, self.counter.calls, self.limits.escalate
        many, beside = self.local.log_posteriors, self.beside

        def left() -> int:
            return max(self.budget + beside - (self.counter.calls - first), 0)

        bends = bool(self.problem.curved) and escalate
        rounds = 1 if bends else ROUNDS
        sampled = sample_by_importance(many, proposal, self.count, self.rng, rounds)
        said = f"k-hat {sampled.k_hat:.2f}"
        if bends and sampled.k_hat > GOOD_K:
            self.tell(0.45, f"{said}: following the posterior where it bends")
            before = self.counter.calls
            for mixture in _following(self.local, self.problem.curved, left):
                joined = mixture.joined(proposal, DEFENSIVE)
                outcome = sample_by_proposal(many, joined, self.count, self.rng, left())
                said += f", {outcome.k_hat:.2f} with a proposal that follows the bend"
                if outcome.trusted:
                    return self._weighed(outcome, said)
            beside = min(beside, self.counter.calls - before)
            sampled = replace(sampled, limit=GOOD_K)
        if sampled.k_hat > GOOD_K and escalate:
            self.tell(0.5, f"{said}: one Student-t does not fit well, adapting a mixture")
            after = left() - fewest_evaluations(len(self.problem.names))
            # where those are enough, ensembles can follow
            most = after if after >= MIXTURE_TAKES * self.count else left()
            mixed = sample_by_mixture(many, sampled, proposal, self.count, self.rng, most)
            if mixed is not None:
                said += f", {mixed.k_hat:.2f} with an adapted mixture"
                said += f" and {mixed.effective:.0f} effective draws ({mixed.wanted:.0f} wanted)"
                # Weights that passed are not refused by the stricter limits of a better proposal.
                passed = sampled.trusted and mixed.k_hat < sampled.k_hat
                sampled = replace(mixed, limit=sampled.limit, wanted=0.0) if passed else mixed
        if sampled.trusted or not escalate:
            return self._weighed(sampled, said)
        wanted = fewest_evaluations(len(self.problem.names))
        if left() < wanted:
            said += f"; ensembles need at least {wanted} evaluations and {left()} are left"
            return self._weighed(sampled, said)
        self.tell(0.6, f"{said}: running ensembles")
        return self._walked(left(), sampled, f"Escalated from standard ({said}). ")

    def thorough(self) -> Posterior:
        self.tell(0.4, "checking the approximation")
        many = self.local.log_posteriors
        sampled = sample_by_importance(many, self.proposal, self.count, self.rng, rounds=1)
        return self._walked(self.budget, sampled, "")

    def _weighed(self, sampled: Sampled, said: str) -> Posterior:
        status = SamplingStatus.WEIGHED if sampled.trusted else SamplingStatus.HEAVY_WEIGHTS
        if not sampled.trusted and sampled.k_hat <= sampled.limit:
            status = SamplingStatus.TOO_FEW
        return replace(
            self.start,
            draws=sampled.resample(self.count, self.rng),
            effort_reached="standard",
            status=status,
            sentence=f"{status.value} ({said}.)",
            effective=sampled.effective,
            k_hat=sampled.k_hat,
        )

    def _walked(self, budget: int, sampled: Sampled, before: str) -> Posterior:
        limits = replace(
            self.limits,
            budget=budget,
            progress=lambda done, sentence: self.tell(0.5 + 0.5 * done, sentence),
        )
        local = self.local
        chains = run_ensembles(
            local.log_posterior, self.proposal, self.rng, limits, local.log_posteriors
        )
        return replace(
            self.start,
            draws=_thinned(chains, self.count, self.rng),
            effort_reached="thorough",
            status=chains.status,
            sentence=before + _said(chains, self.problem.names),
            effective=chains.effective,
            k_hat=sampled.k_hat,
            r_hat=chains.r_hat,
            tau=chains.tau,
            ensembles=ENSEMBLES,
            acceptance=chains.acceptance,
        )


def _thinned(chains: Chains, count: int, rng: np.random.Generator) -> Array:
    """Draws (count, p) from all ensembles alike, evenly spread over their steps."""
    every = np.moveaxis(chains.draws, 1, 0).reshape(-1, chains.draws.shape[-1])
    positions = ((rng.random() + np.arange(count)) / count * len(every)).astype(np.int64)
    return np.asarray(every[rng.permutation(positions)])


def _said(chains: Chains, names: tuple[str, ...]) -> str:
    never = ~np.isfinite(chains.tau)
    if np.any(never):
        return about(chains.status, picked(names, never))
    return (
        f"{chains.status.value} ({ENSEMBLES} ensembles of {chains.steps} steps, autocorrelation "
        f"time {chains.tau.max():.0f}, R-hat {chains.r_hat.max():.3f}.)"
    )
