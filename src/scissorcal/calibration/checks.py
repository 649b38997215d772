"""Verdicts on a fit: may its numbers be used, and if not, what to measure next."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from scissorcal.aliases import Array
from scissorcal.calibration.fit_candidate import SEARCH_REACH, FittedCandidate
from scissorcal.calibration.fit_model import Outcome
from scissorcal.calibration.result import PRIOR_ONLY, StrokeError, worst_stroke
from scissorcal.calibration.signals.filtering import Bins
from scissorcal.calibration.signals.segments import by_label
from scissorcal.inference import Posterior, SearchStatus
from scissorcal.inference.importance import ADAPTED_LIMIT, K_HAT_LIMIT
from scissorcal.inference.problem import SamplingStatus
from scissorcal.model.friction_terms import NEAR_REST
from scissorcal.verdicts import INTERVALS, STATED, TORQUE, Check, Status, Verdict

HELD_OUT_LIMIT = 0.2
"""Error on unseen strokes, as a share of what all strokes measured, that a law may have."""
OTHER_SPEED = 1.5
"""Ratio between the fastest and the slowest motion from which speeds count as varied."""
OTHER_CONTACT_M = 2e-3
LIMITS = (K_HAT_LIMIT, ADAPTED_LIMIT)
"""Limits of k-hat, of a proposal made without draws and of one that was adapted to them."""

SEARCH = "whether the estimate is an optimum at all"
DATA = "whether the recording can tell the parameters"
FINITE = Check("fit finite", "whether there are numbers at all: how many are missing", at_most=0.0)
OPTIMUM = Check("fit optimum", f"{SEARCH}: starts that ended there", at_least=1.0)
K_HAT = Check(
    "fit k-hat", f"{INTERVALS}: tail index of the importance weights, enough draws", at_most=STATED
)
BOUNDS = Check(
    "fit bounds", f"{SEARCH}: largest distance from a prior in its sds", at_most=0.98 * SEARCH_REACH
)
"""Prior standard deviations from its centre at which a parameter is at the search's limit."""
IDENTIFIABILITY = Check(
    "fit identifiability", f"{DATA}: largest posterior sd over prior sd", at_most=PRIOR_ONLY
)
NULL_DIRECTIONS = Check(
    "fit null-directions", f"{DATA}: directions that are left to the prior", at_most=0.0
)
STROKES = Check(
    "fit strokes", f"{DATA}: ratio of the fastest to the slowest stroke", at_least=OTHER_SPEED
)
WHITENESS = Check(
    "fit whiteness",
    "nothing of the torque by itself; it tells how much data an interval rests on: "
    "independent observations per parameter",
    at_least=10.0,
)
"""Independent observations wanted per parameter."""
R_SQUARED = Check(
    "fit r-squared", f"{TORQUE}share of its variance that the law explains", at_least=0.0
)
HOLD_OUT = Check(
    "fit hold-out",
    f"{TORQUE}median rms error on unseen strokes, share of the rms of all strokes",
    at_most=HELD_OUT_LIMIT,
)


def trust_verdicts(
    outcome: Outcome, diagnostics: Mapping[str, Any], held_out: tuple[StrokeError, ...]
) -> tuple[Verdict, ...]:
    """Judge a fit: its numbers, search, draws, bounds, data, strokes, unseen strokes."""
    chosen, posterior, design = outcome.chosen, outcome.posterior, outcome.design
    what, contact = design.what, design.contact(outcome.point)
    from_others = (p.name for p in chosen.candidate.layout.parameters if p.measured_prior)
    nuisance = (*design.nuisance, *from_others)
    verdicts = (
        _finite(chosen, posterior, diagnostics),
        _search(posterior, nuisance),
        _importance(outcome.effort, posterior),
        _bounds(chosen),
        _identified(chosen, posterior, (*nuisance, *NEAR_REST)),
        _null(posterior, nuisance),
        _independent(what, chosen, diagnostics, held_out),
        _explained(diagnostics),
        _varied(what, chosen, design.bins, contact),
        _unseen(held_out),
    )
    return tuple(verdict.of(f"fit.{what}") for verdict in verdicts)


def _finite(
    chosen: FittedCandidate, posterior: Posterior, diagnostics: Mapping[str, Any]
) -> Verdict:
    wanted = ("residual_rms", "relative_error", "r_squared", "independent_share")
    broken = [name for name in wanted if not np.isfinite(diagnostics[name])]
    bad = ~np.all(np.isfinite(posterior.draws), axis=0) | ~np.isfinite(posterior.optimum.point)
    broken += [name for name, no in zip(chosen.candidate.layout.names, bad, strict=True) if no]
    bad = (
        f"{', '.join(broken)} did not come out as a number: check the recording for gaps, constant "
        "channels and absurd values."
    )
    return FINITE.judge(len(broken), "Every number of the fit is finite.", bad)


def _search(posterior: Posterior, nuisance: tuple[str, ...]) -> Verdict:
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
        return OPTIMUM.verdict("pass", float(ended.agreeing), why)
    status: Status = "pass" if ended.success else "fail"
    return OPTIMUM.verdict(status, float(ended.agreeing), ended.sentence)


def _importance(effort: str, posterior: Posterior) -> Verdict:
    k = posterior.k_hat if np.isfinite(posterior.k_hat) else None
    if effort == "draft":
        why = "Draft effort does not check the posterior's shape; use --effort standard."
        return K_HAT.not_evaluated(why, threshold=K_HAT_LIMIT)
    status: Status = "pass" if posterior.status.trusted else "fail"
    if posterior.ensembles or posterior.status is SamplingStatus.TOO_FEW:
        # what decides then is in the sentence: k-hat is of a proposal that was not used, or passes
        return K_HAT.verdict(status, None, posterior.sentence)
    exceeded = [limit for limit in LIMITS if status == "fail" and k is not None and k > limit]
    limit = exceeded[0] if exceeded else K_HAT_LIMIT
    return K_HAT.verdict(status, k, posterior.sentence, threshold=limit)


def _bounds(chosen: FittedCandidate) -> Verdict:
    layout, point = chosen.candidate.layout, chosen.optimum.point
    reach = np.abs(point - layout.mean) / layout.sd
    at = [name for name, r in zip(layout.names, reach, strict=True) if r > BOUNDS.threshold]
    bad = (
        f"{', '.join(at)} ended at the limit of the search, so no value was found: check the units "
        "and signs of the recording."
    )
    good = "No parameter ended at the limit of the search."
    return BOUNDS.judge(float(reach.max()), good, bad)


def _identified(
    chosen: FittedCandidate, posterior: Posterior, nuisance: tuple[str, ...]
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
    return IDENTIFIABILITY.judge(ratios[worst], good, bad)


def _null(posterior: Posterior, nuisance: tuple[str, ...]) -> Verdict:
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
    return NULL_DIRECTIONS.judge(len(silent), good, bad)


def _varied(what: str, chosen: FittedCandidate, bins: Bins, contact: Array) -> Verdict:
    """Whether strokes differ in what the law is to be used over: speed, and where it is met."""
    strokes = by_label(chosen.strokes).values()
    if len(strokes) < 2:
        why = (
            "There is one stroke only, so nothing shows that another would agree: record several, "
            "in both directions and at several speeds."
        )
        return STROKES.verdict("fail", float(len(strokes)), why, threshold=2.0)
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
    return STROKES.verdict(status, ratio, why)


def _spread(speeds: Array) -> tuple[float, float]:
    """Ratio of the fastest to the slowest of speeds (k,), and the fastest; 1 and 0 for none."""
    if len(speeds) == 0 or speeds.min() <= 0:
        return 1.0, float(speeds.max(initial=0.0))
    return float(speeds.max() / speeds.min()), float(speeds.max())


def _independent(
    what: str,
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
    if what == "cut":
        why = (
            f"{diagnostics['observations']} segments of the path leave residuals that are worth "
            f"{count:.0f} independent ones; the likelihood takes them as its noise has them."
        )
    unseen = _median_error(held_out)
    if per < WHITENESS.threshold and unseen is not None and unseen < HELD_OUT_LIMIT:
        why += (
            f" That is few for this many parameters, yet unseen strokes are predicted to "
            f"{unseen:.1%}, so the fit may be used: longer or more varied motion would narrow its "
            "intervals."
        )
        return WHITENESS.not_evaluated(why, per)
    bad = f"{why} That is too few for this many parameters: record longer or more varied motion."
    return WHITENESS.judge(per, why, bad)


def _median_error(held_out: tuple[StrokeError, ...]) -> float | None:
    """Median error on unseen strokes; None where none could be held out."""
    if len(held_out) < 2:
        return None
    return float(np.median([error.relative_rms for error in held_out]))


def _explained(diagnostics: Mapping[str, Any]) -> Verdict:
    r2 = diagnostics["r_squared"]
    good = f"The model explains {r2:.1%} of the variance of what was measured."
    bad = "The model is no better than a constant: check signs, units and what was recorded."
    return R_SQUARED.verdict("pass" if r2 > 0.0 else "fail", r2, good if r2 > 0.0 else bad)


def _unseen(held_out: tuple[StrokeError, ...]) -> Verdict:
    median = _median_error(held_out)
    if median is None:
        why = "Only one stroke was recorded, so none can be held out: record several."
        return HOLD_OUT.not_evaluated(why)
    worst = worst_stroke(held_out)
    why = f"On hold-out strokes the error is {median:.1%} (median rms)."
    if worst is not None:
        why = f"{why[:-1]}; the worst is stroke {worst.stroke} with {worst.relative_rms:.1%}."
    bad = f"{why} Record more strokes at the speeds of the worst ones, or try a richer candidate."
    return HOLD_OUT.judge(median, why, bad)
