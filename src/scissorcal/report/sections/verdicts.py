"""Verdicts of all fits and sheets, those that failed first."""

from collections.abc import Iterable
from dataclasses import dataclass

from scissorcal.report.numbers import Number, finite
from scissorcal.verdicts import Limit, Status, Verdict

ORDER: tuple[Status, ...] = ("fail", "not_evaluated", "pass")


@dataclass(frozen=True)
class VerdictRow:
    """One verdict, its numbers finite or None.

    ``limit`` is "at most" or "at least", ``guards`` says what ``value`` is and what it guards.
    """

    scope: str
    check: str
    status: Status
    value: Number
    threshold: Number
    why: str
    limit: Limit = ""
    guards: str = ""


@dataclass(frozen=True)
class VerdictSection:
    """All verdicts with their counts."""

    passed: int
    failed: int
    not_evaluated: int
    rows: tuple[VerdictRow, ...]


def gather_verdicts(verdicts: Iterable[Verdict]) -> VerdictSection:
    """Order verdicts by outcome, failures first; within an outcome they keep their order."""
    rows = [row_of(verdict) for verdict in verdicts]
    count = {status: sum(row.status == status for row in rows) for status in ORDER}
    ordered = tuple(sorted(rows, key=lambda row: ORDER.index(row.status)))
    return VerdictSection(count["pass"], count["fail"], count["not_evaluated"], ordered)


def row_of(verdict: Verdict) -> VerdictRow:
    """Take a verdict over, with numbers that JSON can hold."""
    return VerdictRow(
        verdict.scope,
        verdict.check,
        verdict.status,
        finite(verdict.value),
        finite(verdict.threshold),
        verdict.why,
        verdict.limit,
        verdict.guards,
    )
