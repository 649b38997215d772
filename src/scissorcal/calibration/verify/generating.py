"""What simulated data are made from: parameters around a posterior, noise like the residuals."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.experiment import Experiment
from scissorcal.calibration.verify.result import PriorKind
from scissorcal.inference import ArNoise, fit_ar

Array = NDArray[np.float64]

REPLICATES = 20
NOISE_SIZES = ("noise", "slow_noise")
"""Parameters that only say how loud the noise is, in the terms of the likelihood."""

QUIET = 0.05
"""A model's own irregularity, as a share of the residuals' variance, that counts as none."""

FEWEST_QUIET = 200


@dataclass(frozen=True)
class Generating:
    """A normal distribution of unconstrained parameters, for truths and as the refits' prior.

    ``mean`` (p,), ``precision`` (p, p); ``kind`` and ``spread`` say where it comes from.
    """

    kind: PriorKind
    spread: float
    mean: Array
    precision: Array

    @property
    def words(self) -> str:
        """Where it comes from, for people."""
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
    """Say what truths are drawn from, given the posterior's unconstrained ``draws`` (n, p).

    "local": the recipe's prior times the likelihood raised to 1 / ``spread``^2, as a normal
    distribution. It is ``spread`` times as wide as the posterior where the data speak and never
    wider than the prior where they do not, so that calibration is asked for where it is needed: a
    recipe's prior spans factors of 100, and most of what it would draw is absurd, or would be
    refused. Because the same distribution is the refits' prior, ranks are uniform for a calibrated
    inference all the same. Posterior calibration (Säilynoja et al. 2025, arXiv:2502.03279)
    conditions on the data in the same way; it gives them their full weight, which leaves the
    simulated data little to say.

    "recipe": the recipe's own prior, for simulated fits and refits.
    """
    rung = experiment.rung(experiment.observed)
    prior = rung.prior_precision
    if kind == "recipe":
        return Generating(kind, 1.0, rung.prior_mean, prior)
    scale = experiment.layout.sd
    unit = np.outer(scale, scale)
    posterior = np.linalg.inv(np.cov(draws, rowvar=False) / unit)
    values, vectors = np.linalg.eigh(posterior - prior * unit)
    likelihood = (vectors * np.maximum(values, 0.0)) @ vectors.T / unit
    return Generating(kind, spread, draws.mean(axis=0), prior + likelihood / spread**2)


def refit_prior(experiment: Experiment, generating: Generating) -> tuple[Array, Array]:
    """Mean (p,) and precision (p, p) of the prior that simulated data are refitted with.

    That which truths are drawn from, but for the sizes of the noise: what autoregressive noise
    amounts to in the terms of the likelihood is not known beforehand, so that these keep the
    recipe's prior. Thousands of bins tell them well, whatever the prior.
    """
    if generating.kind == "recipe":
        return generating.mean, generating.precision
    own = experiment.rung(experiment.observed)
    free = np.isin(experiment.layout.names, NOISE_SIZES)
    covariance = np.linalg.inv(generating.precision)
    covariance[free, :] = 0.0
    covariance[:, free] = 0.0
    covariance += np.diag(np.where(free, experiment.layout.sd**2, 0.0))
    return np.where(free, own.prior_mean, generating.mean), np.linalg.inv(covariance)


def residual_noise(experiment: Experiment, point: Array, rng: np.random.Generator) -> ArNoise:
    """Autoregression of the residuals at ``point`` (p,), where the model itself is regular.

    Bins at which simulations differ among themselves (a ripple, an uneven sheet) are left out, so
    that what the model adds by itself is not added twice; all are taken where too few remain.
    """
    mean = experiment.mean(point)
    residuals = experiment.observed - mean
    replicates = [experiment.simulate(point, rng) - mean for _ in range(REPLICATES)]
    irregular = np.mean(np.square(replicates), axis=0)
    quiet = irregular <= QUIET * np.median(residuals**2)
    if np.count_nonzero(quiet) < FEWEST_QUIET:
        return fit_ar(residuals, experiment.series)
    return fit_ar(residuals[quiet], unbroken(experiment.series, quiet)[quiet])


def unbroken(series: NDArray[np.int64], kept: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Labels (n,) of the stretches that stay whole where only ``kept`` bins of ``series`` are used.

    >>> unbroken(np.array([0, 0, 0, 0, 1]), np.array([True, True, False, True, True]))
    array([0, 0, 1, 2, 3])
    """
    turns = (np.diff(series) != 0) | (np.diff(kept.astype(np.int64)) != 0)
    return np.concatenate([[0], np.cumsum(turns)]).astype(np.int64)


def simulate(
    experiment: Experiment,
    noise: ArNoise,
    reference: Array,
    point: Array,
    rng: np.random.Generator,
) -> Array:
    """Simulate efforts (n,) at ``point`` (p,): the model's own, and autoregressive noise.

    The noise has its fitted size at the ``reference`` point, and grows with the parameter "noise"
    from there.
    """
    grown = 1.0
    if "noise" in experiment.layout.names:
        where = experiment.layout.names.index("noise")
        grown = float(np.exp(point[where] - reference[where]))
    drawn = noise.draw(experiment.series, rng)
    return np.asarray(experiment.simulate(point, rng) + grown * drawn)


def noise_in_words(noise: ArNoise, unit: str) -> str:
    """Describe an autoregression for people.

    >>> noise_in_words(ArNoise(1, (0.9,), 0.001), "N m")
    'AR(1), neighbours correlate by 0.90, standard deviation 0.00229 N m'
    """
    if noise.order == 0:
        return f"white, standard deviation {noise.sd:.3g} {unit}"
    memory = noise.autocovariance(2)
    return (
        f"AR({noise.order}), neighbours correlate by {memory[1] / memory[0]:.2f}, standard "
        f"deviation {noise.marginal_sd:.3g} {unit}"
    )
