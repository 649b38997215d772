"""The states that a step of the day may be in."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, Protocol

if TYPE_CHECKING:
    from pathlib import Path

    from scissorcal.recipe.schema import Recipe
    from scissorcal.workday.index import FileIndex
    from scissorcal.workday.workspace import Workspace

State = Literal[
    "missing", "damaged", "stale", "incomplete", "failed", "unverified", "done", "excluded"
]
"""What a step may be in, in the order in which it is decided.

missing: there is no result. damaged: its file cannot be read; its command makes it again. stale: it
was made from other inputs than there are now, or an input is missing, damaged or stale. incomplete:
a capture lacks what the recipe plans, a fit ran out of time, or a trust check counted no coverage.
failed: a check of it or of a fit below it failed, a recording cannot be read, or a person rejected
it. unverified: no complete trust check of this very fit is there. done: none of these. excluded:
the scene does not need it.
"""

WAITING: frozenset[State] = frozenset({"missing", "damaged", "stale"})
"""States of an input in which what builds on it is stale."""

CHANGED = {
    "verify": "of an earlier fit",
    "report": "it shows other fits, trust checks or settings than there are now",
    "package": "built from other fits or settings than there are now",
}
"""Why a result of this kind is stale, where its inputs are all there."""


@dataclass(frozen=True)
class StepState:
    """The state of one step, what was found, and the command that comes next for it.

    ``why`` says what the scene needs it for. ``command`` is empty where nothing is to be done.
    ``content`` is the digest of its result, empty where there is none.
    """

    name: str
    state: State
    found: str
    why: str = ""
    command: str = ""
    files: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()
    content: str = ""
    failed: tuple[str, ...] = ()
    optional: bool = False


class DayStates(Protocol):
    """The states of all steps of a day, as one step's state is worked out from those of others."""

    workspace: Workspace
    recipe: Recipe
    index: FileIndex

    def state(self, name: str) -> StepState: ...

    def shown(self, name: str) -> bool: ...

    def file(self, name: str) -> Path: ...

    def facts(self, name: str) -> dict[str, Any]: ...


def counted(number: int, thing: str) -> str:
    """A number of things in words.

    >>> counted(1, "photograph"), counted(2, "photograph")
    ('1 photograph', '2 photographs')
    """
    return f"{number} {thing}{'' if number == 1 else 's'}"
