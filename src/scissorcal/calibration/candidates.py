"""One rule that compares candidate models: the simplest that hold-out data do not reject."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from scissorcal.aliases import Array

POSITIVE_EVIDENCE = 3.0
"""Log density, counting independent observations only, that the best candidate must gain: a factor
of 20 (Kass and Raftery 1995, doi:10.1080/01621459.1995.10476572, call this strong)."""

FEWEST_UNITS = 6
"""With fewer units their spread is hardly known, and the evidence alone decides."""

RELIABLE_UNITS = 0.8
"""Share of units that must have reliable scores for an account to count."""


@dataclass(frozen=True)
class Account:
    """Log densities (candidates, units) of hold-out units, simplest candidate first.

    A unit is what errs independently of the others: a stroke, a photograph. ``reliable``
    (candidates, units) marks the densities to use; None stands for all.
    """

    scores: Array
    reliable: NDArray[np.bool_] | None = None


@dataclass(frozen=True)
class CandidateRow:
    """One candidate in a comparison.

    ``score`` is the log density of all hold-out units, ``behind`` that of the best candidate less
    this one's, ``behind_se`` its standard error over units (NaN for a single unit).
    ``equivalent`` candidates are not distinguishable from the best, the ``chosen`` one is used.
    """

    name: str
    parameters: int
    score: float
    behind: float
    behind_se: float
    equivalent: bool
    chosen: bool


def compare(
    names: Sequence[str],
    parameters: Sequence[int],
    accounts: Sequence[Account],
    negligible: Sequence[bool] | None = None,
) -> tuple[CandidateRow, ...]:
    """Choose the simplest candidate that is not distinguishable from the best.

    Candidates stand simplest first. The best has the highest log density of hold-out units in the
    first account. Another one is distinguishable from it where every account rejects it: the best
    gains `POSITIVE_EVIDENCE` in sum, and more than one standard error of the paired differences
    over units (the one-standard-error rule of Breiman, Friedman, Olshen and Stone 1984, chapter 3,
    on the densities of Vehtari, Gelman and Gabry 2017, doi:10.1007/s11222-016-9696-4). An account
    in which too few units are reliable for both does not count, the first always does.
    ``negligible`` marks candidates whose error exceeds the best one's by too little to matter:
    these are equivalent in any case.
    """
    scores = accounts[0].scores
    best = int(np.argmax(scores.sum(axis=1)))
    equivalent = [
        (negligible is not None and bool(negligible[index]))
        or not all(_rejects(account, best, index) for account in accounts)
        for index in range(len(names))
    ]
    chosen = equivalent.index(True)
    rows = []
    for index, name in enumerate(names):
        gained = scores[best] - scores[index]
        rows.append(
            CandidateRow(
                name=name,
                parameters=parameters[index],
                score=float(scores[index].sum()),
                behind=float(gained.sum()),
                behind_se=standard_error(gained),
                equivalent=equivalent[index],
                chosen=index == chosen,
            )
        )
    return tuple(rows)


def comparison_sentence(rows: Sequence[CandidateRow], units: str) -> str:
    """Say which candidate is used, and which others the hold-out ``units`` do not reject.

    "Do not distinguish" is said of differences below ``POSITIVE_EVIDENCE`` alone.
    """
    (chosen,) = (row for row in rows if row.chosen)
    if len(rows) == 1:
        return f"{chosen.name} is the only candidate."
    near = [row for row in rows if row.equivalent]
    others = [row.name for row in near if not row.chosen]
    if not others:
        return f"{chosen.name} is used: every other candidate predicts hold-out {units} worse."
    also = f"The others are {', '.join(others)}."
    if len(others) == 1:
        also = f"The other is {others[0]}."
    count = f"{len(near)} candidates that hold-out {units} do not distinguish from the best"
    behind = [row for row in near if row.behind >= POSITIVE_EVIDENCE]
    if behind:
        count = f"{len(near)} candidates near the best"
        also += "".join(
            f" {row.name} is {row.behind:.0f} nats behind the best, with a standard error of "
            f"{row.behind_se:.0f} over {units}."
            for row in behind
        )
    if chosen.parameters > min(row.parameters for row in near):
        return f"{chosen.name} is used, one of {count}, though not the simplest (see notes). {also}"
    return f"{chosen.name} is used: the simplest of {count}. {also}"


def standard_error(scores: Array) -> float:
    """Of a sum over independent units (units,); NaN for a single one."""
    if len(scores) < 2:
        return float("nan")
    return float(np.sqrt(len(scores) * np.var(scores, ddof=1)))


def _rejects(account: Account, best: int, index: int) -> bool:
    """Whether an account distinguishes a candidate from the best one, or does not count."""
    gained = account.scores[best] - account.scores[index]
    if account.reliable is not None:
        both = account.reliable[best] & account.reliable[index]
        if np.mean(both) < RELIABLE_UNITS:
            return True
        gained = gained[both]
    return is_positive(gained)


def is_positive(gained: Array) -> bool:
    """Whether log density gained by unit (units,) is strong evidence, and more than its spread.

    The sum must exceed one standard error over units. A single unit reaches that limit and never
    exceeds it, so that one unit alone decides nothing; a unit in which two candidates predict the
    same says nothing for or against either.
    """
    total = float(gained.sum())
    if total < POSITIVE_EVIDENCE:
        return False
    return len(gained) < FEWEST_UNITS or total > standard_error(gained)
