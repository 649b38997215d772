"""Whether to trust a fit, why, and what to do next."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from scissorcal.calibration.result import FitResult
from scissorcal.recipe.requirements import GeometryKind
from scissorcal.report.numbers import percent
from scissorcal.report.subjects.posterior import prior_only
from scissorcal.report.subjects.torque import held_out_summary
from scissorcal.verdicts import Verdict

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
    """Weigh a fit's verdicts, effort and identifiability; ``checked`` are of its trust check.

    Any failed verdict rejects. Missing verdicts, checks that were not evaluated, draft effort, or
    a parameter that repeats its prior ask for care. Without a trust check a fit that passed its
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
        brief = f"{passed}; {'coverage not counted' if checked else 'trust check not done'}"
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
        "photographs have no trust check."
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
