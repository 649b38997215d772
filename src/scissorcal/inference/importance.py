"""Importance sampling around optima, Pareto-smoothed, with its own check."""

import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.inference.mixture import Mixture, fit_mixture, wide_mixture

Array = NDArray[np.float64]

GOOD_K = 0.6
"""k-hat at which the proposal is not improved further; 0.7 is where weights cannot be trusted."""

K_HAT_LIMIT = 0.7
COMPONENTS = 8
DEFENSIVE = 0.1


@dataclass(frozen=True)
class Sampled:
    """Draws (n, p) with smoothed normalised weights (n,), tail index and effective sample size."""

    draws: Array
    weights: Array
    k_hat: float
    effective: float
    evaluations: int = 0

    def resample(self, count: int, rng: np.random.Generator) -> Array:
        """Equally weighted draws (count, p), by systematic resampling."""
        positions = (rng.random() + np.arange(count)) / count
        chosen = np.searchsorted(np.cumsum(self.weights), positions)
        return np.asarray(self.draws[rng.permutation(np.minimum(chosen, len(self.draws) - 1))])


def sample_by_importance(
    log_posterior: Callable[[Array], float],
    proposal: Mixture,
    count: int,
    rng: np.random.Generator,
    rounds: int = 4,
) -> Sampled:
    """Sample a posterior near its Laplace approximation.

    Draws come from a mixture of multivariate Student-t (7 degrees of freedom), one for each known
    optimum; weights are Pareto-smoothed (Vehtari et al. 2024, JMLR 25:72). Where k-hat exceeds 0.6
    the proposal's mean and covariance are moved to those of the weighted draws, ``rounds`` times
    at most. k-hat below 0.7 says that the weights can be trusted.
    """
    return _rounds(log_posterior, proposal, count, rng, rounds, len(proposal.weights), None)


def sample_by_mixture(
    log_posterior: Callable[[Array], float],
    first: Sampled,
    proposal: Mixture,
    count: int,
    rng: np.random.Generator,
    rounds: int,
) -> Sampled:
    """Sample a posterior that one Student-t does not fit, from a mixture of several.

    Begins from weighted draws that failed their check. In each round a mixture is fitted to the
    weighted draws (population Monte Carlo, Cappé et al. 2008, doi:10.1007/s11222-008-9059-x); a
    tenth of the draws keeps coming from ``proposal``, made wider, so that no region is lost for
    good.
    """
    guard = wide_mixture(proposal, 2.0)
    begin = _refit(first, COMPONENTS, guard, rng)
    best = _rounds(log_posterior, begin, count, rng, rounds, COMPONENTS, guard)
    return best if best.k_hat < first.k_hat else _plus(first, best.evaluations)


def _rounds(
    log_posterior: Callable[[Array], float],
    proposal: Mixture,
    count: int,
    rng: np.random.Generator,
    rounds: int,
    components: int,
    guard: Mixture | None,
) -> Sampled:
    best: Sampled | None = None
    for round_ in range(rounds):
        draws = proposal.draw(count, rng)
        log_target = np.array([log_posterior(draw) for draw in draws])
        sampled = _weigh(draws, log_target - proposal.log_density(draws))
        if best is None or sampled.k_hat < best.k_hat:
            best = sampled
        best = _plus(best, count * (round_ + 1) - best.evaluations)
        if sampled.k_hat <= GOOD_K or round_ == rounds - 1:
            break
        proposal = _refit(sampled, components, guard, rng)
    assert best is not None
    return best


def _refit(
    sampled: Sampled, components: int, guard: Mixture | None, rng: np.random.Generator
) -> Mixture:
    fitted = fit_mixture(sampled.draws, sampled.weights, components, rng)
    return fitted if guard is None else fitted.joined(guard, DEFENSIVE)


def _plus(sampled: Sampled, evaluations: int) -> Sampled:
    return Sampled(
        sampled.draws,
        sampled.weights,
        sampled.k_hat,
        sampled.effective,
        sampled.evaluations + evaluations,
    )


def _weigh(draws: Array, log_ratio: Array) -> Sampled:
    with warnings.catch_warnings():
        # Once a day ArviZ announces its next major version, which this project does not use.
        warnings.simplefilter("ignore", FutureWarning)
        import arviz

    usable = np.isfinite(log_ratio)
    if usable.sum() < 50:
        return Sampled(draws, np.full(len(draws), 1 / len(draws)), np.inf, 0.0)
    smooth: Any = arviz.psislw
    smoothed, k_hat = smooth(log_ratio[usable])
    weights = np.zeros(len(draws))
    weights[usable] = np.exp(smoothed - smoothed.max())
    weights /= weights.sum()
    return Sampled(draws, weights, float(k_hat), float(1.0 / np.sum(weights**2)))
