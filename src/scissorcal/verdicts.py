"""Scoped verdicts: what was checked, against which threshold, and why it came out so."""

from dataclasses import asdict, dataclass
from typing import Any, Literal

Status = Literal["pass", "fail", "not_evaluated"]


@dataclass(frozen=True)
class Verdict:
    """One check with its outcome.

    ``scope`` names what was judged (``"fit.friction"``), ``check`` the question asked
    (``"whiteness"``). ``value`` and ``threshold`` are numbers in the unit that ``why`` states;
    both are None where a check could not be evaluated. ``why`` is a sentence for people.

    >>> Verdict("fit.cut", "k-hat", "pass", 0.31, 0.7, "The weights are well behaved.").status
    'pass'
    """

    scope: str
    check: str
    status: Status
    value: float | None
    threshold: float | None
    why: str

    def as_dict(self) -> dict[str, Any]:
        """Give the verdict as the plain object that ``--json`` prints."""
        return asdict(self)


def failed(verdicts: tuple[Verdict, ...]) -> tuple[Verdict, ...]:
    """Return the verdicts whose status is ``fail``, in order."""
    return tuple(verdict for verdict in verdicts if verdict.status == "fail")
