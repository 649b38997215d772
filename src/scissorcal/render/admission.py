"""Decide before any force whether a rig can render a package stably, and what is taken back if not.

What the package asks for (`derating.needs_of`) is compared with what rig and loop allow
(`admission_rule`). Where it is too much the elastic response is softened, at most to
LEAST_FACTOR; the fracture energy never changes. Rendered friction gets a width near rest that
suits the encoder and the delay. What cannot be rendered even so is refused, with what would help.
"""

import json
import math
from dataclasses import dataclass, replace

from scissorcal.errors import InputError
from scissorcal.kernel import Identity, ModelTables, PassivityConfig
from scissorcal.package import ModelPackage
from scissorcal.render.admission_rule import (
    MARGIN,
    OSCILLATION_RATE,
    LoopFacts,
    allowed_stiffness,
    delayed_stiffness,
    dissipation,
)
from scissorcal.render.derating import Needs, felt_change, needs_of, softened

LATE_TICKS = 2.0
"""Where no probe measured the delay: one tick for line and host, one for the motor."""
LEAST_FACTOR = 0.05
"""A response twenty times as soft as the material's is another material: refused."""
COUNTS_NEAR_REST = 4
"""Rendered friction builds up over at least so many counts: one count moves it by a quarter."""
FAST_INERTIA_kg_m2 = 5e-5
"""Where neither fit nor probe has the inertia: of small scissors, which damping disturbs first."""
ENERGY_RATE = 0.75
"""The passivity controller waits for the energy that the rig has at this share of the
oscillation's rate."""
QUANTILE_SDS = 1.645


@dataclass(frozen=True)
class Admission:
    """What a rendering was allowed, N m/rad and shares.

    ``allowed_alone`` and ``allowed_in_hand`` are the rule's stiffness without and with the hand's
    damping ``hand_damping_Nm_s_per_rad``; ``needed`` the package's largest over the scene, at
    ``needed_at`` (opening rad, contact m), ``rendered`` what is left of it. ``factor`` is by how much the elastic slope was
    multiplied (1: not derated), ``felt_share`` the relative rms change of mean torque that this
    costs. ``friction_width_rad`` is over which opening rendered friction builds up. ``facts`` are
    the rig's, None where its friction is not known: then nothing was checked. ``sources`` say where
    each comes from, ``reasons`` what was done and why, ``cures`` what would make it unnecessary.
    """

    facts: LoopFacts | None
    hand_damping_Nm_s_per_rad: float
    allowed_alone: float
    allowed_in_hand: float
    needed: float
    needed_at: tuple[float, float]
    rendered: float
    drop_Nm: float
    factor: float
    felt_share: float
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
        return self.factor < 1.0


@dataclass(frozen=True)
class RigFacts:
    """What is known of the rig itself, None where nobody measured it; see LoopFacts.

    ``source`` says where friction and inertia come from, ``late_source`` the delay.
    """

    coulomb_Nm: float | None = None
    damping_Nm_s_per_rad: float | None = None
    inertia_kg_m2: float | None = None
    late_s: float | None = None
    source: str = ""
    late_source: str = ""


def admit(
    tables: ModelTables, facts: LoopFacts | None, hand: float, limit: float, rate: float
) -> Admission:
    """Decide what of ``tables`` is rendered; `rendered_tables` gives the tables that follow.

    ``hand`` is the damping of a hand (N m s/rad), ``limit`` the torque limit (N m), ``rate`` the
    scene's largest rate (rad/s). Raises InputError where even the softest response is too stiff.
    """
    needs = needs_of(tables, limit)
    if facts is None:
        return _unchecked(needs, hand)
    rate = max(rate, OSCILLATION_RATE)
    alone, held = (allowed_stiffness(facts, damping, rate) for damping in (0.0, hand))
    width = _friction_width(needs, facts, held)
    factor, left = _soften(tables, needs.stiffness, held, limit)
    cures = _cures(facts, hand, rate, needs)
    if factor < LEAST_FACTOR:
        raise InputError(
            f"This rig cannot render the package stably: {needs.stiffness:.3g} N m/rad are needed "
            f"and {held:.2g} N m/rad allowed in a hand, which would leave less than "
            f"{LEAST_FACTOR:.0%} of the elastic slope. {' '.join(cures)}"
        )
    felt = felt_change(tables, softened(tables, factor)) if factor < 1.0 else 0.0
    reasons = _reasons(needs, facts, alone, held, factor, felt)
    return Admission(
        facts=facts,
        hand_damping_Nm_s_per_rad=hand,
        allowed_alone=alone,
        allowed_in_hand=held,
        needed=needs.stiffness,
        needed_at=(needs.opening, needs.contact),
        rendered=left,
        drop_Nm=needs.drop_Nm,
        factor=factor,
        felt_share=felt,
        friction_width_rad=width,
        sources=(),
        reasons=reasons,
        cures=cures if factor < 1.0 else (),
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
    found = admit(package.tables, facts, hand, limit, rate)
    return replace(found, sources=sources)


def rendered_tables(tables: ModelTables, admission: Admission) -> ModelTables:
    """What the loop renders of ``tables`` under an admission."""
    return softened(tables, admission.factor) if admission.derated else tables


def passivity_config(admission: Admission, cutoff_Hz: float) -> PassivityConfig:
    """How the servo watches the energy of an admitted rendering.

    The controller's damping acts on a rate that is late by the loop's delay and by the estimator's
    1 / (2 pi f): its largest value keeps the phase of that damper below a quarter of a turn at
    twice its crossing, MARGIN I / delay.
    """
    facts = admission.facts
    if facts is None:
        return PassivityConfig(is_measured=True)
    late = facts.delay_s + 1.0 / (2.0 * math.pi * cutoff_Hz)
    return PassivityConfig(
        is_measured=True,
        rig_damping=facts.damping_Nm_s_per_rad,
        rig_coulomb=facts.coulomb_Nm,
        margin_J=0.5 * facts.inertia_kg_m2 * (ENERGY_RATE * OSCILLATION_RATE) ** 2,
        most_damping=MARGIN * facts.inertia_kg_m2 / late,
        friction_width=admission.friction_width_rad,
    )


def rig_facts(package: ModelPackage) -> RigFacts:
    """Friction and inertia of the rig, from the friction fit in a package.

    Levels are the lower ends of the 90 % intervals, of the weaker direction and the opening where
    friction is least.
    """
    record = package.manifest.provenance.friction
    if record is None:
        return RigFacts()
    lower = {parameter.name: parameter.q05 for parameter in record.parameters}
    middle = {parameter.name: parameter.value for parameter in record.parameters}
    least = float(package.tables.friction_angle.y.min())
    return RigFacts(
        coulomb_Nm=least * _weakest(lower, "coulomb"),
        damping_Nm_s_per_rad=least * _weakest(lower, "viscous"),
        inertia_kg_m2=middle.get("inertia"),
        source="the package's friction fit",
    )


def loop_facts(identity: Identity, rig: RigFacts) -> tuple[LoopFacts | None, tuple[str, ...]]:
    """Join what the device states and what is known of the rig; None without its friction."""
    if rig.coulomb_Nm is None:
        return None, ()
    tick_s = identity.tick_us * 1e-6
    late_s = LATE_TICKS * tick_s if rig.late_s is None else rig.late_s
    inertia = rig.inertia_kg_m2 or FAST_INERTIA_kg_m2
    late = rig.late_source or f"assumed, {LATE_TICKS:g} ticks: no probe measured it"
    known = rig.source if rig.inertia_kg_m2 else "assumed, of small scissors"
    sources = (
        f"friction: {rig.coulomb_Nm * 1e3:.3g} mN m dry and "
        f"{(rig.damping_Nm_s_per_rad or 0.0) * 1e3:.3g} mN m s/rad viscous ({rig.source})",
        f"delay: {late_s * 1e3:.3g} ms ({late})",
        f"inertia: {inertia:.2g} kg m^2 ({known})",
        f"encoder step: {identity.opening_resolution:.2g} rad (device)",
    )
    return LoopFacts(
        tick_s=tick_s,
        late_s=late_s,
        inertia_kg_m2=inertia,
        damping_Nm_s_per_rad=rig.damping_Nm_s_per_rad or 0.0,
        coulomb_Nm=rig.coulomb_Nm,
        encoder_step_rad=identity.opening_resolution,
    ), sources


def _hand_damping(package: ModelPackage) -> float:
    """The hand's damping of the opening, as the recipe in the package states it, N m s/rad."""
    rig = json.loads(package.manifest.provenance.recipe)["rig"]
    mechanics = package.manifest.mechanics
    damping = float(rig.get("hand_damping_N_s_per_m", 0.0))
    return damping * mechanics.handle_radius_m**2 / mechanics.moving_blades


def _weakest(levels: dict[str, float], term: str) -> float:
    found = [value for name, value in levels.items() if name.startswith(term)]
    return max(0.0, min(found, default=0.0))


def _unchecked(needs: Needs, hand: float) -> Admission:
    return Admission(
        facts=None,
        hand_damping_Nm_s_per_rad=hand,
        allowed_alone=math.nan,
        allowed_in_hand=math.nan,
        needed=needs.stiffness,
        needed_at=(needs.opening, needs.contact),
        rendered=needs.stiffness,
        drop_Nm=needs.drop_Nm,
        factor=1.0,
        felt_share=0.0,
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
    tables: ModelTables, needed: float, allowed: float, limit: float
) -> tuple[float, float]:
    """By how much to soften, and the stiffness that is left.

    Levers change with depth, so that the slope does not fall by the factor alone.
    """
    factor = 1.0
    while needed > allowed and factor >= LEAST_FACTOR:
        factor *= max(0.999 * allowed / needed, 0.5)
        needed = needs_of(softened(tables, factor), limit).stiffness
    return factor, needed


def _reasons(
    needs: Needs, facts: LoopFacts, alone: float, held: float, factor: float, felt: float
) -> tuple[str, ...]:
    place = f"{math.degrees(needs.opening):.0f} deg, contact {needs.contact * 1e3:.0f} mm"
    found = (
        f"The package needs up to {needs.stiffness:.3g} N m/rad (at {place}); this rig renders "
        f"{alone:.2g} N m/rad stably alone and {held:.2g} N m/rad in a hand, at "
        f"{facts.delay_s * 1e3:.2g} ms of delay."
    )
    if factor == 1.0:
        return (found,)
    return (
        found,
        f"The elastic slope is rendered at {factor:.0%} of the material's, which changes the mean "
        f"torque of a stroke by {felt:.1%}; the fracture energy is unchanged.",
    )


def _cures(facts: LoopFacts, hand: float, rate: float, needs: Needs) -> tuple[str, ...]:
    """What would make the package pass: delay, damping, encoder; each alone, where it can."""
    wanted = needs.stiffness
    cures = []
    cap = 2.0 * facts.coulomb_Nm / facts.encoder_step_rad
    if cap < wanted and facts.coulomb_Nm > 0.0:
        step = 2.0 * facts.coulomb_Nm / wanted
        cures.append(f"An encoder step of {step:.1g} rad (now {facts.encoder_step_rad:.1g}).")
    if delayed_stiffness(facts, hand, rate) < wanted:
        taken = dissipation(facts, hand, rate)
        delay = MARGIN * taken / wanted
        more = wanted * facts.delay_s / MARGIN - taken
        cures.append(
            f"A delay of {delay * 1e3:.2g} ms, half a tick included (now "
            f"{facts.delay_s * 1e3:.2g} ms)."
        )
        cures.append(f"{more * 1e3:.2g} mN m s/rad more damping, of the rig or of the hand.")
    return tuple(cures)
