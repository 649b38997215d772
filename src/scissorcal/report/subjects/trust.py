"""Whether to trust a fit: its headline, and the verification of its intervals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from scissorcal.calibration.result import FitResult
from scissorcal.calibration.verify.result import Calibration, Halves, Sensitivity, VerifyResult
from scissorcal.recipe.requirements import GeometryKind
from scissorcal.report.numbers import percent, short, significant
from scissorcal.report.panel import (
    Axis,
    Chart,
    Look,
    Panel,
    Row,
    Style,
    absent,
    band,
    curve,
    number,
    percent_of,
    words,
)
from scissorcal.report.subjects.posterior import prior_only
from scissorcal.report.subjects.torque import held_out_summary
from scissorcal.verdicts import Verdict

LOOKS: tuple[tuple[Look, Style], ...] = (
    ("blue", "full"),
    ("vermillion", "dashed"),
    ("green", "dotted"),
    ("purple", "dashed"),
    ("orange", "dotted"),
)
LARGE_Z = 3.0
METHOD = "simulation-based calibration, Talts et al. 2018, doi 10.48550/arXiv.1804.06788"


def trust_panels(fit: FitResult, check: VerifyResult | None, part: str) -> tuple[Panel, ...]:
    """The verification of a fit in the report; how to make it where it was not made."""
    if check is None:
        why = (
            f"It has not been made for this fit: run `scissorcal verify {fit.words}`. It simulates "
            f"recordings, refits them and counts the coverage of the intervals ({METHOD})."
        )
        return (absent(f"{part}-verify", part, "Verification", why),)
    return check_panels(check, part)


def check_panels(check: VerifyResult, part: str) -> tuple[Panel, ...]:
    """Panels on simulated data, halves and prior sensitivity, as far as they were made."""
    id_ = f"{part}-verify"
    panels = []
    if check.calibration is not None:
        panels.append(_calibration(check.calibration, part, id_))
    if check.halves is not None:
        panels.append(_halves(check.halves, part, id_))
    if check.sensitivity is not None:
        panels.append(_sensitivity(check.sensitivity, part, id_))
    if check.not_done:
        why = " ".join(check.not_done)
        panels.append(absent(f"{id_}-open", part, "Verification: not done", why))
    return tuple(panels)


def coverage_found(check: VerifyResult | None) -> str:
    """In a sentence, how often intervals held the truth; empty where that was not tested."""
    calibration = check.calibration if check is not None else None
    if calibration is None:
        return ""
    covers = [(c, q.name) for q in calibration.quantities for c in q.coverage if c.level >= 0.9]
    if not covers:
        return ""
    level = min(c.level for c, _ in covers)
    shares = [c.share for c, _ in covers if c.level == level]
    worst, name = min(((c.share, name) for c, name in covers if c.level == level))
    return (
        f"{percent(level)} intervals held the truth in {percent(float(np.mean(shares)), 3)} of "
        f"{calibration.fits} simulated fits; lowest {name} with {percent(worst, 3)}"
    )


def _calibration(calibration: Calibration, part: str, id_: str) -> Panel:
    rows = []
    for quantity in calibration.quantities:
        covers = [
            percent_of(f"{percent(c.level)} interval holds", c.share, 3, low=c.low, high=c.high)
            for c in quantity.coverage
        ]
        rows.append(
            Row(
                quantity.name,
                (
                    *covers,
                    number("uniformity p", quantity.ecdf_p, digits=2),
                    number("too narrow by", quantity.width),
                    number("shift", quantity.shift, "sd", digits=2),
                ),
                marked=any(not c.low <= c.share <= c.high for c in quantity.coverage),
            )
        )
    out = [row.name for row in rows if row.marked]
    sentence = (
        f"Intervals do not hold the truth as often as they claim for {', '.join(out)}."
        if out
        else "Intervals hold the truth as often as they claim."
    )
    note = (
        f"{calibration.fits} fits to data simulated from known values, with this fit's motion and "
        f"size ({calibration.generating}; {calibration.noise}). {percent(calibration.escalated)} "
        f"of them went to a higher effort, {percent(calibration.unreliable)} failed their "
        f"diagnostics, {len(calibration.broken)} gave no result."
    )
    caption = (
        f"{METHOD[0].upper()}{METHOD[1:]}: share of intervals that held the truth; in brackets the "
        "range that correct intervals keep to."
    )
    title = "Verification: intervals on simulated data"
    charts = (_ranks(calibration, f"{id_}-ranks"),)
    return Panel(id_, part, title, sentence, tuple(rows), charts, notes=(note,), caption=caption)


def _ranks(calibration: Calibration, id_: str) -> Chart:
    """The ranks' distribution function less that of uniform ranks, with its simultaneous band."""
    z, low, high = (
        np.array(v) for v in (calibration.band.z, calibration.band.low, calibration.band.high)
    )
    series = [band("correct intervals", z, low - z, high - z)]
    outside = []
    for place, quantity in enumerate(calibration.quantities):
        ranks = (np.array(quantity.ranks) + 0.5) / calibration.levels
        share = np.searchsorted(np.sort(ranks), z, side="right") / max(len(ranks), 1)
        look, style = LOOKS[place % len(LOOKS)]
        series.append(curve(quantity.name, z, share - z, look, style=style, toggle=True))
        if np.any((share < low) | (share > high)):
            outside.append(quantity.name)
    caption = (
        f"Each line is a quantity; one with correct intervals leaves the shade with probability "
        f"{percent(calibration.band.alpha)}. "
        + (f"Outside: {', '.join(outside)}." if outside else "None leaves it.")
    )
    x, y = Axis("share of the range of ranks"), Axis("ECDF − uniform")
    return Chart(id_, "Ranks of the truth among the draws", x, y, tuple(series), caption)


def _halves(halves: Halves, part: str, id_: str) -> Panel:
    rows = tuple(
        Row(
            row.name,
            (
                number("first half", row.first, row.unit),
                number("second half", row.second, row.unit),
                number("sd of the difference", row.sd, row.unit, digits=2),
                words("z", "prior alone") if row.z is None else number("z", row.z, digits=2),
            ),
            marked=row.z is not None and abs(row.z) > LARGE_Z,
        )
        for row in halves.rows
    )
    sentence = (
        f"Fitted to each half alone, the predicted effort differs by "
        f"{percent(halves.effort_difference)} rms ({percent(halves.effort_expected)} expected); "
        f"probability {significant(halves.effort_p_value, 2)}, of all parameters together "
        f"{significant(halves.p_value, 2)}."
    )
    note = f"Two fits to strokes that they do not share ({halves.split})."
    title = "Verification: two halves of the data"
    caption = "The difference against the uncertainty that each half claims."
    return Panel(f"{id_}-halves", part, title, sentence, rows, notes=(note,), caption=caption)


def _sensitivity(sensitivity: Sensitivity, part: str, id_: str) -> Panel:
    rows = tuple(
        Row(
            row.name,
            (
                number("to the prior", row.prior, digits=2),
                number("to the data", row.likelihood, digits=2),
                words("diagnosis", row.diagnosis),
            ),
            marked=row.diagnosis != "fine",
        )
        for row in sensitivity.rows
    )
    odd = [row.name for row in rows if row.marked]
    sentence = (
        f"The prior matters for {', '.join(odd)}."
        if odd
        else "No quantity depends on the strength of the prior."
    )
    caption = (
        "How far the posterior moves when prior or data count slightly more (power scaling); above "
        f"{short(sensitivity.threshold)} it matters."
    )
    title = "Verification: prior sensitivity"
    return Panel(f"{id_}-sensitivity", part, title, sentence, rows, caption=caption)


Assessment = Literal["trust", "unverified", "care", "reject"]
ASSESSMENTS: tuple[Assessment, ...] = ("reject", "care", "unverified", "trust")
"""From the worst."""
SAID: dict[Assessment, str] = {
    "trust": "✓ trust",
    "unverified": "? not verified",
    "care": "! use with care",
    "reject": "✗ do not use",
}
DRAFT_SKIPS = "k-hat"


@dataclass(frozen=True)
class Headline:
    """What to think of one fit: a sentence, the same in brief, and the next steps in order."""

    fit: str
    assessment: Assessment
    sentence: str
    brief: str
    next_steps: tuple[str, ...]


def write_headline(fit: FitResult, checked: Sequence[Verdict] = ()) -> Headline:
    """Weigh a fit's verdicts, effort and identifiability; ``checked`` are of its verification.

    Any failed verdict rejects. Missing verdicts, checks that were not evaluated, draft effort, or
    a parameter that repeats its prior ask for care. Without a verification a fit that passed its
    own checks is not verified, nor with one that counted no coverage.
    """
    verdicts = (*fit.verdicts, *checked)
    failed = [verdict for verdict in verdicts if verdict.status == "fail"]
    error = _error_words(fit)
    if failed:
        again = f"Then run `scissorcal fit {fit.words}` and `scissorcal report` again."
        brief = f"{_listed([verdict.check for verdict in failed])} failed"
        sentence = f"Do not use the {fit.what} fit: {brief}.{error}"
        steps = (*dict.fromkeys(verdict.why for verdict in failed), again)
        return Headline(fit.what, "reject", sentence, brief, steps)
    doubts, steps = _doubts(fit, verdicts)
    if doubts:
        brief = "; ".join(doubts)
        sentence = f"Use the {fit.what} fit with care: {brief}.{error}"
        return Headline(fit.what, "care", sentence, brief, steps)
    passed = f"passed all {len(verdicts)} checks" if len(verdicts) > 1 else "passed its one check"
    if not any(v.check == "calibration" and v.status != "not_evaluated" for v in checked):
        sentence = (
            f"The {fit.what} fit is not verified: it {passed}, but whether its intervals hold the "
            f"truth was not tested.{error}"
        )
        step = f"Run `scissorcal verify {fit.words}`, then `scissorcal report`."
        brief = f"{passed}; {'coverage not counted' if checked else 'verification not done'}"
        return Headline(fit.what, "unverified", sentence, brief, (step,))
    sentence = f"The {fit.what} fit can be trusted: it {passed}.{error}"
    step = "Read on, and sign with `scissorcal report sign`."
    return Headline(fit.what, "trust", sentence, passed, (step,))


def geometry_headline(kind: GeometryKind, verdicts: Sequence[Verdict]) -> Headline:
    """Weigh the verdicts on a fit of photographs."""
    failed = [verdict for verdict in verdicts if verdict.status == "fail"]
    unmade = [verdict for verdict in verdicts if verdict.status == "not_evaluated"]
    if failed:
        brief = f"{_listed([v.check for v in failed])} failed"
        again = f"Then run `scissorcal fit {kind}` and `scissorcal report` again."
        steps = (*(verdict.why for verdict in failed), again)
        return Headline(kind, "reject", f"Do not use the {kind} fit: {brief}.", brief, steps)
    if unmade or not verdicts:
        brief = "nothing was checked"
        if unmade:
            brief = f"{_listed([v.check for v in unmade])} not evaluated"
        steps = tuple(verdict.why for verdict in unmade) or (
            f"Run `scissorcal fit {kind} --force`, so that its checks are made.",
        )
        return Headline(kind, "care", f"Use the {kind} fit with care: {brief}.", brief, steps)
    passed = f"passed all {len(verdicts)} checks" if len(verdicts) > 1 else "passed its one check"
    sentence = (
        f"The {kind} fit {passed}. Whether its intervals hold the truth is not among them: fits of "
        "photographs have no verification."
    )
    step = "Look at its pictures: is what was drawn what you see?"
    return Headline(kind, "unverified", sentence, passed, (step,))


def _doubts(fit: FitResult, verdicts: Sequence[Verdict]) -> tuple[list[str], tuple[str, ...]]:
    """What asks for care, and what to do about it."""
    draft = fit.effort == "draft"
    unmade = [
        verdict.check
        for verdict in verdicts
        if verdict.status == "not_evaluated" and not (draft and verdict.check == DRAFT_SKIPS)
    ]
    silent = prior_only(fit)
    doubts, steps = [], []
    if not verdicts:
        doubts.append("nothing was checked")
        steps.append("Fit again, so that its checks are made.")
    if unmade:
        doubts.append(f"{_listed(unmade)} could not be evaluated")
        steps.append("Read in the verdicts why, and supply what the check needs.")
    if silent:
        named = _listed([f"`{name}`" for name in silent])
        doubts.append(f"{named} repeat{'s' if len(silent) == 1 else ''} the prior")
        steps.append(
            "Some parameters repeat their prior: record the speeds or openings that inform them, "
            f"or choose a candidate without them. Then run `scissorcal fit {fit.words}` again."
        )
    if draft:
        doubts.append("its intervals are those of a draft")
        steps.append(f"Run `scissorcal fit {fit.words} --effort standard` for reliable intervals.")
    return doubts, tuple(steps)


def _error_words(fit: FitResult) -> str:
    middle, worst = held_out_summary(fit)
    if middle is None:
        return ""
    return f" Hold-out error by stroke: {percent(middle)} (median; worst {percent(worst)})."


def _listed(names: Sequence[str]) -> str:
    unique = list(dict.fromkeys(names))
    return unique[0] if len(unique) == 1 else f"{', '.join(unique[:-1])} and {unique[-1]}"
