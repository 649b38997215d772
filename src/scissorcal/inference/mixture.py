"""Mixtures of multivariate Student-t."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from scissorcal.aliases import Array

DEGREES_OF_FREEDOM = 7.0
FITTING_ROUNDS = 12
FEWEST_EFFECTIVE = 20
"""Effective draws per parameter that a fit is made from; fewer are evened out first."""


@dataclass(frozen=True)
class Mixture:
    """Student-t components: weights (k,), centres (k, p), Cholesky roots of scale (k, p, p)."""

    weights: Array
    centres: Array
    roots: Array

    @classmethod
    def of(cls, weights: Array, centres: Array, covariances: Array) -> "Mixture":
        """Build one from covariances (k, p, p), which become the components' scale matrices."""
        roots = np.linalg.cholesky(covariances)
        return cls(weights / np.sum(weights), np.asarray(centres), np.asarray(roots))

    def draw(self, count: int, rng: np.random.Generator) -> Array:
        """Draws, shape (count, p)."""
        nu, size = DEGREES_OF_FREEDOM, self.centres.shape[1]
        which = rng.choice(len(self.weights), size=count, p=self.weights)
        normal = rng.standard_normal((count, size))
        stretch = np.sqrt(nu / rng.chisquare(nu, count))
        away = np.einsum("nij,nj->ni", self.roots[which], normal * stretch[:, None])
        return np.asarray(self.centres[which] + away)

    def log_density(self, draws: Array) -> Array:
        """Log-density at draws (n, p) up to a constant, shape (n,)."""
        return np.asarray(np.logaddexp.reduce(self._by_component(draws), axis=1))

    def joined(self, other: "Mixture", share: float) -> "Mixture":
        """This mixture, with ``share`` of the weight given to another one."""
        return Mixture(
            np.concatenate([(1 - share) * self.weights, share * other.weights]),
            np.concatenate([self.centres, other.centres]),
            np.concatenate([self.roots, other.roots]),
        )

    def mapped(self, to: Callable[[Array], Array], slope: Array) -> "Mixture":
        """The mixture of draws that a linear map ``to`` of slope (p, p) leads elsewhere."""
        roots = slope @ self.roots
        return Mixture.of(self.weights, to(self.centres), roots @ roots.transpose(0, 2, 1))

    def _by_component(self, draws: Array) -> Array:
        nu, size = DEGREES_OF_FREEDOM, draws.shape[1]
        columns = []
        for weight, centre, root in zip(self.weights, self.centres, self.roots, strict=True):
            distance = np.sum(np.linalg.solve(root, (draws - centre).T) ** 2, axis=0)
            height = np.log(max(weight, 1e-300)) - np.log(np.diag(root)).sum()
            columns.append(height - 0.5 * (nu + size) * np.log1p(distance / nu))
        return np.stack(columns, axis=1)


def wide_mixture(mixture: Mixture, factor: float) -> Mixture:
    """The same components, each wider by a factor."""
    return Mixture(mixture.weights, mixture.centres, factor * mixture.roots)


def fit_mixture(draws: Array, weights: Array, components: int, rng: np.random.Generator) -> Mixture:
    """Fit a mixture to weighted draws (n, p), (n,) by expectation maximisation.

    Weights that rest on a few draws are evened out first, by the largest power that leaves enough
    of them. Components that few draws belong to lean on the covariance of all, so that each is
    positive definite.
    """
    weights = _evened(weights, min(FEWEST_EFFECTIVE * draws.shape[1], len(draws) / 2))
    overall = _covariance(draws, weights, weights @ draws)
    overall = overall + 1e-10 * np.diag(np.diag(overall)) + 1e-300 * np.eye(len(overall))
    if components == 1:
        return Mixture.of(np.ones(1), (weights @ draws)[None], overall[None])
    mixture = Mixture.of(
        np.ones(components),
        _spread_centres(draws, weights, overall, components, rng),
        np.repeat(overall[None] / 4, components, axis=0),
    )
    for _ in range(FITTING_ROUNDS):
        mixture = _improved(mixture, draws, weights, overall)
    return mixture


def _improved(mixture: Mixture, draws: Array, weights: Array, overall: Array) -> Mixture:
    logs = mixture._by_component(draws)
    share = np.exp(logs - np.logaddexp.reduce(logs, axis=1)[:, None]) * weights[:, None]
    mass = share.sum(axis=0)
    size = draws.shape[1]
    kept = [k for k in np.argsort(-mass) if mass[k] > 1e-3]
    centres, covariances = [], []
    for k in kept:
        own = share[:, k] / mass[k]
        centre = own @ draws
        members = 1.0 / np.sum(own**2)
        lean = (size + 2) / (members + size + 2)
        centres.append(centre)
        covariances.append((1 - lean) * _covariance(draws, own, centre) + lean * overall / 4)
    return Mixture.of(mass[kept], np.stack(centres), np.stack(covariances))


def _covariance(draws: Array, weights: Array, centre: Array) -> Array:
    away = draws - centre
    return np.asarray((weights * away.T) @ away)


def _spread_centres(
    draws: Array, weights: Array, overall: Array, components: int, rng: np.random.Generator
) -> Array:
    """Centres far from one another, drawn as k-means++ does (Arthur and Vassilvitskii 2007)."""
    white = np.linalg.solve(np.linalg.cholesky(overall), draws.T).T
    chosen = [int(rng.choice(len(draws), p=weights))]
    nearest = np.sum((white - white[chosen[0]]) ** 2, axis=1)
    for _ in range(components - 1):
        chances = weights * nearest
        if chances.sum() <= 0:
            break
        chosen.append(int(rng.choice(len(draws), p=chances / chances.sum())))
        nearest = np.minimum(nearest, np.sum((white - white[chosen[-1]]) ** 2, axis=1))
    chosen += [chosen[0]] * (components - len(chosen))
    return np.asarray(draws[chosen])


def _evened(weights: Array, wanted: float) -> Array:
    """Weights to the largest power up to one that leaves ``wanted`` effective draws."""
    usable = weights > 0
    if usable.sum() <= wanted:
        return np.asarray(usable / usable.sum())
    logs = np.where(usable, np.log(np.where(usable, weights, 1.0)), -np.inf)

    def tempered(power: float) -> Array:
        raised = np.where(usable, np.exp(power * (logs - logs[usable].max())), 0.0)
        return np.asarray(raised / raised.sum())

    low, high = 0.0, 1.0
    if 1.0 / np.sum(tempered(1.0) ** 2) >= wanted:
        return tempered(1.0)
    for _ in range(30):
        middle = 0.5 * (low + high)
        low, high = (
            (middle, high) if 1.0 / np.sum(tempered(middle) ** 2) >= wanted else (low, middle)
        )
    return tempered(low)
