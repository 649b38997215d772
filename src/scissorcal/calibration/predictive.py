"""Replicated data and log-likelihoods by stroke, for posterior predictive checks and LOO."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.calibration.comparison import best_of, contenders
from scissorcal.calibration.fit_candidate import FittedCandidate
from scissorcal.calibration.psis_loo import DRAWS, LeftOut
from scissorcal.calibration.result import Effort, Predictive
from scissorcal.inference import fit_ar

RESAMPLED = 3 * DRAWS // 4
"""Equally weighted draws, few enough that hardly one is repeated: repeated ones raise k-hats."""

REPLICATES = 50
AT_ONCE = 4_000_000
"""Values of the noise that are drawn together: 32 MB."""
LARGEST = 3e38
MANTISSA_BITS = 10
"""Bits of a replicated value's mantissa, which compresses it to a third: within 0.05 %."""


def predictive_of(
    compared: Sequence[FittedCandidate],
    chosen: FittedCandidate,
    predictions: Array,
    thin: slice,
    effort: Effort,
    rng: np.random.Generator,
) -> Predictive:
    """Replicate the data of a fit, and collect log-likelihoods by stroke of its contenders.

    ``compared`` are the candidates that were compared, ``chosen`` is among them. ``predictions``
    (draws, k) are means by draws of the posterior at the points that ``thin`` selects; to some of
    them a draw of the noise is added. Candidates that are no :func:`~.comparison.contenders`, and
    draft effort, have no log-likelihoods.
    """
    own = next(one for one in compared if one.candidate is chosen.candidate)
    share = best_of(list(compared)).share
    near = [] if effort == "draft" else contenders(compared)
    sampled = [one for one in near if len(one.left_out.densities)]
    densities = np.zeros((RESAMPLED, len(np.unique(own.strokes)), len(sampled)))
    for index, one in enumerate(sampled):
        densities[:, :, index] = share * one.left_out.densities[_resampled(one.left_out)]
    reference = densities.max(axis=(0, 2)) if sampled else np.zeros(densities.shape[1])
    densities -= reference[:, None]
    layout = own.candidate.layout
    held = own in sampled
    points = layout.columns(own.left_out.points[_resampled(own.left_out)]) if held else None
    means = predictions[:: max(1, len(predictions) // REPLICATES)]
    return Predictive(
        torque=_rounded(means + _noise(own, len(means), thin, rng)),
        stroke=np.unique(own.strokes),
        log_likelihood=densities[:, :, sampled.index(own)] if held else None,
        log_likelihood_draws=points,
        parameters=layout.names,
        log_likelihood_reference=reference,
        independent_share=share,
        candidates=tuple(one.name for one in sampled),
        candidate_log_likelihoods=densities if sampled else None,
    )


def _noise(fitted: FittedCandidate, count: int, thin: slice, rng: np.random.Generator) -> Array:
    """Draws of the noise (count, k) at the points that ``thin`` selects.

    It is autoregressive, with the likelihood's standard deviations.

    The autoregression is fitted to the residuals at the optimum over these standard deviations,
    within each series without a gap: the likelihood itself counts a share of the points.
    """
    likelihood, point = fitted.candidate.likelihood, fitted.optimum.point
    sd = np.exp(likelihood.normal(point)[1])
    noise = fit_ar(likelihood.residuals(point) / sd, fitted.series)
    most = max(1, AT_ONCE // len(sd))
    drawn = [
        noise.draws(fitted.series, min(most, count - first), rng)[:, thin]
        for first in range(0, count, most)
    ]
    return sd[thin] * np.concatenate(drawn)


def _resampled(left_out: LeftOut) -> NDArray[np.int64]:
    """Rows (RESAMPLED,) of equally weighted draws, by systematic resampling."""
    weights = np.cumsum(np.exp(left_out.log_weights))
    places = (np.arange(RESAMPLED) + 0.5) / RESAMPLED * weights[-1]
    return np.asarray(np.searchsorted(weights, places))


def _rounded(values: Array) -> NDArray[np.float32]:
    """The nearest numbers with a short mantissa; those of a law that is far off are bounded."""
    bits = np.clip(values, -LARGEST, LARGEST).astype(np.float32).view(np.uint32)
    step = np.uint32(1 << (23 - MANTISSA_BITS))
    return ((bits + step // np.uint32(2)) & ~(step - np.uint32(1))).view(np.float32)
