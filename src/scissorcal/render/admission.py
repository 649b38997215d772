"""Decide before any force whether a rig can render a package stably, and what is taken back if not.

What the package asks for (`derating.needs_on`) is compared with what rig and loop allow
(`admission_rule`). Where it is too much the elastic response is softened, at most to
LEAST_FACTOR; the fracture energy never changes. Rendered friction gets a width near rest that
suits the encoder and the delay. What cannot be rendered even so is refused, with what would help.
What all of it changes of the felt torque is stated beside the tolerance of the scene.
"""

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
    damping_share,
    friction_width,
)
from scissorcal.render.derating import LEAST_FACTOR, Needs, derate, limited, needs_on
from scissorcal.render.felt_cost import FeltTorque, felt_rates
from scissorcal.render.felt_cures import Asked, felt_cures, stated_cures
from scissorcal.render.rig_facts import RigFacts, loop_facts, rig_facts

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
    is to what the response was limited (None: not derated). ``damping_share`` is the share of the
    material's rate damping that is rendered, ``friction_width_rad`` over which opening rendered
    friction builds up. ``felt_share`` is the relative rms change of the felt torque that all of
    this costs (`felt_cost.FeltTorque`) in what is cut: strokes through the uniform sheet, or those
    through the drawn plate (``is_drawn``); ``felt_sheet_share`` is that of the uniform sheet in any
    case. ``tolerance`` is the scene's, as a share. ``facts`` are the rig's, None where its friction
    is not known: then nothing was checked. ``sources`` say where each comes from, ``reasons`` what
    was done and why, ``cures`` what would make it unnecessary, ``felt_cures`` what would bring the
    felt torque within the tolerance where it is beyond, each by itself.
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
    tolerance: float
    sources: tuple[str, ...]
    reasons: tuple[str, ...]
    cures: tuple[str, ...]
    felt_cures: tuple[str, ...]

    @property
    def evaluated(self) -> bool:
        """Whether the rig was known well enough to check anything."""
        return self.facts is not None

    @property
    def derated(self) -> bool:
        """Whether the package is rendered softer than it is."""
        return self.steepest_N_per_m is not None or self.damping_share < 1.0

    @property
    def is_felt(self) -> bool:
        """Whether the felt torque differs from the package's by more than the tolerance."""
        return self.felt_share > self.tolerance

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
        return (
            f"stiffness {self.rendered:.3g} of the package's {self.needed:.3g} N m/rad (stable "
            f"alone {self.allowed_alone:.2g}, in a hand {self.allowed_in_hand:.2g}); felt torque "
            f"of the {what} changed by {self.felt_share:.1%} (rms, tolerance "
            f"{self.tolerance * 100:.3g} %)"
        )


def admit(
    tables: ModelTables, facts: LoopFacts | None, asked: Asked, pieces: Sequence[Piece] = ()
) -> Admission:
    """Decide what of ``tables`` is rendered; `rendered_tables` gives the tables that follow.

    ``asked`` is what the scene asks for, ``pieces`` a drawn plate. Raises InputError where even the
    softest response is too stiff.
    """
    needs = needs_on(tables, asked.limit_Nm, pieces)
    unchecked = _unchecked(needs, asked, bool(pieces))
    if facts is None:
        return unchecked
    rate, hand = max(asked.fastest, OSCILLATION_RATE), asked.hand_damping
    alone, held = (allowed_stiffness(facts, damping, rate) for damping in (0.0, hand))
    cures = stated_cures(facts, hand, rate, needs.stiffness)
    if not held > 0.0:
        raise InputError(_nothing_allowed(facts, cures))
    derated = derate(tables, needs.stiffness, held, asked.limit_Nm, pieces)
    if derated.is_refused(needs.stiffness, held):
        raise InputError(_too_stiff(needs, held, cures))
    steepest = derated.steepest_N_per_m
    damping = damping_share(needs.damper, facts)
    width = friction_width(needs.friction_Nm, facts, held)
    rates = felt_rates(tables, asked.slowest, asked.fastest)
    felt, rendered = [], limited(tables, steepest, damping)
    for plate in (pieces, ()) if pieces else ((),):
        torque = FeltTorque(tables, asked.limit_Nm, rates, plate)
        felt.append(torque.change(rendered, width))
    beyond = felt[0] > asked.tolerance
    return replace(
        unchecked,
        facts=facts,
        allowed_alone=alone,
        allowed_in_hand=held,
        rendered=derated.stiffness,
        steepest_N_per_m=steepest,
        felt_share=felt[0],
        felt_sheet_share=felt[-1],
        damping_share=damping,
        friction_width_rad=width,
        reasons=(
            *_need_sentences(needs, facts, (alone, held), is_drawn=bool(pieces)),
            *_cost_sentences(needs, derated.stiffness, felt, is_drawn=bool(pieces)),
            *_damping_sentences(needs, damping),
        ),
        cures=() if steepest is None else cures,
        felt_cures=felt_cures(tables, facts, asked, needs, pieces) if beyond else (),
    )


def admit_package(
    package: ModelPackage, identity: Identity, rig: RigFacts | None, limit: float
) -> Admission:
    """Decide for a package on a device, with what is known of the rig (`rig_facts` where None).

    Raises as `admit` does.
    """
    rig = rig or rig_facts(package)
    facts, sources = loop_facts(identity, rig)
    found = admit(package.tables, facts, _asked(package, limit), package.pieces)
    return replace(found, sources=sources)


def rendered_tables(tables: ModelTables, admission: Admission) -> ModelTables:
    """What the loop renders of ``tables`` under an admission."""
    return limited(tables, admission.steepest_N_per_m, admission.damping_share)


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


def _asked(package: ModelPackage, limit: float) -> Asked:
    """What the scene asks for, as the recipe in the package states it."""
    recipe, rates = package.recipe, package.manifest.ranges.opening_rate_rad_per_s
    return Asked(
        limit_Nm=limit,
        slowest=rates[0],
        fastest=rates[1],
        tolerance=0.01 * recipe.scene.tolerance_percent,
        hand_damping=recipe.rig.hand_damping_Nm_s_per_rad,
    )


def _unchecked(needs: Needs, asked: Asked, is_drawn: bool) -> Admission:
    """What holds of a rig of which nothing is known; `admit` adds what it checks."""
    return Admission(
        facts=None,
        hand_damping_Nm_s_per_rad=asked.hand_damping,
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
        tolerance=asked.tolerance,
        sources=(),
        reasons=(
            "Whether this rig renders the package stably was not checked: its friction is not "
            "known.",
        ),
        cures=("Run 'scissorcal device probe', or fit friction.",),
        felt_cures=(),
    )


def _need_sentences(
    needs: Needs, facts: LoopFacts, allowed: tuple[float, float], *, is_drawn: bool
) -> tuple[str, ...]:
    """What the package needs, and what the rig renders alone and in a hand."""
    place = f"{math.degrees(needs.opening):.0f} deg, contact {needs.contact * 1e3:.0f} mm"
    known = f"at {place}"
    if is_drawn:
        known += f"; a bound over the scene's openings, {needs.found:.3g} are found in strokes"
    return (
        f"The package needs up to {needs.stiffness:.3g} N m/rad ({known}); this rig renders "
        f"{allowed[0]:.2g} N m/rad stably alone and {allowed[1]:.2g} N m/rad in a hand, at "
        f"{facts.delay_s * 1e3:.2g} ms of delay.",
    )


def _cost_sentences(
    needs: Needs, left: float, felt: Sequence[float], *, is_drawn: bool
) -> tuple[str, ...]:
    """What derating costs; nothing where all is rendered.

    ``felt`` are the changes of felt torque, of what is cut first and of the uniform sheet last.
    """
    if left == needs.stiffness:
        return ()
    begun = f"The steepest elastic slope is rendered at {left / needs.stiffness:.0%}, which changes"
    kept = "the fracture energy is unchanged."
    if not is_drawn:
        said = f"the felt torque of strokes through the uniform sheet by {felt[0]:.1%}"
        return (f"{begun} {said}; {kept}",)
    return (
        f"{begun} the felt torque of strokes through the drawn plate by {felt[0]:.1%}, of those "
        f"through a uniform sheet by {felt[-1]:.1%}: ends of pieces and of stretches of another "
        f"toughness are felt at smaller openings; {kept}",
    )


def _damping_sentences(needs: Needs, share: float) -> tuple[str, ...]:
    """How much of the material's damping is rendered; nothing where all is."""
    if share == 1.0:
        return ()
    return (
        f"The material's damping of up to {needs.damper * 1e3:.2g} mN m s/rad is rendered at "
        f"{share:.0%}, as the rate is known too late for more.",
    )


def _too_stiff(needs: Needs, held: float, cures: Sequence[str]) -> str:
    """The refusal of what even the softest response does not make stable."""
    return (
        f"This rig cannot render the package stably: {needs.stiffness:.3g} N m/rad are needed "
        f"and {held:.2g} N m/rad allowed in a hand, which would leave less than "
        f"{LEAST_FACTOR:.0%} of the elastic slope. What would cure it: {' '.join(cures)}"
    )


def _nothing_allowed(facts: LoopFacts, cures: Sequence[str]) -> str:
    """The refusal where no dry friction is known for sure."""
    known = f"known to be at least {facts.coulomb_Nm * 1e3:.2g} mN m"
    again = "Capture friction again, for longer, so that its lower end is above 0. "
    return (
        f"This rig cannot render the package stably: its dry friction is {known}, and without any "
        "the blades find no rest between two counts of the encoder, however soft the material. "
        f"What would cure it: {again}{' '.join(cures)}"
    ).rstrip()
