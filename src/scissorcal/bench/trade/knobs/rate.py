"""Loop rate: share of a core against rendered minus continuous torque, and the stability margin."""

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from scissorcal.bench.trade.case import Case
from scissorcal.bench.trade.frame_time import frame_time_s
from scissorcal.bench.trade.models import kernel_model, nothing_rendered
from scissorcal.bench.trade.point import Error, Quantity, Sample, Setting
from scissorcal.bench.trade.rendered import hand_strokes, rendered_error
from scissorcal.bench.trade.torque import AVERAGE, WORST
from scissorcal.device.session import identity_of
from scissorcal.kernel import ModelTables
from scissorcal.model import FrictionLaw
from scissorcal.model.friction import angle_factor
from scissorcal.package.exact import FitDraws
from scissorcal.recording.probe import probe_of
from scissorcal.render.admission_rule import (
    OSCILLATION_RATE,
    LoopFacts,
    allowed_stiffness,
)
from scissorcal.render.derating import needs_of
from scissorcal.render.rig_facts import fitted_facts, loop_facts, with_probe

RATES_HZ = (125.0, 250.0, 500.0, 1000.0, 2000.0, 4000.0, 8000.0)
MOMENTS = "torque at every moment, average"
IN_HAND, ALONE = "needed over allowed stiffness in a hand", "needed over allowed stiffness alone"
NO_PORT = (
    "Missed frames are not counted: the loop ran in lockstep, and only a port that keeps its own "
    "time can be missed ('scissorcal render' counts them)."
)
NOTHING_ALLOWED = (
    "The rule allows this rig no stiffness: its dry friction is not known to be above 0."
)
NO_RIG = "The stability margin is not known: the recordings do not state the rig, or its friction."


class Rate:
    """How often the loop samples the blades and answers.

    Counted against the continuous torque: the same tables at 64 kHz with the true rate of opening,
    over strokes of a hand.
    """

    name = "rate"
    title = "Loop rate"
    cost = "share of a core"
    error = AVERAGE
    against = "the continuous torque: the same tables stepped at 64 kHz with the true rate"
    of_torque, stand_in = True, False
    combined = False  # that of the tables is the torque of a loop of any rate

    def missing(self, case: Case) -> str:
        """Where nothing is rendered no loop runs."""
        return nothing_rendered(case)

    def settings(self, case: Case) -> tuple[Setting, ...]:
        """Octaves from 125 Hz to 8 kHz, and the scene's own rate."""
        own = case.recipe.scene.loop_rate_Hz
        return tuple(
            Setting(f"{rate:g} Hz", rate, rate, "hold", present=rate == own)
            for rate in sorted({*RATES_HZ, own})
        )

    def applied(self, case: Case, setting: Setting) -> Case:
        """The case whose scene is rendered at that rate."""
        scene = case.recipe.scene.model_copy(update={"loop_rate_Hz": float(setting.value)})
        return replace(case, recipe=case.recipe.model_copy(update={"scene": scene}))

    def expected_s(self, case: Case, setting: Setting) -> float:
        """The reference takes most of it, and a faster loop more samples."""
        return 1.5 + 2e-4 * float(setting.value)

    def repeats(self, case: Case, setting: Setting) -> int:
        """Each repeat begins at another part of a tick, and on a sheet with another near edge."""
        return 3

    def measure(self, case: Case, setting: Setting, repeat: int) -> Sample:
        """Render the strokes at this rate, and time the loop on frames of the middle one."""
        rate, tables = float(setting.value), kernel_model(case)
        phase, shift = np.random.default_rng([case.seed, repeat]).uniform(size=2)
        strokes, limits = hand_strokes(case.recipe, float(shift)), case.recipe.limits
        rig = known_rig(case)
        frame_s = frame_time_s(tables, strokes[1], rate, limits)
        step_rad = rig[1] if rig else 0.0
        outcome = rendered_error(tables, strokes, rate, limits.torque_Nm, step_rad, float(phase))
        if rig:
            outcome |= margin(case, tables, rig[0], rate)
        notes = [NO_PORT, *(() if rig else (NO_RIG,))]
        if not all(math.isfinite(value) for value in outcome.values()):
            notes.append(NOTHING_ALLOWED)
        return Sample(
            {
                "share of a core": Quantity(frame_s * rate, ""),
                "frame": Quantity(frame_s * 1e6, "us"),
            },
            {name: value if math.isfinite(value) else None for name, value in outcome.items()},
            tuple(notes),
        )

    def errors(self, case: Case, sample: Sample, reference: Sample | None) -> Mapping[str, Error]:
        """Rendered minus continuous torque, and needed over allowed stiffness."""
        found = sample.outcome
        largest = found["largest"]
        names = {AVERAGE: "average", WORST: "worst", MOMENTS: "moments"}
        errors = {
            label: Error(found[name], "N m", found[name] / largest) for label, name in names.items()
        }
        for label, name in ((IN_HAND, "in_hand"), (ALONE, "alone")):
            # None is what an infinite number is kept as; without a rig there is none at all
            margin = math.inf if found.get(name, math.nan) is None else found.get(name, math.nan)
            errors[label] = Error(margin, "", guarded=True)
        return errors


OPENINGS = 201


def known_rig(case: Case) -> tuple[LoopFacts, float] | None:
    """The rig as recordings and the friction fit know it; None where they do not.

    What decides about stability, at the rate of the recordings, and the encoder's step in rad.
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
    return None if facts is None else (facts, identity.opening_resolution)


def margin(case: Case, tables: ModelTables, known: LoopFacts, rate_Hz: float) -> dict[str, float]:
    """Needed over allowed stiffness at a loop rate, by `render.admission_rule`: stable up to 1.

    ``alone`` without a hand, ``in_hand`` with the damping that the recipe counts on.

    The delay of line, host and motor is taken to shrink and grow with the tick: it was measured (or
    assumed) in ticks of the recordings' rate.
    """
    tick_s = 1.0 / rate_Hz
    facts = replace(known, tick_s=tick_s, late_s=known.late_s * tick_s / known.tick_s)
    needed = needs_of(tables, case.recipe.limits.torque_Nm).stiffness
    rate = max(case.recipe.scene.opening_rate_rad_per_s[1], OSCILLATION_RATE)
    hand = case.recipe.rig.hand_damping_Nm_s_per_rad
    alone, held = (allowed_stiffness(facts, damping, rate) for damping in (0.0, hand))
    return {"alone": _over(needed, alone), "in_hand": _over(needed, held)}


def _over(needed: float, allowed: float) -> float:
    return needed / allowed if allowed > 0.0 else float("inf")


def _least_factor(case: Case) -> float:
    """Least factor of friction over the scene's openings."""
    assert case.friction_fit is not None
    fit = FitDraws.centre(case.friction_fit)
    law = FrictionLaw.of_fit(fit.row(0), float(fit.structure["angle_center"]))
    return float(np.min(angle_factor(law, np.linspace(*case.recipe.scene.opening_rad, OPENINGS))))
