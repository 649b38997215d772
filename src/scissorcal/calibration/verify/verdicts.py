"""Verdicts of the trust check, each with its threshold and its reason."""

from collections.abc import Sequence

from scissorcal.calibration.verify.halves import BY_RECORDING
from scissorcal.calibration.verify.result import (
    Calibration,
    Check,
    Halves,
    RankedQuantity,
    Sensitivity,
)
from scissorcal.calibration.verify.study import EFFORT
from scissorcal.verdicts import Status, Verdict, judge, not_evaluated

FALSE_ALARM = 0.01
"""Probability that any of the statistical verdicts fails although all is right."""

RANKS_SHARE = 0.5 * FALSE_ALARM
"""What of it the calibration may use; the two verdicts on halves share the rest."""

HALVES_SHARE = 0.25 * FALSE_ALARM
FEWEST_FITS = 20
UNRELIABLE_LIMIT = 0.05
"""Share of simulated fits that may break or fail their own diagnostics."""


def verify_verdicts(
    what: str,
    checks: Sequence[Check],
    calibration: Calibration | None,
    halves: Halves | None,
    sensitivity: Sensitivity | None,
    not_done: Sequence[str],
) -> tuple[Verdict, ...]:
    """Judge what was asked for; what could not be made is not evaluated, for the reasons given."""
    scope = f"verify.{what}"
    because = " ".join(not_done) or "It could not be made."
    verdicts: list[Verdict] = []
    if "sbc" in checks:
        verdicts += _calibration(scope, calibration, because)
    if "halves" in checks:
        verdicts += _halves(scope, halves, because)
    if "prior" in checks:
        verdicts.append(_prior(scope, sensitivity, because))
    return tuple(verdicts)


def _calibration(scope: str, found: Calibration | None, because: str) -> list[Verdict]:
    if found is None:
        return [not_evaluated(scope, "calibration", because, RANKS_SHARE)]
    return [_ranks(scope, found), _refits(scope, found)]


def _ranks(scope: str, found: Calibration) -> Verdict:
    check, limit = "calibration", found.band.alpha
    if found.fits < FEWEST_FITS:
        why = f"{found.fits} simulated fits tell little; {FEWEST_FITS} are needed, better 200."
        return not_evaluated(scope, check, why, limit)
    worst = min(found.quantities, key=lambda quantity: quantity.ecdf_p)
    good = (
        f"In {found.fits} fits to simulated data the truth's ranks are uniform for all "
        f"{len(found.quantities)} quantities ({worst.name} least so, p = {worst.ecdf_p:.2g})."
    )
    wrong = [quantity for quantity in found.quantities if quantity.ecdf_p < limit]
    remedy = (
        "They are on the safe side; a longer recording narrows them."
        if all(quantity.width < 1.0 - abs(quantity.shift) for quantity in wrong)
        else "Do not rely on these intervals: record more strokes, or choose a simpler model or a "
        "higher effort."
    )
    how = "; ".join(_how_wrong(quantity) for quantity in wrong)
    bad = f"In {found.fits} fits to simulated data {how}. {remedy}"
    return judge(scope, check, worst.ecdf_p, limit, good, bad)


def _how_wrong(quantity: RankedQuantity) -> str:
    name, width, shift = quantity.name, quantity.width, quantity.shift
    fifty, ninety = quantity.coverage
    held = f"(50 % intervals held {fifty.share:.0%}, 90 % ones {ninety.share:.0%})"
    if abs(shift) > abs(width - 1.0):
        side = "below" if shift > 0 else "above"
        return (
            f"intervals of {name} lie {abs(shift):.2g} standard deviations {side} the truth {held}"
        )
    if width > 1.0:
        return f"intervals of {name} are too narrow by a factor of about {width:.2g} {held}"
    return f"intervals of {name} are too wide by a factor of about {1 / width:.2g} {held}"


def _refits(scope: str, found: Calibration) -> Verdict:
    every = found.fits + len(found.broken)
    share = (found.unreliable * found.fits + len(found.broken)) / every
    why = (
        f"{share:.1%} of {every} simulated fits broke or failed their own diagnostics, "
        f"{found.escalated:.1%} went to a higher effort, {found.other_law:.1%} took another law."
    )
    if found.broken:
        why += f" One ended with: {found.broken[0]}"
    return judge(scope, "refits", share, UNRELIABLE_LIMIT, why)


def _halves(scope: str, found: Halves | None, because: str) -> list[Verdict]:
    checks = ("halves", "halves-effort")
    if found is None or found.p_value is None or found.effort_p_value is None:
        why = because if found is None else "Each half holds too little to be judged by itself."
        return [not_evaluated(scope, name, why, HALVES_SHARE) for name in checks]
    largest = max((row for row in found.rows if row.z is not None), key=lambda r: abs(r.z or 0.0))
    size = f"{largest.name} differs most, by {abs(largest.z or 0.0):.1f} standard deviations"
    p, effort_p = found.p_value, found.effort_p_value
    by_recording = found.split.startswith(BY_RECORDING)
    good = f"Two halves of the data agree within their claimed errors (p = {p:.2g}; {size})."
    if p > 1.0 - HALVES_SHARE:
        good += (
            " They agree better than expected: a lack of fit repeats in every stroke, and the "
            "intervals allow for it as if it were noise."
        )
    if not by_recording:
        good += " How much recordings differ is not known, as there is only one."
    units = "recordings" if by_recording else "strokes"
    bad = (
        f"Two halves of the data differ by more than their claimed errors (p = {p:.2g}; {size}): "
        f"the law or the rig changes between {units}. Look at the residuals by stroke, and repeat "
        "some."
    )
    what = (
        f"The halves' predictions differ by {found.effort_difference:.2%} of the effort's rms "
        f"where {found.effort_expected:.2%} is expected (p = {effort_p:.2g})."
    )
    return [
        judge(scope, checks[0], p, HALVES_SHARE, good, bad),
        judge(scope, checks[1], effort_p, HALVES_SHARE, what),
    ]


def _prior(scope: str, found: Sensitivity | None, because: str) -> Verdict:
    if found is None:
        return not_evaluated(scope, "prior", because)
    worst = max(found.rows, key=lambda row: row.prior)
    effort = next(row for row in found.rows if row.name == EFFORT)
    conflict = [row.name for row in found.rows if row.diagnosis == "prior-data conflict"]
    weak = [row.name for row in found.rows if row.diagnosis == "weak likelihood"]
    said = []
    if conflict:
        said.append(
            f"prior and data pull {', '.join(conflict)} apart: check units and signs, or widen the "
            "recipe's prior"
        )
    if weak:
        said.append(
            f"the data say little about {', '.join(weak)}, and the prior decides: record strokes "
            "that excite it"
        )
    status: Status = "fail" if conflict or effort.prior >= found.threshold else "pass"
    why = (
        f"Sensitivity to the prior is {worst.prior:.2g} at most ({worst.name}); the data decide."
        if not said
        else "; ".join(said).capitalize() + "."
    )
    if weak and status == "pass":
        why += " The predicted effort does not depend on it."
    return Verdict(scope, "prior", status, worst.prior, found.threshold, why)
