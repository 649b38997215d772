"""What differs between recordings of one rig: each fitted by itself, each predicted by the rest."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.calibration.friction_experiment import FrictionExperiment
from scissorcal.calibration.friction_moments import ReducedLaw
from scissorcal.calibration.friction_search import ReducedProblem, ascend
from scissorcal.calibration.layout import Layout
from scissorcal.calibration.trust import HELD_OUT_LIMIT
from scissorcal.inference import Posterior, infer
from scissorcal.inference.between import between_groups
from scissorcal.recording.recording import Recording
from scissorcal.verdicts import Status, Verdict

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

SCALE = 0.02
"""Usual size of a difference between recordings: 2 % of what has a logarithm, else this share of
the prior's standard deviation."""
FEWEST_BINS = 100
"""Moving bins from which a recording is fitted by itself."""
FAR_APART = 3.0
"""Standard deviations from which two recordings are said to differ."""

NOT_KNOWN = (
    "There is one recording: how much the law's parameters vary from recording to recording is not "
    "known, and the intervals do not include it. Record the same sweeps again, after setting up "
    "anew or on another day."
)


@dataclass(frozen=True)
class RecordingError:
    """Errors on one recording, rms in the unit of the effort.

    ``rms`` is by the fit to all the others, ``own_rms`` by the law fitted to it alone.
    """

    recording: str
    rms: float
    relative_rms: float
    own_rms: float


@dataclass(frozen=True)
class BetweenRecordings:
    """What a law's parameters differ by from recording to recording.

    ``points`` (r, p) and ``covariances`` (r, p, p) are those of the recordings by themselves, in
    unconstrained coordinates; ``weights`` (r, p, p) what each has of the pooled point, ``sd``
    (n, p) draws of the standard deviation between recordings. ``largest_z`` (p,) is the largest
    difference of two recordings over its standard deviation. ``errors`` are those by the other
    recordings.
    """

    layout: Layout
    points: Array
    covariances: Array
    weights: Array
    sd: Array
    largest_z: Array
    errors: tuple[RecordingError, ...]

    def widened(self, draws: Array, rng: np.random.Generator) -> Array:
        """Give draws (n, p) of the pooled point the scatter of the recordings it rests on.

        The pooled point is a weighted mean of the recordings' values, theta + sum W_r delta_r with
        delta_r ~ N(0, diag(tau^2)); each draw takes its own tau.
        """
        tau = self.sd[rng.integers(len(self.sd), size=len(draws))]
        scatter = rng.standard_normal((len(self.points), *draws.shape)) * tau
        return np.asarray(draws + np.einsum("rij,rnj->ni", self.weights, scatter))

    def diagnostics(self) -> dict[str, Any]:
        """Plain numbers by parameter and by recording, for the fit's file."""
        names = self.layout.names
        return {
            "between_recordings_sd": dict(
                zip(names, np.median(self.sd, axis=0).tolist(), strict=True)
            ),
            "between_recordings_z": dict(zip(names, self.largest_z.tolist(), strict=True)),
            "left_out_recordings": [vars(error) for error in self.errors],
        }

    def notes(self, nuisance: tuple[str, ...]) -> tuple[str, ...]:
        """Which parameters differ by recording and by how much, in one sentence."""
        told = []
        for i, parameter in enumerate(self.layout.parameters):
            if parameter.name in nuisance or self.largest_z[i] < FAR_APART:
                continue
            values = parameter.natural(self.points[:, i])
            told.append(
                f"{parameter.name} from {values.min():.4g} to {values.max():.4g} {parameter.unit} "
                f"({self.largest_z[i]:.1f} standard deviations)"
            )
        head = f"{len(self.points)} recordings were fitted each by itself. "
        if not told:
            return (
                f"{head}Their parameters agree within {FAR_APART:g} standard deviations; so few "
                "recordings could agree by chance, and the intervals allow for that.",
            )
        return (
            f"{head}They differ in {', '.join(told)}. The intervals are of the mean over "
            "recordings and include this; a single new recording may lie as far away as these.",
        )

    def verdict(self) -> Verdict:
        """Judge the error on recordings that the fit had not seen."""
        worst = max(self.errors, key=lambda error: error.relative_rms)
        bad = worst.relative_rms >= HELD_OUT_LIMIT
        status: Status = "fail" if bad else "pass"
        why = (
            f"Fitted to the other recordings the law is off by {worst.relative_rms:.1%} (rms) on "
            f"{worst.recording}, fitted to that one by itself by "
            f"{worst.relative_rms * worst.own_rms / max(worst.rms, 1e-300):.1%}."
        )
        if bad:
            why += " The rig changed between recordings: find out what did, or fit them apart."
        return Verdict(
            "fit.friction", "recordings", status, worst.relative_rms, HELD_OUT_LIMIT, why
        )


def compare_recordings(
    design: FrictionExperiment,
    point: Array,
    recordings: tuple[Recording, ...],
    rng: np.random.Generator,
) -> BetweenRecordings | None:
    """Fit every recording by itself and by the others; None where fewer than two can be.

    ``design`` is the chosen law over all recordings, with normal noise, and ``point`` (p,) its
    optimum. The prior, which all share, is taken out of the recordings' estimates before they are
    compared (see :func:`scissorcal.inference.between.between_groups`).
    """
    index, every = design.bins.recording, design.rung(design.observed)
    labels = [
        int(label)
        for label in np.unique(index)
        if np.count_nonzero(index == label) >= FEWEST_BINS
    ]
    law = every.reduced
    if len(labels) < 2 or law is None:
        return None
    prior, problem = every.prior_precision, every.problem(design.series)
    points, covariances, precisions, estimates, errors = [], [], [], [], []
    for label in labels:
        here = index == label
        own = _inferred(design, law, here, point, rng)
        likelihood = _less_prior(np.linalg.inv(own.covariance), prior)
        points.append(own.optimum.point)
        covariances.append(own.covariance)
        precisions.append(likelihood)
        estimates.append(_without_prior(own, likelihood, prior, every.prior_mean))
        others = law.without(np.unique(design.strokes[here]))
        reached = ascend(replace(problem, reduced=others), point).point
        errors.append(
            _error(design, recordings[label].source, here, reached, own.optimum.point)
        )
    lambdas = np.stack(precisions)
    pooled = np.linalg.inv(lambdas.sum(axis=0) + prior)
    scatter = between_groups(np.stack(estimates), lambdas, _scales(design.layout), prior, rng)
    return BetweenRecordings(
        layout=design.layout,
        points=np.stack(points),
        covariances=np.stack(covariances),
        weights=np.einsum("ij,rjk->rik", pooled, lambdas),
        sd=scatter.sd,
        largest_z=_largest_z(np.stack(points), np.stack(covariances)),
        errors=tuple(errors),
    )


def jackknife(
    design: FrictionExperiment, point: Array, nuisance: tuple[str, ...]
) -> Mapping[str, float]:
    """Standard deviation of each parameter by leaving out one stroke at a time, in its unit.

    It estimates how far the estimate would move over repeats of such strokes: a lack of fit that
    every stroke repeats cancels and is not in it. Strokes of unequal length count by their bins
    (Busing, Meijer and van der Leeden 1999, doi:10.1023/A:1008800423698). Empty for fewer than
    three strokes.
    """
    rung = design.rung(design.observed)
    law, problem = rung.reduced, rung.problem(design.series)
    if law is None or len(law.moments.labels) < 3:
        return {}
    full = design.layout.columns(point)
    left = []
    for label in law.moments.labels:
        seen = replace(problem, reduced=law.without(np.array([label])))
        left.append(design.layout.columns(ascend(seen, point).point))
    size = (law.counted / law.moments.counts)[:, None]
    pseudo = size * full - (size - 1.0) * np.stack(left)
    centre = np.sum(pseudo / size, axis=0)
    variance = np.mean((pseudo - centre) ** 2 / (size - 1.0), axis=0)
    return {
        name: float(np.sqrt(value))
        for name, value in zip(design.layout.names, variance, strict=True)
        if name not in nuisance
    }


def _inferred(
    design: FrictionExperiment,
    law: ReducedLaw,
    here: NDArray[np.bool_],
    point: Array,
    rng: np.random.Generator,
) -> Posterior:
    """Normal approximation of the posterior by the bins (n,) of one recording."""
    outside = np.setdiff1d(law.moments.labels, np.unique(design.strokes[here]))
    rung = replace(design.rung(design.observed), starts=point[None, :])
    over: ReducedProblem = replace(
        rung.problem(design.series, here), reduced=law.without(outside)
    )
    from scissorcal.calibration.friction_search import search

    return infer(over, "draft", rng, optimum=search(over))


def _less_prior(precision: Array, prior: Array) -> Array:
    """Precision of the likelihood alone, never negative in any direction."""
    size = np.sqrt(np.diag(prior))
    values, vectors = np.linalg.eigh(precision / np.outer(size, size))
    values = np.maximum(values - 1.0, 0.0)
    return np.asarray((vectors * values) @ vectors.T * np.outer(size, size))


def _without_prior(own: Posterior, likelihood: Array, prior: Array, prior_mean: Array) -> Array:
    """Estimate (p,) by the likelihood alone, held where it is silent at the posterior's."""
    from scissorcal.inference.between import BROAD

    pulled = likelihood @ own.optimum.point + prior @ (own.optimum.point - prior_mean)
    held = likelihood + BROAD * prior
    return np.asarray(np.linalg.solve(held, pulled + BROAD * prior @ own.optimum.point))


def _scales(layout: Layout) -> Array:
    return np.array(
        [SCALE * (1.0 if p.transform == "log" else p.sd) for p in layout.parameters]
    )


def _largest_z(points: Array, covariances: Array) -> Array:
    variances = np.diagonal(covariances, axis1=1, axis2=2)
    apart = np.abs(points[:, None] - points[None]) / np.sqrt(variances[:, None] + variances[None])
    return np.asarray(apart.max(axis=(0, 1)))


def _error(
    design: FrictionExperiment, source: str, here: NDArray[np.bool_], others: Array, own: Array
) -> RecordingError:
    size = float(np.sqrt(np.mean(design.observed**2)))
    by_others, by_itself = (
        float(np.sqrt(np.mean((design.observed - design.mean(u))[here] ** 2)))
        for u in (others, own)
    )
    return RecordingError(source, by_others, by_others / size, by_itself)
