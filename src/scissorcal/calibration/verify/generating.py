"""The distribution that true parameters are drawn from: around a posterior, or the prior."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.calibration.fit_model import Experiment
from scissorcal.calibration.stated_prior import StatedPrior
from scissorcal.calibration.verify.result import PriorKind

NOT_SIMULATED = ("noise", "noise_scale", "rest_phase", "rest_spread")
"""Parameters of a likelihood that a simulation does not take from the truth: the size of the noise
of its terms, and where in a tooth's cycle cracks come to rest. A simulated crack walks with other
teeth along the recorded motion, so it turns at any phase."""


@dataclass(frozen=True)
class Generating:
    """A normal distribution of unconstrained parameters, for truths and as the refits' prior.

    ``mean`` (p,), ``precision`` (p, p); see `generating_prior` for ``kind`` and ``spread``.
    """

    kind: PriorKind
    spread: float
    mean: Array
    precision: Array

    @property
    def words(self) -> str:
        """Its description, for people."""
        if self.kind == "recipe":
            return "the recipe's prior"
        return (
            f"a normal distribution around the posterior, {self.spread:g} times as wide and within "
            "the recipe's prior"
        )

    def draw(self, rng: np.random.Generator) -> Array:
        """Draw one point (p,)."""
        root = np.linalg.cholesky(self.precision)
        return np.asarray(self.mean + np.linalg.solve(root.T, rng.standard_normal(len(self.mean))))


def generating_prior(
    experiment: Experiment, draws: Array, kind: PriorKind, spread: float
) -> Generating:
    """The distribution of truths, given the posterior's unconstrained ``draws`` (n, p).

    "local": the recipe's prior times the likelihood raised to 1 / ``spread``^2, as a normal
    distribution. It is ``spread`` times as wide as the posterior where the data are informative and
    never wider than the prior, so that calibration is tested near the posterior: a recipe's prior
    spans factors of 100, and most of its draws are far from any material. The same distribution is
    the refits' prior, so ranks are uniform for a calibrated inference. Posterior calibration
    (Säilynoja et al. 2025, arXiv:2502.03279) conditions on the data in the same way, but with their
    full weight, so that the simulated data add little.

    "recipe": the recipe's own prior, for simulated fits and refits.
    """
    rung = experiment.candidate(experiment.observed)
    prior = rung.prior_precision
    if kind == "recipe":
        return Generating(kind, 1.0, rung.prior_mean, prior)
    scale = experiment.layout.sd
    unit = np.outer(scale, scale)
    posterior = np.linalg.inv(np.cov(draws, rowvar=False) / unit)
    values, vectors = np.linalg.eigh(posterior - prior * unit)
    likelihood = (vectors * np.maximum(values, 0.0)) @ vectors.T / unit
    return Generating(kind, spread, draws.mean(axis=0), prior + likelihood / spread**2)


def refit_prior(experiment: Experiment, generating: Generating) -> StatedPrior:
    """The prior of fits to simulated data: the distribution of their truths.

    What is ``NOT_SIMULATED`` keeps the recipe's prior: simulated data do not come from its truth.
    """
    own = experiment.candidate(experiment.observed)
    names = experiment.layout.names
    kept = [i for i, name in enumerate(names) if name not in NOT_SIMULATED]
    mean = generating.mean if generating.kind == "local" else own.prior_mean
    covariance: Array = np.asarray(np.linalg.inv(generating.precision))
    return StatedPrior(
        tuple(names[i] for i in kept),
        mean[kept],
        covariance[np.ix_(kept, kept)],
        str(own.key.get("response", "")),
    )


def unbroken(series: NDArray[np.int64], kept: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Labels (n,) of the contiguous stretches where only ``kept`` bins of ``series`` are used.

    >>> unbroken(np.array([0, 0, 0, 0, 1]), np.array([True, True, False, True, True]))
    array([0, 0, 1, 2, 3])
    """
    turns = (np.diff(series) != 0) | (np.diff(kept.astype(np.int64)) != 0)
    return np.concatenate([[0], np.cumsum(turns)]).astype(np.int64)
