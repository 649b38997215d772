"""Decide before any force whether a rig can render a package stably, and what is taken back if not.

What the package asks for (`derating.needs_on`) is compared with what rig and loop allow
(`admission_rule`). Where it is too much the elastic response is softened, at most to
LEAST_FACTOR; the fracture energy never changes. Rendered friction gets a width near rest that
suits the encoder and the delay. What cannot be rendered even so is refused, with what would help.
"""

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from scissorcal.errors import InputError
from scissorcal.kernel import Capability, Identity, ModelTables, PassivityConfig, Piece
from scissorcal.package import ModelPackage
from scissorcal.render.admission_rule import (
    OSCILLATION_RATE,
    LoopFacts,
    allowed_damper,
    allowed_stiffness,
)
from scissorcal.render.cures import stated_cures
from scissorcal.render.derating import Needs, needs_on, softened, stiffness_on
from scissorcal.render.felt_cost import felt_change
from scissorcal.render.rig_facts import RigFacts, loop_facts, rig_facts

LEAST_FACTOR = 0.05
"""A response twenty times as soft as the material's is another material: refused."""
COUNTS_NEAR_REST = 4
"""Rendered friction builds up over at least so many counts: one count moves it by a quarter."""
ENERGY_RATE = 0.75
"""The passivity controller waits for the energy that the rig has at this share of the
oscillation's rate."""


@dataclass(frozen=True)
class Admission:
    """What a rendering was allowed, N m/rad and shares.

    ``allowed_alone`` and ``allowed_in_hand`` are the rule's stiffness without and with the hand's
    damping ``hand_damping_Nm_s_per_rad``; ``needed`` the package's largest over the scene, at
    about ``needed_at`` (opening rad, contact m), ``rendered`` what is left of it. Of a drawn plate
    both are proved bounds, and ``needed_found`` is the largest slope that its strokes show; of the
    uniform sheet it is ``needed``. ``steepest_N_per_m``
    is to what the response was limited (None: not derated), ``felt_share`` the relative rms change
    of mean torque that this costs (`felt_cost.felt_change`) in what is cut: a stroke through the
    uniform sheet, or those through the drawn plate (``is_drawn``); ``felt_sheet_share`` is that of
    the uniform sheet in any case. ``damping_share`` is the share of the material's rate damping
    that is rendered. ``friction_width_rad`` is over which opening rendered friction
    builds up. ``facts`` are the rig's, None where its friction is not known: then nothing was
    checked. ``sources`` say where each comes from, ``reasons`` what was done and why, ``cures``
    what would make it unnecessary, each by itself.
    """

    facts: LoopFacts | None
    hand_damping_Nm_s_per_rad: float
    allowed_alone: float
    allowed_in_hand: float
    needed: float
    needed_found: float
    needed_at: tuple[float, float]
    rendered: float
    drop_Nm: float
    steepest_N_per_m: float | None
    felt_share: float
    felt_sheet_share: float
    is_drawn: bool
    damping_share: float
    friction_width_rad: float
    sources: tuple[str, ...]
    reasons: tuple[str, ...]
    cures: tuple[str, ...]

    @property
    def evaluated(self) -> bool:
        """Whether the rig was known well enough to check anything."""
        return self.facts is not None

    @property
    def derated(self) -> bool:
        """Whether the package is rendered softer than it is."""
        return self.steepest_N_per_m is not None or self.damping_share < 1.0

    @property
    def factor(self) -> float:
        """Rendered over needed stiffness."""
        return self.rendered / self.needed if self.needed > 0.0 else 1.0

    @property
    def summary(self) -> str:
        """What is rendered of the package's stiffness, in a line."""
        if not self.evaluated:
            return f"stiffness {self.rendered:.3g} N m/rad, not checked against this rig"
        what = "drawn plate" if self.is_drawn else "uniform sheet"
        changed = f", which changes the {what}'s torque by {self.felt_share:.1%} (rms)"
        cost = changed if self.derated else ""
        return (
            f"stiffness {self.rendered:.3g} of the package's {self.needed:.3g} N m/rad{cost} "
            f"(stable alone {self.allowed_alone:.2g}, in a hand {self.allowed_in_hand:.2g})"
        )


def admit(
    tables: ModelTables,
    facts: LoopFacts | None,
    hand: float,
    limit: float,
    rate: float,
    pieces: Sequence[Piece] = (),
) -> Admission:
    """Decide what of ``tables`` is rendered; `rendered_tables` gives the tables that follow.

    ``hand`` is the damping of a hand (N m s/rad), ``limit`` the torque limit (N m), ``rate`` the
    scene's largest rate (rad/s), ``pieces`` a drawn plate. Raises InputError where even the
    softest response is too stiff.
    """
    needs = needs_on(tables, limit, pieces)
    if facts is None:
        return _unchecked(needs, hand, is_drawn=bool(pieces))
    rate = max(rate, OSCILLATION_RATE)
    alone, held = (allowed_stiffness(facts, damping, rate) for damping in (0.0, hand))
    cures = stated_cures(facts, hand, rate, needs.stiffness)
    if not held > 0.0:
        raise InputError(_nothing_allowed(facts, cures))
    steepest, left = _soften(tables, needs.stiffness, held, limit, pieces)
    if left > held or left < LEAST_FACTOR * needs.stiffness:
        raise InputError(
            f"This rig cannot render the package stably: {needs.stiffness:.3g} N m/rad are needed "
            f"and {held:.2g} N m/rad allowed in a hand, which would leave less than "
            f"{LEAST_FACTOR:.0%} of the elastic slope. What would cure it: {' '.join(cures)}"
        )
    felt = _felt(tables, steepest, limit, pieces)
    damping = min(1.0, allowed_damper(facts) / needs.damper) if needs.damper > 0.0 else 1.0
    return Admission(
        facts=facts,
        hand_damping_Nm_s_per_rad=hand,
        allowed_alone=alone,
        allowed_in_hand=held,
        needed=needs.stiffness,
        needed_found=needs.found,
        needed_at=(needs.opening, needs.contact),
        rendered=left,
        drop_Nm=needs.drop_Nm,
        steepest_N_per_m=steepest,
        felt_share=felt[0],
        felt_sheet_share=felt[1],
        is_drawn=bool(pieces),
        damping_share=damping,
        friction_width_rad=_friction_width(needs, facts, held),
        sources=(),
        reasons=(
            *_reasons(needs, facts, (alone, held), is_drawn=bool(pieces)),
            *_cost(needs, left, felt, is_drawn=bool(pieces)),
            *_damped(needs, damping),
        ),
        cures=() if steepest is None else cures,
    )


def admit_package(
    package: ModelPackage, identity: Identity, rig: RigFacts | None, limit: float
) -> Admission:
    """Decide for a package on a device, with what is known of the rig (`rig_facts` where None).

    Raises as `admit` does.
    """
    rig = rig or rig_facts(package)
    facts, sources = loop_facts(identity, rig)
    rate = package.manifest.ranges.opening_rate_rad_per_s[1]
    hand = _hand_damping(package)
    found = admit(package.tables, facts, hand, limit, rate, package.pieces)
    return replace(found, sources=sources)


def rendered_tables(tables: ModelTables, admission: Admission) -> ModelTables:
    """What the loop renders of ``tables`` under an admission."""
    steepest = admission.steepest_N_per_m
    soft = tables if steepest is None else softened(tables, steepest)
    if admission.damping_share == 1.0:
        return soft
    return replace(soft, rate_damping=admission.damping_share * soft.rate_damping)


def passivity_config(admission: Admission, identity: Identity) -> PassivityConfig:
    """How the servo watches the energy of an admitted rendering on a device."""
    sensor = bool(identity.capabilities & Capability.HANDLE_FORCE_SENSOR)
    radius = identity.handle_radius if sensor else 0.0
    facts = admission.facts
    if facts is None:
        return PassivityConfig(is_measured=True, handle_radius=radius)
    return PassivityConfig(
        is_measured=True,
        handle_radius=radius,
        rig_damping=facts.damping_Nm_s_per_rad,
        rig_coulomb=facts.coulomb_Nm,
        margin_J=0.5 * facts.inertia_kg_m2 * (ENERGY_RATE * OSCILLATION_RATE) ** 2,
        most_damping=allowed_damper(facts),
        friction_width=admission.friction_width_rad,
    )


def _hand_damping(package: ModelPackage) -> float:
    """The hand's damping of the opening, as the recipe in the package states it, N m s/rad."""
    rig = json.loads(package.manifest.provenance.recipe)["rig"]
    mechanics = package.manifest.mechanics
    damping = float(rig.get("hand_damping_N_s_per_m", 0.0))
    return damping * mechanics.handle_radius_m**2 / mechanics.moving_blades


def _unchecked(needs: Needs, hand: float, *, is_drawn: bool) -> Admission:
    return Admission(
        facts=None,
        hand_damping_Nm_s_per_rad=hand,
        allowed_alone=math.nan,
        allowed_in_hand=math.nan,
        needed=needs.stiffness,
        needed_found=needs.found,
        needed_at=(needs.opening, needs.contact),
        rendered=needs.stiffness,
        drop_Nm=needs.drop_Nm,
        steepest_N_per_m=None,
        felt_share=0.0,
        felt_sheet_share=0.0,
        is_drawn=is_drawn,
        damping_share=1.0,
        friction_width_rad=0.0,
        sources=(),
        reasons=(
            "Whether this rig renders the package stably was not checked: its friction is not "
            "known.",
        ),
        cures=("Run 'scissorcal device probe', or fit friction.",),
    )


def _friction_width(needs: Needs, facts: LoopFacts, allowed: float) -> float:
    """Opening over which rendered friction builds up: some counts, and no stiffer than allowed."""
    if needs.friction_Nm == 0.0:
        return 0.0
    return max(COUNTS_NEAR_REST * facts.encoder_step_rad, needs.friction_Nm / allowed)


def _soften(
    tables: ModelTables, needed: float, allowed: float, limit: float, pieces: Sequence[Piece]
) -> tuple[float | None, float]:
    """The steepest response that is allowed (N/m, None for all) and the stiffness that is left.

    In steps, as levers change with the depth.
    """
    steepest, left = float(tables.response.slope.max()), needed
    if needed <= allowed:
        return None, needed
    while left > allowed and left > LEAST_FACTOR * needed:
        steepest *= max(0.999 * allowed / left, 0.5)
        left = stiffness_on(softened(tables, steepest), limit, pieces)
    return steepest, left


def _felt(
    tables: ModelTables, steepest: float | None, limit: float, pieces: Sequence[Piece]
) -> tuple[float, float]:
    """What a response costs that is limited to ``steepest``: of the plate, of the uniform sheet."""
    if steepest is None:
        return 0.0, 0.0
    soft = softened(tables, steepest)
    sheet = felt_change(tables, soft, limit)
    return (felt_change(tables, soft, limit, pieces) if pieces else sheet), sheet


def _reasons(
    needs: Needs, facts: LoopFacts, allowed: tuple[float, float], *, is_drawn: bool
) -> tuple[str, ...]:
    place = f"{math.degrees(needs.opening):.0f} deg, contact {needs.contact * 1e3:.0f} mm"
    known = f"at {place}"
    if is_drawn:
        known += f"; a bound over the scene's openings, {needs.found:.3g} are found in strokes"
    return (
        f"The package needs up to {needs.stiffness:.3g} N m/rad ({known}); this rig renders "
        f"{allowed[0]:.2g} N m/rad stably alone and {allowed[1]:.2g} N m/rad in a hand, at "
        f"{facts.delay_s * 1e3:.2g} ms of delay.",
    )


def _cost(
    needs: Needs, left: float, felt: tuple[float, float], *, is_drawn: bool
) -> tuple[str, ...]:
    """What derating costs; nothing where all is rendered."""
    if left == needs.stiffness:
        return ()
    begun = f"The steepest elastic slope is rendered at {left / needs.stiffness:.0%}, which changes"
    kept = "the fracture energy is unchanged."
    if not is_drawn:
        said = f"the mean torque of a stroke through the uniform sheet by {felt[0]:.1%}"
        return (f"{begun} {said}; {kept}",)
    return (
        f"{begun} the mean torque of strokes through the drawn plate by {felt[0]:.1%}, of one "
        f"through a uniform sheet by {felt[1]:.1%}: ends of pieces and of stretches of another "
        f"toughness are felt at smaller openings; {kept}",
    )


def _damped(needs: Needs, share: float) -> tuple[str, ...]:
    if share == 1.0:
        return ()
    return (
        f"The material's damping of up to {needs.damper * 1e3:.2g} mN m s/rad is rendered at "
        f"{share:.0%}, as the rate is known too late for more.",
    )


def _nothing_allowed(facts: LoopFacts, cures: tuple[str, ...]) -> str:
    known = f"known to be at least {facts.coulomb_Nm * 1e3:.2g} mN m"
    again = "Capture friction again, for longer, so that its lower end is above 0. "
    return (
        f"This rig cannot render the package stably: its dry friction is {known}, and without any "
        "the blades find no rest between two counts of the encoder, however soft the material. "
        f"What would cure it: {again}{' '.join(cures)}"
    ).rstrip()
