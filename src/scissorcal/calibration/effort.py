"""Which candidate models an effort fits: draft one, the others all of them."""

from collections.abc import Callable, Container, Sequence
from typing import Protocol, TypeVar

from scissorcal.calibration.result import Effort


class Named(Protocol):
    """A candidate model, which has its law's name in words."""

    @property
    def name(self) -> str:
        """Name of the law, as :attr:`FitResult.rung` has it."""
        ...


Candidate = TypeVar("Candidate", bound=Named)


def candidates_for(
    effort: Effort,
    candidates: Sequence[Candidate],
    usual: Callable[[Sequence[Candidate]], Candidate],
    last_chosen: str | None = None,
    among: Container[str] = (),
) -> tuple[Candidate, ...]:
    """The candidates that are fitted at an effort, simplest first.

    Draft fits one: the only one that the recipe leaves, else the one that the last fit of the
    workspace chose (``last_chosen``, its :attr:`FitResult.rung`), else the one that such data
    usually support, which ``usual`` picks of them. Standard and thorough compare all of them, or
    those that ``among`` names, if any. A name that no candidate has is passed over: the recipe may
    have changed since. ValueError where there is no candidate.
    """
    candidates = [one for one in candidates if one.name in among] or candidates
    if not candidates:
        raise ValueError("The recipe allows no law, so there is no candidate model to fit.")
    if effort != "draft" or len(candidates) == 1:
        return tuple(candidates)
    chosen = [one for one in candidates if one.name == last_chosen]
    return tuple(chosen[:1]) or (usual(candidates),)


def draft_note(
    effort: Effort, candidates: Sequence[Named], fitted: Sequence[Named]
) -> tuple[str, ...]:
    """The note for a result of which one candidate alone was fitted; empty elsewhere."""
    if effort != "draft" or len(fitted) == len(candidates):
        return ()
    return (
        f"Draft effort fitted one law of {len(candidates)}, {fitted[0].name}, and compared it with "
        "none; use standard effort to have the law chosen by the data.",
    )
