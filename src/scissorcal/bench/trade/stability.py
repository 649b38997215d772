"""Whether a loop of another rate would render a case's model stably, by the admission rule."""

from dataclasses import dataclass, replace

import numpy as np

from scissorcal.bench.trade.case import Case
from scissorcal.device.session import identity_of
from scissorcal.kernel import ModelTables
from scissorcal.model import FrictionLaw
from scissorcal.model.friction import angle_factor
from scissorcal.package.exact import FitDraws
from scissorcal.recording.probe import probe_of
from scissorcal.render.admission_rule import OSCILLATION_RATE, LoopFacts, allowed_stiffness
from scissorcal.render.derating import needs_of
from scissorcal.render.rig_facts import fitted_facts, loop_facts, with_probe

OPENINGS = 201


@dataclass(frozen=True)
class Rig:
    """What of a case's rig decides about stability, at the rate of its recordings."""

    facts: LoopFacts
    encoder_step_rad: float


@dataclass(frozen=True)
class Margin:
    """Stiffness that the model needs over the stiffness that is allowed: stable up to 1.

    ``alone`` without a hand, ``in_hand`` with the damping that the recipe counts on.
    """

    alone: float
    in_hand: float


def known_rig(case: Case) -> Rig | None:
    """The rig as recordings and the friction fit know it; None where they do not.

    An imported recording states no encoder and no tick, and without a friction fit the rule has
    nothing that damps.
    """
    recordings = (*case.cut, *case.friction)
    known = next((one for one in recordings if "schema_hash" in one.device), None)
    if known is None or case.friction_fit is None:
        return None
    identity = identity_of(known.device, known.source)
    rig = fitted_facts(case.friction_fit.parameters, _least_factor(case), "the fit of friction")
    facts, _ = loop_facts(identity, with_probe(rig, probe_of(known.device)))
    return None if facts is None else Rig(facts, identity.opening_resolution)


def margin(case: Case, tables: ModelTables, rig: Rig, rate_Hz: float) -> Margin:
    """Needed over allowed stiffness at a loop rate, by `render.admission_rule`.

    The delay of line, host and motor is taken to shrink and grow with the tick: it was measured (or
    assumed) in ticks of the recordings' rate.
    """
    tick_s = 1.0 / rate_Hz
    facts = replace(rig.facts, tick_s=tick_s, late_s=rig.facts.late_s * tick_s / rig.facts.tick_s)
    needed = needs_of(tables, case.recipe.limits.torque_Nm).stiffness
    rate = max(case.recipe.scene.opening_rate_rad_per_s[1], OSCILLATION_RATE)
    hand = case.recipe.rig.hand_damping_Nm_s_per_rad
    alone, held = (allowed_stiffness(facts, damping, rate) for damping in (0.0, hand))
    return Margin(_over(needed, alone), _over(needed, held))


def _over(needed: float, allowed: float) -> float:
    return needed / allowed if allowed > 0.0 else float("inf")


def _least_factor(case: Case) -> float:
    """Least factor of friction over the scene's openings."""
    assert case.friction_fit is not None
    fit = FitDraws.centre(case.friction_fit)
    law = FrictionLaw.of_fit(fit.row(0), float(fit.structure["angle_center"]))
    return float(np.min(angle_factor(law, np.linspace(*case.recipe.scene.opening_rad, OPENINGS))))
