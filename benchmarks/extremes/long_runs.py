"""Long runs: whether energy is neither made nor lost, and the crack never recedes."""

import dataclasses
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from benchmarks.extremes.cells import Found, judged, worst_of
from benchmarks.extremes.states import fitted_tables, made_state

from scissorcal.bench.extremes.compare import strokes
from scissorcal.bench.extremes.states import State
from scissorcal.kernel import CrackLaw, Curve, Kernel, ModelTables, StepFlag, walk_crack
from scissorcal.model import Response, edge_height, settled_contact

CLOSING_rad = 1e-5
CONTACT_m = 0.01
"""Where the sheet begins."""
EVERYDAY: Mapping[str, float] = {
    "edge_offset": -0.008,
    "taper": 0.035,
    "curvature": 0.0,
    "nick": 0.0,
    "blade_length": 0.075,
    "rate_damping": 0.0,
    "contact": 0.3,
    "opening": 0.55,
    "opening_rate": -1.0,
    "indentation": 1e-4,
    "table_size": 128.0,
    "thickness": 2e-4,
    "force": 5.0,
    "exponent": 1.6,
    "toughness": 3e3,
}
FIRST, LAST = 0.85, 0.3
"""Openings of the strokes."""


def scissors(values: Mapping[str, float]) -> State:
    """Everyday scissors of two moving blades that cut, with some values changed."""
    return made_state({**EVERYDAY, **values})


def scissors_tables(values: Mapping[str, float]) -> ModelTables:
    """The kernel's tables of such scissors, as deep as the strokes need them."""
    state = scissors(values)
    return fitted_tables(state, _deepest(state))[0]


def balance_of_strokes(values: Mapping[str, float]) -> Found:
    """Close, withdraw and close farther; compare the blades' work with the kernel's books."""
    answer = strokes(scissors_tables(values), (LAST, FIRST), CONTACT_m)
    return Found(answer.outcome, answer.sentence, answer.error)


def energy_of_throw(inertia: float, allowed: float) -> Found:
    """Throw blades of an inertia (kg m^2) at the sheet; compare kinetic energy with the books.

    The rate is such that they come to rest within the blade. The opening falls by 1e-5 rad a step;
    the rate follows from the torque by the midpoint rule on its square, so that the step takes
    exactly the trapezoid of the torque.
    """
    kernel = Kernel(scissors_tables({"kappa": 1.0}))
    kernel.reset(crack=0.0)
    opening, first = FIRST, kernel.step(FIRST, 0.0, -CONTACT_m)
    energy = kinetic = 0.02
    torque, spent, steps, out = float(first.torque), 0.0, 0, first
    while kinetic > 0.0 and opening > LAST:
        near = float(np.float32(opening - CLOSING_rad))
        rate = -math.sqrt(2.0 * kinetic / inertia)
        out = kernel.step(near, rate, -CONTACT_m)
        if out.flags & StepFlag.INVALID:
            return Found("wrong", f"refused at a rate of {rate:.2g} rad/s")
        kinetic -= 0.5 * (torque + out.torque) * (opening - near)
        spent += out.fracture_J + out.arrest_J
        opening, torque, steps = near, float(out.torque), steps + 1
    away = abs(energy - kinetic - spent - (out.stored_J - first.stored_J)) / energy
    return judged(away, allowed, f"inertia {inertia:.1g} kg m^2", steps)


def hostile_inputs(rng: np.random.Generator) -> Found:
    """Steps of 1e-5 to 1 s with gaps, duplicates, backward jumps, NaN and infinities."""
    kernel = Kernel(scissors_tables({"kappa": 0.7, "rate_damping": 5.0}))
    kernel.reset(crack=0.0)
    count = 20_000
    ticks = 10.0 ** rng.uniform(-5, 0, count) * rng.choice([0.0, 1.0, 1.0, 1.0, -1.0], count)
    opening = 0.55 + 0.3 * np.cos(np.cumsum(rng.uniform(0.0, 0.02, count)))
    opening[rng.integers(0, count, 50)] = rng.choice([np.nan, np.inf, -np.inf, 4.0, 1e30], 50)
    with np.errstate(all="ignore"):
        rate = np.diff(opening, prepend=opening[0]) / ticks
    crack, wrong = kernel.crack, ""
    for theta, speed in zip(opening.tolist(), rate.tolist(), strict=True):
        out = kernel.step(theta, speed, -CONTACT_m)
        refused = bool(out.flags & StepFlag.INVALID)
        bad = not math.isfinite(theta) or not math.isfinite(speed) or abs(theta) > math.pi
        if not (math.isfinite(out.torque) and math.isfinite(out.force)):
            wrong = "an output is not finite"
        elif bad and not (refused and out.torque == 0.0 and kernel.crack == crack):
            wrong = f"opening {theta:.3g}, rate {speed:.3g} was not refused"
        elif kernel.crack < crack:
            wrong = "the crack recedes"
        crack = kernel.crack
    if wrong:
        return Found("wrong", wrong, states=count)
    return Found("refused", "INVALID: an opening or rate that is not finite", states=count)


def walk_of_strokes(rng: np.random.Generator) -> Found:
    """The float64 walk of a crack: its work against what it stored and lost."""
    found = []
    for kappa in (1e-3, 0.1, 0.7, 0.999, 1.0):
        law = walk_law(scissors({"kappa": kappa}))
        opening = np.concatenate([np.linspace(FIRST, LAST, 1200), np.linspace(LAST, FIRST, 1200)])
        path = walk_crack(law, opening, np.full(opening.shape, -CONTACT_m), place=0.02)
        work = -float(np.sum(path.torque * np.diff(opening)))
        if np.any(np.diff(path.place) < 0.0):
            found.append(Found("wrong", "the crack recedes", states=len(opening)))
            continue
        away = abs(work - path.stored - path.lost) / abs(work)
        found.append(judged(away, 1e-3, f"kappa {kappa:g}", len(opening)))
    return worst_of(found)


def walk_law(state: State, **changes: Any) -> CrackLaw:
    """The law of a state as a crack's walk takes it, with some fields changed."""
    edge, response = state.cutting.edge, state.cutting.response
    length, kappa = float(edge.length_m), float(state.cutting.kappa)
    line = Curve(0.0, length, edge.offset_at([0.0, length]), edge.slope_at([0.0, length]))
    logs = np.array([-20.0, 0.0])
    power = float(np.asarray(response.exponent))
    law = CrackLaw(
        edge=line,
        response=Curve(-20.0, 20.0, np.log(response.force_at(np.exp(logs))), np.full(2, power)),
        energy=Curve(-20.0, 20.0, np.log(response.energy_at(np.exp(logs))), np.full(2, power + 1)),
        moving_blades=state.cutting.moving_blades,
        upper_face_m=state.cutting.upper_face_m,
        closure="work",
        fracture="smooth" if kappa == 1.0 else "rippled",
        kappa=kappa,
        damping_s_per_m=0.0,
        tick_s=1e-3,
        tough=np.full(2, float(state.cutting.fracture_energy or 0.0)),
        tough_first=0.0,
        tough_step=1.0,
    )
    return dataclasses.replace(law, **changes)


def _deepest(state: State) -> float:
    """The deepest indentation of the strokes: where the crack runs, or all of it without a run."""
    law = state.cutting
    response: Response = law.response
    opening = np.linspace(LAST, FIRST, 50)
    smooth = dataclasses.replace(law, kappa=1.0)
    place = settled_contact(smooth, opening)
    known = np.where(np.isfinite(place), place, 0.0)
    depth = law.upper_face_m - edge_height(law.edge, known, opening / law.moving_blades).height
    return max(float(np.max(depth)), float(response.indentation_at(1.0)))
