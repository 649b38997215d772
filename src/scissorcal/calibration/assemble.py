"""Put a posterior and the compared candidates into the result that people read."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array
from scissorcal.calibration.candidates import DRAWS, LeftOut
from scissorcal.calibration.checks import trust_verdicts
from scissorcal.calibration.comparison import best_of, candidate_rows, comparison_text, contenders
from scissorcal.calibration.critic import NOT_ASKED, Critique, criticise, structure_verdict
from scissorcal.calibration.fit_candidate import FittedCandidate
from scissorcal.calibration.fit_model import Outcome
from scissorcal.calibration.replay import compare_with_replay
from scissorcal.calibration.result import Effort, FitResult, FitSeries, Predictive, StrokeError
from scissorcal.calibration.signals.filtering import Bins
from scissorcal.calibration.signals.segments import by_label
from scissorcal.calibration.signals.usage import Usage
from scissorcal.inference import fit_ar, ljung_box
from scissorcal.recording.recording import Recording
from scissorcal.verdicts import Verdict

MOST_POINTS = 20000
BAND_DRAWS = 100
PRIOR_DRAWS = 1000


@dataclass(frozen=True)
class Particulars:
    """What only the fit itself can say; it follows what is common to all fits.

    ``critic`` says whether the residuals are searched for what the law lacks. That is judged by the
    ``tolerance`` of torque, a share, where there is one, but for terms that are ``known`` by name
    from elsewhere.
    """

    verdicts: tuple[Verdict, ...]
    notes: tuple[str, ...]
    diagnostics: Mapping[str, Any]
    critic: bool
    tolerance: float | None = None
    known: tuple[str, ...] = ()


def assemble(
    outcome: Outcome,
    recordings: tuple[Recording, ...],
    usage: Usage,
    particulars: Particulars,
    rng: np.random.Generator,
) -> FitResult:
    """Put a finished fit into the form that reports, packages and files read.

    Nuisance parameters of its design are kept out of the parameter table. ``usage`` says which
    samples the fit uses. A fit of simulated data leaves out replay and replicated data.
    """
    design, chosen, compared = outcome.design, outcome.chosen, outcome.compared
    what, measured, joint = design.what, design.observed, recordings[0].joint
    contact = design.contact(outcome.point)
    held_out = _stroke_errors(outcome, recordings)
    thin = slice(None, None, max(1, -(-len(measured) // MOST_POINTS)))
    predictions = _predictions(outcome, thin)
    series = _series(outcome, predictions, thin)
    rows = candidate_rows(compared, chosen)
    diagnostics = _diagnostics(outcome) | dict(particulars.diagnostics)
    critique = Critique((), NOT_ASKED)
    if particulars.critic:
        critique = criticise(design, chosen, joint, rng, particulars.known)
    tables = _parameters(outcome, rng)
    diagnostics["critic"] = critique.sentence
    trust = trust_verdicts(outcome, diagnostics, held_out)
    if particulars.tolerance is not None:
        drive, unit = float(np.sqrt(np.mean(measured**2))), joint.effort_unit
        verdict = structure_verdict(critique, drive, unit, particulars.tolerance)
        trust += (verdict.of(f"fit.{what}"),)
    for_people: dict[str, Any] = {}
    if not outcome.simulated:
        for_people["replay"] = compare_with_replay(
            chosen,
            design.bins,
            measured,
            contact,
            tuple(recording.source for recording in recordings),
            refit=what == "cut" and outcome.effort != "draft",
        )
        for_people["predictive"] = _predictive_of(
            compared, chosen, predictions, thin, outcome.effort, rng.spawn(1)[0]
        )
    return FitResult(
        what=what,
        effort=outcome.effort,
        candidate=chosen.candidate.name,
        structure=outcome.structure,
        series=series,
        held_out=held_out,
        candidates=rows,
        diagnostics=diagnostics,
        verdicts=(*trust, *particulars.verdicts),
        effort_unit=joint.effort_unit,
        position_unit=joint.position_unit,
        inputs_hash="",
        sources=tuple(f"{_name(r.source)} sha256:{r.content_hash}" for r in recordings),
        used=usage.spans,
        notes=(*(note for recording in recordings for note in recording.notes), *particulars.notes),
        selection=comparison_text(compared, chosen, design.bins, contact, joint),
        critic=critique.proposals,
        proposed=None if critique.torque is None else critique.torque[thin],
        **for_people,
        **tables,
    )


def _name(source: str) -> str:
    """A recording's file as it is named in the results: without the folders of somebody's disk."""
    path = PurePath(source)
    return path.name if path.is_absolute() else source


def _parameters(outcome: Outcome, rng: np.random.Generator) -> dict[str, Any]:
    """The fields of a result that have a column for each parameter, in natural units."""
    chosen, posterior, nuisance = outcome.chosen, outcome.posterior, outcome.design.nuisance
    layout = chosen.candidate.layout
    fitted, natural = layout.fitted(posterior.draws), layout.columns(posterior.draws)
    wanted = [i for i, name in enumerate(layout.names) if name not in nuisance]
    others = [i for i, name in enumerate(layout.names) if name in nuisance]
    return {
        "parameters": tuple(fitted[i] for i in wanted),
        "draws": natural[:, wanted],
        "map_point": layout.columns(chosen.optimum.point)[wanted],
        "prior_draws": _prior_draws(chosen, rng)[:, wanted],
        "nuisance": tuple(fitted[i] for i in others),
        "nuisance_draws": natural[:, others],
    }


def _diagnostics(outcome: Outcome) -> dict[str, Any]:
    """Plain numbers and strings; ``evaluations`` are those of all candidates and of sampling."""
    compared, chosen, posterior = outcome.compared, outcome.chosen, outcome.posterior
    bins, measured = outcome.design.bins, outcome.design.observed
    likelihood, point = chosen.candidate.likelihood, chosen.optimum.point
    white = ljung_box(likelihood.standardised(point), bins.series)
    residuals = likelihood.residuals(point)
    return {
        "k_hat": posterior.k_hat,
        "effective_samples": posterior.effective,
        "effort_reached": posterior.effort_reached,
        "evaluations": sum(candidate.evaluations for candidate in compared)
        + posterior.evaluations
        - posterior.optimum.evaluations,
        "observations": len(residuals),
        "independent_share": chosen.share,
        "whiteness_p": white.p_value,
        "first_lag_autocorrelation": white.first_lag,
        "largest_inflation": float(posterior.inflation.max()),
        "noise_order": ", ".join(str(order) for order in posterior.noise_orders),
        "dispersion": posterior.dispersion,
        "residual_rms": float(np.sqrt(np.mean(residuals**2))),
        "relative_error": float(np.linalg.norm(residuals) / np.linalg.norm(measured)),
        "r_squared": float(1 - np.sum(residuals**2) / np.sum((measured - measured.mean()) ** 2)),
        "starts_agreeing": f"{chosen.optimum.agreeing} of {chosen.optimum.starts}",
        "search": chosen.optimum.sentence,
        **_of_time(bins),
        "noise": float(np.std(residuals)),
    }


def _of_time(bins: Bins) -> dict[str, float]:
    """What only bins of time have; segments of a path have no length in seconds."""
    if not np.isfinite(bins.bin_s):
        return {}
    return {"rate_floor": bins.rate_floor, "bin_s": bins.bin_s}


def _prior_draws(chosen: FittedCandidate, rng: np.random.Generator) -> Array:
    """Draws of the prior (PRIOR_DRAWS, parameters) in natural units."""
    candidate = chosen.candidate
    covariance = np.linalg.inv(candidate.prior_precision)
    draws = rng.multivariate_normal(candidate.prior_mean, covariance, PRIOR_DRAWS, method="eigh")
    return candidate.layout.columns(draws)


def _stroke_errors(outcome: Outcome, recordings: tuple[Recording, ...]) -> tuple[StrokeError, ...]:
    chosen, bins, measured = outcome.chosen, outcome.design.bins, outcome.design.observed
    planned = [stroke for recording in recordings for stroke in recording.strokes]
    errors = []
    size = float(np.sqrt(np.mean(measured**2)))
    for label, here in by_label(outcome.design.strokes).items():
        rms = float(np.sqrt(np.mean(chosen.held_out_residuals[here] ** 2)))
        known = planned[label] if 0 <= label < len(planned) else None
        errors.append(
            StrokeError(
                stroke=label,
                recording=recordings[int(bins.recording[here[0]])].source,
                kind=known.kind if known else ("opening" if bins.rate[here[0]] > 0 else "closing"),
                speed=float(np.median(np.abs(bins.rate[here]))),
                rms=rms,
                relative_rms=rms / size if size > 0 else float("inf"),
                independent=len(here) * chosen.share,
            )
        )
    return tuple(errors)


def _predictions(outcome: Outcome, thin: slice) -> Array:
    """Means (draws, k) by draws of the posterior, at the points that ``thin`` selects."""
    posterior, measured = outcome.posterior, outcome.design.observed
    residuals = outcome.chosen.candidate.likelihood.residuals
    step = max(1, len(posterior.draws) // BAND_DRAWS)
    return np.stack([(measured - residuals(u))[thin] for u in posterior.draws[::step]])


def _series(outcome: Outcome, predictions: Array, thin: slice) -> FitSeries:
    design, bins = outcome.design, outcome.design.bins
    low, high = np.quantile(predictions, [0.05, 0.95], axis=0)
    return FitSeries(
        time_s=bins.time_s[thin],
        recording=bins.recording[thin],
        stroke=design.strokes[thin],
        opening=bins.opening[thin],
        opening_rate=bins.rate[thin],
        contact=design.contact(outcome.point)[thin],
        measured=design.observed[thin],
        predicted=outcome.expected[thin],
        band_low=low,
        band_high=high,
    )


RESAMPLED = 3 * DRAWS // 4
"""Equally weighted draws, few enough that hardly one is repeated: repeated ones raise k-hats."""

REPLICATES = 50
AT_ONCE = 4_000_000
"""Values of the noise that are drawn together: 32 MB."""
LARGEST = 3e38
MANTISSA_BITS = 10
"""Bits of a replicated value's mantissa, which compresses it to a third: within 0.05 %."""


def _predictive_of(
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
    own = next(candidate for candidate in compared if candidate.candidate is chosen.candidate)
    share = best_of(list(compared)).share
    near = [] if effort == "draft" else contenders(compared)
    sampled = [candidate for candidate in near if len(candidate.left_out.densities)]
    densities = np.zeros((RESAMPLED, len(np.unique(own.strokes)), len(sampled)))
    for index, candidate in enumerate(sampled):
        densities[:, :, index] = (
            share * candidate.left_out.densities[_resampled(candidate.left_out)]
        )
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
        candidates=tuple(candidate.name for candidate in sampled),
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
