"""What strokes tell about parameters, and what is known of these after more strokes."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.between import usual_sd
from scissorcal.calibration.cut.model import CutExperiment
from scissorcal.calibration.cut.widening import PERTURBATION, changed_designs
from scissorcal.calibration.friction.model import FrictionExperiment
from scissorcal.calibration.parameters import Layout
from scissorcal.calibration.signals.torque_noise import TorqueNoise
from scissorcal.inference.between import BROAD
from scissorcal.inference.curvature import (
    Slopes,
    gradient,
    likelihood_information,
    natural_step,
    slopes_at,
)
from scissorcal.recipe.fields import BETWEEN_percent

STEP = 1e-3
"""Step in prior standard deviations by which a friction law's mean is differentiated."""
SILENT, TINY = 1e-10, 1e-300
"""Share of the largest curvature below which a stroke tells nothing, and the least size of one."""
LAGS = 60
"""Windows over which their noise is correlated at most: 0.3 s."""


@dataclass(frozen=True)
class Information:
    """What data tell at one point of a fit's unconstrained parameters; sums over strokes.

    ``curvature`` (p, p) is Fisher's information as the fit's likelihood counts it, ``scores``
    (p, p) the covariance of that likelihood's score, which is larger where noise is correlated.
    ``errors`` has by kind of segment the change (p,) of the score for a relative error of one in
    the law, as :class:`~scissorcal.calibration.cut.widening.Budget` counts it.
    """

    curvature: Array
    scores: Array
    errors: Mapping[str, Array] = field(default_factory=dict)

    @classmethod
    def none(cls, parameters: int) -> "Information":
        """That of no data.

        >>> Information.none(2).curvature.tolist()
        [[0.0, 0.0], [0.0, 0.0]]
        """
        empty = np.zeros((parameters, parameters))
        return cls(empty, empty)

    def __add__(self, other: "Information") -> "Information":
        kinds = {**self.errors, **other.errors}
        return Information(
            self.curvature + other.curvature,
            self.scores + other.scores,
            {k: np.asarray(self.errors.get(k, 0.0) + other.errors.get(k, 0.0)) for k in kinds},
        )

    def times(self, count: float) -> "Information":
        """That of ``count`` such strokes."""
        errors = {kind: count * error for kind, error in self.errors.items()}
        return Information(count * self.curvature, count * self.scores, errors)


def friction_information(
    design: FrictionExperiment, point: Array, noise: TorqueNoise, stroke_sd: float
) -> dict[int, Information]:
    """Information of each empty stroke by its label, at ``point`` (p,).

    Windows that are independent have curvature H = sum x x' / s^2, x the slopes of the drive. Their
    noise is correlated: with its covariance R from ``noise`` by sample, and strokes
    that differ by ``stroke_sd`` (N m), the score has the covariance

        J = sum_strokes (x' R x + stroke_sd^2 (sum x)(sum x)') / s^4,

    and the data are worth H J^-1 H, to which the fit stretches its likelihood (Chandler and Bate
    2007, doi:10.1093/biomet/asm015), but no more than the share of H that a fit has found.
    """
    slopes = gradient(design.mean, point, STEP * design.layout.sd)
    variance = float(np.exp(2.0 * point[-1]))
    correlated = _window_covariance(design, noise)
    by_stroke = {}
    for label in np.unique(design.strokes):
        here = slopes[design.strokes == label]
        total = here.sum(axis=0)
        curvature = here.T @ here / variance
        spread = here.T @ _convolved(here, correlated) + stroke_sd**2 * np.outer(total, total)
        scores = spread / variance**2
        curvature[-1, -1] = scores[-1, -1] = 2.0 * len(here)
        by_stroke[int(label)] = Information(curvature, _at_least(scores, curvature, design.share))
    return by_stroke


def _at_least(scores: Array, curvature: Array, share: float | None) -> Array:
    """Covariance of a score (p, p), along no direction less than curvature over ``share``."""
    if share is None:
        return scores
    size = np.sqrt(np.maximum(np.diag(curvature), TINY))
    values, vectors = np.linalg.eigh(curvature / np.outer(size, size))
    determined = values > SILENT * values[-1]
    root = size[:, None] * vectors[:, determined] * np.sqrt(values[determined])
    white = vectors[:, determined] / np.sqrt(values[determined]) / size[:, None]
    factors, directions = np.linalg.eigh(white.T @ scores @ white)
    away = root @ directions
    return np.asarray((away * np.maximum(factors, 1.0 / share)) @ away.T)


def cut_information(design: CutExperiment, point: Array) -> dict[int, Information]:
    """Information of each stroke through material by its label, at ``point`` (p,).

    Segments of a sheet are predicted one after the other, so that a stroke's information is what it
    adds to the strokes before it on the same sheet. The line of the teeth is one number over all
    strokes and is not among them: see :func:`line_information`.
    """
    candidate = design.candidate(design.observed)
    problem = candidate.problem(design.series)
    step = natural_step(problem.log_likelihood, point, 0.1 * problem.prior_sd)
    slopes = slopes_at(replace(problem, standardised=candidate.likelihood.normal), point, step)
    assert slopes is not None
    errors = _errors(design, point, slopes)
    by_stroke = {}
    for label in np.unique(design.strokes):
        here = design.strokes == label
        curvature = likelihood_information(problem, point, step, slopes.where(here))
        by_kind = {kind: error[here].sum(axis=0) for kind, error in errors.items()}
        by_stroke[int(label)] = Information(curvature, curvature, by_kind)
    return by_stroke


def line_information(design: CutExperiment, point: Array) -> Information:
    """Information of the line of the teeth, where the design has one.

    Its error is mostly that of the period's formula, which more strokes repeat.
    """
    count = len(point)
    line = design.likelihood.line
    if line is None:
        return Information.none(count)
    slope = gradient(
        lambda u: np.array([design.evaluate(u).log_period]), point, STEP * design.layout.sd
    )[0]
    curvature = np.outer(slope, slope) / line.sd**2
    return Information(curvature, curvature)


def _errors(design: CutExperiment, point: Array, slopes: Slopes) -> dict[str, Array]:
    """Change of each segment's score (n, p) for a relative error of one, by kind of segment."""
    by_kind = {}
    for kind, changed in changed_designs(design).items():
        if kind == "line":
            continue
        moved = (changed.evaluate(point).standardised - slopes.z) / PERTURBATION
        by_kind[kind] = -moved[:, None] * slopes.by_mean
    return by_kind


def _window_covariance(design: FrictionExperiment, noise: TorqueNoise) -> Array:
    """Covariance (lags,) of the noise of two windows that begin so many hops apart."""
    windows = design.windows
    weights = windows.weights
    hop = max(1, round(windows.bins.bin_s / windows.tick_s))
    overlap = np.correlate(weights, weights, "full")
    apart = np.arange(1 - len(weights), len(weights))[:, None] + hop * np.arange(LAGS)
    slow = noise.slow_Nm**2 * np.exp(-np.abs(apart) * windows.tick_s / noise.slow_time_s)
    return np.asarray(overlap @ (noise.white_Nm**2 * (apart == 0) + slow))


def _convolved(columns: Array, covariance: Array) -> Array:
    """The covariance of successive windows times their columns (n, p)."""
    from scipy.signal import fftconvolve

    kernel = np.concatenate([covariance[:0:-1], covariance])
    return np.asarray(fftconvolve(columns, kernel[:, None], axes=0)[LAGS - 1 : -LAGS + 1])


NO_SCORE = 1e-12
"""Variance of the score, as a share of its whole in units of the prior, that counts as none."""


@dataclass(frozen=True)
class Knowledge:
    """One fit's normal approximation: prior, and information by recording.

    ``point`` (p,) and ``prior`` (p, p, a precision) are in the layout's unconstrained coordinates.
    ``recordings`` hold what each recording told so far, ``common`` what is told once by all (the
    line of the teeth). ``error_shares`` are the relative errors of the law that the recipe allows,
    by kind of segment. ``between`` (p,) are standard deviations from recording to recording, which
    count from the second recording on, as in the fit; ``usual_scatter`` is their share where no fit
    tells them.
    """

    layout: Layout
    point: Array
    prior: Array
    recordings: tuple[Information, ...] = ()
    common: Information | None = None
    error_shares: Mapping[str, float] = field(default_factory=dict)
    between: Array | None = None
    usual_scatter: float = 0.01 * BETWEEN_percent

    def plus(self, information: Information, *, new_recording: bool = False) -> "Knowledge":
        """Knowledge after strokes that tell so much, in the last recording or in a new one."""
        if new_recording or not self.recordings:
            return replace(self, recordings=(*self.recordings, information))
        return replace(self, recordings=(*self.recordings[:-1], self.recordings[-1] + information))

    @property
    def covariance(self) -> Array:
        """Covariance (p, p) that a fit of these data would state.

        One recording: C + sum_k e_k^2 (C g_k)(C g_k)', with C = (H J^-1 H + P)^-1, the prior's
        precision P, and H, J, g_k of :class:`Information`: the likelihood stretched to what
        correlated noise leaves of it, as :func:`~scissorcal.inference.infer` does, and the stated
        error of the law. Several: the mean over recordings that scatter by ``between``, as
        :class:`~scissorcal.calibration.between.BetweenRecordings` has it, and the same of the law's
        error, which all recordings share.
        """
        total = sum(self.recordings, self._common)
        pooled = np.linalg.inv(self._worth(total) + self.prior)
        spread = pooled
        if len(self.recordings) > 1:
            spread = spread + self._scatter(self.between_sd) - self._scatter(np.zeros(len(spread)))
        for kind, error in total.errors.items():
            moved = self.error_shares.get(kind, 0.0) * (pooled @ error)
            spread = spread + np.outer(moved, moved)
        return np.asarray(0.5 * (spread + spread.T))

    @property
    def between_sd(self) -> Array:
        """Scatter between recordings (p,): as fitted, or its usual size where nothing tells it."""
        if self.between is not None:
            return self.between
        return usual_sd(self.layout, self.usual_scatter)

    @property
    def _common(self) -> Information:
        return self.common or Information.none(len(self.point))

    def _worth(self, information: Information) -> Array:
        """What information is worth under correlated noise: H J^-1 H (p, p)."""
        unit = self.layout.sd
        curvature = information.curvature * np.outer(unit, unit)
        scores = information.scores * np.outer(unit, unit)
        least = NO_SCORE * max(float(np.trace(scores)), 1.0)
        worth = curvature @ np.linalg.solve(scores + least * np.eye(len(unit)), curvature)
        return np.asarray(worth / np.outer(unit, unit))

    def _scatter(self, tau: Array) -> Array:
        """Covariance of the mean over recordings that scatter by ``tau`` (p,)."""
        broad = BROAD * self.prior
        precision = self.prior.copy()
        for information in self.recordings:
            spread = np.linalg.inv(self._worth(information) + broad) + np.diag(tau**2)
            precision = precision + np.linalg.inv(spread)
        return np.asarray(np.linalg.inv(precision))
