"""One sentence per fit: whether to trust it, and what to do next."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

from scissorcal.calibration.result import FitResult
from scissorcal.report.numbers import percent
from scissorcal.report.sections.held_out import HeldOutSection
from scissorcal.report.sections.parameters import ParameterRow
from scissorcal.verdicts import Verdict

Stance = Literal["trust", "unverified", "care", "reject"]

DRAFT_SKIPS = "k-hat"

ADVICE: tuple[tuple[tuple[str, ...], str], ...] = (
    (
        ("k-hat",),
        "The posterior is far from its approximation: record more varied strokes, or choose a "
        "simpler rung in the recipe's `[fit]` table.",
    ),
    (
        ("optimum",),
        "The search did not settle: check the recording's units and signs, then fit again, with "
        "`--effort standard` if this was a draft.",
    ),
    (
        ("bound",),
        "A parameter ended at the edge of the search: check the recording's units and signs, then "
        "its prior in the recipe.",
    ),
    (
        ("whiteness",),
        "The residuals have structure: look at the worst strokes below, then record longer or more "
        "varied motion, or try a richer rung in the recipe's `[fit]` table.",
    ),
    (
        ("held-out",),
        "New strokes are not predicted well: record more strokes at the speeds of the worst ones, "
        "or try a richer rung.",
    ),
    (
        ("r-squared",),
        "The law explains too little: check the recording's units and signs, and that what was "
        "recorded is what the recipe says.",
    ),
    (
        ("calibration", "refits"),
        "Intervals do not hold what they promise on data simulated from the fit itself: fit with "
        "more effort, or choose a simpler rung in the recipe's `[fit]` table.",
    ),
    (
        ("trust", "halves"),
        "Two halves of the data disagree by more than they claim: check that nothing moved or "
        "warmed up during the capture, then capture again.",
    ),
    (
        ("identifiability",),
        "Some parameters repeat their prior: record the speeds or openings that would tell them "
        "apart, or choose a rung without them.",
    ),
)
"""What to do about a check that failed, by a word in its name."""


@dataclass(frozen=True)
class Headline:
    """What to think of one fit: ``stance``, a sentence, and the next steps in order."""

    fit: str
    stance: Stance
    sentence: str
    next_steps: tuple[str, ...]


def write_headline(
    fit: FitResult,
    held_out: HeldOutSection,
    parameters: Sequence[ParameterRow],
    checked: Sequence[Verdict] = (),
) -> Headline:
    """Weigh a fit's verdicts, effort and identifiability into one sentence.

    ``checked`` are the verdicts of its trust check, if one was made.

    Any failed verdict rejects. Missing verdicts, checks that were not evaluated, draft effort, or
    a parameter that only repeats its prior ask for care. Without a trust check nothing is trusted:
    a fit that passed its own checks is unverified.
    """
    verdicts = (*fit.verdicts, *checked)
    failed = [verdict.check for verdict in verdicts if verdict.status == "fail"]
    draft = fit.effort == "draft"
    open_checks = [
        verdict.check
        for verdict in verdicts
        if verdict.status == "not_evaluated" and not (draft and verdict.check == DRAFT_SKIPS)
    ]
    silent = [row.name for row in parameters if row.word == "prior only"]
    error = _error_words(held_out)
    if failed:
        sentence = f"Do not rely on the {fit.what} fit: {_listed(failed)} failed.{error}"
        return Headline(fit.what, "reject", sentence, _advice(fit, failed))
    doubts, steps = [], []
    if not verdicts:
        doubts.append("nothing was checked")
        steps.append("Fit again, so that its checks are made.")
    if open_checks:
        doubts.append(f"{_listed(open_checks)} could not be evaluated")
        steps.append("Read in the verdicts why, and supply what the check needs.")
    if silent:
        named = _listed([f"`{name}`" for name in silent])
        doubts.append(f"{named} only repeat{'s' if len(silent) == 1 else ''} the prior")
        steps += _advice(fit, ["identifiability"])
    if draft:
        doubts.append("its intervals are those of a draft")
        steps.append(f"Run `scissorcal fit {fit.what} --effort standard` for intervals to rely on.")
    if doubts:
        sentence = f"Use the {fit.what} fit with care: {'; '.join(doubts)}.{error}"
        return Headline(fit.what, "care", sentence, tuple(steps))
    count = len(verdicts)
    made = "its one check" if count == 1 else f"all {count} checks"
    if not checked:
        sentence = (
            f"The {fit.what} fit is unverified: it passed {made} of its own, and whether its "
            f"intervals hold was not tested.{error}"
        )
        step = f"Run `scissorcal verify {fit.what}`, then `scissorcal report`."
        return Headline(fit.what, "unverified", sentence, (step,))
    sentence = f"The {fit.what} fit can be trusted: it passed {made}.{error}"
    return Headline(
        fit.what, "trust", sentence, ("Read on, and sign with `scissorcal report sign`.",)
    )


def _error_words(held_out: HeldOutSection) -> str:
    if held_out.median_relative_rms is None:
        return ""
    return (
        f" On strokes it had not seen it errs by {percent(held_out.median_relative_rms)} "
        f"(median; worst {percent(held_out.worst_relative_rms)})."
    )


def _advice(fit: FitResult, checks: Sequence[str]) -> tuple[str, ...]:
    steps: list[str] = []
    for check in checks:
        words = check.lower()
        known = [step for keys, step in ADVICE if any(key in words for key in keys)]
        steps += known[:1] or [f"Read why {check} failed, mend that, and fit again."]
    again = f"Then run `scissorcal fit {fit.what}` and `scissorcal report` again."
    return (*dict.fromkeys(steps), again)


def _listed(names: Sequence[str]) -> str:
    unique = list(dict.fromkeys(names))
    return unique[0] if len(unique) == 1 else f"{', '.join(unique[:-1])} and {unique[-1]}"
