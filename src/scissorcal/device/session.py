"""A rig that is open, and the person at it: one value for everything that is done there."""

import math
import re
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Protocol, get_type_hints

from scissorcal.aliases import Say
from scissorcal.device.link import Link
from scissorcal.device.motion import Motion
from scissorcal.device.recorder import Recorder
from scissorcal.errors import DeviceError, InputError
from scissorcal.kernel import Capability, ConfigKey, Identity
from scissorcal.recipe.schema import Recipe
from scissorcal.recording.probe import PROBE_KEY, UNKNOWN_REST, Estimate, ProbeResult, RestFacts
from scissorcal.recording.until import UntilMark

Confirm = Callable[[str], None]
"""Shows a request to a person and returns once it is done; raises to cancel."""


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


def refuse_nobody(identity: Identity, confirm: Confirm | None, why: str) -> None:
    """Raise InputError, which begins with ``why``, where a real rig needs a person and has none."""
    if confirm is None and not is_simulator(identity):
        raise InputError(
            f"{why}: pass a confirm callback that shows a sentence and returns when that is done."
        )


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


def is_simulator(identity: Identity) -> bool:
    """Whether the rig is virtual, and so loads and clears material by itself."""
    return bool(identity.capabilities & Capability.SIMULATOR)


class Loader:
    """Has the blades cleared, or a fresh sheet loaded.

    On a simulator it sets MATERIAL. Elsewhere it switches the motors off and calls ``confirm``
    with the request; InputError, before anything moves, if there is no ``confirm``.
    """

    def __init__(self, motion: Motion, recorder: Recorder, confirm: Confirm | None) -> None:
        self._motion = motion
        self._recorder = recorder
        self._confirm = confirm
        self.simulated = is_simulator(motion.identity)
        why = "This capture must ask a person to clear the blades and load material"
        refuse_nobody(motion.identity, confirm, why)

    def clear(self, request: str) -> None:
        """Have everything taken out from between the blades."""
        if self.simulated:
            self._motion.configure(ConfigKey.HAND_SPEED_rad_per_s, 0.0)
            self._motion.configure(ConfigKey.MATERIAL, 0.0)
        else:
            self._ask(request)

    def retract(self) -> None:
        """Before the carriage returns: a simulator's used sheet is taken out, a real one stays."""
        if self.simulated:
            self._motion.configure(ConfigKey.MATERIAL, 0.0)

    def load(self, request: str) -> None:
        """Have a fresh sheet put in, its near edge where advance + contact = 0."""
        if self.simulated:
            self._motion.configure(ConfigKey.MATERIAL, 1.0)
        else:
            self._ask(request)

    def _ask(self, request: str) -> None:
        assert self._confirm is not None
        with self._motion.paused():
            self._confirm(request)
        self._recorder.resume(request)


MOST_ENERGY_J = 0.5
"""Of a blow on a hand or its fingers: ISO/TS 15066:2016 allows 140 N there, twice that for a brief
contact, and has 75 N/mm for their stiffness, which is F^2 / (2 k) = 0.52 J."""


def refuse_unanswered(recipe: Recipe, identity: Identity, inertia: Estimate | None) -> str:
    """Refuse a rig whose blades a last command may throw, before a motor runs.

    Until the device brakes, after ``rig.line.brake_after_ms`` = t, the largest torque T of commands
    brings free blades of inertia I to T t / I, and to no more energy than T times their travel. At
    the rate that is stated they hold MOST_ENERGY_J: sqrt(2 E / I), 69 rad/s for 2.1e-4 kg m^2.

    Raises DeviceError where even the upper end of the inertia's interval is too fast. Returns a
    sentence where only its lower end is, or where no inertia is known; else an empty one.
    """
    torque = min(recipe.limits.torque_Nm, identity.torque_limit)
    brake_s = 1e-3 * recipe.rig.line.brake_after_ms
    if torque * (identity.opening_max - identity.opening_min) <= MOST_ENERGY_J:
        return ""
    # blades of T^2 t^2 / (2 E) or more hold no more than E then
    enough = (torque * brake_s) ** 2 / (2.0 * MOST_ENERGY_J)
    if inertia is None:
        return (
            f"It is not known how fast the blades get within rig.line.brake_after_ms = "
            f"{1e3 * brake_s:g} without a new command: the probe found no inertia. Blades of less "
            f"than {1e6 * enough:.3g} kg mm^2 would be too fast."
        )
    low, high = inertia.interval
    if low >= enough:
        return ""
    most_torque = math.sqrt(2.0 * MOST_ENERGY_J * max(low, 0.0)) / brake_s
    most_ms = 1e3 * math.sqrt(2.0 * MOST_ENERGY_J * max(low, 0.0)) / torque
    cure = (
        f"Set limits.torque_Nm to {_down(most_torque)} or less, or rig.line.brake_after_ms to "
        f"{_down(most_ms)} or less."
    )
    if high < enough:
        rate, most = torque * brake_s / inertia.mean, math.sqrt(2.0 * MOST_ENERGY_J / inertia.mean)
        raise DeviceError(
            f"Without a new command the blades ({1e6 * inertia.mean:.3g} kg mm^2) would reach "
            f"{rate:.0f} rad/s before the device brakes: limits.torque_Nm = {torque:g} acts for "
            f"rig.line.brake_after_ms = {1e3 * brake_s:g}. At more than {most:.0f} rad/s they hold "
            f"{MOST_ENERGY_J:g} J, which may hurt a hand. {cure}"
        )
    return (
        "It is not known well enough how fast the blades get within rig.line.brake_after_ms = "
        f"{1e3 * brake_s:g} without a new command: their inertia is {1e6 * max(low, 0.0):.3g} to "
        f"{1e6 * high:.3g} kg mm^2, and {1e6 * enough:.3g} would do. Run 'scissorcal device probe' "
        f"again, or be on the safe side: {cure[0].lower()}{cure[1:]}"
    )


def _down(value: float) -> str:
    """Two digits, rounded down, so that the stated value is one that is taken."""
    if value <= 0.0:
        return "0"
    step = 10.0 ** (math.floor(math.log10(value)) - 1)
    return f"{math.floor(value / step * (1.0 + 1e-9)) * step:.6g}"
