"""What differs between recordings of one rig: each fitted by itself, each predicted by the rest."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array, Mask
from scissorcal.calibration.caveats import NEXT_RECORDING
from scissorcal.calibration.checks import HELD_OUT_LIMIT
from scissorcal.calibration.fit_model import Design, Experiment
from scissorcal.calibration.friction.model import FrictionExperiment
from scissorcal.calibration.friction.moments import ReducedLaw
from scissorcal.calibration.friction.search import search, search_from
from scissorcal.calibration.parameters import Layout
from scissorcal.inference import Posterior, infer
from scissorcal.inference.between import BROAD, between_groups, one_normal
from scissorcal.model.terms import LOG
from scissorcal.recording.recording import Recording
from scissorcal.verdicts import TORQUE, Check, Verdict

FEWEST_BINS = 100
"""Moving bins from which a recording is fitted by itself."""
MISFIT = 1.5
"""Factor on the error of a recording's own fit from which the fit to all is one to none."""
REPEATED = 0.5
"""Share of a parameter's information that every stroke must leave to the others for a jackknife."""
MOST_GROUPS = 64
"""Groups of strokes that a jackknife leaves out in turn at most. A standard deviation of g values
has a relative error of 1 / sqrt(2 (g - 1)), 9 % of 64: more would hardly make it better known."""
FAR_APART = 3.0
"""Standard deviations from which two recordings are said to differ."""

NOT_KNOWN = (
    "There is one recording: how much the law's parameters vary from recording to recording is not "
    "known, and the intervals do not include it. Record the same sweeps again, after setting up "
    "anew or on another day."
)
RECORDINGS = Check(
    "fit recordings",
    f"{TORQUE}rms error on a recording by the others, share of the rms of all recordings",
    at_most=HELD_OUT_LIMIT,
)


@dataclass(frozen=True)
class RecordingError:
    """Errors on one recording, rms in the unit of the effort.

    ``rms`` is by the fit to all the others, ``pooled_rms`` by that to all, ``own_rms`` by the law
    fitted to it alone.
    """

    recording: str
    rms: float
    relative_rms: float
    pooled_rms: float
    own_rms: float


@dataclass(frozen=True)
class BetweenRecordings:
    """What a law's parameters differ by from recording to recording.

    ``points`` (r, p) are those of the recordings by themselves, in unconstrained coordinates,
    ``precisions`` (r, p, p) those of their likelihoods alone, ``prior`` (p, p) that of the prior.
    ``sd`` (n, p) are draws of the standard deviation between recordings. ``largest_z`` (p,) is the
    largest difference of two recordings over its standard deviation. ``errors`` are those by the
    other recordings, ``what`` names the fit.
    """

    layout: Layout
    points: Array
    precisions: Array
    prior: Array
    sd: Array
    largest_z: Array
    errors: tuple[RecordingError, ...]
    what: str = "friction"

    def widened(self, draws: Array, rng: np.random.Generator) -> Array:
        """Widen draws (n, p) of the pooled parameters to those of the mean over recordings.

        Given the scatter tau, the covariance of that mean exceeds the pooled one. Draws get normal
        noise of the difference: its correlations are those given the median tau, its standard
        deviations those of the normals with the 90 % intervals of all tau
        (:func:`~scissorcal.inference.between.one_normal`). Without scatter draws stay where they
        are, whatever shape the posterior has. The centre stays the pooled one: where recordings say
        little by themselves, their own estimates would move it farther than they know.
        """
        pooled, typical = self._given(np.stack([np.zeros(len(self.prior)), self._typical_sd]))
        wanted = one_normal(np.diagonal(self._given(self.sd), axis1=1, axis2=2))
        stretch = wanted / np.sqrt(np.diag(typical))
        values, vectors = np.linalg.eigh(typical * np.outer(stretch, stretch) - pooled)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        return np.asarray(draws + rng.standard_normal(draws.shape) @ root.T)

    @property
    def _typical_sd(self) -> Array:
        """Median (p,) of the standard deviation between recordings."""
        return np.asarray(np.median(self.sd, axis=0))

    def _given(self, tau: Array) -> Array:
        """Covariance (k, p, p) of the mean over recordings given scatters ``tau`` (k, p)."""
        spread = tau[:, None, :, None] ** 2 * np.eye(tau.shape[1])
        covariances = np.linalg.inv(self.precisions + BROAD * self.prior)
        return np.linalg.inv(np.linalg.inv(covariances + spread).sum(axis=1) + self.prior)

    def diagnostics(self) -> dict[str, Any]:
        """Plain numbers by parameter and by recording, for the fit's file."""
        names = self.layout.names
        return {
            "between_recordings_sd": dict(zip(names, self._typical_sd.tolist(), strict=True)),
            NEXT_RECORDING: dict(zip(names, self._natural_sd().tolist(), strict=True)),
            "between_recordings_z": dict(zip(names, self.largest_z.tolist(), strict=True)),
            "left_out_recordings": [vars(error) for error in self.errors],
        }

    def _natural_sd(self) -> Array:
        """The median sd between recordings (p,) in the parameters' units."""
        centre = self.points.mean(axis=0)
        ends = self.layout.columns(np.stack([centre - self._typical_sd, centre + self._typical_sd]))
        return np.asarray(0.5 * (ends[1] - ends[0]))

    def notes(self, nuisance: tuple[str, ...]) -> tuple[str, ...]:
        """Which parameters differ by recording and by how much, in one sentence."""
        differences = []
        for i, parameter in enumerate(self.layout.parameters):
            if parameter.name in nuisance or self.largest_z[i] < FAR_APART:
                continue
            values = self.layout.columns(self.points)[:, i]
            differences.append(
                f"{parameter.name} from {values.min():.4g} to {values.max():.4g} {parameter.unit} "
                f"({self.largest_z[i]:.1f} standard deviations)"
            )
        head = f"{len(self.points)} recordings were fitted each by itself. "
        if not differences:
            return (
                f"{head}Their parameters agree within {FAR_APART:g} standard deviations; so few "
                "recordings could agree by chance, and the intervals allow for that.",
            )
        return (
            f"{head}They differ in {', '.join(differences)}. The intervals are of the mean over "
            "recordings and include this; a single new recording may lie as far away as these.",
        )

    def verdict(self) -> Verdict:
        """Judge the error on recordings that the fit had not seen."""
        worst = max(self.errors, key=lambda error: error.relative_rms)
        size = worst.rms / max(worst.relative_rms, 1e-300)
        why = (
            f"Fitted to the other recordings the law is off by {worst.relative_rms:.1%} (rms) on "
            f"{worst.recording}; fitted to all by {worst.pooled_rms / size:.1%}, to that one by "
            f"itself by {worst.own_rms / size:.1%}."
        )
        off = worst.relative_rms
        if off > HELD_OUT_LIMIT and worst.pooled_rms <= MISFIT * worst.own_rms:
            why += (
                " One law fits them all, but the others do not determine it there: record each "
                "load and speed twice to know how recordings differ."
            )
            return RECORDINGS.not_evaluated(why, off).of(f"fit.{self.what}")
        thing = "rig" if self.what == "friction" else "rig or the material"
        bad = f"{why} The {thing} changed between recordings: find out what did, or fit them apart."
        return RECORDINGS.judge(off, why, bad).of(f"fit.{self.what}")


def compare_recordings(
    design: FrictionExperiment,
    point: Array,
    recordings: tuple[Recording, ...],
    usual: float,
    rng: np.random.Generator,
) -> BetweenRecordings | None:
    """Fit every recording by itself and by the others; None where fewer than two can be.

    ``design`` is the chosen law over all recordings, with normal noise, ``point`` (p,) its optimum,
    ``usual`` the share by which recordings usually differ. The prior, which all share, is taken out
    of the recordings' estimates before they are compared (see
    :func:`scissorcal.inference.between.between_groups`).
    """
    candidate = design.candidate(design.observed)
    law, problem = candidate.reduced, candidate.problem(design.series)
    if law is None:
        return None

    def alone(here: Mask) -> Posterior:
        return _inferred(design, law, here, point, rng)

    def others(here: Mask) -> Array:
        left = law.without(np.unique(design.strokes[here]))
        return np.asarray(search_from(replace(problem, reduced=left), point)[0].point)

    return gather_recordings(design, point, recordings, (alone, others), usual, rng)


def gather_recordings(
    design: Design,
    point: Array,
    recordings: tuple[Recording, ...],
    fits: tuple[Callable[[Mask], Posterior], Callable[[Mask], Array]],
    usual: float,
    rng: np.random.Generator,
) -> BetweenRecordings | None:
    """Compare a law's fits to single recordings; None where fewer than two can be fitted.

    ``point`` (p,) is the optimum over all of them, ``usual`` the share by which recordings usually
    differ. ``fits`` give, for the bins (n,) of one recording, the posterior by it alone and the
    optimum (p,) without it.
    """
    index = design.bins.recording
    labels = [
        int(label) for label in np.unique(index) if np.count_nonzero(index == label) >= FEWEST_BINS
    ]
    if len(labels) < 2:
        return None
    candidate = design.candidate(design.observed)
    prior = candidate.prior_precision
    alone, others = fits
    points, covariances, precisions, estimates, errors = [], [], [], [], []
    for label in labels:
        here = index == label
        posterior = alone(here)
        likelihood = _less_prior(np.asarray(np.linalg.inv(posterior.covariance), float), prior)
        points.append(posterior.optimum.point)
        covariances.append(posterior.covariance)
        precisions.append(likelihood)
        estimates.append(_without_prior(posterior, likelihood, prior, candidate.prior_mean))
        reached = (others(here), point, posterior.optimum.point)
        errors.append(_error(design, recordings[label].source, here, reached))
    scatter = between_groups(
        np.stack(estimates), np.stack(precisions), usual_sd(design.layout, usual), prior, rng
    )
    return BetweenRecordings(
        layout=design.layout,
        points=np.stack(points),
        precisions=np.stack(precisions),
        prior=prior,
        sd=scatter.sd,
        largest_z=_largest_z(np.stack(points), np.stack(covariances)),
        errors=tuple(errors),
        what=design.what,
    )


def widened(
    posterior: Posterior, between: BetweenRecordings | None, rng: np.random.Generator
) -> Posterior:
    """The posterior with what recordings differ by in its draws."""
    if between is None:
        return posterior
    return replace(posterior, draws=between.widened(posterior.draws, rng))


def jackknife(
    design: FrictionExperiment, point: Array, nuisance: tuple[str, ...]
) -> Mapping[str, float]:
    """Standard deviation of each parameter by leaving out strokes in turn, in its unit.

    It estimates how far the estimate would move over repeats of such strokes: a lack of fit that
    every stroke repeats cancels and is not in it. One stroke is left out at a time, of more than
    ``MOST_GROUPS`` every such one together. Groups of unequal length count by their bins
    (Busing, Meijer and van der Leeden 1999, doi:10.1023/A:1008800423698). Parameters that owe most
    of their information to one group are left out, as no other repeats it; empty for fewer than
    three strokes.
    """
    candidate = design.candidate(design.observed)
    law, problem = candidate.reduced, candidate.problem(design.series)
    if law is None or len(law.moments.labels) < 3:
        return {}
    full, information = design.layout.columns(point), np.diag(law.information(point))
    left, repeated = [], np.ones(len(point), dtype=bool)
    labels, counts = law.moments.labels, law.moments.counts
    groups = [slice(k, None, MOST_GROUPS) for k in range(min(MOST_GROUPS, len(labels)))]
    for group in groups:
        rest = law.without(labels[group])
        repeated &= np.diag(rest.information(point)) > REPEATED * information
        others = replace(problem, reduced=rest)
        left.append(design.layout.columns(search_from(others, point)[0].point))
    size = np.array([[law.counted / counts[group].sum()] for group in groups])
    pseudo = size * full - (size - 1.0) * np.stack(left)
    centre = np.sum(pseudo / size, axis=0)
    variance = np.mean((pseudo - centre) ** 2 / (size - 1.0), axis=0)
    return {
        name: float(np.sqrt(value))
        for name, value, determined in zip(design.layout.names, variance, repeated, strict=True)
        if determined and name not in nuisance
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
    candidate = replace(design.candidate(design.observed), starts=point[None, :])
    over = replace(candidate.problem(design.series, here), reduced=law.without(outside))
    return infer(over, "draft", rng, optimum=search(over))


def _less_prior(precision: Array, prior: Array) -> Array:
    """Precision of the likelihood alone, never negative in any direction."""
    size = np.sqrt(np.diag(prior))
    values, vectors = np.linalg.eigh(precision / np.outer(size, size))
    values = np.maximum(values - 1.0, 0.0)
    return np.asarray((vectors * values) @ vectors.T * np.outer(size, size))


def _without_prior(own: Posterior, likelihood: Array, prior: Array, prior_mean: Array) -> Array:
    """Estimate (p,) by the likelihood alone, held where it is silent at the posterior's."""
    pulled = likelihood @ own.optimum.point + prior @ (own.optimum.point - prior_mean)
    held = likelihood + BROAD * prior
    return np.asarray(np.linalg.solve(held, pulled + BROAD * prior @ own.optimum.point))


def usual_sd(layout: Layout, share: float) -> Array:
    """Standard deviations (p,) between recordings that differ by ``share``.

    It is the share of what has a logarithm, else of the prior's standard deviation, both in
    unconstrained coordinates.
    """
    return np.array([share * (1.0 if p.transform == LOG else p.sd) for p in layout.parameters])


def _largest_z(points: Array, covariances: Array) -> Array:
    variances = np.diagonal(covariances, axis1=1, axis2=2)
    apart = np.abs(points[:, None] - points[None]) / np.sqrt(variances[:, None] + variances[None])
    return np.asarray(apart.max(axis=(0, 1)))


def _error(
    design: Experiment, source: str, here: NDArray[np.bool_], fits: tuple[Array, ...]
) -> RecordingError:
    """Errors on the bins (n,) of one recording by others, by all and by itself."""
    size = float(np.sqrt(np.mean(design.observed**2)))
    others, pooled, own = (
        float(np.sqrt(np.mean((design.observed - design.mean(u))[here] ** 2))) for u in fits
    )
    return RecordingError(Path(source).name, others, others / size, pooled, own)
