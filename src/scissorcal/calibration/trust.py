"""Verdicts on a fit: may its numbers be used, and if not, what to measure next."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from scissorcal.calibration.ladder import SEARCH_REACH, Climbed
from scissorcal.calibration.result import StrokeError
from scissorcal.inference import Posterior
from scissorcal.verdicts import Status, Verdict

K_HAT_LIMIT = 0.7
PRIOR_ONLY = 0.9
"""A posterior at least this share of its prior's width says that the data are silent."""
FEWEST_INDEPENDENT = 10.0
"""Independent observations wanted per parameter."""
HELD_OUT_LIMIT = 0.2
"""Error on unseen strokes, as a share of what all strokes measured, that a law may have."""


def trust_verdicts(
    what: str,
    effort: str,
    chosen: Climbed,
    posterior: Posterior,
    diagnostics: Mapping[str, Any],
    held_out: tuple[StrokeError, ...],
    nuisance: tuple[str, ...],
) -> tuple[Verdict, ...]:
    """Judge a fit: search, importance weights, bounds, data, unseen strokes."""
    scope = f"fit.{what}"
    return (
        _search(scope, chosen),
        _importance(scope, effort, posterior),
        _bounds(scope, chosen),
        _identified(scope, chosen, posterior, nuisance),
        _independent(scope, chosen, diagnostics),
        _explained(scope, diagnostics),
        _unseen(scope, held_out),
    )


def _search(scope: str, chosen: Climbed) -> Verdict:
    ended = chosen.optimum
    status: Status = "pass" if ended.success else "fail"
    return Verdict(scope, "optimum", status, float(ended.agreeing), 1.0, ended.sentence)


def _importance(scope: str, effort: str, posterior: Posterior) -> Verdict:
    k = posterior.k_hat
    if effort == "draft":
        why = "Draft effort does not check the posterior's shape; use --effort standard."
        return Verdict(scope, "k-hat", "not_evaluated", None, K_HAT_LIMIT, why)
    if k < K_HAT_LIMIT:
        why = f"The importance weights are well behaved (k-hat {k:.2f})."
        return Verdict(scope, "k-hat", "pass", k, K_HAT_LIMIT, why)
    why = (
        f"The posterior is far from its approximation (k-hat {k:.2f}), so its intervals cannot be "
        "trusted: record more varied strokes, or choose a simpler rung in the recipe."
    )
    return Verdict(scope, "k-hat", "fail", k if np.isfinite(k) else None, K_HAT_LIMIT, why)


def _bounds(scope: str, chosen: Climbed) -> Verdict:
    layout, point = chosen.rung.layout, chosen.optimum.point
    reach = np.abs(point - layout.mean) / layout.sd
    at = [name for name, r in zip(layout.names, reach, strict=True) if r > 0.98 * SEARCH_REACH]
    if at:
        why = (
            f"{', '.join(at)} ended at the edge of the search, so no value was found: "
            "check the units and signs of the recording."
        )
        return Verdict(scope, "bounds", "fail", float(reach.max()), SEARCH_REACH, why)
    why = "No parameter ended at the edge of the search."
    return Verdict(scope, "bounds", "pass", float(reach.max()), SEARCH_REACH, why)


def _identified(
    scope: str, chosen: Climbed, posterior: Posterior, nuisance: tuple[str, ...]
) -> Verdict:
    layout = chosen.rung.layout
    ratios = {
        name: float(posterior.draws[:, i].std(ddof=1) / layout.sd[i])
        for i, name in enumerate(layout.names)
        if name not in nuisance
    }
    worst = max(ratios, key=lambda name: ratios[name])
    silent = [name for name, ratio in ratios.items() if ratio > PRIOR_ONLY]
    if silent:
        why = (
            f"The data say nothing about {', '.join(silent)}; the values shown are the prior's. "
            "Record strokes that excite them, or choose a rung without them."
        )
        return Verdict(scope, "identifiability", "fail", ratios[worst], PRIOR_ONLY, why)
    why = f"Every parameter is narrower than its prior; {worst} is the least certain one."
    return Verdict(scope, "identifiability", "pass", ratios[worst], PRIOR_ONLY, why)


def _independent(scope: str, chosen: Climbed, diagnostics: Mapping[str, Any]) -> Verdict:
    count = diagnostics["observations"] * diagnostics["independent_share"]
    per = float(count / len(chosen.optimum.point))
    why = (
        f"Residuals are autocorrelated: {diagnostics['observations']} bins are worth "
        f"{count:.0f} independent ones; intervals were widened by up to "
        f"{diagnostics['largest_inflation']:.1f} for it."
    )
    if per < FEWEST_INDEPENDENT:
        why += " That is too few for this many parameters: record longer or more varied motion."
        return Verdict(scope, "whiteness", "fail", per, FEWEST_INDEPENDENT, why)
    return Verdict(scope, "whiteness", "pass", per, FEWEST_INDEPENDENT, why)


def _explained(scope: str, diagnostics: Mapping[str, Any]) -> Verdict:
    r2 = diagnostics["r_squared"]
    if r2 > 0:
        why = f"The law explains {r2:.1%} of the variance of the band-limited data."
        return Verdict(scope, "r-squared", "pass", r2, 0.0, why)
    why = "The law is worse than a constant; check signs and units, and what was recorded."
    return Verdict(scope, "r-squared", "fail", r2, 0.0, why)


def _unseen(scope: str, held_out: tuple[StrokeError, ...]) -> Verdict:
    if len(held_out) < 2:
        why = "Only one stroke was recorded, so none can be held out: record several."
        return Verdict(scope, "held-out", "not_evaluated", None, HELD_OUT_LIMIT, why)
    median = float(np.median([error.relative_rms for error in held_out]))
    worst = max(held_out, key=lambda error: error.relative_rms)
    why = (
        f"On strokes it had not seen the law is off by {median:.1%} (median, rms); "
        f"worst is stroke {worst.stroke} with {worst.relative_rms:.1%}."
    )
    status: Status = "pass" if median < HELD_OUT_LIMIT else "fail"
    return Verdict(scope, "held-out", status, median, HELD_OUT_LIMIT, why)
