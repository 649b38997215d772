"""Checks and their verdicts: what was checked, against which limit, what it guards, and why."""

from dataclasses import asdict, dataclass, replace
from math import isnan, nan
from numbers import Real
from typing import Any, Literal, get_args

Status = Literal["pass", "fail", "not_evaluated"]
Limit = Literal["at most", "at least", ""]

TORQUE = "torque: "
"""What a check guards begins so where its number judges torque itself: an error of it, its share,
a share of its variance, or how likely a difference of it is."""
STATED = nan
"""The limit of a check whose verdicts each state their own, as it depends on what is judged."""
INTERVALS = "whether intervals hold what they promise"


@dataclass(frozen=True)
class Verdict:
    """One check with its outcome; a :class:`Check` gives it, or a file holds it.

    ``scope`` names what was judged (``"fit.friction"``), ``check`` the question asked
    (``"whiteness"``). ``value`` and ``threshold`` are numbers in the unit that ``guards`` states;
    None where there is none. ``why`` is a sentence for people. ``limit`` says whether ``value`` may
    be at most or at least ``threshold``; ``guards`` what the number is, and whether it bounds an
    error of torque. Raises TypeError for a field of another type.
    """

    scope: str
    check: str
    status: Status
    value: float | None
    threshold: float | None
    why: str
    limit: Limit = ""
    guards: str = ""

    def __post_init__(self) -> None:
        """Refuse fields of other types, which a changed file may hold; numbers become floats."""
        texts = (self.scope, self.check, self.why, self.guards)
        if not all(isinstance(text, str) for text in texts):
            raise TypeError(f"a verdict's scope, check, why and guards are text, not {texts}")
        if self.status not in get_args(Status) or self.limit not in get_args(Limit):
            raise TypeError(f"no verdict has the status {self.status!r} and limit {self.limit!r}")
        for name in ("value", "threshold"):
            number = getattr(self, name)
            if number is not None and not isinstance(number, Real):
                raise TypeError(f"the {name} of a verdict is a number or None, not {number!r}")
            object.__setattr__(self, name, None if number is None else float(number))

    @property
    def limited(self) -> str:
        """The value and its limit in words; empty where there is no number."""
        if self.value is None:
            return ""
        if self.threshold is None or not self.limit:
            return f"{self.value:.3g}"
        return f"{self.value:.3g}, {self.limit} {self.threshold:.3g}"

    def of(self, scope: str) -> "Verdict":
        """The verdict on a part of its scope, as "fit.cut" is of "fit". ValueError for another."""
        if not scope.startswith(self.scope):
            raise ValueError(f"the check {self.check} is of {self.scope}, not of {scope}")
        return replace(self, scope=scope)

    def as_dict(self) -> dict[str, Any]:
        """Give the verdict as the plain object that ``--json`` prints."""
        return asdict(self)


@dataclass(frozen=True)
class Check:
    """A check as a row: declared once, as a constant of the module that measures its value.

    ``key`` is the scope of its verdicts, or what theirs begins with, and the check's name.
    ``guards`` says what the value is, in which unit, and what the check is for. The limit is what a
    value may be ``at_most`` or ``at_least``, neither where something else decides.

    >>> RESIDUALS = Check("fit.plate residuals", "sd of corners, px", at_most=0.3)
    >>> verdict = RESIDUALS.judge(0.4, "0.4 px.", "0.4 px: the target may be bent.")
    >>> verdict.status, verdict.limited, verdict.why
    ('fail', '0.4, at most 0.3', '0.4 px: the target may be bent.')
    """

    key: str
    guards: str
    at_most: float | None = None
    at_least: float | None = None

    @property
    def limit(self) -> Limit:
        """On which side of the threshold a value is good, if on any."""
        if self.at_most is not None:
            return "at most"
        return "" if self.at_least is None else "at least"

    @property
    def threshold(self) -> float:
        """The number of the limit; NaN where there is none, or each verdict states its own."""
        return next((x for x in (self.at_most, self.at_least) if x is not None), STATED)

    @property
    def name(self) -> str:
        """The name of the check, without its scope."""
        return self.key.partition(" ")[2]

    def judge(
        self, value: float, good: str, bad: str | None = None, threshold: float | None = None
    ) -> Verdict:
        """Judge a value by the limit: ``good`` is said where it passes, ``bad`` where it fails.

        The limit itself passes, NaN fails. Raises ValueError where there is no limit to judge by.
        """
        allowed = self.threshold if threshold is None else threshold
        if isnan(allowed) or not self.limit:
            raise ValueError(f"the check {self.key} has no limit to judge by")
        passes = value <= allowed if self.limit == "at most" else value >= allowed
        why = good if passes or bad is None else bad
        return self.verdict("pass" if passes else "fail", value, why, allowed)

    def not_evaluated(
        self, why: str, value: float | None = None, threshold: float | None = None
    ) -> Verdict:
        """A check that could not be made, or decides nothing here, and why."""
        return self.verdict("not_evaluated", value, why, threshold)

    def verdict(
        self, status: Status, value: float | None, why: str, threshold: float | None = None
    ) -> Verdict:
        """A verdict whose status more than the limit decides."""
        scope, _, name = self.key.partition(" ")
        allowed = self.threshold if threshold is None else threshold
        stated = None if isnan(allowed) else allowed
        return Verdict(scope, name, status, value, stated, why, self.limit, self.guards)


def failed(verdicts: tuple[Verdict, ...]) -> tuple[Verdict, ...]:
    """Return the verdicts whose status is ``fail``, in order."""
    return tuple(verdict for verdict in verdicts if verdict.status == "fail")
