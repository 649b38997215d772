"""A rig that is open, and the person at it: one value for everything that is done there."""

import re
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol, get_type_hints

from scissorcal.aliases import Say
from scissorcal.device.link import Link
from scissorcal.device.loading import Confirm, is_simulator
from scissorcal.device.recorder import Recorder
from scissorcal.errors import InputError
from scissorcal.kernel import Identity
from scissorcal.recipe.schema import Recipe
from scissorcal.recording.probe import PROBE_KEY, UNKNOWN_REST, ProbeResult, RestFacts
from scissorcal.recording.until import UntilMark


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
    >>> from scissorcal.recipe.library import builtin_recipe
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


def rig_facts(identity: Identity, motor_sign: int, probe: ProbeResult | None) -> dict[str, Any]:
    """What a recording holds of its rig: the identity, a motor sign of -1, and the probe.

    Torques in the recording are of the corrected sign.
    """
    facts = identity_facts(identity)
    if motor_sign != 1:
        facts["motor_sign"] = motor_sign
    if probe is not None:
        facts[PROBE_KEY] = probe.as_dict()
    return facts


def identity_facts(identity: Identity) -> dict[str, Any]:
    """The identity as plain numbers and strings, for a recording; the hash in hexadecimal."""
    facts = identity._asdict()
    del facts["nonce_echo"]
    return {**facts, "schema_hash": f"{identity.schema_hash:016x}"}


def identity_of(facts: Mapping[str, Any], source: str) -> Identity:
    """The identity that the facts of the recording ``source`` state, as `identity_facts` wrote it.

    Raises InputError, which names ``source`` and the field, where one is missing or no number.
    """
    known = {**facts, "nonce_echo": 0, "schema_hash": _hash(facts.get("schema_hash"))}
    for name, kind in get_type_hints(Identity).items():
        if not _is(known.get(name), kind):
            raise InputError(
                f"{source or 'The recording'} is damaged: what it holds of its rig has no {name} "
                "that is a number or text as a rig states it. Capture again, or restore it from a "
                "backup."
            )
    return Identity(**{name: known[name] for name in Identity._fields})


def _is(value: Any, kind: type) -> bool:
    """Whether a value is one that the wire bears; JSON's integers may be of any length."""
    if kind is float:
        return type(value) in (int, float) and abs(value) <= sys.float_info.max
    if kind is int:
        return type(value) is int and 0 <= value < 1 << 64
    return type(value) is kind


def _hash(value: Any) -> int | None:
    """A hash of 64 bits as `identity_facts` writes it; None for any other text or value."""
    written = isinstance(value, str) and re.fullmatch("[0-9a-f]{16}", value)
    return int(value, 16) if written else None
