"""Verdicts on a fit: may its numbers be used, and if not, what to measure next."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.fit_candidate import SEARCH_REACH, FittedCandidate
from scissorcal.calibration.result import PRIOR_ONLY, StrokeError, worst_stroke
from scissorcal.calibration.signals.filtering import Bins
from scissorcal.calibration.signals.segments import by_label
from scissorcal.inference import Posterior, SearchStatus
from scissorcal.inference.importance import ADAPTED_LIMIT, K_HAT_LIMIT
from scissorcal.inference.status import SamplingStatus
from scissorcal.model.friction_terms import NEAR_REST
from scissorcal.verdicts import Status, Verdict, judge, not_evaluated

FEWEST_INDEPENDENT = 10.0
"""Independent observations wanted per parameter."""
HELD_OUT_LIMIT = 0.2
"""Error on unseen strokes, as a share of what all strokes measured, that a law may have."""
OTHER_SPEED = 1.5
"""Ratio between the fastest and the slowest motion from which speeds count as varied."""
OTHER_CONTACT_M = 2e-3
LIMITS = (K_HAT_LIMIT, ADAPTED_LIMIT)
"""Limits of k-hat, of a proposal made without draws and of one that was adapted to them."""
NEAR_EDGE = 0.98 * SEARCH_REACH
"""Prior standard deviations from its centre at which a parameter is at the search's limit."""


def trust_verdicts(
    what: str,
    effort: str,
    chosen: FittedCandidate,
    posterior: Posterior,
    diagnostics: Mapping[str, Any],
    held_out: tuple[StrokeError, ...],
    nuisance: tuple[str, ...],
    bins: Bins,
    contact: Array,
) -> tuple[Verdict, ...]:
    """Judge a fit: its numbers, search, draws, bounds, data, strokes, unseen strokes."""
    scope = f"fit.{what}"
    nuisance = (*nuisance, *(p.name for p in chosen.candidate.layout.parameters if p.believed))
    return (
        _finite(scope, chosen, posterior, diagnostics),
        _search(scope, posterior, nuisance),
        _importance(scope, effort, posterior),
        _bounds(scope, chosen),
        _identified(scope, chosen, posterior, (*nuisance, *NEAR_REST)),
        _null(scope, posterior, nuisance),
        _independent(scope, chosen, diagnostics, held_out),
        _explained(scope, diagnostics),
        _varied(scope, what, chosen, bins, contact),
        _unseen(scope, held_out),
    )


def _finite(
    scope: str, chosen: FittedCandidate, posterior: Posterior, diagnostics: Mapping[str, Any]
) -> Verdict:
    wanted = ("residual_rms", "relative_error", "r_squared", "independent_share")
    broken = [name for name in wanted if not np.isfinite(diagnostics[name])]
    bad = ~np.all(np.isfinite(posterior.draws), axis=0) | ~np.isfinite(posterior.optimum.point)
    broken += [name for name, no in zip(chosen.candidate.layout.names, bad, strict=True) if no]
    bad = (
        f"{', '.join(broken)} did not come out as a number: check the recording for gaps, constant "
        "channels and absurd values."
    )
    return judge(scope, "finite", len(broken), 0.0, "Every number of the fit is finite.", bad)


def _search(scope: str, posterior: Posterior, nuisance: tuple[str, ...]) -> Verdict:
    """Judge the search by the law's own parameters.

    A nuisance to which the data do not respond stays at its prior, whose width is then in the
    draws: that is no lack of an optimum.
    """
    ended = posterior.optimum
    silent = ended.status in (SearchStatus.AT_START, SearchStatus.PLATEAU)
    if silent and ended.concerns and set(ended.concerns) <= set(nuisance):
        why = (
            f"The search settled for every parameter that is reported. {', '.join(ended.concerns)} "
            "stayed where the prior is, and the intervals have the prior's width for it."
        )
        return Verdict(scope, "optimum", "pass", float(ended.agreeing), 1.0, why)
    status: Status = "pass" if ended.success else "fail"
    return Verdict(scope, "optimum", status, float(ended.agreeing), 1.0, ended.sentence)


def _importance(scope: str, effort: str, posterior: Posterior) -> Verdict:
    k = posterior.k_hat if np.isfinite(posterior.k_hat) else None
    if effort == "draft":
        why = "Draft effort does not check the posterior's shape; use --effort standard."
        return not_evaluated(scope, "k-hat", why, K_HAT_LIMIT)
    status: Status = "pass" if posterior.status.trusted else "fail"
    if posterior.ensembles or posterior.status is SamplingStatus.TOO_FEW:
        # what decides then is in the sentence: k-hat is of a proposal that was not used, or passes
        return Verdict(scope, "k-hat", status, None, None, posterior.sentence)
    exceeded = [limit for limit in LIMITS if status == "fail" and k is not None and k > limit]
    limit = exceeded[0] if exceeded else K_HAT_LIMIT
    return Verdict(scope, "k-hat", status, k, limit, posterior.sentence)


def _bounds(scope: str, chosen: FittedCandidate) -> Verdict:
    layout, point = chosen.candidate.layout, chosen.optimum.point
    reach = np.abs(point - layout.mean) / layout.sd
    at = [name for name, r in zip(layout.names, reach, strict=True) if r > NEAR_EDGE]
    bad = (
        f"{', '.join(at)} ended at the limit of the search, so no value was found: check the units "
        "and signs of the recording."
    )
    good = "No parameter ended at the limit of the search."
    return judge(scope, "bounds", float(reach.max()), NEAR_EDGE, good, bad)


def _identified(
    scope: str, chosen: FittedCandidate, posterior: Posterior, nuisance: tuple[str, ...]
) -> Verdict:
    layout = chosen.candidate.layout
    widths = posterior.draws.std(axis=0, ddof=1) / layout.sd
    every = dict(zip(layout.names, widths.tolist(), strict=True))
    ratios = {name: ratio for name, ratio in every.items() if name not in nuisance}
    worst = max(ratios, key=lambda name: ratios[name])
    silent = [name for name, ratio in ratios.items() if ratio > PRIOR_ONLY]
    bad = (
        f"The data say nothing about {', '.join(silent)}; the values shown are the prior's. Record "
        "strokes that excite them, or choose a model without them."
    )
    good = f"Every parameter is narrower than its prior; {worst} is the least certain one."
    unjudged = [name for name in NEAR_REST if every.get(name, 0.0) > PRIOR_ONLY]
    if unjudged:
        good += (
            f" Not judged, because only friction below the slowest sweep or next to a turn depends "
            f"on it: {', '.join(unjudged)}, which the data leave to the prior."
        )
    return judge(scope, "identifiability", ratios[worst], PRIOR_ONLY, good, bad)


def _null(scope: str, posterior: Posterior, nuisance: tuple[str, ...]) -> Verdict:
    """Directions that data leave to the prior; those with nuisance parameters in them may be.

    What is reported of a law's parameter then still has the width that the nuisance gives it. What
    only concerns friction near rest is judged by *near rest*.
    """

    def names(direction: str) -> set[str]:
        return {part.partition(" (")[0] for part in direction.split(" + ")}

    silent = [
        direction
        for direction in posterior.null
        if not names(direction) & set(nuisance) and names(direction) - set(NEAR_REST)
    ]
    bad = (
        f"The data leave {'; '.join(silent)} to the prior: the effects of parameters named "
        "together are not distinguishable. Record motion in which they act differently, or choose "
        "a simpler model."
    )
    mixed = [direction for direction in posterior.null if names(direction) - set(nuisance)]
    good = "The data determine every direction of the model's parameters."
    if mixed:
        good = f"Only combinations with noise parameters are left open: {mixed[0]}."
    return judge(scope, "null-directions", len(silent), 0.0, good, bad)


def _varied(scope: str, what: str, chosen: FittedCandidate, bins: Bins, contact: Array) -> Verdict:
    """Whether strokes differ in what the law is to be used over: speed, and where it is met."""
    strokes = by_label(chosen.strokes).values()
    if len(strokes) < 2:
        why = (
            "There is one stroke only, so nothing shows that another would agree: record several, "
            "in both directions and at several speeds."
        )
        return Verdict(scope, "strokes", "fail", float(len(strokes)), 2.0, why)
    medians = np.array([np.median(bins.rate[here]) for here in strokes])
    ratio, fast = _spread(-medians[medians < 0])
    if what == "friction":
        quarters = np.quantile(np.abs(bins.rate), [0.25, 0.75])
        ratio, fast = max(_spread(np.abs(medians)), _spread(quarters))
    met = contact[np.isfinite(contact)]
    reach = float(np.ptp(np.quantile(met, [0.05, 0.95]))) if len(met) else float("nan")
    same = [] if ratio >= OTHER_SPEED else [f"speed (all near {fast:.2g})"]
    if what == "cut" and not reach >= OTHER_CONTACT_M:
        same.append("where the material is met along the blades")
    status: Status = "fail" if what == "friction" or len(same) == 2 else "not_evaluated"
    why = (
        f"Strokes do not differ in {' and '.join(same)}, so the fit says nothing of other ones: "
        "record some that differ in it."
    )
    if not same:
        status, why = "pass", f"Speeds of strokes differ by a factor of {ratio:.3g}."
    return Verdict(scope, "strokes", status, ratio, OTHER_SPEED, why)


def _spread(speeds: Array) -> tuple[float, float]:
    """Ratio of the fastest to the slowest of speeds (k,), and the fastest; 1 and 0 for none."""
    if len(speeds) == 0 or speeds.min() <= 0:
        return 1.0, float(speeds.max(initial=0.0))
    return float(speeds.max() / speeds.min()), float(speeds.max())


def _independent(
    scope: str,
    chosen: FittedCandidate,
    diagnostics: Mapping[str, Any],
    held_out: tuple[StrokeError, ...],
) -> Verdict:
    """Say how many independent observations there are; few of them reject no fit that predicts."""
    count = diagnostics["observations"] * diagnostics["independent_share"]
    per = float(count / len(chosen.optimum.point))
    why = (
        f"Residuals are autocorrelated: {diagnostics['observations']} bins are worth "
        f"{count:.0f} independent ones; intervals were widened by up to "
        f"{diagnostics['largest_inflation']:.1f} for it."
    )
    if scope == "fit.cut":
        why = (
            f"{diagnostics['observations']} segments of the path leave residuals that are worth "
            f"{count:.0f} independent ones; the likelihood takes them as its noise has them."
        )
    unseen = _median_error(held_out)
    if per < FEWEST_INDEPENDENT and unseen is not None and unseen < HELD_OUT_LIMIT:
        why += (
            f" That is few for this many parameters, yet unseen strokes are predicted to "
            f"{unseen:.1%}, so the fit may be used: longer or more varied motion would narrow its "
            "intervals."
        )
        return not_evaluated(scope, "whiteness", why, FEWEST_INDEPENDENT, per)
    bad = f"{why} That is too few for this many parameters: record longer or more varied motion."
    return judge(scope, "whiteness", per, FEWEST_INDEPENDENT, why, bad)


def _median_error(held_out: tuple[StrokeError, ...]) -> float | None:
    """Median error on unseen strokes; None where none could be held out."""
    if len(held_out) < 2:
        return None
    return float(np.median([error.relative_rms for error in held_out]))


def _explained(scope: str, diagnostics: Mapping[str, Any]) -> Verdict:
    r2 = diagnostics["r_squared"]
    if r2 > 0:
        why = f"The model explains {r2:.1%} of the variance of what was measured."
        return Verdict(scope, "r-squared", "pass", r2, 0.0, why)
    why = "The model is no better than a constant: check signs, units and what was recorded."
    return Verdict(scope, "r-squared", "fail", r2, 0.0, why)


def _unseen(scope: str, held_out: tuple[StrokeError, ...]) -> Verdict:
    median = _median_error(held_out)
    if median is None:
        why = "Only one stroke was recorded, so none can be held out: record several."
        return not_evaluated(scope, "hold-out", why, HELD_OUT_LIMIT)
    worst = worst_stroke(held_out)
    why = f"On hold-out strokes the error is {median:.1%} (median rms)."
    if worst is not None:
        why = f"{why[:-1]}; the worst is stroke {worst.stroke} with {worst.relative_rms:.1%}."
    return judge(scope, "hold-out", median, HELD_OUT_LIMIT, why)
