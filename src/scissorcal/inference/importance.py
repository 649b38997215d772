"""Importance sampling from mixtures of Student-t, with Pareto-smoothed weights."""

from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from scissorcal.aliases import Array
from scissorcal.inference.mixture import Mixture, fit_mixture, wide_mixture

Many = Callable[[Array], Array]

K_HAT_LIMIT = 0.7
"""k-hat below which weights of a proposal made without draws can be trusted."""

ADAPTED_LIMIT = 0.5
"""The same for a proposal that was adapted to draws: such a one has seen no region that it lacks,
and k-hat cannot tell of what was never visited. With 0.7 a bent valley passed with a standard
deviation 8 to 20 % too small."""

NO_MEAN = 1.0
"""k-hat above which weights have no mean, so that more draws do not help. Below, k-hat of a few
hundred effective draws is too rough to end with: it is judged when all are drawn."""

GOOD_K = 0.5
"""k-hat above which a better proposal is sought: from there on weights have no variance. Where a
posterior is known to bend, none above is trusted of the normal approximation: one of 0.67 with 183
effective draws of EMPS had a standard deviation 35 % too small."""

FEWEST_EFFECTIVE = 50.0
"""Effective draws below which k-hat counts as infinite. It is then fitted to as few weights, whose
tail may look short: with a proposal 1,000 standard deviations off, 5 of 2,000 draws carried all
weight and k-hat was -0.2. Fifty draws give a standard deviation to 10 %."""

GOOD_MIXTURE_K = 0.3
"""k-hat at which a mixture is not improved further."""

COLLAPSED = 1e-2
"""Width of the weighted draws, in that of the first proposal, below which an adapted one counts as
collapsed: far from the posterior's mass every small region looks level, weights there are even, and
k-hat is low."""

LOOKED_BEYOND = 2.5
"""Factor on the width of half of the draws that judge an adapted proposal. Along a curved ridge 20
times longer than wide, a proposal that ended short of its ends had a k-hat of 0.35, and quantiles
came out 0.3 sds too near; draws from beyond its ends see what it lacks."""

MORE_BATCHES = 24
"""How often a mixture is drawn from again, at most, until its effective draws are as many as were
asked for; with fewer it is not trusted. On four curved ridges in 2 to 14 dimensions (200 seeds
each) 25 of 207 mixtures trusted so had a quantile off by more than 0.3 sds. With a k-hat up to 0.5
and half as many effective draws it was 115 of 335, and 31 of 113 where 0.3 was enough."""

ROUNDS = 4
MIXTURE_ROUNDS = 5
COMPONENTS = 3
DEFENSIVE = 0.1
WIDER = 1.5
"""Factor on the width of a mixture's components, so that its reach grows from round to round."""


@dataclass(frozen=True)
class Sampled:
    """Draws (n, p) with smoothed normalised weights (n,), tail index and effective sample size.

    ``limit`` is the k-hat below which the weights can be trusted, where the effective draws are at
    least ``wanted``; ``log_ratio`` (n,) is the logarithm of the weights as they were drawn,
    ``proposal`` what the draws came from.
    """

    draws: Array
    weights: Array
    k_hat: float
    effective: float
    evaluations: int
    limit: float = K_HAT_LIMIT
    wanted: float = 0.0
    log_ratio: Array = field(default_factory=lambda: np.zeros(0), repr=False)
    proposal: Mixture | None = field(default=None, repr=False)

    @property
    def trusted(self) -> bool:
        """Whether the draws stand for the posterior."""
        return self.k_hat <= self.limit and self.effective >= self.wanted

    def resample(self, count: int, rng: np.random.Generator) -> Array:
        """Equally weighted draws (count, p), by systematic resampling."""
        positions = (rng.random() + np.arange(count)) / count
        chosen = np.searchsorted(np.cumsum(self.weights), positions)
        return np.asarray(self.draws[rng.permutation(np.minimum(chosen, len(self.draws) - 1))])


def sample_by_importance(
    log_posteriors: Many,
    proposal: Mixture,
    count: int,
    rng: np.random.Generator,
    rounds: int = ROUNDS,
) -> Sampled:
    """Sample a posterior near its Laplace approximation.

    ``log_posteriors`` gives the log-posterior of draws (n, p), shape (n,). Draws come from a
    mixture of multivariate Student-t (7 degrees of freedom), one for each known optimum; weights
    are Pareto-smoothed (Vehtari et al. 2024, JMLR 25:72). Where k-hat lies between 0.5 and 0.7 as
    many draws are added first: of 2,000 draws k-hat has an error of 0.1. Where it still exceeds 0.5
    the proposal is moved to the mean and covariance of the weighted draws, ``rounds`` times at
    most, and kept where that served. Each fit is to the draws of all rounds so far.
    """
    sampler = _Sampler(log_posteriors, count, rng)
    first = sampler.once(proposal)
    if rounds < 2:
        return first
    if GOOD_K < first.k_hat <= K_HAT_LIMIT:
        first = _joined(first, sampler.once(proposal), proposal)
    if first.k_hat <= GOOD_K:
        return first
    components = len(proposal.weights)

    def refit(sampled: Sampled) -> Mixture:
        return fit_mixture(sampled.draws, sampled.weights, components, rng)

    adapted = _adapted(sampler, first, refit, rounds - 1, GOOD_K)
    if first.trusted and not adapted.trusted:
        return replace(first, evaluations=adapted.evaluations)
    return adapted


def sample_by_mixture(
    log_posteriors: Many,
    first: Sampled,
    proposal: Mixture,
    count: int,
    rng: np.random.Generator,
    budget: int,
) -> Sampled | None:
    """Sample a posterior that one Student-t does not fit, from a mixture of several.

    Begins from weighted draws that failed their check. In each round a mixture is fitted to the
    weighted draws of all rounds so far (Cappé et al. 2008, doi:10.1007/s11222-008-9059-x) and
    made wider; a tenth of the draws keeps coming from ``proposal``, also made wider, so that no
    region is lost for good. It takes ``budget`` evaluations at most; None where they are too few.
    """
    rounds = min(MIXTURE_ROUNDS, budget // count - 2)
    if rounds < 1:
        return None
    batches = min(MORE_BATCHES, (budget - (rounds + 2) * count) // (2 * count))
    guard = wide_mixture(proposal, 2.0)

    def refit(sampled: Sampled) -> Mixture:
        fitted = fit_mixture(sampled.draws, sampled.weights, COMPONENTS, rng)
        return wide_mixture(fitted, WIDER).joined(guard, DEFENSIVE)

    sampler = _Sampler(log_posteriors, count, rng)
    return _adapted(sampler, first, refit, rounds, GOOD_MIXTURE_K, batches)


def sample_by_proposal(
    log_posteriors: Many, proposal: Mixture, count: int, rng: np.random.Generator, budget: int
) -> Sampled:
    """Sample from a proposal that was made without draws, until ``count`` of them are effective.

    Half of the draws come from a mixture of a few components that is fitted to a first round, the
    others from ``proposal``, so that no region that it has is lost. It takes about ``budget``
    evaluations at most.
    """
    sampler = _Sampler(log_posteriors, count, rng)
    first = sampler.once(proposal, 2)
    fitted = fit_mixture(first.draws, first.weights, COMPONENTS, rng)
    batches = max(min(MORE_BATCHES, budget // (2 * count) - 2), 0)
    joined = fitted.joined(proposal, 0.5)
    sampled = sampler.enough(joined, batches, NO_MEAN)
    return replace(sampled, wanted=float(count))


def _adapted(
    sampler: "_Sampler",
    first: Sampled,
    refit: Callable[[Sampled], Mixture],
    rounds: int,
    good: float,
    batches: int | None = None,
) -> Sampled:
    """Fit and draw in turn, then judge the best proposal by draws it was not made from.

    Each fit is to the draws of all rounds so far, weighed as draws of one mixture of all their
    proposals (Cornuet et al. 2012, doi:10.1111/j.1467-9469.2011.00756.x).
    The lowest of several k-hats is too low by its very choice, and a proposal that was fitted to
    draws looks better on them than it is; so what was adapted is drawn from afresh, twice as often.
    Where ``batches`` are given, half of these draws come from farther out than it reaches, and as
    many are drawn again, so often at most, until as many as were asked for are effective. A k-hat
    up to ``good`` ends the search.
    """
    sampled, lowest, used = first, np.inf, first.evaluations
    chosen = refit(first)
    proposal, earlier = chosen, [first]
    for left in range(rounds - 1, -1, -1):
        sampled = sampler.once(proposal)
        earlier.append(sampled)
        used += sampler.count
        if sampled.k_hat < lowest:
            lowest, chosen = sampled.k_hat, proposal
        if sampled.k_hat <= good or left == 0:
            break
        proposal = refit(pooled(earlier))
    beyond = batches is not None
    judging = chosen.joined(wide_mixture(chosen, LOOKED_BEYOND), 0.5) if beyond else chosen
    fresh = sampler.enough(judging, batches or 0, ADAPTED_LIMIT)
    if first.proposal is not None and _width(fresh, first.proposal) < COLLAPSED:
        fresh = replace(fresh, k_hat=np.inf)
    return replace(
        fresh,
        evaluations=used + len(fresh.draws),
        limit=ADAPTED_LIMIT,
        wanted=float(sampler.count) if beyond else 0.0,
    )


@dataclass(frozen=True)
class _Sampler:
    """Draws ``count`` at a time."""

    log_posteriors: Many
    count: int
    rng: np.random.Generator

    def once(self, proposal: Mixture, times: int = 1) -> Sampled:
        """So many ``times`` the count, weighed."""
        draws = proposal.draw(times * self.count, self.rng)
        return _weigh(draws, self.log_posteriors(draws) - proposal.log_density(draws), proposal)

    def enough(self, proposal: Mixture, batches: int, limit: float) -> Sampled:
        """Twice the count, and as many again until the count of all are effective.

        It ends after so many ``batches`` more, where k-hat is beyond ``limit``, and where there is
        no hope of as many.
        """
        count, fresh = self.count, self.once(proposal, 2)
        for left in range(batches, 0, -1):
            drawn = len(fresh.draws)
            # they grow in jumps, so go on while half of what is wanted is expected
            hopeless = 2.0 * fresh.effective * (drawn + 2 * count * left) < count * drawn
            if fresh.k_hat > limit or fresh.effective >= count or hopeless:
                break
            fresh = _joined(fresh, self.once(proposal, 2), proposal)
        return fresh


def _joined(sampled: Sampled, more: Sampled, proposal: Mixture) -> Sampled:
    """Draws of one proposal together."""
    return _weigh(
        np.concatenate([sampled.draws, more.draws]),
        np.concatenate([sampled.log_ratio, more.log_ratio]),
        proposal,
    )


def _width(sampled: Sampled, proposal: Mixture) -> float:
    """Least sd of weighted draws in any direction, in sds of a proposal's first component."""
    away = sampled.draws - sampled.weights @ sampled.draws
    white = np.linalg.solve(proposal.roots[0], away.T)
    values = np.linalg.eigvalsh((sampled.weights * white) @ white.T)
    return float(np.sqrt(max(values[0], 0.0)))


def pooled(parts: list[Sampled]) -> Sampled:
    """All draws, weighed as if each had come from the mixture of all proposals by their shares."""
    known = [(part, part.proposal) for part in parts if part.proposal is not None]
    if len(known) < len(parts):
        raise ValueError("draws are pooled by their proposals, and some have none")
    draws = np.concatenate([part.draws for part, _ in known])
    heights = [part.log_ratio + proposal.log_density(part.draws) for part, proposal in known]
    densities = [np.log(len(part.draws)) + proposal.log_density(draws) for part, proposal in known]
    joined = np.logaddexp.reduce(densities, axis=0) - np.log(len(draws))
    return _weigh(draws, np.concatenate(heights) - joined)


def _weigh(draws: Array, log_ratio: Array, proposal: Mixture | None = None) -> Sampled:
    usable = np.isfinite(log_ratio)
    if usable.sum() < FEWEST_EFFECTIVE:
        even = np.full(len(draws), 1 / len(draws))
        return Sampled(draws, even, np.inf, 0.0, len(draws), log_ratio=log_ratio, proposal=proposal)
    smoothed, k_hat = smooth_weights(log_ratio[usable])
    weights = np.zeros(len(draws))
    weights[usable] = np.exp(smoothed - smoothed.max())
    weights /= weights.sum()
    effective = float(1.0 / np.sum(weights**2))
    k = float(k_hat) if effective >= FEWEST_EFFECTIVE else np.inf
    return Sampled(draws, weights, k, effective, len(draws), log_ratio=log_ratio, proposal=proposal)


LARGEST_TAIL = 0.2
"""Share of the weights that may count as their tail."""

FEWEST_IN_TAIL = 5
PRIOR_DRAWS = 10
PRIOR_K = 0.5
"""Weak prior on the tail index: as much as ten draws, at a half."""

QUARTILES = 3.0


def smooth_weights(log_ratios: Array) -> tuple[Array, Array]:
    """Pareto-smoothed normalised log weights of log ratios (..., n), and their k-hats (...,).

    The largest 3 sqrt(n) ratios, a fifth of them at most, are replaced by quantiles of a
    generalised Pareto distribution that is fitted to them; its shape is k-hat, infinite where the
    tail is too short to be fitted (Vehtari et al. 2024, JMLR 25:72). Ratios must be finite;
    ValueError where they are not, or where there are none.

    >>> draws = np.random.default_rng(0).standard_normal(1000)
    >>> weights, k_hat = smooth_weights(0.1 * draws)
    >>> round(float(np.exp(weights).sum()), 6), bool(k_hat < 0.5)
    (1.0, True)
    """
    rows = np.atleast_2d(log_ratios)
    if rows.size == 0 or not np.all(np.isfinite(rows)):
        raise ValueError("importance ratios are smoothed where there are some, and all are finite")
    smoothed = [_smoothed(row) for row in rows]
    weights = np.stack([row for row, _ in smoothed]).reshape(np.shape(log_ratios))
    return weights, np.array([k_hat for _, k_hat in smoothed]).reshape(np.shape(log_ratios)[:-1])


def _smoothed(log_ratios: Array) -> tuple[Array, float]:
    logs = log_ratios - log_ratios.max()
    count = len(logs)
    length = int(np.ceil(min(LARGEST_TAIL * count, 3.0 * np.sqrt(count))))
    order = np.argsort(logs)
    cutoff = max(
        float(logs[order[-min(length, count - 1) - 1]]), float(np.log(np.finfo(float).tiny))
    )
    tail = order[logs[order] > cutoff]
    k_hat = float("inf")
    if len(tail) >= FEWEST_IN_TAIL:
        above = np.exp(logs[tail]) - np.exp(cutoff)
        k_hat, scale = _fit_pareto(above)
        if np.isfinite(k_hat) and scale > 0.0:
            places = (np.arange(len(tail)) + 0.5) / len(tail)
            logs[tail] = np.log(_pareto_quantiles(places, k_hat, scale) + np.exp(cutoff))
            logs = np.minimum(logs, 0.0)
    return logs - float(np.logaddexp.reduce(logs)), k_hat


def _fit_pareto(sample: Array) -> tuple[float, float]:
    """Shape and scale of a generalised Pareto distribution for a sorted sample (n,) above zero.

    The empirical Bayes estimate of Zhang and Stephens 2009 (doi:10.1198/tech.2009.08017), its shape
    drawn to a half by a weak prior.
    """
    count = len(sample)
    points = 30 + int(np.sqrt(count))
    quartile = sample[int(count / 4 + 0.5) - 1]
    grid = (1.0 - np.sqrt(points / (np.arange(points) + 0.5))) / (QUARTILES * quartile)
    grid = grid + 1.0 / sample[-1]
    shapes = np.mean(np.log1p(-grid[:, None] * sample), axis=1)
    heights = count * (np.log(-grid / shapes) - shapes - 1.0)
    weights = np.exp(heights - np.logaddexp.reduce(heights))
    weights = np.where(weights >= 10 * np.finfo(float).eps, weights, 0.0)
    best = float(np.sum(grid * weights) / np.sum(weights))
    shape = float(np.mean(np.log1p(-best * sample)))
    scale = -shape / best
    return (count * shape + PRIOR_DRAWS * PRIOR_K) / (count + PRIOR_DRAWS), scale


def _pareto_quantiles(places: Array, shape: float, scale: float) -> Array:
    if abs(shape) < np.finfo(float).eps:
        return np.asarray(-scale * np.log1p(-places))
    with np.errstate(over="ignore"):  # an infinite quantile is cut to the largest ratio
        return np.asarray(scale * np.expm1(-shape * np.log1p(-places)) / shape)
