"""A rig that is open, and the person at it: one value for everything that is done there."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from scissorcal.aliases import Say
from scissorcal.device.link import Link
from scissorcal.device.loading import Confirm, is_simulator
from scissorcal.device.recorder import Recorder
from scissorcal.kernel import Identity
from scissorcal.recipe.schema import Recipe
from scissorcal.recording.header import UntilMark
from scissorcal.recording.probe import UNKNOWN_REST, ProbeResult, RestFacts


class ShowProgress(Protocol):
    """Called with the share done (0 to 1) and a sentence; by a capture with its recorder, too."""

    def __call__(self, done: float, sentence: str, recorder: Recorder | None = None, /) -> None: ...


def _no_progress(done: float, sentence: str, recorder: Recorder | None = None) -> None:
    pass


def _not_shown(shown: object) -> None:
    pass


@dataclass(frozen=True)
class Operator:
    """The person at the rig: asked by ``confirm``, told by ``say``, shown ``progress``.

    ``approach`` is called after each update of the fit of a capture until the tolerance.
    By default nobody is there. Without ``confirm`` work that needs a person raises InputError
    before anything moves; a simulator loads and clears material by itself.
    """

    confirm: Confirm | None = None
    say: Say = _not_shown
    progress: ShowProgress = _no_progress
    approach: Callable[[UntilMark], None] = _not_shown


@dataclass(frozen=True, eq=False)
class RigSession:
    """An open rig, with what everything done at it needs to know.

    ``recipe_toml`` is the text of ``recipe``, unchanged, which recordings keep; ``probe`` what a
    probe of this rig found; ``cleared`` says that a person has cleared the blades for the motion
    that comes next.

    >>> import numpy as np
    >>> from scissorcal.device.lockstep import LockstepLink
    >>> from scissorcal.recipe.load import builtin_recipe
    >>> with LockstepLink("office-paper", np.random.default_rng(1)) as link:
    ...     RigSession(link, builtin_recipe("paper-80gsm")).name
    'scissorcal-sim office-paper'
    """

    link: Link
    recipe: Recipe
    operator: Operator = Operator()
    probe: ProbeResult | None = None
    cleared: bool = False
    recipe_toml: str = ""

    @property
    def identity(self) -> Identity:
        """What the device states of itself."""
        return self.link.identity

    @property
    def name(self) -> str:
        """Name and serial number, as people know the rig."""
        return f"{self.identity.name} {self.identity.serial}"

    @property
    def rest(self) -> RestFacts:
        """What the probe found of blades at rest."""
        return self.probe.rest if self.probe else UNKNOWN_REST

    @property
    def simulated(self) -> bool:
        """Whether the rig is virtual."""
        return is_simulator(self.identity)
