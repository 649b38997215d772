"""What is known of a fit's parameters, and how well they will be known after more strokes."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.between import usual_sd
from scissorcal.calibration.design.information import Information
from scissorcal.calibration.parameters import Layout
from scissorcal.inference.between import BROAD
from scissorcal.recipe.fields import BETWEEN_percent

SILENT = 1e-12
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

    def plus(self, told: Information, *, new_recording: bool = False) -> "Knowledge":
        """Knowledge after strokes that tell so much, in the last recording or in a new one."""
        if new_recording or not self.recordings:
            return replace(self, recordings=(*self.recordings, told))
        return replace(self, recordings=(*self.recordings[:-1], self.recordings[-1] + told))

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
    def shares_of_prior(self) -> dict[str, float]:
        """Standard deviation of each parameter as a share of its prior's, by name."""
        sds = np.sqrt(np.maximum(np.diag(self.covariance), 0.0))
        return dict(zip(self.layout.names, (sds / self.layout.sd).tolist(), strict=True))

    def sd_of(self, name: str) -> float:
        """Standard deviation of one parameter in its unconstrained coordinate."""
        place = self.layout.names.index(name)
        return float(np.sqrt(self.covariance[place, place]))

    @property
    def _common(self) -> Information:
        return self.common or Information.none(len(self.point))

    def _worth(self, told: Information) -> Array:
        """What information is worth under correlated noise: H J^-1 H (p, p)."""
        unit = self.layout.sd
        curvature = told.curvature * np.outer(unit, unit)
        scores = told.scores * np.outer(unit, unit)
        least = SILENT * max(float(np.trace(scores)), 1.0)
        worth = curvature @ np.linalg.solve(scores + least * np.eye(len(unit)), curvature)
        return np.asarray(worth / np.outer(unit, unit))

    def _scatter(self, tau: Array) -> Array:
        """Covariance of the mean over recordings that scatter by ``tau`` (p,)."""
        broad = BROAD * self.prior
        precision = self.prior.copy()
        for told in self.recordings:
            spread = np.linalg.inv(self._worth(told) + broad) + np.diag(tau**2)
            precision = precision + np.linalg.inv(spread)
        return np.asarray(np.linalg.inv(precision))
