"""Which candidates of a ladder an effort fits: draft one, the others all of them."""

from collections.abc import Sequence
from typing import Protocol, TypeVar

from scissorcal.calibration.result import Effort


class Named(Protocol):
    """A candidate of a ladder, which says its law's name in words."""

    @property
    def name(self) -> str:
        """Name of the law, as :attr:`FitResult.rung` has it."""
        ...


Candidate = TypeVar("Candidate", bound=Named)


def candidates_for(
    effort: Effort,
    ladder: Sequence[Candidate],
    last_chosen: str | None = None,
    default: str | None = None,
) -> tuple[Candidate, ...]:
    """The candidates that are fitted at an effort, in the ladder's order.

    Draft fits one: the only one that the recipe leaves, else the one that the last fit of the
    workspace chose (``last_chosen``, its :attr:`FitResult.rung`), else ``default``, else the last
    of the ladder, which is the richest. Standard and thorough compare all of them. A name that the
    ladder does not have is passed over: the recipe may have changed since. ValueError where the
    ladder is empty.
    """
    if not ladder:
        raise ValueError("A ladder without candidates cannot be fitted; the recipe allows no law.")
    if effort != "draft" or len(ladder) == 1:
        return tuple(ladder)
    for wanted in (last_chosen, default):
        for candidate in ladder:
            if candidate.name == wanted:
                return (candidate,)
    return (ladder[-1],)


def draft_note(effort: Effort, ladder: Sequence[Named], fitted: Sequence[Named]) -> tuple[str, ...]:
    """The note for a result whose ladder was cut down to one candidate; empty where it was not."""
    if effort != "draft" or len(fitted) == len(ladder):
        return ()
    return (
        f"Draft effort fitted one law of {len(ladder)}, {fitted[0].name}, and compared it with "
        "none; use standard effort to have the law chosen by the data.",
    )
