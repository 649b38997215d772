"""Verdicts of the verification."""

from collections.abc import Sequence

from scissorcal.calibration.verify.result import (
    Calibration,
    CheckKind,
    Halves,
    RankedQuantity,
    Sensitivity,
)
from scissorcal.calibration.verify.statistics import BY_RECORDING
from scissorcal.calibration.verify.study import EFFORT
from scissorcal.verdicts import INTERVALS, STATED, TORQUE, Check, Status, Verdict

FALSE_ALARM = 0.01
"""Probability that any of the statistical verdicts fails for a correct fit."""

RANKS_SHARE = 0.5 * FALSE_ALARM
"""The calibration's part of it; the two verdicts on halves share the rest."""

HALVES_SHARE = 0.25 * FALSE_ALARM
FEWEST_FITS = 20
LEAST, MOST = 0.84, 0.96
"""Shares that 90 % intervals may hold: 90 % within 6, as a count of 100 fits shows it (two standard
errors). A shift of 0.6 standard deviations alone reaches the lower one, widths off by a factor of
1.17 or 0.8 either. Ranks of enough fits show smaller errors, too: encoder steps shift a cut's
exponent by 0.3 standard deviations, and its intervals hold 88 %."""
CALIBRATION = Check(
    "verify calibration",
    f"{INTERVALS}: p-value of uniform ranks; below, 90 % intervals must hold 84 to 96 %",
    at_least=RANKS_SHARE,
)
REFITS = Check(
    "verify refits", f"{INTERVALS}: share of simulated fits that are unreliable", at_most=0.05
)
"""Limit of the share of simulated fits that fail or do not pass their diagnostics."""
MOVED = "Check that nothing moved or warmed up during the capture, and repeat some strokes."
HALVES = Check(
    "verify halves", f"{INTERVALS}: p-value of two halves' difference", at_least=HALVES_SHARE
)
HALVES_EFFORT = Check(
    "verify halves-effort",
    f"{TORQUE}difference of two halves' predictions against what they claim, p-value",
    at_least=HALVES_SHARE,
)
PRIOR = Check("verify prior", "what is the prior's: sensitivity to its power", at_most=STATED)


def verify_verdicts(
    what: str,
    checks: Sequence[CheckKind],
    calibration: Calibration | None,
    halves: Halves | None,
    sensitivity: Sensitivity | None,
    not_done: Sequence[str],
) -> tuple[Verdict, ...]:
    """Judge the requested checks; one that could not be done is not evaluated, with the reason."""
    because = " ".join(not_done) or "The check could not be done."
    verdicts: list[Verdict] = []
    if "sbc" in checks:
        verdicts += _calibration(calibration, because)
    if "halves" in checks:
        verdicts += _halves(halves, because)
    if "prior" in checks:
        verdicts.append(_prior(sensitivity, because))
    return tuple(verdict.of(f"verify.{what}") for verdict in verdicts)


def _calibration(found: Calibration | None, because: str) -> list[Verdict]:
    if found is None:
        return [CALIBRATION.not_evaluated(because)]
    return [_ranks(found), _refits(found)]


def _ranks(found: Calibration) -> Verdict:
    limit = found.band.alpha
    if found.fits < FEWEST_FITS:
        why = f"{found.fits} simulated fits are too few: {FEWEST_FITS} are needed, 100 recommended."
        return CALIBRATION.not_evaluated(why, threshold=limit)
    worst = min(found.quantities, key=lambda quantity: quantity.ecdf_p)
    uneven = [quantity for quantity in found.quantities if quantity.ecdf_p < limit]
    good = (
        f"In {found.fits} fits to simulated data the ranks of the true values are uniform for "
        f"all {len(found.quantities)} quantities (smallest p = {worst.ecdf_p:.2g}, "
        f"{worst.name}; limit {limit:.2g})."
    )
    if uneven:
        held = [100.0 * held_by_90(quantity) for quantity in uneven]
        good = (
            f"In {found.fits} fits to simulated data the ranks of the true values of "
            f"{', '.join(quantity.name for quantity in uneven)} are not uniform (smallest p = "
            f"{worst.ecdf_p:.2g}), by too little to matter: 90 % intervals hold "
            f"{min(held):.0f} to {max(held):.0f} % ({100 * LEAST:.0f} to {100 * MOST:.0f} allowed)."
        )
    wrong = [quantity for quantity in uneven if not LEAST <= held_by_90(quantity) <= MOST]
    remedy = (
        "The intervals are conservative; a longer recording narrows them."
        if all(quantity.width < 1.0 - abs(quantity.shift) for quantity in wrong)
        else "Do not rely on these intervals: record more strokes, or choose a simpler candidate "
        "or a higher effort."
    )
    how = "; ".join(_how_wrong(quantity) for quantity in wrong)
    bad = f"In {found.fits} fits to simulated data {how}. {remedy}"
    if not wrong:
        return CALIBRATION.verdict("pass", worst.ecdf_p, good, threshold=limit)
    least = min(quantity.ecdf_p for quantity in wrong)
    return CALIBRATION.verdict("fail", least, bad, threshold=limit)


def held_by_90(quantity: RankedQuantity) -> float:
    """The share of truths in 90 % intervals, by the width and shift of all ranks.

    That of a normal error with the standard deviation ``width`` and the mean ``shift``; its error
    is half of that of a count.

    >>> made = RankedQuantity("a", "m", (), (), 1.0, None, width=1.0, shift=0.0, coverage=())
    >>> round(held_by_90(made), 3)
    0.9
    """
    from scipy.special import ndtr, ndtri

    reach = float(ndtri(0.95))
    if quantity.width == 0.0:
        return float(abs(quantity.shift) <= reach)
    low, high = ((side * reach - quantity.shift) / quantity.width for side in (-1.0, 1.0))
    return float(ndtr(high) - ndtr(low))


def _how_wrong(quantity: RankedQuantity) -> str:
    name, width, shift = quantity.name, quantity.width, quantity.shift
    fifty, ninety = quantity.coverage
    held = f"(50 % intervals contain {fifty.share:.0%}, 90 % intervals {ninety.share:.0%})"
    if abs(shift) > abs(width - 1.0):
        side = "below" if shift > 0 else "above"
        return (
            f"intervals of {name} are {abs(shift):.2g} standard deviations {side} the true "
            f"value {held}"
        )
    if width > 1.0:
        return f"intervals of {name} are too narrow by a factor of about {width:.2g} {held}"
    if width == 0.0:
        return f"all true values have one rank among the draws of {name} {held}"
    return f"intervals of {name} are too wide by a factor of about {1 / width:.2g} {held}"


def _refits(found: Calibration) -> Verdict:
    total = found.fits + len(found.broken)
    share = (found.unreliable * found.fits + len(found.broken)) / total
    why = (
        f"{share:.1%} of {total} simulated fits failed or did not pass their diagnostics (limit "
        f"{REFITS.threshold:.0%}); {found.escalated:.1%} used a higher effort, "
        f"{found.other_law:.1%} chose another candidate."
    )
    if found.broken:
        why += f" Example: {found.broken[0]}"
    remedy = " Fit with more effort, or choose a simpler candidate in the recipe's [fit] table."
    return REFITS.judge(share, why, why + remedy)


def _halves(found: Halves | None, because: str) -> list[Verdict]:
    if found is None or found.p_value is None or found.effort_p_value is None:
        why = because if found is None else "Each half has too few data to be judged alone."
        return [check.not_evaluated(why) for check in (HALVES, HALVES_EFFORT)]
    largest = max((row for row in found.rows if row.z is not None), key=lambda r: abs(r.z or 0.0))
    size = f"{largest.name} differs most, by {abs(largest.z or 0.0):.1f} standard deviations"
    p, effort_p = found.p_value, found.effort_p_value
    by_recording = found.split.startswith(BY_RECORDING)
    good = f"Two halves of the data agree within their uncertainty (p = {p:.2g}; {size})."
    if p > 1.0 - HALVES_SHARE:
        good += (
            " They agree better than by chance: the lack of fit repeats in every stroke, and the "
            "intervals treat it as noise."
        )
    if not by_recording:
        good += " One recording: the variation between recordings is unknown."
    units = "recordings" if by_recording else "strokes"
    bad = (
        f"Two halves of the data differ by more than their uncertainty (p = {p:.2g}, limit "
        f"{HALVES_SHARE:.2g}; {size}): law or rig change between {units}. Look at the "
        f"residuals by stroke. {MOVED}"
    )
    what = (
        f"The halves' predictions differ by {found.effort_difference:.2%} of the effort's rms; "
        f"expected {found.effort_expected:.2%} (p = {effort_p:.2g}, limit {HALVES_SHARE:.2g})."
    )
    return [
        HALVES.judge(p, good, bad),
        HALVES_EFFORT.judge(effort_p, what, f"{what} {MOVED}"),
    ]


def _prior(found: Sensitivity | None, because: str) -> Verdict:
    if found is None:
        return PRIOR.not_evaluated(because)
    worst = max(found.rows, key=lambda row: row.prior)
    effort = next(row for row in found.rows if row.name == EFFORT)
    conflict = [row.name for row in found.rows if row.diagnosis == "prior-data conflict"]
    weak = [row.name for row in found.rows if row.diagnosis == "weak likelihood"]
    said = []
    if conflict:
        said.append(
            f"prior and data disagree on {', '.join(conflict)}: check units and signs, or widen "
            "the recipe's prior"
        )
    if weak:
        said.append(
            f"the data hardly inform {', '.join(weak)}, and the prior dominates: record strokes "
            "that excite it"
        )
    status: Status = "fail" if conflict or effort.prior >= found.threshold else "pass"
    why = (
        f"The largest prior sensitivity is {worst.prior:.2g} ({worst.name}; limit "
        f"{found.threshold:.2g}): the data dominate."
        if not said
        else "; ".join(said).capitalize() + "."
    )
    if weak and status == "pass":
        why += " The predicted effort does not depend on it."
    return PRIOR.verdict(status, worst.prior, why, threshold=found.threshold)
